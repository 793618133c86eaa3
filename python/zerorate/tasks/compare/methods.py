"""Methods by name, for one axis of a recording and for simulated records."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np

from zerorate import metrics
from zerorate._native import DriftFilter, exponential_mean
from zerorate.denoising import denoise
from zerorate.faults import ArgumentError
from zerorate.options import FILTER_OPTIONS, add_rest_limits
from zerorate.options import METHODS as FILTERS
from zerorate.tasks.compare.own_method import OwnMethod
from zerorate.tasks.replay.history import Recorder, time_constants
from zerorate.tasks.trace import Trace
from zerorate.types import Booleans, Floats

MethodSpec = str | OwnMethod
"""Name of a method of the package, or a method of the user."""


_SUFFIXES: Final = {"hold": ("motion", "hold"), "reject": ("outliers", "reject")}
"""Options of the filter by the words after the method's name and a plus."""

WHOLE_RECORD_METHODS: Final = ("wu-ran", "visushrink")
"""Wavelet methods for whole recordings: Wu & Ran's with their robust filter, and VisuShrink."""

_VISUSHRINK_LEVELS: Final = 5
"""Number of octaves with a threshold in VisuShrink, as in Wu & Ran's comparison."""

METHODS: Final = (
    "raw",
    "mean",
    "ema",
    "kf",
    "akf",
    "fading",
    "fading+hold",
    "fading+reject",
    "robust",
    "auto",
    *WHOLE_RECORD_METHODS,
)
"""Methods compared by default."""

FIRST_REST_S: Final = 10.0
"""Duration of the first rest; its mean is the bias, s."""

_TRACE_BLOCKS: Final = 64


@dataclass(frozen=True, eq=False)
class AxisResult:
    """Result of a method on one axis of n samples.

    Attributes
    ----------
    estimate : ndarray, shape (n,)
        Value to hold while coasting: the drift, or the smoothed rate of a sensor at rest.
    bias : ndarray, shape (n,), or None
        Drift to subtract from the raw rate; None if the method subtracts no drift.
    smooth : ndarray or None
        Smoothed rate, to be used instead of the raw rate. NaN where the raw rate is missing,
        because a prediction is no measurement.
    time_constant : float
        Time in which the estimate makes 63 % of a step, s. Infinite if this time keeps growing, NaN
        if unknown.
    sigma : ndarray or None
        Standard deviation of the bias.
    at_rest : ndarray of bool or None
        True if the method considered the sensor at rest.
    innovation, innovation_variance : ndarray or None
        Innovation of a Kalman filter and its variance.
    causal : bool
        True if no value depends on later samples.
    """

    estimate: Floats
    bias: Floats | None
    smooth: Floats | None = None
    time_constant: float = np.nan
    sigma: Floats | None = None
    at_rest: Booleans | None = None
    innovation: Floats | None = None
    innovation_variance: Floats | None = None
    causal: bool = True


def resolve_methods(methods: Sequence[str | OwnMethod | Callable[..., Any]]) -> list[MethodSpec]:
    """Return the methods in the same order, with methods of the user imported and checked.

    Parameters
    ----------
    methods : sequence of str, OwnMethod or callable
        Names, ``name=module:function``, or functions and classes (see `OwnMethod`).

    Raises
    ------
    ValueError
        If there is no method, or two methods have the same name. Also if a method of the user
        cannot be found, or has the name of a method of the package.
    """
    specs = [_resolve_method(spec) for spec in methods]
    names = [name_of(spec) for spec in specs]
    if not names or len(set(names)) < len(names):
        raise ArgumentError("methods", f"must be at least one and all different, got {names}")
    return specs


def _resolve_method(method: str | OwnMethod | Callable[..., Any]) -> MethodSpec:
    if isinstance(method, str):
        if "=" not in method:
            return method
        method = OwnMethod.parse(method)
    elif not isinstance(method, OwnMethod):
        method = OwnMethod(getattr(method, "__name__", repr(method)), method)
    if _is_known(method.name) or method.name == _OPTIMUM:
        raise ValueError(f"{method.name} is a method of this package: give yours another name")
    return method


_OPTIMUM: Final = "optimum"
"""Name in tables for the filter that knows the model of a simulated gyro."""


