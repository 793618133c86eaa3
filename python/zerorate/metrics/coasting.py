"""What a wrong bias costs."""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.metrics.series import answer, columns, positive, same_shape

Floats = npt.NDArray[np.float64]

_BLOCK: Final = 8192


def coasting_error(
    raw: npt.ArrayLike, estimate: npt.ArrayLike, rate: float, horizon: float
) -> float | Floats:
    """Return the angle error of holding each estimate through the next `horizon` seconds.

    The estimate of time t is held, raw minus it integrated over the samples after t up to
    t + horizon, and the RMS of that angle taken over all t. It is what a wrong bias costs a user,
    and needs no truth, but a sensor at rest: turning counts as error. White noise of density N
    alone leaves N sqrt(horizon), so for short horizons every filter looks alike.

    Parameters
    ----------
    raw, estimate : array_like, shape (n,) or (n, k)
        Gyro output at rest and the estimate of its bias or drift, in any one unit.
    rate : float
        Samples per second, Hz.
    horizon : float
        Seconds to coast, rounded to whole samples.

    Returns
    -------
    float or ndarray, shape (k,)
        In the unit of the data times seconds. Times whose window holds a missing raw sample, or
        whose estimate is missing, are left out.

    Raises
    ------
    ValueError
        If the shapes differ, `rate` or `horizon` is not positive and finite, the horizon is less
        than half a sample or not shorter than the record, or no window is complete.

    Examples
    --------
    >>> coasting_error([1.0] * 5, [1.5] * 5, rate=1.0, horizon=2.0)
    1.0
    """
    z, x = columns("raw", raw), columns("estimate", estimate)
    same_shape("raw", z, "estimate", x)
    m = round(positive("horizon", horizon) * positive("rate", rate))
    if not 1 <= m < z.shape[1]:
        raise ValueError(
            f"a horizon of {horizon} s is {m} samples: it must be at least 1 and less than the "
            f"record's {z.shape[1]}"
        )
    return answer([_coast(z[i], x[i], m) / rate for i in range(len(z))], raw)


def _coast(z: Floats, x: Floats, m: int) -> float:
    """Return the RMS over t of sum(z[t+1..t+m]) - m x[t], through one cumulative sum."""
    sums = np.array(z)
    missing = ~np.isfinite(sums)
    gaps = np.cumsum(missing) if missing.any() else None
    sums[missing] = 0.0
    # Sums stay small, and so exact, when the level is taken out first.
    level = float(sums.mean())
    sums -= level
    sums[missing] = 0.0
    np.cumsum(sums, out=sums)
    square, count = 0.0, 0
    for start in range(0, z.size - m, _BLOCK):
        now = slice(start, min(start + _BLOCK, z.size - m))
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
