"""A stream of attitudes: columns by names and positions, garbled lines, numbers, saved states."""

import numpy as np
import pytest

import zerorate as zr
from zerorate.tasks.live import (
    AttitudeSettings,
    CheckpointError,
    ColumnError,
    LineError,
    LineStream,
    SettingsError,
)

MOTION = zr.simulate_motion("hand", rate=50.0, duration=4.0, seed=5)
ROWS = np.hstack([np.degrees(MOTION.gyro), MOTION.accel / 9.80665])
LINES = [",".join(map(repr, row)) for row in ROWS.tolist()]


def settings(**given):
    return AttitudeSettings(50.0, **{"gyro_unit": "deg/s", "accel_unit": "g", **given})


def own(rows, **given):
    filter_ = zr.Attitude(50.0, mag=False, gyro_unit="deg/s", accel_unit="g")
    return filter_.process(rows[:, :3], rows[:, 3:], **given)


def without(lost):
    """What the filter says of all rows but those lost, which are missing to it."""
    rows = ROWS.copy()
    rows[lost] = np.nan
    return np.delete(own(rows), lost, axis=0)


def quaternions(answers):
    return np.array([[float(cell) for cell in line.split(",")[-4:]] for line in answers])


def test_six_numbers_without_a_header():
    stream = LineStream(settings())
    np.testing.assert_array_equal(quaternions(map(stream.take, LINES)), own(ROWS))
    assert (stream.samples, stream.position) == (200, 200)


def test_columns_by_position_and_the_rest_passes():
    stream = LineStream(settings(columns=(4, 5, 6, 1, 2, 3)))
    turned = [
        f"{i},{line.split(',', 3)[3]},{','.join(line.split(',')[:3])}"
        for i, line in enumerate(LINES)
    ]
    answers = [stream.take(line) for line in turned]
    np.testing.assert_array_equal(quaternions(answers), own(ROWS))
    assert answers[17].startswith("17,")


def test_a_magnetometer_is_learned():
    motion = zr.simulate_motion("hand", rate=50.0, duration=30.0, seed=5)
    mag = motion.mag + np.array([20.0, -12.0, 9.0])
    rows = np.hstack([np.degrees(motion.gyro), motion.accel / 9.80665, mag])
    units = {"gyro_unit": "deg/s", "accel_unit": "g"}
    filter_ = zr.Attitude(50.0, learn_magnetometer=True, **units)
    expected = filter_.process(rows[:, :3], rows[:, 3:6], rows[:, 6:])
    assert filter_.magnetometer_state == "known"
    stream = LineStream(settings(learn_magnetometer=True))
    answers = [stream.take(",".join(map(repr, row))) for row in rows.tolist()]
    np.testing.assert_array_equal(quaternions(answers), expected)
    with pytest.raises(ColumnError, match="the lines have no magnetometer"):
        LineStream(settings(learn_magnetometer=True)).take(LINES[0])
    with pytest.raises(ValueError, match="learn_magnetometer has no effect with mag=False"):
        settings(learn_magnetometer=True, mag=False)


def test_scales_make_counts_units():
    scaled = ROWS / [0.1, 0.1, 0.1, 0.5, 0.5, 0.5]
    stream = LineStream(settings(gyro_scale=0.1, accel_scale=0.5))
    lines = [",".join(map(repr, row)) for row in scaled.tolist()]
    # Powers of two are exact, tenths are rounded once more.
    np.testing.assert_allclose(quaternions(map(stream.take, lines)), own(ROWS), atol=1e-12)


def test_a_garbled_line_takes_its_time():
    stream = LineStream(settings())
    answers = [stream.take(line) for line in LINES[:100]]
    with pytest.raises(LineError, match="it has 2 cells, expected 6"):
        stream.take("1.0,2.0")
    assert stream.no_answer == "nan,nan,nan,nan"
    answers += [stream.take(line) for line in LINES[101:]]
    np.testing.assert_array_equal(quaternions(answers), without([100]))


def test_numbers_tell_what_was_lost():
    stream = LineStream(settings(sequence=0))
    kept = np.delete(np.arange(200), [60, 61, 62])
    answers = [stream.take(f"{i},{LINES[i]}") for i in kept]
    np.testing.assert_array_equal(quaternions(answers), without([60, 61, 62]))
    assert stream.take(f"199,{LINES[199]}") == "199,nan,nan,nan,nan"
    assert (stream.sequence.lost_count, stream.sequence.late_count, stream.position) == (3, 1, 200)


