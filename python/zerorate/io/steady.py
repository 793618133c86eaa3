"""Stamps that are those of a round rate to their last digits: most of all, and told in one pass."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

__all__ = ["SteadyClock", "resolution", "roundest", "steady_clock", "steps_between"]

Floats = npt.NDArray[np.float64]

_BLOCK: Final = 1 << 16
_ALIKE: Final = 0.01


@dataclass(frozen=True)
class SteadyClock:
    """Rate, Hz, and the deviation of the stamps from it, s, which is that of their rounding."""

    rate: float
    rms: float
    most: float


def steady_clock(stamps: Floats, start: float) -> SteadyClock | None:
    """Return the clock of stamps whose place no estimate could tell better, None for others.

    The rate is the one that the estimates of `zerorate.io.clock` come to: it is the roundest among
    all within four times their doubt, and the stamps keep to it within a quarter of that.
    """
    span = float(stamps[-1])
    if not span > 0.0:
        return None
    doubt = resolution(start, span)
    rate = roundest(span / (len(stamps) - 1), 4.0 * doubt / span)
    squares = most = 0.0
    for first in range(0, len(stamps), _BLOCK):
        part = stamps[first : first + _BLOCK]
        off = part - np.arange(first, first + len(part)) / rate
        most = max(most, float(off.max()), -float(off.min()))
        if most > 0.25 * doubt:
            return None
        squares += float(np.square(off, out=off).sum())
    return SteadyClock(rate, math.sqrt(squares / len(stamps)), most)


def resolution(start: float, last: float) -> float:
    """Return what stamps tell at best, s: the first one bounds the precision of the others."""
    return float(4 * np.finfo(np.float64).eps * (abs(start) + abs(last)))


def roundest(period: float, doubt: float) -> float:
    """Return the rate of the fewest digits, of itself or its period, within a relative doubt."""
    for digits in range(1, 16):
        for rate in (float(f"{1 / period:.{digits}g}"), 1 / float(f"{period:.{digits}g}")):
            if abs(rate * period - 1) <= doubt:
                return rate
    return 1 / period


def steps_between(column: npt.NDArray[np.float64 | np.int64]) -> tuple[float, float] | None:
    """Return the least and the largest step, None unless they are positive and all but equal."""
    ends = list(_ends(column))
    if not ends:
        return None
    least, most = min(low for low, _ in ends), max(high for _, high in ends)
    return (least, most) if 0.0 < most <= (1.0 + _ALIKE) * least else None


def _ends(column: npt.NDArray[np.float64 | np.int64]) -> Iterator[tuple[float, float]]:
    for first in range(0, len(column) - 1, _BLOCK):
        steps = np.diff(column[first : first + _BLOCK + 1])
        yield float(steps.min()), float(steps.max())