def run_on_axis(
    method: MethodSpec, z: Floats, rate: float, gain: Callable[[], float], unit: str | None = None
) -> AxisResult:
    """Run a method on one axis.

    Parameters
    ----------
    method : str or OwnMethod
        Name in `METHODS`, or another method of `zerorate.DriftFilter`, or a method of the user.
        Append ``+hold`` to learn only at rest, ``+reject`` to reject outliers.
    z : ndarray, shape (n,)
        Raw rates.
    rate : float
        Samples per second, Hz.
    gain : callable
        Function that returns the gain of the best exponential moving average in hindsight, by the
        measure for this record.
    unit : str, optional
        Unit of the rates. If it is known, "auto" has the limits of rest of the command line.

    Raises
    ------
    ValueError
        If the method is unknown.
    MethodError
        If a method of the user fails.
    """
    if isinstance(method, OwnMethod):
        bias = method.run(z, rate)
        return AxisResult(bias, bias, causal=method.is_causal(z, bias, rate))
    if method == "raw":
        return AxisResult(z, np.zeros_like(z), time_constant=0.0)
    if method == "mean":
        mean = metrics.running_mean(z)
        return AxisResult(mean, mean, time_constant=np.inf)
    if method == "ema":
        best_gain = gain()
        average = exponential_mean(z, best_gain)
        return AxisResult(average, average, time_constant=1.0 / (best_gain * rate))
    if method in WHOLE_RECORD_METHODS:
        smooth = _run_wavelet(method, z, rate)
        return AxisResult(smooth, None, smooth, causal=False)
    return _run_filter(method, z, rate, unit)


def filter_arguments(method: str) -> dict[str, Any]:
    """Return the arguments of `zerorate.DriftFilter` for a name such as ``fading+hold``."""
    name, *words = method.split("+")
    options = dict(_SUFFIXES.get(word, ("", "")) for word in words)
    # Unknown words are left to the filter, which raises the error.
    is_known = FILTER_OPTIONS.keys() >= options.keys()
    return {"method": name} | options if is_known else {"method": method}


def _is_known(method: str) -> bool:
    return (
        method in (*_SIMPLE_METHODS, *WHOLE_RECORD_METHODS)
        or filter_arguments(method)["method"] in FILTERS
    )


_SIMPLE_METHODS: Final = ("raw", "mean", "ema")


def first_rest_bias(z: Floats, rate: float) -> AxisResult:
    """Return the mean of the first ten seconds as bias; the sensor must be at rest there."""
    start = z[: max(1, round(FIRST_REST_S * rate))]
    present = start[np.isfinite(start)]
    bias = np.full(z.shape, present.mean() if present.size else np.nan)
    return AxisResult(bias, bias)


def _run_filter(method: str, z: Floats, rate: float, unit: str | None) -> AxisResult:
    arguments = filter_arguments(method)
    filter_ = DriftFilter(
        rate, channels=1, **add_rest_limits(arguments, [arguments["method"]], unit)
    )
    recorder, parts = Recorder(), []
    # Traces of a whole long record would fill the memory.
    for block in np.array_split(z[:, np.newaxis], min(_TRACE_BLOCKS, z.size)):
        parts.append(_select_fields(filter_.trace(block)))
        recorder.take(filter_)
    readings: dict[str, Any]
    readings = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    if filter_.order is None:
        gain = float(filter_.gain[0, 0])
        return AxisResult(**readings, time_constant=1.0 / (gain * rate) if gain > 0.0 else np.nan)
    seconds = float(time_constants(recorder.history(), filter_.order, rate)[0])
    smooth = np.where(np.isfinite(z), readings["estimate"], np.nan)
    return AxisResult(**readings, smooth=smooth, time_constant=seconds)


def _run_wavelet(method: str, z: Floats, rate: float) -> Floats:
    """Return the wavelet's output for a whole record; NaN if samples are missing or too few."""
    try:
        if method == "visushrink":
            return _denoise_signal(z, level=_VISUSHRINK_LEVELS)
        robust = DriftFilter(rate, output="estimate", **filter_arguments("robust")).process(z)
        return _denoise_signal(robust, level="psr", approximation=True)
    except ValueError:
        return np.full_like(z, np.nan)


def _denoise_signal(z: Floats, **options: Any) -> Floats:  # noqa: ANN401
    signal: Floats = denoise(z, **options).signal
    return signal