def test_time_of_its_own_unit():
    stream = LineStream(settings(time="millis", extra=("euler", "heading", "linear", "bias")))
    assert stream.take("millis,gx,gy,gz,ax,ay,az").startswith("millis,quat_w")
    kept = np.delete(np.arange(200), [60, 61, 62])
    answers = [stream.take(f"{20 * i},{LINES[i]}") for i in kept]
    found = np.array([[float(cell) for cell in line.split(",")[1:5]] for line in answers])
    np.testing.assert_array_equal(found, without([60, 61, 62]))
    assert len(answers[0].split(",")) == 5 + 3 + 1 + 3 + 3


@pytest.mark.parametrize(
    ("line", "given", "match"),
    [
        ("1,2,3", {}, "six or nine columns, got 3"),
        ("gx,gy,gz,temp,humidity,ax", {}, "six or nine columns, got 3"),
        ("1,2,3,4,5,6", {"gyro_unit": None}, "the unit of the gyro is not known"),
        ("gx_dps,gy_dps,gz_dps,ax,ay,az", {"gyro_unit": "rad/s"}, "named in deg/s, but unit="),
        ("1,2,3,4,5,6", {"time": "t"}, "there is no column 't'"),
        (
            "1,2,3,4,5,6",
            {"columns": (0, 1, 2, 3, 4, 5), "time": 0},
            "is also the column of a sensor",
        ),
    ],
)
def test_columns_that_cannot_be(line, given, match):
    with pytest.raises(ColumnError, match=match):
        LineStream(settings(**given)).take(line)


@pytest.mark.parametrize(
    ("given", "match"),
    [
        ({"frame": "up"}, "frame must be"),
        ({"extra": ("stuck",)}, "stuck"),
        ({"columns": (1, 2)}, "six columns, or nine"),
        ({"gyro_unit": "g"}, "gyro_unit is no unit of rate: 'g'"),
    ],
)
def test_settings_that_cannot_be(given, match):
    with pytest.raises(ValueError, match=match):
        settings(**given)


class TestState:
    def stream(self):
        made = LineStream(settings(sequence=0, extra=("at_rest",)))
        for i in range(90):
            made.take(f"{i},{LINES[i]}")
        return made

    def test_it_goes_on_bit_by_bit(self):
        made = self.stream()
        again = LineStream.from_bytes(made.to_bytes(), made.settings)
        for i in range(95, 200):
            assert again.take(f"{i},{LINES[i]}") == made.take(f"{i},{LINES[i]}")
        assert again.to_bytes() == made.to_bytes()

    def test_bytes_that_are_none(self):
        raw = self.stream().to_bytes()
        for bad in (b"", raw[:-1], raw[:40], raw[:50] + b"x" + raw[51:], b"ZRLINES1" + raw[8:]):
            with pytest.raises(CheckpointError):
                LineStream.from_bytes(bad)
        with pytest.raises(SettingsError, match="made with extra"):
            LineStream.from_bytes(raw, settings(sequence=0))


def test_a_time_in_another_unit_than_the_rate_is_refused():
    lines = LineStream(settings(time="t_s"))
    lines.take("t_s,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g")
    # At 50 Hz ten lines in milliseconds and one before; of lost lines a few are as far apart.
    for i in range(10):
        lines.take(f"{20 * i},0,0,0,0,0,1")
    with pytest.raises(ColumnError, match="the time and rate= contradict: 10 lines are 20 s apart"):
        lines.take("200,0,0,0,0,0,1")


def test_the_limit_of_a_bias_is_in_the_unit_of_the_lines():
    """A turn of 5 deg/s from the first sample on is a bias unless a gyro has less."""
    rows = np.tile([0.0, 0.0, 5.0, 0.0, 0.0, 1.0], (100, 1))
    lines = [",".join(map(repr, row)) for row in rows.tolist()]
    for limit, turned in ((None, False), (2.0, True)):
        stream = LineStream(settings(bias_limit=limit))
        yaw = 2.0 * np.degrees(np.arctan2(*quaternions(map(stream.take, lines))[-1, [3, 0]]))
        assert (abs(yaw) > 5.0) == turned
