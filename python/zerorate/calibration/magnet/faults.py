"""Faults of a magnetometer's samples, detected before the fit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from zerorate.numerals import shorten
from zerorate.types import Booleans, Floats

_MIN_TURN_RATE_RAD_S: Final = np.radians(20.0)
"""Rate, rad/s, above which a working axis changes from sample to sample."""
_MIN_CLIPPED_SHARE: Final = 0.01
_MIN_READINGS: Final = 10
_MAX_CLIPPED_SHARE: Final = 0.2
"""Share of samples at the end of the range above which no fit is possible."""


def describe_stuck_axes(mag: Floats) -> tuple[str, ...]:
    """Return a sentence on axes that never change."""
    known = mag[np.isfinite(mag).all(axis=1)]
    if not len(known):
        return ()
    constant_axes = [
        axis for axis, values in zip("xyz", known.T, strict=True) if np.ptp(values) == 0.0
    ]
    if not constant_axes:
        return ()
    return (f"the magnetometer's {' and '.join(constant_axes)} never changes: it is stuck",)


def find_clipped(mag: Floats, gyro: Floats) -> tuple[Booleans, list[str], list[str]]:
    """Return the mask of saturated samples, with problems and notes about them.

    An axis is saturated if it stays at its largest or smallest reading while the sensor rotates and
    the other axes change.
    """
    fresh: Booleans = np.asarray(np.isfinite(mag).all(axis=1))
    fresh[1:] &= np.any(mag[1:] != mag[:-1], axis=1)
    fresh &= np.linalg.norm(np.nan_to_num(gyro), axis=1) > _MIN_TURN_RATE_RAD_S
    is_clipped, problems, notes = np.zeros(len(mag), dtype=np.bool_), [], []
    for axis, values in zip("xyz", mag.T, strict=True):
        for end in _find_range_ends(values[fresh]):
            at_end = values == end
            share = float(at_end.sum() / max(np.isfinite(values).sum(), 1))
            is_clipped |= at_end
            sentence = (
                f"the magnetometer's {axis} is at the end of its range, {end:.6g}, in "
                f"{shorten(100.0 * share)} % of the samples"
            )
            if share > _MAX_CLIPPED_SHARE:
                problems.append(sentence)
            else:
                notes.append(f"{sentence}: these are left out")
    return is_clipped, problems, notes


def _find_range_ends(values: Floats) -> Iterator[float]:
    """Yield the largest and the smallest reading, if an axis stays there."""
    if len(values) < _MIN_READINGS or np.ptp(values) == 0.0:
        return
    for end in (float(values.max()), float(values.min())):
        at_end = values == end
        stays = int((at_end[1:] & at_end[:-1]).sum())
        if stays >= _MIN_READINGS and stays >= _MIN_CLIPPED_SHARE * len(values):
            yield end
