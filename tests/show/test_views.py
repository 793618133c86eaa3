"""Every result has a table, a figure and a text, by what `zerorate.show` registers."""

import base64
import dataclasses
import html
import importlib
import inspect
import pkgutil
import re
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import polars
import pyarrow
import pytest

import zerorate as zr
from support.calibrated import calibration, session
from support.checks import assert_same_bits
from support.drives import drive, start_of
from support.figures import check_colours, check_contrast, check_layout
from zerorate import views
from zerorate.noise.coefficient import Coefficient
from zerorate.show.registry import VIEWS
from zerorate.tasks.compare import compare_methods
from zerorate.tasks.replay.run import run_filters

RNG = np.random.default_rng(7)
RATE = 50.0
Z = 0.02 + 0.1 * RNG.standard_normal((3000, 3))
TEMPERATURE = np.linspace(15.0, 45.0, 3000)
ANGLE = np.cumsum(np.sin(np.arange(3000) / 40.0)) / RATE


def log():
    time = np.arange(len(Z)) / RATE
    return zr.Log(time, RATE, np.deg2rad(Z), ("gyro_x", "gyro_y", "gyro_z"), "rad/s")


def accelerometer():
    data = np.tile([0.0, 0.0, 9.81], (len(Z), 1))
    return zr.Log(log().time, RATE, data, ("accel_x", "accel_y", "accel_z"), "m/s^2")


def boards(count=3):
    """Gyros side by side, long enough for weights."""
    return RNG.standard_normal((60_000, count)) * (0.1 + 0.02 * np.arange(count))


def linear(keep="all"):
    kalman = zr.LinearKalman([[1.0, 0.1], [0.0, 1.0]], [[1.0, 0.0]], 0.01 * np.eye(2), [[1.0]])
    return kalman.process(RNG.standard_normal((50, 1)), keep=keep)


def fused():
    return zr.array.fuse_accelerometers(9.8 + RNG.normal(0, 0.1, (600, 3, 3)), Z[:600] / 57.3, RATE)


@cache
def covariance():
    return zr.array.allan_covariance(boards(), 10.0)


@cache
def turns():
    """Rates of three sensors that rest, then move together, the second in other axes."""
    seconds = np.arange(3000) / RATE
    turning = np.stack([np.sin(seconds * k) for k in (1.1, 1.7, 2.3)], axis=-1)
    turning[seconds < 20.0] = 0.0
    rates = np.stack([turning, turning[:, [1, 0, 2]] * [1, 1, -1], turning], axis=1)
    return rates + 0.001 * RNG.standard_normal(rates.shape)


@cache
def aligned():
    moving = drive()
    return zr.align(moving.recording(), latitude=48.0, heading="course", span=(0.0, 10.0))


@cache
def tracked():
    moving = drive()
    return zr.NavigationFilter(start_of(moving)).process(moving.recording(), moving.fixes)


@cache
def outages():
    moving = drive(160.0, rest=12.0)
    nav = zr.NavigationFilter(start_of(moving))
    return zr.navigation.outages(moving.recording(), moving.fixes, seconds=(10,), nav=nav)


def batched():
    """Nine logs, of which one is noisier than the others."""
    folder = Path(tempfile.mkdtemp())
    for k in range(9):
        z = np.random.default_rng(k).normal(0.0, 0.3 if k == 4 else 0.1, 3000)
        one = zr.Log(np.arange(3000) / 100.0, 100.0, z, ["gyro_z_dps"], "deg/s")
        zr.write_log(one, folder / f"{k}.parquet")
    return zr.batch(folder, folder / "out", workers=1)


