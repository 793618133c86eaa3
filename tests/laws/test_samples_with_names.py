"""Logs and data frames are their samples to every streaming class, at its rate and in its units."""

import inspect

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

import zerorate as zr
from support.checks import assert_same_bits
from support.classes import EXAMPLES, example
from support.feeding import arguments_of, called, flat
from zerorate.record import Log

N = 150
RECORD = np.random.default_rng(8).standard_normal((N, 18))
UNITS = {"gyro": "rad/s", "accel": "m/s^2", "position": "m", "speed": "m/s", "temperature": "degC"}
OTHERS = {"rad/s": ("deg/s", 180.0 / np.pi), "m/s^2": ("g", 1.0 / 9.80665)}


def named(values):
    """Columns by names that tell of no unit."""
    return {f"c{i}": column for i, column in enumerate(values.reshape(N, -1).T.copy())}


def log(values, unit="unit", rate=100.0, start=0.0):
    return Log(start + np.arange(N) / rate, rate, values, tuple(named(values)), unit)


KINDS = {
    "Log": lambda values, name, rate: log(values, UNITS.get(name, "unit"), rate),
    "pandas": lambda values, name, rate: pd.DataFrame(named(values)),
    "polars": lambda values, name, rate: pl.DataFrame(named(values)),
    "pyarrow": lambda values, name, rate: pa.table(named(values)),
}


def arguments(f, width):
    """Arguments of the method that takes a record, by name."""
    given = arguments_of(f, RECORD[:, 0] if width == 1 else RECORD[:, :width])
    return dict(zip(inspect.signature(getattr(f, called(f))).parameters, given, strict=False))


def answer(f, given):
    return flat(getattr(f, called(f))(**given))


@pytest.mark.filterwarnings("ignore:the accelerometer shows")
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", EXAMPLES)
def test_samples_with_names_are_samples(name, kind):
    plain, f = example(name), example(name)
    given = arguments(f, EXAMPLES[name][0].width)
    rate = getattr(f, "rate", 100.0)
    told = {
        key: KINDS[kind](values, key, rate)
        if np.ndim(values) in (1, 2) and key not in ("time", "fixes", "rest", "aids")
        else values
        for key, values in given.items()
    }
    expected, got = answer(plain, given), answer(f, told)
    assert f.to_bytes() == plain.to_bytes()
    if expected is not None:
        assert_same_bits(got, expected)


SINGLE = [name for name in EXAMPLES if EXAMPLES[name][0].side_by_side]


@pytest.mark.filterwarnings("ignore:the accelerometer shows")
@pytest.mark.parametrize("name", [one for one in SINGLE if EXAMPLES[one][0].width == 1])
@pytest.mark.parametrize("channels", [1, 3])
def test_a_log_of_channels(name, channels):
    plain, f = example(name, channels), example(name, channels)
    z = RECORD[:, :channels]
    expected, got = plain.process(z), f.process(log(z))
    assert f.to_bytes() == plain.to_bytes()
    assert expected is None or assert_same_bits(got, expected) is None


@pytest.mark.filterwarnings("ignore:the accelerometer shows")
@pytest.mark.parametrize(
    "make", [lambda: zr.Attitude(100.0, mag=False), lambda: zr.FootFilter(100.0)]
)
def test_another_unit_is_converted(make):
    gyro, accel = RECORD[:, :3], RECORD[:, 3:6]
    expected = make().process(gyro, accel)
    told = [
        log(values * OTHERS[unit][1], OTHERS[unit][0])
        for values, unit in ((gyro, "rad/s"), (accel, "m/s^2"))
    ]
    np.testing.assert_allclose(make().process(*told), expected, rtol=1e-9, atol=1e-12)
    frame = pd.DataFrame(np.degrees(gyro), columns=[f"gyro_{x}_dps" for x in "xyz"])
    np.testing.assert_allclose(make().process(frame, accel), expected, rtol=1e-9, atol=1e-12)


