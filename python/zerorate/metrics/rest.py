"""Measures of a sensor at rest: noise, mean, error from a wrong bias, slow noise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate._native import allan_deviations, longest_factor
from zerorate.faults import ArgumentError
from zerorate.metrics.channels import (
    check_positive,
    check_same_shape,
    columns,
    is_single,
    per_channel,
    present_pairs,
    spread,
)
from zerorate.record.named import rate_of
from zerorate.types import Floats
from zerorate.units import whole_samples


def reduction(raw: npt.ArrayLike, filtered: npt.ArrayLike) -> float | Floats:
    """Return the ratio of the standard deviations after and before a filter.

    The ratio measures the noise of the output, and most papers report it. It hides delay, lost
    motion and a wrong mean: for a constant output the ratio is 0.

    Parameters
    ----------
    raw, filtered : array_like, shape (n,) or (n, k)
        Samples before and after the filter, in the same unit.

    Returns
    -------
    float or ndarray, shape (k,)
        Ratio, 1 for an unchanged signal, over the samples present in both.

    Raises
    ------
    ValueError
        If the shapes differ or no sample is present in both. If `raw` is constant.

    Examples
    --------
    >>> reduction([1.0, -1.0, 1.0, -1.0], [0.5, -0.5, 0.5, -0.5])
    0.5
    """
    both = present_pairs("raw", raw, "filtered", filtered)
    return per_channel([y.std() / spread(z) for z, y in both], raw)


def mean_shift(raw: npt.ArrayLike, filtered: npt.ArrayLike) -> float | Floats:
    """Return the change of the mean by a filter, in standard deviations of the raw signal.

    This shift detects a filter with little noise but a wrong mean. Errors that cancel over the
    record are hidden. Leave the start-up of a filter out, because it counts as a shift.

    Parameters
    ----------
    raw, filtered : array_like, shape (n,) or (n, k)
        Samples before and after the filter, in the same unit.

    Returns
    -------
    float or ndarray, shape (k,)
        (mean filtered - mean raw) / standard deviation of raw, over the samples present in both.

    Raises
    ------
    ValueError
        If the shapes differ or no sample is present in both. If `raw` is constant.

    Examples
    --------
    >>> mean_shift([1.0, -1.0, 1.0, -1.0], [0.5, 0.5, 0.5, 0.5])
    0.5
    """
    both = present_pairs("raw", raw, "filtered", filtered)
    return per_channel([(y - z).mean() / spread(z) for z, y in both], raw)


_BLOCK_SAMPLES: Final = 8192


def coasting_error(
    raw: npt.ArrayLike, estimate: npt.ArrayLike, rate: float | None, horizon: float
) -> float | Floats:
    """Return the angle error from holding each bias estimate for the next `horizon` seconds.

    The estimate at time t is held, and raw minus estimate is integrated from t to t + horizon. The
    result is the RMS of this angle over all t: the angle error of a user with a wrong bias. No true
    bias is needed. The sensor must be at rest, because rotation counts as error. White noise of
    density N alone gives N sqrt(horizon), so all filters look equal for short horizons.

    Parameters
    ----------
    raw, estimate : array_like, shape (n,) or (n, k)
        Output of the gyro at rest, and the estimate of its bias or drift, in the same unit.
    rate : float or None
        Sampling rate, Hz. None: the rate of a `Log`.
    horizon : float
        Coasting time, s, rounded to whole samples.

    Returns
    -------
    float or ndarray, shape (k,)
        RMS angle, in the unit of the data times seconds. Times with a missing estimate, or with a
        missing raw sample in the window, are left out.

    Raises
    ------
    ValueError
        If the shapes differ. If `rate` or `horizon` is not positive and finite. If the horizon is
        less than half a sample, or not shorter than the record. If no window is complete.

    Examples
    --------
    >>> coasting_error([1.0] * 5, [1.5] * 5, rate=1.0, horizon=2.0)
    1.0
    """
    z, x = columns("raw", raw), columns("estimate", estimate)
    check_same_shape("raw", z, "estimate", x)
    hertz = rate_of(rate, raw, estimate)
    m = whole_samples(check_positive("horizon", horizon), hertz)
    if not 1 <= m < z.shape[1]:
        raise ValueError(
            f"a horizon of {horizon} s is {m} samples: it must be at least 1 and less than the "
            f"record's {z.shape[1]}"
        )
    return per_channel([_coasting_rms(z[i], x[i], m) / hertz for i in range(len(z))], raw)


def _coasting_rms(z: Floats, x: Floats, m: int) -> float:
    """Return the RMS over t of sum(z[t+1..t+m]) - m x[t], through one cumulative sum."""
    sums = np.array(z)
    missing = ~np.isfinite(sums)
    gaps = np.cumsum(missing) if missing.any() else None
    sums[missing] = 0.0
    # The level is subtracted first: sums then stay small and exact.
    level = float(sums.mean())
    sums -= level
    sums[missing] = 0.0
    np.cumsum(sums, out=sums)
    square, count = 0.0, 0
    for start in range(0, z.size - m, _BLOCK_SAMPLES):
        now = slice(start, min(start + _BLOCK_SAMPLES, z.size - m))
        then = slice(now.start + m, now.stop + m)
        angle = sums[then] - sums[now] - m * (x[now] - level)
        usable = np.isfinite(angle)
        if gaps is not None:
            usable &= gaps[then] == gaps[now]
        angle = angle[usable]
        square, count = square + float(np.dot(angle, angle)), count + angle.size
    if count == 0:
        raise ValueError("no window of the horizon's length is free of missing samples")
    return math.sqrt(square / count)


@dataclass(frozen=True, eq=False)
class AllanRatio:
    """Ratio of the Allan deviations after and before a filter.

    Attributes
    ----------
    taus : ndarray, shape (m,)
        Averaging times, one per octave, s.
    ratio : ndarray, shape (m,) or (m, k)
        Ratio; NaN where a deviation is undefined.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.metrics import allan_ratio
    >>> z = np.random.default_rng(1).standard_normal(4000)
    >>> found = allan_ratio(z, 0.5 * z, rate=100.0, time_constant=0.04)
    >>> found.taus.tolist(), found.ratio.tolist()
    ([0.64, 1.28, 2.56, 5.12], [0.5, 0.5, 0.5, 0.5])
    """

    taus: Floats
    ratio: Floats


def allan_ratio(
    raw: npt.ArrayLike, filtered: npt.ArrayLike, rate: float | None, time_constant: float
) -> AllanRatio:
    """Return the ratio of the Allan deviations after and before a filter, at long times.

    Averaging times start at ten time constants of the filter. Below this limit, the deviation
    describes the filter instead of the sensor. Above it, an estimate of gain 1 has a ratio near 1,
    because a filter cannot reduce the angle random walk of a single gyro. A one-pole low-pass
    filter has a ratio of 0.92 at ten of its time constants, and of 0.99 at a hundred. The
    compensated rate, raw minus bias, has a lower ratio than the estimate, because its drift is
    removed.

    Parameters
    ----------
    raw, filtered : array_like, shape (n,) or (n, k)
        Output of the gyro at rest, and an estimate or the compensated rate, in the same unit.
    rate : float or None
        Sampling rate, Hz. None: the rate of a `Log`.
    time_constant : float
        Time in which the filter follows 63 % of a step, s; 0 if it has no delay.

    Returns
    -------
    AllanRatio
        Ratio at averaging times up to a quarter of the record, from the samples present in both.

    Raises
    ------
    ValueError
        If the shapes differ. If `rate` is not positive and finite. If `time_constant` is negative
        or NaN. If ten time constants exceed a quarter of the record.

    Examples
    --------
    >>> z = np.random.default_rng(1).standard_normal(4000)
    >>> allan_ratio(z, 0.5 * z, rate=100.0, time_constant=0.5).ratio.tolist()
    [0.5]
    """
    z, y = columns("raw", raw), columns("filtered", filtered)
    check_same_shape("raw", z, "filtered", y)
    hertz = rate_of(rate, raw, filtered)
    factors = _octave_factors(z.shape[1], hertz, time_constant)
    there = np.isfinite(z) & np.isfinite(y)
    before, after = (_deviations(np.where(there, x, np.nan), factors) for x in (z, y))
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = after / before
    return AllanRatio(np.array(factors) / hertz, ratio[:, 0] if is_single(raw) else ratio)


def _octave_factors(n: int, rate: float, time_constant: float) -> list[int]:
    if not time_constant >= 0.0:
        raise ArgumentError("time_constant", f"must not be negative, got {time_constant}")
    octaves = (1 << i for i in range(max(1, (n // 4).bit_length())))
    max_factor = min(n // 4, longest_factor("oadev", n))
    factors = [m for m in octaves if 10.0 * time_constant * rate <= m <= max_factor]
    if not factors:
        raise ValueError(
            f"ten time constants of {time_constant:g} s must not exceed a quarter of the record's "
            f"{n / rate:g} s"
        )
    return factors


def _deviations(rows: Floats, factors: list[int]) -> Floats:
    return allan_deviations(rows.T, factors)[0]