RESULTS = {
    "Log": log,
    "AllanResult": lambda: zr.allan(log()),
    "DynamicAllan": lambda: zr.noise.dynamic_allan(Z[:, 0], RATE, window=10.0),
    "NoiseModel": lambda: zr.NoiseModel(
        angle_random_walk=1e-4, markov=[zr.noise.Markov(1e-5, 30.0)]
    ),
    "Calibration": calibration,
    "Corrected": lambda: zr.correct(session().recording, session().truth),
    "MagnetometerCalibration": lambda: zr.calibrate_magnetometer(
        zr.simulate_motion("hand", duration=30.0).recording()
    ),
    "CalibrationComparison": lambda: zr.compare_calibrations(calibration(), calibration(seed=6)),
    "FittedRate": lambda: zr.calibration.fit_rate(np.gradient(ANGLE, 1 / RATE), RATE, angle=ANGLE),
    "RateTable": lambda: zr.calibrate_rate_table(np.arange(-6.0, 7.0), 1.01 * np.arange(-6.0, 7.0)),
    "TemperatureModel": lambda: zr.TemperatureModel.fit(
        Z[:, 0] + 0.01 * TEMPERATURE, TEMPERATURE, RATE, unit="deg/s"
    ),
    "AttitudeEstimate": lambda: zr.estimate_attitude(
        zr.Recording({"gyro": log(), "accel": accelerometer()}, "a.csv")
    ),
    "Identification": lambda: zr.identification.identify(Z[:, 0], RATE),
    "Integrated": lambda: zr.integrate(Z, RATE, unit="deg/s", angle_random_walk=1e-4),
    "Integrated about one axis": lambda: zr.integrate(Z[:, 0], RATE, angle_random_walk=1e-4),
    "Denoised": lambda: zr.denoise(Z),
    "LinearRun": linear,
    "LinearRun of states": lambda: linear("state"),
    "SmoothedRun": lambda: linear().smooth(),
    "FusedAccelerometers": fused,
    "AllanCovariance": covariance,
    "VirtualGyro": lambda: covariance().virtual_gyro(),
    "Rotations": lambda: zr.array.find_rotations(turns(), RATE, unit="rad/s"),
    "Alignment": aligned,
    "TimeOffset": lambda: zr.record.TimeOffset(0.259, 0.002),
    "TimeOffset not known": lambda: zr.record.TimeOffset(np.nan, np.inf),
    "Track": tracked,
    "Outages": outages,
    "Trace": lambda: zr.DriftFilter(RATE).trace(Z[:, 0]),
    "Trace of channels": lambda: zr.DriftFilter(RATE, method="fading", channels=3).trace(Z),
    "Replay": lambda: run_filters(log(), methods=("auto", "kf")),
    "Comparison": lambda: compare_methods([zr.Recording({"gyro": log()})], ("raw", "auto", "kf"))[
        0
    ],
    "BatchResult": batched,
    "ArmaModel": lambda: zr.identification.fit_arma(Z[:, 0], 1, 1),
}


@pytest.mark.every(2)
@pytest.mark.parametrize("name", RESULTS)
def test_a_result_shows_itself(name):
    result = RESULTS[name]()
    assert type(result).__name__ in (name.split()[0], "FittedModel")
    text = result.table()
    assert text.strip()
    assert isinstance(result, zr.Log) or str(result) == text
    assert all(len(line) <= 100 for line in text.splitlines())
    figure = result.plot()
    check_layout(figure)
    check_contrast(figure)
    check_colours(figure)
    check_columns(result)


def check_columns(result):
    """Check the columns of a result in the libraries that take them."""
    table = pyarrow.table(result)
    assert min(table.shape) > 0
    frame = result.to_pandas()
    assert list(frame.columns) == table.column_names == polars.DataFrame(result).columns
    assert len(frame) == table.num_rows
    numbers = [name for name in frame if frame[name].dtype.kind == "f"]
    for name in numbers:
        np.testing.assert_array_equal(table[name].to_pandas().to_numpy(), frame[name])


def test_a_log_leaves_as_a_table_and_comes_back():
    """Values, rate, unit and names of a log survive Arrow; so do its further columns."""
    flags = np.arange(len(Z)) % 7 == 0
    expected = dataclasses.replace(log(), extra={"at_rest": flags})
    table = pyarrow.table(expected)
    assert table.column_names == [
        "time_s",
        "gyro_x_radps",
        "gyro_y_radps",
        "gyro_z_radps",
        "at_rest",
    ]
    again = zr.read_log(table)
    assert (again.rate, again.unit, again.names) == (RATE, "rad/s", expected.names)
    assert_same_bits(again.data, expected.data)
    np.testing.assert_array_equal(expected.to_pandas()["at_rest"], flags)


