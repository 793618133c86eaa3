"""Samples of every kind, and missing ones, are arrays with NaN to all that takes samples."""

import inspect
from decimal import Decimal

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

import zerorate as zr
from zerorate.io import write_log
from zerorate.record import Log
from zerorate.record.log import LogError
from zerorate.tasks.replay.run import run_filters

N = 3000
RATE = 100.0
GONE = (np.arange(N) % 500 >= 100) & (np.arange(N) % 500 < 110)
NAN = np.where(GONE, np.nan, np.random.default_rng(1).standard_normal(N))
OTHER = np.random.default_rng(2).standard_normal(N)
TIME = np.arange(N) / RATE

SHAPES = {
    "masked": np.ma.array(np.where(GONE, 1e9, NAN), mask=GONE),
    "list with None": [None if gone else z for gone, z in zip(GONE, NAN.tolist(), strict=True)],
    "list with NA": [pd.NA if gone else z for gone, z in zip(GONE, NAN.tolist(), strict=True)],
    "objects": np.where(GONE, None, NAN.astype(object)),
    "decimals": np.where(GONE, None, np.array([Decimal(repr(z)) for z in NAN.tolist()])),
    "pandas": pd.Series(NAN).astype("Float64").mask(GONE),
    "pandas' array": pd.array(np.where(GONE, None, NAN.astype(object)), "Float64"),
    "pandas' Arrow": pd.Series(NAN).mask(GONE).convert_dtypes(dtype_backend="pyarrow"),
    "pyarrow": pa.array(NAN, from_pandas=True),
    "chunks of pyarrow": pa.chunked_array([pa.array(NAN, from_pandas=True)]),
    "polars": pl.Series(NAN).fill_nan(None),
    "Log": Log(TIME, RATE, NAN, ["wx"]),
    "data frame": pd.DataFrame({"wx": NAN}),
    "polars' frame": pl.DataFrame({"wx": NAN}).fill_nan(None),
    "table of Arrow": pa.table({"wx": pa.array(NAN, from_pandas=True)}),
}


m, i = zr.metrics, zr.identification
WHERE = np.arange(N) % 3 > 0
METRICS = {
    "allan_ratio": lambda z: m.allan_ratio(z, OTHER, RATE, 0.5).ratio,
    "best_ema": lambda z: m.best_ema(z, RATE, 1.0).estimate,
    "coasting_error": lambda z: m.coasting_error(z, OTHER, RATE, 1.0),
    "coverage": lambda z: (m.coverage(z, np.ones(N)), m.coverage(OTHER, abs_of(z))),
    "delay": lambda z: (m.delay(z, OTHER, RATE, 0.1), m.delay(OTHER, z, RATE, 0.1)),
    "equal_delay_lowpass": lambda z: m.equal_delay_lowpass(z, RATE, 0.1),
    "mean_shift": lambda z: (m.mean_shift(z, OTHER), m.mean_shift(OTHER, z)),
    "motion_error": lambda z: (*vars(m.motion_error(z, OTHER, RATE, raw=z)).values(),),
    "nis": lambda z: m.nis(z, np.ones(N), WHERE),
    "orientation_error_growth": lambda z: m.orientation_error_growth(
        rows(z, 3), rows(np.ones(N), 4), RATE, (0.05,)
    ),
    "heading_offset": lambda z: (
        m.heading_offset(rows(z, 4), rows(OTHER, 4)),
        m.heading_offset(rows(OTHER, 4), rows(z, 4)),
    ),
    "orientation_errors": lambda z: (
        m.orientation_errors(rows(z, 4), rows(OTHER, 4)),
        m.orientation_errors(rows(OTHER, 4), rows(z, 4)),
    ),
    "reduction": lambda z: (m.reduction(z, OTHER), m.reduction(OTHER, z)),
    "regret": lambda z: m.regret(z, OTHER, np.zeros(N)),
    "rmse": lambda z: (m.rmse(z, OTHER), m.rmse(OTHER, z)),
    "running_mean": lambda z: m.running_mean(z),
    "settling_time": lambda z: m.settling_time(z, 0.0, 1.0, RATE),
}
IDENTIFY = {
    "adf": i.adf,
    "anderson_darling": i.anderson_darling,
    "arma_grid": lambda z: i.arma_grid(z, 1, 0),
    "autocorrelation": lambda z: i.autocorrelation(z, 5),
    "decimate": lambda z: i.decimate(z, 2),
    "detrend": i.detrend,
    "far_from_average": i.far_from_average,
    "fit_ar": lambda z: i.fit_ar(z, 1),
    "fit_arma": lambda z: i.fit_arma(z, 1, 0),
    "fit_network": lambda z: i.fit_network(z, inputs=2, hidden=1).weights,
    "hampel": i.hampel,
    "identify": lambda z: i.identify(z, RATE, name="wx", order=(1, 0)),
    "jarque_bera": i.jarque_bera,
    "kpss": i.kpss,
    "ljung_box": i.ljung_box,
    "moving_average": lambda z: i.moving_average(z, 5),
    "moving_spans": lambda z: i.moving_spans(z, RATE),
    "prepare": lambda z: i.prepare(z, RATE),
    "reverse_arrangements": i.reverse_arrangements,
    "segments": lambda z: i.segments(z, 5),
    "select_order": lambda z: i.select_order(z, max_order=2),
    "whiteness": i.whiteness,
}
STREAMS = {
    "DriftFilter": lambda: zr.DriftFilter(RATE),
    "RecursiveLeastSquares": lambda: zr.identification.RecursiveLeastSquares((1, 0)),
    "AllanNoise": lambda: zr.noise.AllanNoise(),
    "StreamingAllan": lambda: zr.StreamingAllan(RATE),
    "RestDetector": lambda: zr.RestDetector(RATE),
    "WaveletDenoiser": lambda: zr.WaveletDenoiser(RATE),
}
CORRECTOR = zr.ImuCorrector(np.eye(3), np.zeros(3), g_sensitivity=np.eye(3))
LOGS = {
    "Log": lambda z: Log(TIME, RATE, z, ["wx"]).data,
    "with_data": lambda z: Log(TIME, RATE, OTHER, ["wx"]).with_data(z).data,
    "read_log": lambda z: zr.read_log({"wx": z}, rate=RATE).data,
    "read_recording": lambda z: zr.read_recording({"wx": z}, rate=RATE).gyro.data,
    "allan": lambda z: zr.allan(z, RATE).deviation.ravel(),
    "allan_covariance": lambda z: zr.array.allan_covariance(rows(z, 2), RATE).matrix,
    "whittle": lambda z: zr.noise.whittle(z, RATE),
    "dynamic_allan": lambda z: zr.noise.dynamic_allan(z, RATE, window=5.0).deviation,
    "replay": lambda z: (
        run_filters(Log(TIME, RATE, OTHER, ["wx"], "deg/s"), methods=["auto"], truth=z).scores
    ),
}
PROCESS = {name: (lambda z, made=made: made().process(z)) for name, made in STREAMS.items()}
PROCESS["TemperatureFilter"] = lambda z: zr.TemperatureFilter(RATE).process(z, z)
PROCESS["ImuCorrector"] = lambda z: CORRECTOR.copy().process(rows(z, 6))
CALLS = METRICS | IDENTIFY | LOGS | PROCESS


