"""What is wrong with a magnetometer's samples before anything is fitted."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from zerorate.types import Booleans, Floats

_TURNS: Final = np.radians(20.0)
"""rad/s above which a reading changes from sample to sample."""
_SHARE: Final = 0.01
_FEW: Final = 10
_MOST: Final = 0.2
"""Share of samples at the end of the range above which nothing can be told."""


def stuck(mag: Floats) -> tuple[str, ...]:
    """Return a sentence on axes that never change."""
    known = mag[np.isfinite(mag).all(axis=1)]
    if not len(known):
        return ()
    still = [axis for axis, values in zip("xyz", known.T, strict=True) if np.ptp(values) == 0.0]
    if not still:
        return ()
    return (f"the magnetometer's {' and '.join(still)} never changes: it is stuck",)


def clipped(mag: Floats, gyro: Floats) -> tuple[Booleans, list[str], list[str]]:
    """Return which samples are at the end of the range, and what is wrong and to be noted of it.

    An axis that stays at its largest or smallest reading while the sensor turns and others change
    is at the end of its range.
    """
    fresh: Booleans = np.asarray(np.isfinite(mag).all(axis=1))
    fresh[1:] &= np.any(mag[1:] != mag[:-1], axis=1)
    fresh &= np.linalg.norm(np.nan_to_num(gyro), axis=1) > _TURNS
    ends, wrong, notes = np.zeros(len(mag), dtype=np.bool_), [], []
    for axis, values in zip("xyz", mag.T, strict=True):
        for end in _ends(values[fresh]):
            there = values == end
            share = float(there.sum() / max(np.isfinite(values).sum(), 1))
            ends |= there
            said = (
                f"the magnetometer's {axis} is at the end of its range, {end:.6g}, in "
                f"{100.0 * share:.2g} % of the samples"
            )
            if share > _MOST:
                wrong.append(said)
            else:
                notes.append(f"{said}: these are left out")
    return ends, wrong, notes


def _ends(values: Floats) -> Iterator[float]:
    """Yield the largest and the smallest reading, if an axis stays there."""
    if len(values) < _FEW or np.ptp(values) == 0.0:
        return
    for end in (float(values.max()), float(values.min())):
        there = values == end
        stays = int((there[1:] & there[:-1]).sum())
        if stays >= _FEW and stays >= _SHARE * len(values):
            yield end