_TRACE_FIELDS: Final = {
    "estimate": "estimate",
    "bias": "bias",
    "bias_sigma": "sigma",
    "at_rest": "at_rest",
    "innovation": "innovation",
    "innovation_variance": "innovation_variance",
}


def _select_fields(trace: Trace) -> dict[str, Any]:
    """Return the necessary fields of the trace for the one channel."""
    return {own: getattr(trace, name)[:, 0] for name, own in _TRACE_FIELDS.items()}


# A trace needs much memory per sample, so a long record is processed in blocks.
_BLOCK_SAMPLES: Final = 10_000

HINDSIGHT_METHOD: Final = "ema"
"""Method with a gain chosen in hindsight from the true drift."""


class Estimate(NamedTuple):
    """Drift and its stated standard deviation, shape (n, k), deg/s.

    `sigma` is None if the method states none. `causal` is False if the method looks ahead.
    """

    drift: Floats
    sigma: Floats | None
    causal: bool = True


Method = Callable[[Floats, float], Floats | Estimate]
"""Function of k records, shape (n, k), and their rate, Hz; it returns the drift."""


def name_of(method: MethodSpec | Method) -> str:
    """Return the name of a method in a table."""
    if isinstance(method, OwnMethod):
        return method.name
    return method if isinstance(method, str) else getattr(method, "__name__", repr(method))


def causal_method(method: MethodSpec | Method) -> Method:
    """Return a method by name, or the given function; only `WHOLE_RECORD_METHODS` look ahead."""
    if isinstance(method, OwnMethod):
        return partial(_run_own, method=method)
    if not isinstance(method, str):
        return method
    return _METHOD_FUNCTIONS.get(method) or partial(
        _run_whole_record if method in WHOLE_RECORD_METHODS else _run_published, method=method
    )


def check_name(method: MethodSpec | Method) -> None:
    """Raise ValueError for an unknown name."""
    if isinstance(method, str) and not _is_known(method):
        raise ValueError(f"unknown method {method!r}; known are {', '.join(METHODS)}")


def _run_raw(signal: Floats, rate: float) -> Floats:
    return signal


def _run_mean(signal: Floats, rate: float) -> Floats:
    total: Floats = np.cumsum(signal, axis=0)
    return total / np.arange(1.0, len(signal) + 1.0)[:, np.newaxis]


def _run_published(signal: Floats, rate: float, *, method: str) -> Floats:
    arguments = filter_arguments(method)
    bank = DriftFilter(rate, channels=signal.shape[1], output="estimate", **arguments)
    return bank.process(signal)


def _run_whole_record(signal: Floats, rate: float, *, method: str) -> Estimate:
    records = np.ascontiguousarray(signal.T)
    drift = np.column_stack([_run_wavelet(method, record, rate) for record in records])
    return Estimate(drift, None, causal=False)


def _run_own(signal: Floats, rate: float, *, method: OwnMethod) -> Estimate:
    """Return the bias of the user's method, which gets rad/s, and a flag if it is causal."""
    records = np.radians(np.ascontiguousarray(signal.T))
    biases = [method.run(record, rate) for record in records]
    causal = method.is_causal(records[0], biases[0], rate)
    return Estimate(np.degrees(np.column_stack(biases)), None, causal)


def _run_auto(signal: Floats, rate: float) -> Estimate:
    """Return the bias of the self-tuning filter at rest, record by record."""
    estimates = [_run_auto_record(record, rate) for record in np.ascontiguousarray(signal.T)]
    drifts, sigmas = zip(*estimates, strict=True)
    return Estimate(np.column_stack(drifts), np.column_stack(sigmas))


def _run_auto_record(record: Floats, rate: float) -> tuple[Floats, Floats]:
    drift_filter = DriftFilter(rate, method="auto")
    drift, sigma = np.empty_like(record), np.empty_like(record)
    for begin in range(0, record.size, _BLOCK_SAMPLES):
        block = slice(begin, begin + _BLOCK_SAMPLES)
        trace = drift_filter.trace(record[block])
        drift[block], sigma[block] = trace.bias, trace.bias_sigma
    return drift, sigma


_METHOD_FUNCTIONS: Final[Mapping[str, Method]] = {
    "raw": _run_raw,
    "mean": _run_mean,
    "auto": _run_auto,
}