def test_the_unit_of_an_attitude_is_that_of_its_log():
    """Without any conversion, and so without rounding."""
    gyro, accel = log(RECORD[:, :3], "deg/s"), np.tile([0.0, 0.0, 9.81], (N, 1))
    plain, f = (zr.Attitude(100.0, mag=False, gyro_unit="deg/s") for _ in range(2))
    assert f.gyro_unit == "deg/s"
    assert f.accel_unit == "m/s^2"
    assert_same_bits(f.process(gyro, accel), plain.process(gyro.data, accel))


def test_stamps_of_a_log_are_the_times_between_samples():
    times = np.arange(N) / 100.0 * (1.0 + 0.05 * np.sin(np.arange(N) / 20.0))
    gyro, accel = RECORD[:, :3], np.tile([0.0, 0.0, 9.81], (N, 1))
    uneven = Log.at(times, 100.0, gyro, ["x", "y", "z"], "rad/s", {})
    assert uneven.steps is not None
    for make in (lambda: zr.Attitude(100.0, mag=False),):
        expected = make().process(gyro, accel, dt=uneven.steps)
        assert_same_bits(make().process(uneven, accel), expected)
        assert_same_bits(make().process(uneven, accel, dt=0.01), make().process(gyro, accel))
    tilt = zr.Tilt(100.0).process(gyro[:, 0], accel[:, 0], dt=uneven.steps)
    one = Log.at(times, 100.0, gyro[:, 0], ["x"], "rad/s", {})
    assert_same_bits(zr.Tilt(100.0).process(one, accel[:, 0]), tilt)


GYRO, ACCEL = log(RECORD[:, :3], "rad/s"), log(RECORD[:, 3:6], "m/s^2")


@pytest.mark.parametrize(
    ("gyro", "accel", "message"),
    [
        (log(RECORD[:, :3], "rad/s", 200.0), ACCEL, "gyro must have the rate of the Attitude, 100"),
        (ACCEL, ACCEL, r"gyro must be in rad/s, got a log in m/s\^2"),
        (log(RECORD[:, :3]), ACCEL, "gyro must be in rad/s, and the unit of the log .* not known"),
        (GYRO, log(RECORD[:, 3:6], "m/s^2", 100.0, 0.5), "accel must be on the clock of gyro"),
        (GYRO, RECORD[:9, 3:6], "accel must have as many samples as gyro, 150, got 9"),
    ],
)
def test_what_a_log_contradicts(gyro, accel, message):
    with pytest.raises(ValueError, match=message):
        zr.Attitude(100.0, mag=False).process(gyro, accel)


def test_a_temperature_is_in_degrees_celsius():
    z, heat = log(RECORD[:, 0]), np.linspace(20.0, 40.0, N)
    expected = zr.TemperatureFilter(100.0).process(z.data[:, 0], heat)
    for unit in ("degC", "unit"):
        assert_same_bits(zr.TemperatureFilter(100.0).process(z, log(heat, unit)), expected)
    with pytest.raises(ValueError, match="temperature must be in degC, got a log in K"):
        zr.TemperatureFilter(100.0).process(z, log(heat + 273.15, "K"))
    with pytest.raises(ValueError, match="temperature must be in degC, got a log in K"):
        zr.TemperatureModel.fit(z, log(heat + 273.15, "K"))


@pytest.mark.parametrize("gone", [None, (None, None, None), [np.nan] * 3])
def test_none_is_a_missing_sample(gone):
    rest, up = [0.0, 0.0, 0.1], [0.0, 0.0, 9.81]
    for given in ((rest, gone), (gone, up), (gone, gone)):
        missing = [np.full(3, np.nan) if part is gone else part for part in given]
        for make in (lambda: zr.Attitude(100.0, mag=False), lambda: zr.FootFilter(100.0)):
            assert_same_bits(make().update(*given), make().update(*missing))
    several = zr.DriftFilter(100.0, channels=3)
    assert np.isnan(several.update(None)).all()
