"""Outliers: samples far from all their neighbours, while the sensor is still."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.types import Floats, Integers

_NEIGHBOURS: Final = 5
"""Number of samples on either side that a sample is compared with."""

_MIN_OUTLIER_SPREADS: Final = 20.0
"""Distance of an outlier from its neighbours, in spreads of these neighbours. Noise reaches three
spreads; a knock lasts for several samples.
"""

_MAX_STILL_SPREADS: Final = 4.0
"""Largest spread of the neighbours of an outlier, in spreads of noise: in motion an odd sample may
be real.
"""

_QUIET_PERCENTILE: Final = 20
"""Percentile of the bends of a record that measures noise: motion bends the record more."""

_QUIET_BEND_SIGMAS: Final = 0.31
"""The same percentile for white noise, in its standard deviations."""

_NOISE_RANGE_SIGMAS: Final = 2.0
"""Range of ten samples of noise without the two extremes, in standard deviations of the noise."""


def find_outliers(data: Floats, step: Floats) -> Integers:
    """Return the indices of samples at rest with an axis far from its neighbours.

    Parameters
    ----------
    data : ndarray of float64, shape (n, k)
        Samples, NaN where missing. Missing samples and their neighbours are never outliers.
    step : ndarray of float64, shape (k,)
        Step between neighbouring values of each axis.
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
    # Even next to another outlier, an outlier bends the curve by half of its error.
    candidates = 1 + np.flatnonzero(bends > 0.4 * _MIN_OUTLIER_SPREADS * noise)
    candidates = np.concatenate(([0], candidates, [axis.size - 1]))
    first = np.clip(candidates - _NEIGHBOURS, 0, axis.size - width)
    neighbours = axis[first[:, np.newaxis] + np.arange(width)]
    neighbours = neighbours[np.arange(width) != (candidates - first)[:, np.newaxis]].reshape(
        -1, width - 1
    )
    neighbours.sort(axis=1)
    # The extremes are left out, because one of them may be another outlier.
    spread = neighbours[:, -2] - neighbours[:, 1]
    distance = np.abs(axis[candidates] - neighbours[:, _NEIGHBOURS])
    is_outlier = (spread <= _MAX_STILL_SPREADS * noise) & (
        distance > _MIN_OUTLIER_SPREADS * np.maximum(spread, noise)
    )
    return np.asarray(candidates[is_outlier], dtype=np.intp)
