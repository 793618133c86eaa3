"""What a filter makes of slow noise."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from zerorate._native import allan_deviations, longest_factor
from zerorate.metrics.series import columns, positive, same_shape

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class AllanRatio:
    """Allan deviations after a filter over those before it.

    Attributes
    ----------
    taus : ndarray, shape (m,)
        Averaging times an octave apart, s.
    ratio : ndarray, shape (m,) or (m, k)
        NaN where a deviation means nothing.
    """

    taus: Floats
    ratio: Floats


def allan_ratio(
    raw: npt.ArrayLike, filtered: npt.ArrayLike, rate: float, memory: float
) -> AllanRatio:
    """Return Allan deviations after over before at ten times the filter's memory and beyond.

    At shorter averaging times a filter's output is a smoothed one, and its noise coefficients are
    those of the filter. Beyond, an estimate of gain 1 keeps a ratio near 1, a one-pole low-pass
    filter 0.92 at ten times its memory and 0.99 at a hundred times: one gyro's angle random walk
    does not fall, and a claim that it did is an error. The compensated rate, raw minus bias,
    falls there as far as drift was removed.

    Parameters
    ----------
    raw, filtered : array_like, shape (n,) or (n, k)
        Gyro output at rest, and an estimate or the compensated rate, in any one unit.
    rate : float
        Samples per second, Hz.
    memory : float
        Time in which the filter makes 63 % of a step, s; 0 for none.

    Returns
    -------
    AllanRatio
        Averaging times up to a quarter of the record. Samples missing in either series are left
        out of both.

    Raises
    ------
    ValueError
        If the shapes differ, `rate` is not positive and finite, `memory` negative or NaN, or ten
        times the memory exceed a quarter of the record.

    Examples
    --------
    >>> z = np.random.default_rng(1).standard_normal(4000)
    >>> allan_ratio(z, 0.5 * z, rate=100.0, memory=0.5).ratio.tolist()
    [0.5]
    """
    z, y = columns("raw", raw), columns("filtered", filtered)
    same_shape("raw", z, "filtered", y)
    factors = _factors(z.shape[1], positive("rate", rate), memory)
    there = np.isfinite(z) & np.isfinite(y)
    before, after = (_deviations(np.where(there, x, np.nan), factors) for x in (z, y))
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = after / before
    return AllanRatio(np.array(factors) / rate, ratio[:, 0] if np.ndim(raw) == 1 else ratio)


def _factors(n: int, rate: float, memory: float) -> list[int]:
    if not memory >= 0.0:
        raise ValueError(f"memory must not be negative, got {memory}")
    octaves = (1 << i for i in range(max(1, (n // 4).bit_length())))
    most = min(n // 4, longest_factor("oadev", n))
    factors = [m for m in octaves if 10.0 * memory * rate <= m <= most]
    if not factors:
        raise ValueError(
            f"ten times a memory of {memory:g} s must not exceed a quarter of the record's "
            f"{n / rate:g} s"
        )
    return factors


def _deviations(rows: Floats, factors: list[int]) -> Floats:
    return allan_deviations(rows.T, factors)[0]
