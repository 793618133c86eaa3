"""Live is the log: its lines, sent with their stamps, give the numbers of the log's own task."""

import numpy as np
import pytest

import zerorate as zr
from support.clocks import forms
from zerorate.record import LogError
from zerorate.tasks.live import (
    ArraySettings,
    AttitudeSettings,
    LineStream,
    NavigationSettings,
    Settings,
)

RATE, N = 100.0, 6000
FORMS = forms(RATE, N)
BY_FORM = pytest.mark.parametrize("form", FORMS)
AXES = "xyz"


def turning(rate, n, seed=4):
    """A body that rests, turns by 30 deg/s about the vertical for a third, and rests."""
    rng = np.random.default_rng(seed)
    gyro = np.radians(0.3) + np.radians(0.1) * rng.normal(size=(n, 3))
    gyro[n // 3 : 2 * n // 3, 2] += np.radians(30.0)
    accel = [0.0, 0.0, 9.80665] + 0.03 * rng.normal(size=(n, 3))
    angle = np.cumsum(gyro[:, 2] - np.radians(0.3)) / rate
    field = np.column_stack([20.0 * np.sin(angle), 20.0 * np.cos(angle), np.full(n, -40.0)])
    return gyro, accel, field + 0.3 * rng.normal(size=(n, 3))


GYRO, ACCEL, MAG = turning(RATE, N)


def table(stamped, **sensors):
    """The columns of a log, and the same as lines that begin with their names."""
    columns = {f"time_{stamped.unit}": stamped.column}
    for name, (unit, values) in sensors.items():
        columns |= {f"{name}_{a}_{unit}": values[stamped.rows, i] for i, a in enumerate(AXES)}
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    return columns, [",".join(columns), *(",".join(map(repr, row)) for row in rows)]


def answers(settings, lines, watch=None):
    stream = LineStream(settings)
    first = stream.take(lines[0]).split(",")
    if watch is not None:
        watch(stream._engine)
    return stream, first, [stream.take(line).split(",") for line in lines[1:]]


class FinalRests:
    """Which samples are at rest, as the filter says in the end, once its answers are revised."""

    def __call__(self, engine):
        self._engine, self._feed, self.seen = engine, engine.feed, []
        engine.feed = self._fed

    def _fed(self, row, step, left_out):
        while self.seen and self.seen[-1][0] >= self._engine.samples:
            self.seen.pop()
        self._feed(row, step, left_out)
        self.seen.append((self._engine.samples - 1, bool(self._engine._filter.at_rest)))


def column(names, rows, *wanted):
    return np.array([[float(row[names.index(name)]) for name in wanted] for row in rows])


def attitudes(stamped, mag, typed):
    sensors = {"gyro": ("radps", GYRO), "accel": ("mps2", ACCEL)}
    sensors |= {"mag": ("ut", MAG)} if mag else {}
    columns, lines = table(stamped, **sensors)
    rate = RATE * stamped.part
    log = zr.read_recording(columns, **({"rate": rate} if typed else {}))
    settings = AttitudeSettings(rate, time=f"time_{stamped.unit}", extra=("euler",))
    rests = FinalRests()
    return zr.estimate_attitude(log), log, answers(settings, lines, rests), rests.seen


@pytest.mark.parametrize("mag", [False, True])
@BY_FORM
def test_attitudes(form, mag):
    stamped = FORMS[form]
    found, log, (stream, names, rows), seen = attitudes(stamped, mag, stamped.exact)
    last = column(names, rows, *(f"quat_{a}" for a in "wxyz"))[-1]
    if stamped.exact:
        np.testing.assert_array_equal(last, found.quaternion[-1])
        assert stream.samples == found.n
        places, rests = np.array(seen).T
        np.testing.assert_array_equal(rests, found.at_rest[places])
    # 600 deg: a thousandth of the turn, of samples and of rests.
    yaw = np.unwrap(column(names, rows, "yaw_deg")[:, 0], period=360.0)
    assert abs(np.sin(np.radians(yaw[-1]) - found.euler[-1, 2])) < np.sin(np.radians(0.6))
    assert stream.samples == pytest.approx(found.n, rel=1e-3)
    there = np.isfinite(log.gyro.data).all(axis=1)
    rests = np.mean([rest for _, rest in seen])
    # Blocks that begin amid one look to the log as 99.9 Hz: its filter has another rate.
    off = 2e-3 if form == "blocks from amid" else 1e-3
    assert rests == pytest.approx(found.at_rest[there].mean(), abs=off)
    assert stamped.tell in "; ".join(stream.sentences())


@BY_FORM
def test_drift(form):
    stamped = FORMS[form]
    columns, lines = table(stamped, gyro=("dps", np.degrees(GYRO)))
    rate = RATE * stamped.part
    log = zr.read_log(columns, **({"rate": rate} if stamped.exact else {}))
    settings = Settings(rate, time=f"time_{stamped.unit}", extra=("bias",))
    stream, names, rows = answers(settings, lines)
    filter_ = zr.DriftFilter(rate, channels=3, rest_limit=10.0, bias_limit=20.0)
    filter_.process(log.data)
    bias = column(names, rows, *(f"bias_gyro_{a}_dps" for a in AXES))[-1]
    if stamped.exact:
        np.testing.assert_array_equal(bias, filter_.bias)
        assert stream.samples == log.n
    np.testing.assert_allclose(bias, filter_.bias, atol=1e-3)


@pytest.mark.parametrize("form", [name for name, one in FORMS.items() if one.exact])
def test_arrays(form):
    stamped = FORMS[form]
    columns, lines = table(stamped, gyro=("radps", GYRO), gyro_1=("radps", GYRO + 0.01))
    rate = RATE * stamped.part
    log = zr.read_log(columns, rate=rate, columns=[c for c in columns if "gyro" in c])
    array = zr.GyroArray(rate, 2)
    stream, names, rows = answers(ArraySettings(array, time=f"time_{stamped.unit}"), lines)
    expected = array.process(log.data.reshape(-1, 2, 3))
    found = column(names, rows, "rate_x", "rate_y", "rate_z")[-1]
    np.testing.assert_array_equal(found, expected[-1])
    assert stream.samples == log.n


DRIVE = zr.simulate_drive(RATE, 60.0, seed=3)


@pytest.mark.parametrize(
    "form",
    [
        *("regular", "whole ms", "jittered", "blocks of 5", "losses", "a stall", "an old stamp"),
        *("every second repeats", "every second left out", "every third left out"),
    ],
)
def test_navigation(form):
    stamped = forms(RATE, DRIVE.time.size)[form]
    sensors = {"gyro": ("radps", DRIVE.gyro), "accel": ("mps2", DRIVE.accel)}
    columns, lines = table(stamped, **sensors)
    rate = RATE * stamped.part
    log = zr.read_recording(columns, rate=rate)
    start = zr.align(DRIVE.recording(), latitude=48.0, heading=0.3, span=(0.0, 25.0))
    nav = zr.NavigationFilter(start)
    _, names, rows = answers(NavigationSettings(nav, rate, time=f"time_{stamped.unit}"), lines)
    expected = nav.copy()
    for time, rate, force in zip(log.gyro.time, log.gyro.data, log.accel.data, strict=True):
        expected.update(time, rate, force)
    found = column(names, rows, *(f"quat_{a}" for a in "wxyz"))[-1]
    np.testing.assert_array_equal(found, expected.quaternion)


def test_whole_milliseconds_at_more_than_a_kilohertz():
    rate, n = 1600.0, 16_000
    gyro, accel, _ = turning(rate, n)
    for form in ("whole ms", "blocks of 5", "losses", "late"):
        stamped = forms(rate, n)[form]
        columns, lines = table(stamped, **{"gyro": ("radps", gyro), "accel": ("mps2", accel)})
        found = zr.estimate_attitude(zr.read_recording(columns, rate=rate))
        settings = AttitudeSettings(rate, time=f"time_{stamped.unit}")
        stream, names, rows = answers(settings, lines)
        last = column(names, rows, *(f"quat_{a}" for a in "wxyz"))[-1]
        assert stream.samples == pytest.approx(found.n, rel=1e-3), form
        turned = 2.0 * np.arccos(min(1.0, abs(last @ found.quaternion[-1])))
        assert turned < np.radians(0.1), form


@pytest.mark.parametrize(
    "form",
    [*("blocks of 10", "losses", "a restart", "a stall", "wandering"), "every third left out"],
)
@pytest.mark.parametrize("engine", ["attitude", "drift"])
def test_saved_while_it_is_undecided_it_goes_on(form, engine):
    stamped = FORMS[form]
    _, lines = table(stamped, gyro=("radps", GYRO), accel=("mps2", ACCEL))
    time = f"time_{stamped.unit}"
    settings = {
        "attitude": AttitudeSettings(RATE * stamped.part, time=time),
        "drift": Settings(RATE * stamped.part, time=time),
    }[engine]
    whole = LineStream(settings)
    expected = [whole.take(line) for line in lines[:3500]]
    stream, found = LineStream(settings), []
    for i, line in enumerate(lines[:3500]):
        found.append(stream.take(line))
        if i in (1, 40, 990, 1005, 1010, 1500, 1600, 2995, 3001, 3004, 3012, 3030):
            stream = LineStream.from_bytes(stream.to_bytes(), settings)
    assert found == expected
    assert stream.to_bytes() == whole.to_bytes()


def test_a_heading_is_not_carried_on_over_a_restart():
    stamped = FORMS["a restart"]
    _, lines = table(stamped, gyro=("radps", GYRO), accel=("mps2", ACCEL))
    settings = AttitudeSettings(RATE, time="time_s", extra=("heading_sigma",))
    _, names, rows = answers(settings, lines)
    sigma = column(names, rows, "heading_sigma_deg")[:, 0]
    assert sigma[N // 2 - 1] < 5.0
    assert sigma[N // 2 :].min() > 90.0


@pytest.mark.parametrize("mag", [False, True])
@pytest.mark.parametrize(("value", "off"), [(20_000.0, 0.2), (2000.0, 0.2), (500.0, 0.2)])
def test_a_sample_of_garbage_is_left_out(value, off, mag):
    gyro = GYRO.copy()
    gyro[1000, 2] = np.radians(value)
    sensors = {"gyro": ("radps", gyro), "accel": ("mps2", ACCEL)} | (
        {"mag": ("ut", MAG)} if mag else {}
    )
    _, lines = table(FORMS["regular"], **sensors)
    for time in (None, "time_s"):
        settings = AttitudeSettings(RATE, time=time, extra=("euler",))
        stream, names, rows = answers(settings, lines)
        yaw = column(names, rows, "yaw_deg")[:, 0]
        assert np.ptp(yaw[990:1500]) < off + 4.0 * mag
        assert "rates left out as impossible: 1 " in "; ".join(stream.sentences())


def test_real_motion_is_kept_to_the_last_bit():
    """Fast turns, knocks that ring, and a step that stays: what was doubted is given back."""
    gyro = GYRO.copy()
    swing = np.arange(40) / 40.0
    gyro[500:540, 2] = np.radians(1900.0) * np.sin(np.pi * swing)
    gyro[800:806, 0] = np.radians([600.0, -320.0, 150.0, -60.0, 30.0, -10.0])
    gyro[1200:1300, 1] = np.radians(900.0)
    _, lines = table(FORMS["regular"], gyro=("radps", gyro), accel=("mps2", ACCEL))
    stream, names, rows = answers(AttitudeSettings(RATE), lines)
    alone = zr.Attitude(RATE, mag=False)
    found = column(names, rows, *(f"quat_{a}" for a in "wxyz"))
    np.testing.assert_array_equal(found[-1], alone.process(gyro, ACCEL)[-1])
    assert not any("impossible" in one for one in stream.sentences())


def test_a_rate_that_the_stamps_contradict_is_refused_of_a_log_and_told_of_a_stream():
    stamped = FORMS["a rate far off"]
    with pytest.raises(LogError, match="the rate is stated as 100 Hz"):
        attitudes(stamped, False, True)
