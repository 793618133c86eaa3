"""Averages as a baseline for filters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate._native import exponential_mean
from zerorate.faults import ArgumentError
from zerorate.metrics.channels import check_same_shape, columns, is_single, per_channel
from zerorate.metrics.rest import coasting_error
from zerorate.metrics.truth import rmse
from zerorate.record.named import rate_of
from zerorate.types import Floats

Error = Callable[[Floats], float]

_GAIN_COUNT: Final = 25
"""Number of gains on a grid from the running mean to the samples: four per decade for a million
samples.
"""


@dataclass(frozen=True, eq=False)
class BestEma:
    """Exponential moving average with the smallest error in hindsight.

    Attributes
    ----------
    estimate : ndarray, the shape of the data
        Averages.
    gain : float or ndarray, shape (k,)
        Gain of each channel, from 0 to 1.
    error : float or ndarray, shape (k,)
        Error of this average, the smallest of all gains that were tried.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.metrics import best_ema
    >>> z = 1.0 + np.random.default_rng(1).standard_normal(4096)
    >>> found = best_ema(z, rate=100.0, truth=np.ones(4096), start=20.0)
    >>> found.estimate.shape, bool(found.error < 0.1)
    ((4096,), True)
    """

    estimate: Floats
    gain: float | Floats
    error: float | Floats


def running_mean(raw: npt.ArrayLike) -> Floats:
    """Return the mean of all samples to date, the best estimate of a constant bias.

    Parameters
    ----------
    raw : array_like, shape (n,) or (n, k)
        Gyro output in any unit.

    Returns
    -------
    ndarray of float64, the shape of `raw`
        Means. At a missing sample the mean is held; before the first present sample it is NaN.

    Raises
    ------
    ValueError
        If `raw` is empty or has another shape.

    Examples
    --------
    >>> running_mean([1.0, 3.0, 5.0]).tolist()
    [1.0, 2.0, 3.0]
    """
    return _restore_shape([exponential_mean(z, 0.0) for z in columns("raw", raw)], raw)


def best_ema(
    raw: npt.ArrayLike,
    rate: float | None = None,
    horizon: float | None = None,
    *,
    truth: npt.ArrayLike | None = None,
    start: float = 0.0,
) -> BestEma:
    """Return the exponential moving average with the best gain in hindsight, as a baseline.

    No filter can choose this gain, because the choice uses the whole record. 25 gains are tried,
    from 1/n to 1 in equal ratios. Each average begins as the running mean: y += max(1/k, g) (z - y)
    at the k-th sample. A small gain therefore has no disadvantage at the start.

    Parameters
    ----------
    raw : array_like, shape (n,) or (n, k)
        Gyro output in any unit.
    rate : float
        Sampling rate, Hz. Default: the rate of a `Log`.
    horizon : float, optional
        Coasting time, s: the error is then `coasting_error`. Give either `horizon` or `truth`.
    truth : array_like, shape of `raw`, optional
        True drift; the error is then `rmse`.
    start : float, default 0
        Time from which errors count, s.

    Returns
    -------
    BestEma
        Averages; each channel has its own gain.

    Raises
    ------
    ValueError
        If not exactly one of `horizon` and `truth` is given. If `start` is negative or after the
        end of the record. As in `coasting_error` and `rmse`.

    Examples
    --------
    >>> z = np.random.default_rng(1).standard_normal(4096)
    >>> best_ema(z, rate=100.0, truth=np.zeros(4096), start=20.0).gain == 1 / 4096
    True
    """
    z = columns("raw", raw)
    hertz = rate_of(rate, raw, truth)
    begin = _first_sample(start, hertz, z.shape[1])
    if truth is not None and horizon is None:
        known = columns("truth", truth)
        check_same_shape("raw", z, "truth", known)
        errors = [partial(_truth_error, row, begin) for row in known]
    elif horizon is not None and truth is None:
        errors = [partial(_coasting_error_of, row, begin, hertz, horizon) for row in z]
    else:
        raise ValueError("best_ema takes either a horizon or a truth")
    searches = [_search_gain(row, error) for row, error in zip(z, errors, strict=True)]
    estimates, gains, least = zip(*searches, strict=True)
    return BestEma(_restore_shape(estimates, raw), per_channel(gains, raw), per_channel(least, raw))


def _search_gain(z: Floats, error: Error) -> tuple[Floats, float, float]:
    gains = np.minimum(np.geomspace(1.0 / z.size, 1.0, _GAIN_COUNT), 1.0).tolist()
    errors = [error(exponential_mean(z, gain)) for gain in gains]
    least = int(np.argmin(errors))
    return exponential_mean(z, gains[least]), gains[least], errors[least]


def _coasting_error_of(z: Floats, begin: int, rate: float, horizon: float, x: Floats) -> float:
    return float(coasting_error(z[begin:], x[begin:], rate, horizon))


def _truth_error(truth: Floats, begin: int, x: Floats) -> float:
    return float(rmse(truth[begin:], x[begin:]))


def _first_sample(start: float, rate: float, n: int) -> int:
    if not 0.0 <= start * rate < n:
        raise ArgumentError(
            "start", f"must be 0 or more and less than the record's {n / rate:g} s, got {start}"
        )
    return round(start * rate)


def _restore_shape(rows: Sequence[Floats], like: npt.ArrayLike) -> Floats:
    """Return rows as channels of the shape of the data."""
    return rows[0] if is_single(like) else np.column_stack(rows)


SHARED_GAINS: Final[Floats] = np.geomspace(1e-6, 1e-1, 25)
"""Gains that `best_shared_ema` tries: averages over ten to a million samples."""


def best_shared_ema(signal: Floats, truth: Floats, first: int) -> Floats:
    """Return the mean squared error of each record with the best common gain.

    It is `best_ema` with a truth, but with one gain from a fixed grid for all records. Each average
    is the running mean until 1/k reaches its gain, so the first sample has no extra weight.

    Parameters
    ----------
    signal, truth : ndarray, shape (n, k)
        Output and true drift of k gyros.
    first : int
        Index of the first sample to include in the error.
    """
    gains = SHARED_GAINS[:, np.newaxis]
    x = np.zeros((SHARED_GAINS.size, signal.shape[1]))
    total = np.zeros_like(x)
    for k, (z, drift) in enumerate(zip(signal, truth, strict=True)):
        x += np.maximum(gains, 1.0 / (k + 1)) * (z - x)
        if k >= first:
            total += (x - drift) ** 2
    best: Floats = total[total.sum(axis=1).argmin()]
    return best / (len(signal) - first)
