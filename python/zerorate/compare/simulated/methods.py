"""Methods that find the drift in records, by name or as given."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate._native import DriftFilter

__all__ = ["HINDSIGHT", "Estimate", "Method", "check", "known", "name_of"]

Floats = npt.NDArray[np.float64]

# A trace keeps all that the filter knew at every sample: so many samples of it at a time.
_SLAB: Final = 10_000

HINDSIGHT: Final = "ema"
"""The method that is chosen after the fact, with the truth at hand."""


class Estimate(NamedTuple):
    """Drift, and the standard deviation that the method gives it: shape (n, k), deg/s."""

    drift: Floats
    sigma: Floats


Method = Callable[[Floats, float], Floats | Estimate]
"""Called with k records, shape (n, k), and their rate in Hz; answers their drift, causally."""


def name_of(method: str | Method) -> str:
    """Return what a method is called in a table."""
    return method if isinstance(method, str) else getattr(method, "__name__", repr(method))


def known(method: str | Method) -> Method:
    """Return a causal method by its name, or itself."""
    return _NAMED[method] if isinstance(method, str) else method


def check(method: str | Method) -> None:
    """Raise ValueError for a name that is not known."""
    names = [*_NAMED, HINDSIGHT]
    if isinstance(method, str) and method not in names:
        raise ValueError(f"unknown method {method!r}; known: {', '.join(names)}")


def _raw(signal: Floats, rate: float) -> Floats:
    return signal


def _mean(signal: Floats, rate: float) -> Floats:
    total: Floats = np.cumsum(signal, axis=0)
    return total / np.arange(1.0, len(signal) + 1.0)[:, np.newaxis]


def _filtered(signal: Floats, rate: float, *, method: Literal["kf", "akf", "fading"]) -> Floats:
    return DriftFilter(rate, method=method, channels=signal.shape[1]).process(signal)


def _learned(signal: Floats, rate: float) -> Estimate:
    """Return what the self-tuning filter learned at rest, one record at a time."""
    answers = [_learned_of_one(record, rate) for record in np.ascontiguousarray(signal.T)]
    drifts, sigmas = zip(*answers, strict=True)
    return Estimate(np.column_stack(drifts), np.column_stack(sigmas))


def _learned_of_one(record: Floats, rate: float) -> tuple[Floats, Floats]:
    drift_filter = DriftFilter(rate, method="auto")
    drift, sigma = np.empty_like(record), np.empty_like(record)
    for begin in range(0, record.size, _SLAB):
        slab = slice(begin, begin + _SLAB)
        trace = drift_filter.trace(record[slab])
        drift[slab], sigma[slab] = trace.bias, trace.bias_sigma
    return drift, sigma


_NAMED: Final[Mapping[str, Method]] = {
    "raw": _raw,
    "mean": _mean,
    "kf": partial(_filtered, method="kf"),
    "akf": partial(_filtered, method="akf"),
    "fading": partial(_filtered, method="fading"),
    "auto": _learned,
}
