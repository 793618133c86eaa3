"""Outliers: samples far from all others around them, while the sensor is still."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.types import Floats, Integers

_NEIGHBOURS: Final = 5
"""Samples on either side that one is compared with."""

_MIN_OUTLIER_SPREADS: Final = 20.0
"""Spreads of those by which it is off: noise comes to three, a knock lasts for several samples."""

_MAX_STILL_SPREADS: Final = 4.0
"""Spreads of noise up to which those are still: what is odd in a turn may be the turn."""

_QUIET_PERCENTILE: Final = 20
"""Percentile of the bends of a record: most of one is in motion, and noise bends it least."""

_QUIET_BEND_SIGMAS: Final = 0.31
"""That percentile of the bends of white noise, in standard deviations of it."""

_NOISE_RANGE_SIGMAS: Final = 2.0
"""Range of all but the ends of ten samples of noise, in its standard deviations."""


def find_outliers(data: Floats, step: Floats) -> Integers:
    """Return the samples of which an axis is far from those before and after it, in a rest.

    Parameters
    ----------
    data : ndarray of float64, shape (n, k)
        NaN where missing; none of these, nor their neighbours, is an outlier.
    step : ndarray of float64, shape (k,)
        Between neighbouring values of each axis.
    """
    outliers = [
        _find_axis_outliers(axis, float(least)) for axis, least in zip(data.T, step, strict=True)
    ]
    return np.unique(np.concatenate(outliers))


def _find_axis_outliers(axis: Floats, step: float) -> Integers:
    width = 2 * _NEIGHBOURS + 1
    if axis.size < width:
        return np.zeros(0, dtype=np.intp)
    bends = np.abs(axis[1:-1] - 0.5 * (axis[:-2] + axis[2:]))
    finite = bends[np.isfinite(bends)]
    if not finite.size:
        return np.zeros(0, dtype=np.intp)
    noise = max(
        _NOISE_RANGE_SIGMAS / _QUIET_BEND_SIGMAS * float(np.percentile(finite, _QUIET_PERCENTILE)),
        step,
    )
    # Even next to another outlier it bends the curve by half of its error.
    candidates = 1 + np.flatnonzero(bends > 0.4 * _MIN_OUTLIER_SPREADS * noise)
    candidates = np.concatenate(([0], candidates, [axis.size - 1]))
    first = np.clip(candidates - _NEIGHBOURS, 0, axis.size - width)
    neighbours = axis[first[:, np.newaxis] + np.arange(width)]
    neighbours = neighbours[np.arange(width) != (candidates - first)[:, np.newaxis]].reshape(
        -1, width - 1
    )
    neighbours.sort(axis=1)
    # Without the ends, one of which may be an outlier, too.
    spread = neighbours[:, -2] - neighbours[:, 1]
    distance = np.abs(axis[candidates] - neighbours[:, _NEIGHBOURS])
    is_outlier = (spread <= _MAX_STILL_SPREADS * noise) & (
        distance > _MIN_OUTLIER_SPREADS * np.maximum(spread, noise)
    )
    return np.asarray(candidates[is_outlier], dtype=np.intp)