def abs_of(z):
    return [None if np.isnan(value) else abs(value) for value in zr.record.missing.floats(z, "z")]


def rows(z, axes):
    """Return so many columns, of which the first is a record."""
    column = z if isinstance(z, np.ma.MaskedArray) else np.array(z, dtype=object)
    stack = np.ma.column_stack if isinstance(z, np.ma.MaskedArray) else np.column_stack
    return stack([column, *([np.zeros(N)] * (axes - 1))])


def plain(answer):
    """Return an answer as text, arrays in full."""
    with np.printoptions(threshold=10**9):
        return repr(answer)


@pytest.fixture(scope="module")
def expected():
    """Return what each call gives for NaN."""
    return {name: plain(call(NAN)) for name, call in CALLS.items()}


@pytest.mark.every(5)
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("name", CALLS)
def test_missing_is_nan(expected, name, shape):
    assert plain(CALLS[name](SHAPES[shape])) == expected[name]


@pytest.mark.parametrize(
    "value", [None, np.nan, pd.NA, np.ma.masked, np.float32("nan"), np.array(np.nan)], ids=repr
)
@pytest.mark.parametrize("name", STREAMS)
def test_a_sample_that_is_missing(name, value):
    filters = [STREAMS[name]() for _ in range(2)]
    for one, missing in zip(filters, (np.nan, value), strict=True):
        one.process(OTHER[:500])
        one.update(missing)
    after = [plain(one.process(OTHER[500:])) for one in filters]
    assert after[0] == after[1]


@pytest.mark.parametrize("value", [None, pd.NA, np.float32("nan"), np.inf], ids=repr)
def test_an_axis_that_is_missing(value):
    for place in (1, 4):
        row = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
        row[place] = np.nan
        expected = CORRECTOR.copy().update(row)
        row[place] = value
        assert plain(CORRECTOR.copy().update(row)) == plain(expected)


def test_every_function_of_samples_is_in_the_table():
    def functions(module):
        return {n for n in module.__all__ if inspect.isfunction(getattr(module, n))}

    # Tracks take poses, whose missing parts are in tests/metrics.
    assert functions(zr.metrics) - {"ate", "rpe"} == METRICS.keys()
    assert functions(zr.identification) - {"to_filter"} == IDENTIFY.keys()


@pytest.mark.parametrize("bad", [["a", "b"], [1j, 2], np.array(["NaT", "2024"], "M8[s]")], ids=str)
@pytest.mark.parametrize("name", CALLS)
def test_what_is_no_number_is_refused(name, bad):
    with pytest.raises((TypeError, ValueError), match=r"real numbers|expected"):
        CALLS[name](np.resize(bad, N))


def test_a_number_that_no_double_holds():
    for call in (zr.read_log, lambda z: Log([0.0, 0.1], 10, z["wx"], ["wx"])):
        with pytest.raises(LogError, match=r"holds a number beyond the largest double"):
            call({"wx": [10**400, 1]})
    with pytest.raises(ValueError, match="holds a number beyond the largest double"):
        zr.metrics.rmse([10**400, 1], [1, 1])


@pytest.mark.parametrize("time", [np.ma.array(TIME, mask=GONE), TIME.astype("M8[s]"), [None] * N])
def test_the_time_of_a_log_is_whole(time):
    with pytest.raises(LogError, match="time must"):
        Log(time, RATE, OTHER, ["wx"])


@pytest.mark.parametrize("suffix", ["csv", "npz", "parquet"])
def test_extra_columns_of_a_log_that_is_written(tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    write_log(Log(TIME, RATE, OTHER, ["wx"], extra={"extra": SHAPES["masked"]}), path)
    if suffix == "npz":
        again = np.load(path)["extra"]
    else:
        again = zr.read_log(path, columns="extra").data[:, 0]
    np.testing.assert_array_equal(again, NAN)