def test_a_replay_gives_its_samples_and_its_summary_a_row_an_axis():
    replay = RESULTS["Replay"]()
    assert_same_bits(replay.to_arrow()["gyro_x_radps"].to_numpy(), replay.to_log().data[:, 0])
    rows = replay.summary().to_pandas()
    assert list(rows["axis"]) == ["gyro_x", "gyro_y", "gyro_z"]
    assert (rows["n"] == len(Z)).all()


def test_a_coefficient_that_is_not_identifiable_has_no_value_but_a_bound():
    unknown = Coefficient(0.0, identifiable=False, upper_bound=2e-6)
    rows = zr.NoiseModel(1e-4, rate_random_walk=unknown).to_arrow().to_pylist()
    row = next(row for row in rows if row["coefficient"] == "rate_random_walk")
    assert (row["value"], row["value_identifiable"], row["value_upper"]) == (None, False, 2e-6)


ARRAYS = {
    "Log": "data",
    "Denoised": "signal",
    "Integrated": "angle",
    "FusedAccelerometers": "accel",
    "AttitudeEstimate": "quaternion",
}


def test_a_result_that_is_one_array_is_taken_by_numpy():
    one_array = {name for name in RESULTS if isinstance(RESULTS[name](), views.OneArray)}
    assert {name.split()[0] for name in one_array} == set(ARRAYS)
    for name, field in ARRAYS.items():
        result = RESULTS[name]()
        assert np.asarray(result) is getattr(result, field)


def test_a_notebook_shows_the_table_and_a_small_figure():
    result = RESULTS["NoiseModel"]()
    text = result._repr_html_()
    assert html.escape(result.table()) in text
    data = re.search(r'<img src="data:image/png;base64,([^"]*)" width="(\d+)"', text)
    png = base64.b64decode(data[1])
    # For screens of high resolution.
    assert int.from_bytes(png[16:20]) == pytest.approx(1.5 * int(data[2]), abs=2)
    assert int(data[2]) <= 380
    assert len(text) < 200_000


def test_a_notebook_without_matplotlib_shows_the_table(monkeypatch):
    def missing(result):
        raise ImportError("this needs matplotlib")

    monkeypatch.setattr(views, "figure_of", missing)
    result = RESULTS["NoiseModel"]()
    assert "<pre" in result._repr_html_()
    assert "<img" not in result._repr_html_()


_BASES = {views.Shown, views.Result}


def test_what_is_registered_is_there():
    for place, names in VIEWS.items():
        module, _, name = place.rpartition(".")
        assert issubclass(_of(module, name), views.Shown), place
        for view in names:
            where, _, function = view.partition(":")
            assert callable(_of(f"show.{where}", function)), view


def test_every_result_is_registered():
    found = {
        f"{one.__module__.removeprefix('zerorate.')}.{one.__name__}"
        for module in _modules()
        for _, one in inspect.getmembers(module, inspect.isclass)
        if issubclass(one, views.Shown) and one not in _BASES
    }
    parents = {name for name in found if _BASES & {*_of(*_parts(name)).__bases__}}
    assert parents == set(VIEWS)


def test_what_nobody_shows_is_said():
    class Strange(views.Result):
        pass

    with pytest.raises(TypeError, match="nothing is registered that shows a Strange"):
        str(Strange())


def _of(module, name):
    return getattr(importlib.import_module(f"zerorate.{module}"), name)


def _parts(place):
    module, _, name = place.rpartition(".")
    return module, name


def _modules():
    for found in pkgutil.walk_packages(zr.__path__, "zerorate."):
        if not found.name.startswith(("zerorate.cli", "zerorate.__main__", "zerorate.show")):
            yield importlib.import_module(found.name)
