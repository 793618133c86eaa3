"""Wild samples: far from all others round them, while the sensor is still."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.types import Floats, Integers

_BESIDE: Final = 5
"""Samples on either side that one is compared with."""

_FAR: Final = 20.0
"""Spreads of those by which it is off: noise comes to three, a knock lasts for several samples."""

_STILL: Final = 4.0
"""Spreads of noise up to which those are still: what is odd in a turn may be the turn."""

_QUIET: Final = 20
"""Percentile of the bends of a record: most of one is in motion, and noise bends it least."""

_OF_BENDS: Final = 0.31
"""That percentile of the bends of white noise, in standard deviations of it."""

_NOISE: Final = 2.0
"""Range of all but the ends of ten samples of noise, in its standard deviations."""


def wild_samples(data: Floats, step: Floats) -> Integers:
    """Return the samples of which an axis is far from those before and after it, in a rest.

    Parameters
    ----------
    data : ndarray of float64, shape (n, k)
        NaN where missing; none of these, nor the samples beside them, is wild.
    step : ndarray of float64, shape (k,)
        Between neighbouring values of each axis.
    """
    found = [_of_axis(axis, float(least)) for axis, least in zip(data.T, step, strict=True)]
    return np.unique(np.concatenate(found))


def _of_axis(axis: Floats, step: float) -> Integers:
    width = 2 * _BESIDE + 1
    if axis.size < width:
        return np.zeros(0, dtype=np.intp)
    bends = np.abs(axis[1:-1] - 0.5 * (axis[:-2] + axis[2:]))
    there = bends[np.isfinite(bends)]
    if not there.size:
        return np.zeros(0, dtype=np.intp)
    noise = max(_NOISE / _OF_BENDS * float(np.percentile(there, _QUIET)), step)
    # Even beside another wild one it bends the curve by half of what it is off.
    some = 1 + np.flatnonzero(bends > 0.4 * _FAR * noise)
    some = np.concatenate(([0], some, [axis.size - 1]))
    first = np.clip(some - _BESIDE, 0, axis.size - width)
    beside = axis[first[:, np.newaxis] + np.arange(width)]
    beside = beside[np.arange(width) != (some - first)[:, np.newaxis]].reshape(-1, width - 1)
    beside.sort(axis=1)
    # Without the ends, of which one may be wild as well.
    spread = beside[:, -2] - beside[:, 1]
    off = np.abs(axis[some] - beside[:, _BESIDE])
    wild = (spread <= _STILL * noise) & (off > _FAR * np.maximum(spread, noise))
    return np.asarray(some[wild], dtype=np.intp)
