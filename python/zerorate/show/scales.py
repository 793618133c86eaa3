"""Limits and scales of panels, and long series cut down to what a panel can show."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Panels = np.ndarray[Any, np.dtype[np.object_]]

MAX_BUCKETS: Final = 200
"""Parts of a series that a panel shows: about as many as it has room for."""

MAX_COLUMNS: Final = 400
"""Parts of a series across a panel a page's column wide: two pixels of its PNG each."""

_TAIL_SHARE: Final = 0.005
_MAX_QUANTILE_SAMPLES: Final = 96
"""Samples of a part of which quantiles are taken, evenly spread over it."""

_BAND_QUANTILES: Final = (0.05, 0.95)


def split_into_parts(n: int, count: int) -> npt.NDArray[np.intp]:
    """Return the first sample of so many equal parts of n samples, of fewer if n is smaller."""
    return np.unique(np.linspace(0, n, min(count, n), endpoint=False).astype(np.intp))


def bucket_extremes(z: Floats, rate: float) -> tuple[Floats, Floats, Floats]:
    """Return time (s), least and greatest value of at most `MAX_BUCKETS` buckets of a series (n,).

    A bucket without a present sample is NaN.
    """
    starts = split_into_parts(z.size, MAX_BUCKETS)
    centre = (starts + np.append(starts[1:], z.size) - 1) / (2.0 * rate)
    values = np.where(np.isfinite(z), z, np.nan)
    return centre, np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)


def trace_outline(z: Floats, rate: float) -> tuple[Floats, Floats]:
    """Return time (s) and values of a line that covers a series (n,), peaks included."""
    if z.size <= 2 * MAX_BUCKETS:
        return np.arange(z.size) / rate, np.where(np.isfinite(z), z, np.nan)
    centre, least, most = bucket_extremes(z, rate)
    return np.repeat(centre, 2), np.column_stack((least, most)).ravel()


class Band(NamedTuple):
    """A series (n,) with its scatter as a band, where overlapping lines would hide it.

    Attributes
    ----------
    middle : ndarray, shape (m,)
        Index of the middle of each part, whole or half.
    low, median, high : ndarray, shape (m,)
        Quantiles 5 %, 50 % and 95 % of each part; NaN where nothing is there.
    """

    middle: Floats
    low: Floats
    median: Floats
    high: Floats


def column_quantiles(z: Floats, columns: int = MAX_COLUMNS) -> Band:
    """Return the quantiles of each pixel's column of a series (n,); it is itself where short."""
    starts = split_into_parts(z.size, columns)
    lengths = np.append(starts[1:], z.size) - starts
    count = min(_MAX_QUANTILE_SAMPLES, int(lengths.max(initial=1)))
    samples = z[starts[:, np.newaxis] + lengths[:, np.newaxis] * np.arange(count) // count]
    # What is missing is last of its row, and not counted.
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
    """Return limits that hold all but the outermost half per cent of the values, and a margin.

    Margins are in spans of the values. The limits are finite and apart whatever the values.
    """
    finite = z[np.isfinite(z)]
    low, high = np.quantile(finite, (_TAIL_SHARE, 1.0 - _TAIL_SHARE)) if finite.size else (0.0, 1.0)
    span = high - low
    if not span > 1e-9 * max(abs(low), abs(high)):
        span = 0.1 * abs(high) or 1.0
        low, high = low - span / 2, high + span / 2
    return float(low - below * span), float(high + above * span)


def share_limits(row: Iterable["Axes"]) -> None:
    """Give panels the limits that hold those of each in which something is drawn."""
    panels = list(row)
    shown = [axes.get_ylim() for axes in panels if _is_drawn(axes)]
    if shown:
        lows, highs = zip(*shown, strict=True)
        for axes in panels:
            axes.set_ylim(min(lows), max(highs))


def share_heights(row: Panels) -> None:
    """Give panels the same limits, from their lines without initial jumps."""
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
    """Give logarithmic panels the same limits, with room for a legend below the lines."""
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
