"""Long series cut down to what a panel can show, without hiding a peak."""

from typing import Final

import numpy as np
import numpy.typing as npt

__all__ = ["BUCKETS", "limits", "outline", "spans"]

Floats = npt.NDArray[np.float64]

BUCKETS: Final = 200
_TAIL: Final = 0.005


def spans(z: Floats, rate: float) -> tuple[Floats, Floats, Floats]:
    """Return time (s), least and greatest value of at most `BUCKETS` buckets of a series (n,).

    A bucket without a present sample is NaN.
    """
    starts = np.unique(np.linspace(0, z.size, min(BUCKETS, z.size), endpoint=False).astype(int))
    centre = (starts + np.append(starts[1:], z.size) - 1) / (2.0 * rate)
    values = np.where(np.isfinite(z), z, np.nan)
    return centre, np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)


def outline(z: Floats, rate: float) -> tuple[Floats, Floats]:
    """Return time (s) and values of a line that covers a series (n,), peaks included."""
    if z.size <= 2 * BUCKETS:
        return np.arange(z.size) / rate, np.where(np.isfinite(z), z, np.nan)
    centre, least, most = spans(z, rate)
    return np.repeat(centre, 2), np.column_stack((least, most)).ravel()


def limits(z: Floats, below: float = 0.1, above: float = 0.1) -> tuple[float, float]:
    """Return limits that hold all but the outermost half per cent of the values, and a margin.

    Margins are in spans of the values. The limits are finite and apart whatever the values.
    """
    there = z[np.isfinite(z)]
    low, high = np.quantile(there, (_TAIL, 1.0 - _TAIL)) if there.size else (0.0, 1.0)
    span = high - low
    if not span > 1e-9 * max(abs(low), abs(high)):
        span = 0.1 * abs(high) or 1.0
        low, high = low - span / 2, high + span / 2
    return float(low - below * span), float(high + above * span)
