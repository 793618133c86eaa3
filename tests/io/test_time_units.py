"""The unit of a time that no name tells: what decides it, and what is refused and how."""

import numpy as np
import pytest

import zerorate as zr
from zerorate.io import open_log, read_log
from zerorate.io.reading import read_sensors
from zerorate.record import LogError

N = 2000
I = np.arange(N)  # noqa: E741
GYRO = np.random.default_rng(0).standard_normal(N)


def log_of(time, name="time", extra=(), **asked):
    return read_log({name: time, **dict(extra), "gyro_x_dps": GYRO[: len(time)]}, **asked)


SCALES = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


@pytest.mark.parametrize("unit", SCALES)
@pytest.mark.parametrize("rate", [0.5, 1, 5, 25, 50, 100, 200, 400, 1000, 8000, 32000])
def test_no_unnamed_time_is_read_wrong(unit, rate):
    time = I * SCALES[unit] / rate
    if unit != "s" and (time == np.rint(time)).all():
        time = time.astype(np.int64)
    try:
        log = log_of(time)
    except LogError as error:
        # Refused are the rates at which the next unit would make another sensor of it.
        told = str(error)
        assert rate < 33 or rate >= 500
        assert f"time_unit='{unit}'" in told
    else:
        # Decimals of milliseconds below one are taken for seconds, and that is said.
        said = any("read as" in note for note in log.meta["notes"])
        assert log.rate == pytest.approx(rate, rel=1e-3) or (said and rate >= 8000)
    for asked in ({"time_unit": unit}, {"rate": rate}):
        assert log_of(time, **asked).rate == pytest.approx(rate, rel=1e-3)


def test_two_readings_are_both_named():
    with pytest.raises(LogError, match=r"in ms \(5 Hz\) or us \(5000 Hz\): say which by time_unit"):
        log_of(200 * I)
    with pytest.raises(LogError, match=r"s \(1 Hz\) or ms \(1000 Hz\), or count samples"):
        log_of(I)
    with pytest.raises(LogError, match=r"in no unit the clock of a sensor of 0.5 Hz to 32 kHz"):
        log_of(1e-7 * I)


def test_another_clock_tells():
    log = log_of(200 * I, extra={"elapsed_s": 0.2 * I})
    assert log.rate == 5.0
    assert log.meta["notes"] == ("time column 'time' read as ms, as column 'elapsed_s' shows",)


@pytest.mark.parametrize(
    ("name", "zero"), [("timestamp", 25_569.0), ("date", 719_529.0), ("t", 2_440_587.5)]
)
def test_days_of_spreadsheets_matlab_and_astronomers(name, zero):
    since = 1_714_564_800 / 86_400
    log = log_of(zero + since + I * 0.01 / 86_400, name)
    # A double holds days of this size to 40 us.
    assert log.rate == pytest.approx(100.0, rel=1e-5)
    assert log.time[0] == pytest.approx(1_714_564_800, abs=1e-3)


@pytest.mark.parametrize(("step", "rate"), [(100, 100.0), (25, 400.0), (10_000, 100.0)])
def test_sample_time_fine_counts_by_its_device(step, rate):
    assert log_of(123_456 + step * I, "SampleTimeFine").rate == rate


def test_what_is_typed_is_believed():
    every = (read_log, open_log, zr.read_recording, lambda t, **k: read_sensors(t, **k)[0])
    table = {"a": 200 * I, "b": I, "gyro_x_dps": GYRO}
    for read in every:
        read_so = [
            read(table, time="a", time_unit="ms"),
            read(table, time=0, time_unit="milliseconds"),
            read(table, time="b", time_unit="samples", rate=5.0),
            read({**table, "time_s": I}, time=False, rate=5.0),
        ]
        for found in read_so:
            log = getattr(found, "gyro", None) or found
            assert getattr(log, "header", log).rate == 5.0
        with pytest.raises(ValueError, match="time_unit= must be one of s, ms, us"):
            read(table, time="a", time_unit="weeks")
        with pytest.raises(LogError, match="there is no column 'c'"):
            read(table, time="c", rate=5.0)
    with pytest.raises(LogError, match="time_unit='samples' needs rate="):
        log_of(I, time_unit="samples")
    told = "time column 't_s' read as ms, as stated; its name says s"
    assert log_of(200 * I, "t_s", time_unit="ms").meta["notes"] == (told,)


def test_samples_that_a_counter_shows_lost_are_missing():
    kept = np.r_[0:500, 520:N]
    log = log_of(I[kept], time_unit="samples", rate=50.0)
    assert (log.rate, log.n, log.missing_count) == (50.0, N, 20)


@pytest.mark.parametrize("bits", [16, 24, 32])
@pytest.mark.parametrize("signed", [False, True])
def test_counters_of_few_bits_go_on(bits, signed):
    count = (2**bits - 4000 + 10 * I) % 2**bits
    if signed:
        count = (count + 2 ** (bits - 1)) % 2**bits - 2 ** (bits - 1)
    log = log_of(count, "t_ms")
    assert (log.rate, log.n, log.meta["clock"].regular) == (100.0, N, True)
    # Those that count no further than half of it at first wrap at zero.
    assert signed or f"wrapped at 2^{bits} once" in log.meta["notes"][0]


@pytest.mark.parametrize("seconds", [5, 60, 600])
def test_stamps_of_float32_since_1970_are_refused(seconds):
    stamps = (1.7e9 + np.arange(100 * seconds) / 100).astype(np.float32)
    for kind in (np.float32, np.float64):
        with pytest.raises(LogError, match=r"kept in float32, where numbers as large as 1.7e"):
            read_log({"time": stamps.astype(kind), "gyro_x_dps": np.ones(len(stamps))})
    since = (np.arange(100 * seconds) / 100).astype(np.float32)
    assert read_log({"time": since, "gyro_x_dps": np.ones(len(since))}).rate == pytest.approx(100)


def test_a_day_that_passes_and_one_that_leaps():
    log = log_of((86_390 + 0.02 * I) % 86_400)
    assert (log.n, log.rate, log.time[-1]) == (N, 50.0, pytest.approx(86_390 + 0.02 * (N - 1)))
    assert "passes midnight once" in log.meta["notes"][0]
    for days in (1, 3, 365):
        with pytest.raises(LogError, match=f"leaps by {days} days before row 900 .* cut the log"):
            log_of(0.01 * I + 86_400 * days * (I >= 900))
