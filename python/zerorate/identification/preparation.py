"""Preparation of a record for identification, with a list of the changes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.identification.window_filters import (
    CleanedRecord,
    far_from_average,
    hampel,
    moving_average,
)
from zerorate.identification.window_filters import decimate as _decimated
from zerorate.noise.records import as_record, check_width, mark_gaps
from zerorate.record import Log
from zerorate.record.named import rate_of
from zerorate.types import Floats

Trend = Literal["mean", "linear"]

_MIN_SAMPLES: Final[dict[str, int]] = {"mean": 1, "linear": 2}


def detrend(z: npt.ArrayLike, kind: Trend = "mean") -> Floats:
    """Return a record minus its mean, or minus its best straight line.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; values that are not finite count as missing, and stay missing.
    kind : {"mean", "linear"}
        Trend to subtract: the mean, or the least-squares line of the present samples.

    Returns
    -------
    ndarray of float64, shape (n,)
        Record in the unit of `z`.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, has too few samples, or the kind is unknown.

    Examples
    --------
    >>> detrend([1.0, 3.0, float("nan"), 7.0], "linear").tolist()
    [0.0, 0.0, nan, 0.0]
    """
    if kind not in _MIN_SAMPLES:
        raise ArgumentError("kind", f"must be one of {_trend_names()}, got {kind!r}")
    record = mark_gaps(as_record(z))
    present = np.isfinite(record)
    if np.count_nonzero(present) < _MIN_SAMPLES[kind]:
        raise ValueError(f"a {kind} trend needs at least {_MIN_SAMPLES[kind]} samples, got 1")
    # First subtract one of the samples, so that an offset does not reduce the precision.
    level = record - record[int(np.argmax(present))]
    level -= level[present].mean()
    if kind == "linear":
        time = np.arange(record.size) - np.flatnonzero(present).mean()
        level -= time * (time[present] @ level[present] / (time[present] @ time[present]))
    return np.asarray(level)


def segments(z: npt.ArrayLike, count: int) -> Floats:
    """Return a record cut into segments of equal length.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; values that are not finite count as missing.
    count : int
        Number of segments, 1 to n.

    Returns
    -------
    ndarray of float64, shape (count, n // count)
        One row per segment, NaN where missing. The remaining samples at the end, fewer than
        `count`, are left out.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis with a sample, or the count is not a whole number from 1 to n.

    Examples
    --------
    >>> segments([1, 2, 3, 4, 5], 2).tolist()
    [[1.0, 2.0], [3.0, 4.0]]
    """
    record = mark_gaps(as_record(z))
    if check_width(count, "segments") > record.size:
        raise ArgumentError(
            "segments", f"must be at most the number of samples, {record.size}, got {count}"
        )
    length = record.size // count
    return record[: count * length].reshape(count, length)


def _trend_names() -> str:
    return ", ".join(repr(name) for name in get_args(Trend))


Outliers = Literal["hampel", "moving-average"]


@dataclass(frozen=True)
class Change:
    """Change of a record: a sentence, and the number of changed samples.

    Examples
    --------
    >>> from zerorate.identification import prepare
    >>> prepare([0.0, 2.0, float("nan")]).changes
    (Change(what='the mean was taken off', count=2),)
    """

    what: str
    count: int


@dataclass(frozen=True, eq=False)
class PreparedRecord:
    """Record ready for identification.

    Attributes
    ----------
    data : ndarray of float64, shape (m,)
        Data in the unit of the record, NaN where missing.
    rate : float or None
        Sampling rate of `data`, Hz; None if the record's rate is unknown.
    changes : tuple of Change
        Changes in the order of the steps.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.identification import prepare
    >>> found = prepare(5.0 + np.random.default_rng(1).standard_normal(1000), rate=100.0)
    >>> found.data.shape, found.rate, [change.what for change in found.changes]
    ((1000,), 100.0, ['the mean was taken off'])
    """

    data: Floats
    rate: float | None
    changes: tuple[Change, ...]


def prepare(
    z: npt.ArrayLike,
    rate: float | None = None,
    *,
    smooth: int = 1,
    outliers: Outliers | None = None,
    window: int = 11,
    threshold: float = 4.0,
    trend: Trend | None = "mean",
    decimate: int = 1,
) -> PreparedRecord:
    """Return a record without outliers, smoothed, decimated and detrended, in this order.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples in any unit; values that are not finite count as missing.
    rate : float, optional
        Sampling rate, Hz. Default: the rate of a `Log`.
    smooth : int, default 1
        Width of a moving average in samples. Default 1, no smoothing. A moving average makes the
        noise correlated (see `moving_average`).
    outliers : {"hampel", "moving-average"}, optional
        Replace outliers by the median of a window (`hampel`) or by its mean (`far_from_average`).
        Default: keep outliers.
    window : int, default 11
        Length of the window for `outliers`, in samples.
    threshold : float, default 4.0
        Distance in standard deviations above which a sample is an outlier.
    trend : {"mean", "linear"} or None, default "mean"
        Trend to subtract.
    decimate : int, default 1
        Decimation factor: one of this number of samples is kept. Default 1, all samples.

    Returns
    -------
    PreparedRecord
        Record, its sampling rate, and the changes.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis with a sample, or an argument is not as described.

    Notes
    -----
    Bao and Yuan smooth by a moving average and subtract the mean before they fit an AR(1) model.

    Examples
    --------
    >>> z = np.random.default_rng(1).standard_normal(1000)
    >>> z[[10, 500]] = 40.0
    >>> prepared = prepare(z, rate=100.0, outliers="hampel", window=101, threshold=6.0)
    >>> [change.what for change in prepared.changes]
    ['2 outliers replaced by the median of 101 samples', 'the mean was taken off']
    """
    hertz = rate_of(rate, z) if rate is not None or isinstance(z, Log) else None
    data, changes = mark_gaps(as_record(z)), []
    if outliers is not None:
        data, outlier_mask = _clean_outliers(data, outliers, window, threshold)
        changes.append(_describe_outliers(int(outlier_mask.sum()), outliers, window))
    if check_width(smooth, "smooth") > 1:
        data = moving_average(data, smooth)
        changes.append(_describe_smoothing(smooth, _count_present(data)))
    if check_width(decimate, "decimate") > 1:
        before, data = data.size, _decimated(data, decimate)
        changes.append(_describe_decimation(decimate, before - data.size))
    if trend is not None:
        data = detrend(data, trend)
        what = {"mean": "the mean was taken off", "linear": "a straight line was taken off"}[trend]
        changes.append(Change(what, _count_present(data)))
    return PreparedRecord(data, hertz and hertz / decimate, tuple(changes))


def _clean_outliers(data: Floats, outliers: str, window: int, threshold: float) -> CleanedRecord:
    if outliers not in get_args(Outliers):
        names = ", ".join(repr(name) for name in get_args(Outliers))
        raise ArgumentError("outliers", f"must be one of {names} or None, got {outliers!r}")
    clean = hampel if outliers == "hampel" else far_from_average
    return clean(data, window, threshold)


def _describe_outliers(count: int, outliers: str, window: int) -> Change:
    by = "median" if outliers == "hampel" else "mean"
    noun = "outlier" if count == 1 else "outliers"
    return Change(f"{count} {noun} replaced by the {by} of {window} samples", count)


def _describe_smoothing(width: int, count: int) -> Change:
    return Change(
        f"smoothed by a moving average of {width} samples, which alone gives white noise a "
        f"correlation of {(width - 1) / width:.3g} at lag 1",
        count,
    )


def _describe_decimation(factor: int, count: int) -> Change:
    return Change(f"one sample of {factor} kept after a low-pass against aliasing", count)


def _count_present(data: Floats) -> int:
    return int(np.count_nonzero(np.isfinite(data)))
