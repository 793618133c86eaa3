"""Restoration of rates that a gyro clipped at its range, from the flanks of each peak."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate._native import restore_clipped_rates
from zerorate.faults import ArgumentError
from zerorate.numerals import shorten
from zerorate.record import Recording
from zerorate.record.named import convert_to_unit, rate_of
from zerorate.types import Booleans, Floats
from zerorate.units import convert, kind

_RANGE_SHARE: Final = 0.965
"""Share of the largest rate above which a sample is at the range, as in the core."""


@dataclass(frozen=True)
class ClippedAxis:
    """Axis and sign with rates beyond the gyro's range.

    Parameters
    ----------
    axis : str
        "x", "y" or "z".
    sign : int
        1 or -1.
    limit : float
        Range observed in the recording, rad/s.
    sample_count : int
        Number of restored samples.
    share : float
        Restored samples as a share of all samples.
    certain : bool
        True if at least half of the samples at the range have exactly the same value. Only a
        limited range explains this. False after a calibration that mixes axes, even if an axis was
        clipped.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> seen = np.zeros((2000, 3))
    >>> seen[:, 1] = np.minimum(12.0 * np.sin(np.arange(2000) / 32.0), 9.0)
    >>> (axis,) = zr.restore_clipped(seen, 200.0).clipped
    >>> axis.axis, axis.sign, axis.limit, axis.certain
    ('y', 1, 9.0, True)
    """

    axis: str
    sign: int
    limit: float
    sample_count: int
    share: float
    certain: bool = False

    def __str__(self) -> str:
        """Return a sentence without a full stop."""
        limit = math.degrees(self.sign * self.limit)
        return (
            f"gyro {self.axis} is clipped at {limit:.0f} deg/s in "
            f"{shorten(100.0 * self.share)} % of "
            "the samples: restored from the flanks, with a larger standard deviation"
        )


@dataclass(frozen=True, eq=False)
class RestoredGyro:
    """Rates of a gyro with restored peaks.

    Parameters
    ----------
    gyro : ndarray, shape (n, 3)
        Rates, rad/s, NaN where missing.
    restored : ndarray of bool, shape (n,)
        Mask of changed samples.
    variance : ndarray, shape (n,)
        Error of a restored rate, as the density of a white noise, rad^2/s; 0 for unchanged rates.
    clipped : tuple of ClippedAxis
        Clipped axes and signs; empty if the gyro was never clipped.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> swing = 12.0 * np.sin(2.0 * np.pi * np.arange(2000) / 200.0)
    >>> seen = np.stack([0.0 * swing, np.minimum(swing, 9.0), 0.0 * swing], axis=1)
    >>> found = zr.restore_clipped(seen, 200.0)
    >>> bool(found.gyro[:, 1].max() > 11.0), bool((found.gyro == seen)[~found.restored].all())
    (True, True)
    """

    gyro: Floats
    restored: Booleans
    variance: Floats
    clipped: tuple[ClippedAxis, ...]


def restore_clipped(gyro: npt.ArrayLike, rate: float | None = None) -> RestoredGyro:
    """Restore rates that a gyro clipped at its range, from the flanks of each peak.

    The range need not be known. The positive or negative side of an axis counts as clipped if all
    three conditions are met:

    - The rate is within 4 % of its largest value for a total of a tenth of a second.
    - The band from 88 % to 96 % of this value has at most twice as many samples.
    - Cubics through the flanks exceed the plateaus by 1.5 % of the largest value on average.

    Round peaks and true plateaus agree with their flanks, and stay unchanged. A gyro that stays
    below 100 deg/s also stays unchanged.

    Parameters
    ----------
    gyro : array_like, shape (n, 3)
        Rates, rad/s. A row that is not finite counts as missing and stays missing.
    rate : float
        Sampling rate, Hz. Default: the rate of a `Log`.

    Returns
    -------
    RestoredGyro
        Rates, the mask of restored rates, and their variance.

    Raises
    ------
    ValueError
        If the shape is not (n, 3), or the rate is not a positive number.

    Notes
    -----
    A restored rate is at most twice the range. If a gyro is clipped for more than about a tenth of
    a second, no cubic predicts the peak. `variance` is then large. A rate that is constant for half
    a second comes from a rate table or a wheel, and stays unchanged.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> swing = 12.0 * np.sin(2.0 * np.pi * np.arange(2000) / 200.0)  # rad/s at 200 Hz
    >>> seen = np.zeros((2000, 3))
    >>> seen[:, 1] = np.minimum(swing, 9.0)  # a range of 516 deg/s
    >>> found = zr.restore_clipped(seen, 200.0)
    >>> print(found.clipped[0])  # doctest: +ELLIPSIS
    gyro y is clipped at 516 deg/s in 24 % of the samples: restored from the flanks, ...
    >>> before, after = (np.abs(g[:, 1] - swing).max() for g in (seen, found.gyro))
    >>> bool(before > 2.9), bool(after < 0.6)
    (True, True)
    """
    rates, hertz = convert_to_unit(gyro, "rad/s", "gyro"), rate_of(rate, gyro)
    if rates.ndim != 2 or rates.shape[1] != 3:
        raise ArgumentError("gyro", f"must have shape (n, 3), got {rates.shape}")
    known = np.isfinite(rates).all(axis=1)
    if not known.any():
        return RestoredGyro(rates.copy(), np.zeros(len(rates), bool), np.zeros(len(rates)), ())
    # A missing rate is replaced by the last known rate; at the start, by the first known rate.
    last = np.maximum.accumulate(np.where(known, np.arange(len(rates)), np.argmax(known)))
    values, sides, variance = restore_clipped_rates(rates[last], 1.0 / hertz)
    values[~known] = rates[~known]
    restored = (variance > 0.0) & known
    return RestoredGyro(values, restored, variance, clipped_axes(sides, rates))


def restore_recording(
    imu: Recording, *, gyro: str = "gyro", certain: bool = True
) -> tuple[Recording, tuple[ClippedAxis, ...]]:
    """Return a recording with restored clipped rates, and the clipped axes.

    Parameters
    ----------
    imu : Recording
        Recording with a gyro of three axes in a unit of rates. Other recordings are returned
        unchanged.
    gyro : str
        Name of the gyro's log.
    certain : bool, default True
        Restore only if `ClippedAxis.certain` is True for all clipped axes.

    Returns
    -------
    tuple
        The recording, and a tuple with one `ClippedAxis` for each clipped axis and sign. The
        recording is unchanged if nothing was restored.

    Examples
    --------
    >>> import zerorate as zr
    >>> walk = zr.simulate_walk(strides=20, seed=5, gyro_range=6.5)
    >>> restored, clipped = zr.checks.restore_recording(walk.recording())
    >>> len(clipped), all(axis.certain for axis in clipped)
    (2, True)
    >>> bool(restored.gyro.data[:, 1].max() > 7.0)
    True
    """
    log = imu.logs.get(gyro)
    if log is None or log.channels != 3 or not _is_rate(log.unit):
        return imu, ()
    result = restore_clipped(convert(log.data, log.unit, "rad/s"), log.rate)
    if not result.clipped or (certain and not all(axis.certain for axis in result.clipped)):
        return imu, result.clipped
    data = np.where(
        result.restored[:, np.newaxis], convert(result.gyro, "rad/s", log.unit), log.data
    )
    notes = (*log.meta.get("notes", ()), *map(str, result.clipped))
    corrected = replace(log, data=data, meta={**log.meta, "notes": notes})
    return replace(imu, logs={**imu.logs, gyro: corrected}), result.clipped


def _is_rate(unit: str | None) -> bool:
    try:
        return unit is not None and kind(unit) == "rate"
    except ValueError:
        return False


def clipped_axes(
    sides: Iterable[tuple[int, float, float, int]], gyro: Floats
) -> tuple[ClippedAxis, ...]:
    """Return the clipped axes, detected by the core in uncorrected rates."""
    axes = []
    for axis, sign, limit, count in sides:
        rate = sign * gyro[:, axis]
        at_range = rate[rate > _RANGE_SHARE * limit]
        certain = bool(2 * np.count_nonzero(at_range == limit) >= at_range.size > 0)
        share = count / max(len(gyro), 1)
        axes.append(ClippedAxis("xyz"[axis], int(sign), limit, count, share, certain))
    return tuple(axes)
