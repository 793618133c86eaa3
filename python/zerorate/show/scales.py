"""Limits and scales of panels, and reduction of long series to the visible detail."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Panels = np.ndarray[Any, np.dtype[np.object_]]

MAX_BUCKETS: Final = 200
"""Largest number of buckets of a series in a panel."""

MAX_COLUMNS: Final = 400
"""Largest number of columns in a panel of a page column; each is two pixels of the PNG."""

_TAIL_SHARE: Final = 0.005
_MAX_QUANTILE_SAMPLES: Final = 96
"""Largest number of samples per column for quantiles, evenly spread over the column."""

_BAND_QUANTILES: Final = (0.05, 0.95)


def split_into_parts(n: int, count: int) -> npt.NDArray[np.intp]:
    """Return the first sample of each of `count` equal parts of n samples, fewer if n is small."""
    return np.unique(np.linspace(0, n, min(count, n), endpoint=False).astype(np.intp))


def bucket_extremes(z: Floats, rate: float) -> tuple[Floats, Floats, Floats]:
    """Return times, s, minima and maxima of at most `MAX_BUCKETS` buckets of a series (n,).

    A bucket without a sample is NaN.
    """
    starts = split_into_parts(z.size, MAX_BUCKETS)
    centre = (starts + np.append(starts[1:], z.size) - 1) / (2.0 * rate)
    values = np.where(np.isfinite(z), z, np.nan)
    return centre, np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)


def trace_outline(z: Floats, rate: float) -> tuple[Floats, Floats]:
    """Return times, s, and values of a line that covers a series (n,), including its peaks."""
    if z.size <= 2 * MAX_BUCKETS:
        return np.arange(z.size) / rate, np.where(np.isfinite(z), z, np.nan)
    centre, least, most = bucket_extremes(z, rate)
    return np.repeat(centre, 2), np.column_stack((least, most)).ravel()


class Band(NamedTuple):
    """A series (n,) and its scatter as a band, where overlapping lines would hide it.

    Attributes
    ----------
    middle : ndarray, shape (m,)
        Index of the middle of each part; it may be a half number.
    low, median, high : ndarray, shape (m,)
        Quantiles 5 %, 50 % and 95 % of each part. NaN for a part without samples.
    """

    middle: Floats
    low: Floats
    median: Floats
    high: Floats


def column_quantiles(z: Floats, columns: int = MAX_COLUMNS) -> Band:
    """Return the quantiles of each pixel column of a series (n,); short series are unchanged."""
    starts = split_into_parts(z.size, columns)
    lengths = np.append(starts[1:], z.size) - starts
    count = min(_MAX_QUANTILE_SAMPLES, int(lengths.max(initial=1)))
    samples = z[starts[:, np.newaxis] + lengths[:, np.newaxis] * np.arange(count) // count]
    # Sorting puts missing samples last, where they are not counted.
    finite = np.isfinite(samples)
    ordered = np.sort(np.where(finite, samples, np.nan), axis=1)
    last = np.maximum(finite.sum(axis=1) - 1, 0)
    rows = np.arange(starts.size)
    ranks = (
        np.rint(part * last).astype(np.intp)
        for part in (_BAND_QUANTILES[0], 0.5, _BAND_QUANTILES[1])
    )
    return Band(starts + 0.5 * (lengths - 1), *(ordered[rows, rank] for rank in ranks))


def robust_limits(z: Floats, below: float = 0.1, above: float = 0.1) -> tuple[float, float]:
    """Return limits that include all but the outermost half percent of the values, and margins.

    The margins are relative to the range of the values. The limits are always finite and different.
    """
    finite = z[np.isfinite(z)]
    low, high = np.quantile(finite, (_TAIL_SHARE, 1.0 - _TAIL_SHARE)) if finite.size else (0.0, 1.0)
    span = high - low
    if not span > 1e-9 * max(abs(low), abs(high)):
        span = 0.1 * abs(high) or 1.0
        low, high = low - span / 2, high + span / 2
    return float(low - below * span), float(high + above * span)


def share_limits(row: Iterable["Axes"]) -> None:
    """Give panels common limits, from all panels with drawn curves."""
    panels = list(row)
    shown = [axes.get_ylim() for axes in panels if _is_drawn(axes)]
    if shown:
        lows, highs = zip(*shown, strict=True)
        for axes in panels:
            axes.set_ylim(min(lows), max(highs))


def share_heights(row: Panels) -> None:
    """Give panels common limits, from their lines without initial jumps."""
    start = 2.0 * row[0].get_xlim()[0]
    shown = [
        np.where(line.get_xdata() > start, line.get_ydata(), np.nan)
        for axes in row
        for line in axes.lines
        if not line.get_label().startswith("_")
    ]
    low, high = robust_limits(np.concatenate(shown), 0.1, 0.35)
    for axes in row:
        axes.set_ylim(low, high)
    for axes in row[1:]:
        axes.tick_params(labelleft=False)


def share_decades(row: Panels) -> None:
    """Give logarithmic panels common limits, with room for a legend below the lines."""
    shown = np.concatenate([line.get_ydata() for axes in row for line in axes.lines])
    shown = shown[np.isfinite(shown)]
    least, most = (shown.min(), shown.max()) if shown.size else (1.0, 1.0)
    margin = max(most / least, 10.0) ** 0.15
    for axes in row:
        axes.set_ylim(least / margin**1.5, most * margin)
    for axes in row[1:]:
        axes.tick_params(labelleft=False)


def _is_drawn(axes: "Axes") -> bool:
    return any(np.isfinite(np.asarray(line.get_ydata())).any() for line in axes.lines)
