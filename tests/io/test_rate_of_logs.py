"""Functions of samples take the rate and the unit of a log, and refuse others."""

import inspect
from importlib import import_module

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

import zerorate as zr
from zerorate.record import Log

N, RATE = 3000, 100.0
Z = np.random.default_rng(1).standard_normal(N)
SLOW = np.convolve(Z, np.ones(50) / 50.0, "same")
STILL = np.tile([1.0, 0.0, 0.0, 0.0], (N, 1))
ACCEL = np.tile([0.0, 0.0, 9.81], (N, 2, 1)) + 0.01 * np.random.default_rng(2).standard_normal(
    (N, 2, 3)
)
FLOORS = ("array", "calibration", "checks", "denoising", "identification", "metrics", "noise")
AXES = np.column_stack([Z, SLOW, Z[::-1]])

n, m, i, c = zr.noise, zr.metrics, zr.identification, zr.calibration
CALLS = {
    "allan": lambda z, rate: zr.allan(z, rate).deviation.ravel(),
    "allan_covariance": lambda z, rate: zr.array.allan_covariance(z, rate).matrix,
    "dynamic_allan": lambda z, rate: n.dynamic_allan(z, rate, 5.0).deviation,
    "whittle": lambda z, rate: n.whittle(z, rate).angle_random_walk,
    "identify": lambda z, rate: i.identify(z, rate, order=(1, 0)).model.phi,
    "moving_spans": lambda z, rate: i.moving_spans(z, rate),
    "prepare": lambda z, rate: i.prepare(z, rate).rate,
    "allan_ratio": lambda z, rate: m.allan_ratio(z, Z, rate, 0.5).ratio,
    "best_ema": lambda z, rate: m.best_ema(z, rate, 1.0).estimate,
    "coasting_error": lambda z, rate: m.coasting_error(z, Z, rate, 1.0),
    "delay": lambda z, rate: m.delay(z, SLOW, rate, 0.5),
    "equal_delay_lowpass": lambda z, rate: m.equal_delay_lowpass(z, rate, 0.1),
    "motion_error": lambda z, rate: m.motion_error(z, SLOW, rate).rmse,
    "orientation_error_growth": lambda z, rate: m.orientation_error_growth(z, STILL, rate, (0.1,)),
    "settling_time": lambda z, rate: m.settling_time(z, 0.0, 5.0, rate),
    "fit_rate": lambda z, rate: c.fit_rate(z, rate, reference=Z).scale.value,
    "integrate": lambda z, rate: zr.integrate(z, rate, unit="rad/s").angle,
    "restore_clipped": lambda z, rate: zr.restore_clipped(z, rate).gyro,
    "fuse_accelerometers": lambda z, rate: zr.array.fuse_accelerometers(ACCEL, z, rate).accel,
    "TemperatureModel.fit": lambda z, rate: c.TemperatureModel.fit(
        z, np.linspace(20.0, 40.0, N), rate
    ).coefficients.ravel(),
    "calibrate": None,  # its arrays are gyro= and accel=, in tests/calibration
    "find_rotations": None,  # sensors by three axes, which no log has
}
WIDE = ("allan_covariance", "restore_clipped", "orientation_error_growth", "fuse_accelerometers")
TAKEN = [name for name, call in CALLS.items() if call is not None]


def samples(name):
    """What a function takes: one axis, or three."""
    return AXES if name in WIDE else Z


def log(name, unit="rad/s"):
    data = samples(name)
    columns = ["wx", "wy", "wz"][: data.reshape(N, -1).shape[1]]
    return Log(np.arange(N) / RATE, RATE, data, columns, unit)


def test_every_function_with_a_rate_is_in_the_table():
    found = {
        name
        for floor in FLOORS
        for name in import_module(f"zerorate.{floor}").__all__
        if inspect.isfunction(call := getattr(import_module(f"zerorate.{floor}"), name))
        and "rate" in inspect.signature(call).parameters
    }
    # A model is no record.
    assert found - {"to_filter"} == {name for name in CALLS if "." not in name}


@pytest.mark.parametrize("name", TAKEN)
def test_a_log_brings_its_rate(name):
    expected = CALLS[name](samples(name), RATE)
    for rate in (None, RATE):
        # The stamps of a log, by which it is integrated, are rounded.
        np.testing.assert_allclose(CALLS[name](log(name), rate), expected, rtol=1e-9, atol=1e-12)
    # A clock is hardly known better.
    CALLS[name](log(name), 1.005 * RATE)


@pytest.mark.parametrize("name", TAKEN)
def test_another_rate_is_refused(name):
    with pytest.raises(ValueError, match="rate must be that of the log, 100 Hz, got 50"):
        CALLS[name](log(name), 50.0)
    if name != "prepare":
        with pytest.raises(ValueError, match="rate must be given in Hz: only a Log has one"):
            CALLS[name](samples(name), None)


FRAMES = {
    "pandas": pd.DataFrame,
    "polars": pl.DataFrame,
    "pyarrow": pa.table,
}
DPS = {f"gyro_{axis}_dps": column for axis, column in zip("xyz", AXES.T.copy(), strict=True)}


@pytest.mark.parametrize("frame", FRAMES.values(), ids=FRAMES)
def test_a_frame_brings_names_and_their_unit(frame):
    for call in (zr.allan, zr.array.allan_covariance):
        found = call(frame(DPS), RATE)
        assert (found.names, found.unit) == (tuple(DPS), "deg/s")
        assert call(frame(DPS), RATE, names=list("abc")).names == ("a", "b", "c")
        with pytest.raises(ValueError, match="unit must be that of the samples, deg/s, got rad/s"):
            call(frame(DPS), RATE, unit="rad/s")
    restored = zr.restore_clipped(frame(DPS), RATE).gyro
    np.testing.assert_array_equal(restored, zr.restore_clipped(np.radians(AXES), RATE).gyro)


SERIES = {
    "pandas": lambda z, name: pd.Series(z, name=name),
    "polars": lambda z, name: pl.Series(name, z),
}


@pytest.mark.parametrize("series", SERIES.values(), ids=SERIES)
def test_a_series_brings_its_name_and_unit(series):
    z = series(Z, "gyro_x_dps")
    found = zr.allan(z, RATE)
    assert (found.names, found.unit, found.deviation.ndim) == (("gyro_x_dps",), "deg/s", 1)
    found = zr.identification.identify(z, RATE, order=(1, 0))
    assert (found.name, found.unit) == ("gyro_x_dps", "deg/s")
    found = zr.identification.identify(z, RATE, order=(1, 0), name="x")
    assert (found.name, found.unit) == ("x", "deg/s")
    known = zr.noise.whittle(Z, RATE, unit="deg/s")
    assert zr.noise.whittle(z, RATE).angle_random_walk == known.angle_random_walk


def test_the_array_of_a_log_is_its_data():
    one = log("allan_covariance")
    assert np.asarray(one) is one.data
    copied = np.array(one)
    assert not np.shares_memory(copied, one.data)
    np.testing.assert_array_equal(copied, one.data)
    assert np.asarray(one, dtype=np.float32).dtype == np.float32
    with pytest.raises(ValueError, match="copy"):
        np.asarray(one, dtype=np.float32, copy=False)
    assert np.mean(one) == np.mean(AXES)
