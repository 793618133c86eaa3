"""Units of timestamps: seconds since the first one, from numbers and dates of any unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.io.clocks.iso8601 import dates_in
from zerorate.io.clocks.names import time_unit
from zerorate.io.log import LogError
from zerorate.io.missing import without_masks
from zerorate.io.table import Column
from zerorate.types import Booleans, Floats

__all__ = ["Stamps", "to_seconds", "without_texts"]

_Counts = npt.NDArray[np.float64 | np.int64]

_BLOCK: Final = 1 << 16
_ALIKE: Final = 0.01
_PER_SECOND: Final = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
_OF_DATES: Final = {
    "D": 1 / 86_400,
    "h": 1 / 3_600,
    "m": 1 / 60,
    **_PER_SECOND,
    "ps": 1e12,
    "fs": 1e15,
    "as": 1e18,
}
_LONGEST = 1e10
# The steps of clocks from 10 Hz to 10 kHz: one range a unit, seconds reaching down to 2 Hz.
_STEP_BELOW = (("s", 0.5), ("ms", 100.0), ("us", 1e5), ("ns", np.inf))
_DATES: Final = (946_684_800, 4_102_444_800)
"""Seconds from 1970 to the years 2000 and 2100: of no two units are they the same numbers."""
_SLOWEST: Final = 60.0
"""Longest step of dated stamps, s. A counter passes the same numbers in larger ones: one of
microseconds at 10 kHz in steps of 100."""
_WRAP: Final = 1 << 32
"""Counts after which a counter of 32 bits begins anew: microseconds after 71.6 minutes."""
_NEAR: Final = 1000
"""Steps by which a counter may pass over its wrap; one that was reset is further off."""


@dataclass(frozen=True)
class Stamps:
    """Seconds since the first stamp, shape (n,), the first stamp itself, and what was assumed."""

    seconds: Floats
    start: float
    note: str | None


def to_seconds(column: Column, name: str, rate: float | None) -> Stamps:
    """Return the stamps in seconds.

    Dates, as text of ISO 8601 as well, and durations have a unit. That of numbers is the name's
    suffix; without one, that in which they are dates of this century, in steps of a minute at
    most; without that, the one whose clock comes within 1 % of ``rate``; without that, the step
    decides: below 0.5 it is seconds, below 100 milliseconds, below 100 000 microseconds, and
    nanoseconds above.

    Raises
    ------
    LogError
        If a stamp is missing, is no number or date, or stands too far from the first; or if they
        are dates in a smaller unit than their name tells.
    """
    column = without_texts(column, name)
    per_second, note = None, None
    if column.dtype.kind in "Mm":
        _check_whole(~np.isnat(column), name)
        per_second = _per_second(column.dtype, name)
        column = column.view(np.int64)
    first = column[0]
    since = _since(_numbers(column, name), name)
    if per_second is None:
        since, wraps = _unwrapped(since, float(first))
        unit, note = _read_as(name, float(first), since, rate)
        per_second = _PER_SECOND[unit]
        if wraps:
            note = "; ".join(filter(None, (_on_wraps(name, wraps), note)))
    seconds = since.astype(np.float64, copy=False)
    if per_second != 1.0:
        seconds = seconds / per_second
    if not np.ptp(seconds) < _LONGEST:
        raise LogError(f"time column '{name}' spans more than 300 years")
    return Stamps(seconds, float(first) / per_second, note)


def without_texts(column: Column, name: str) -> Column:
    """Return stamps with texts as dates, and nothing masked; LogError if a text is no date."""
    column = without_masks(column)
    return dates_in(column, name) if column.dtype.kind in "SUO" else column


def _per_second(dtype: np.dtype[np.generic], name: str) -> float | None:
    """Return the counts a second of dates or durations, None if they have no unit."""
    unit, count = np.datetime_data(dtype)  # type: ignore[arg-type]
    if unit == "generic":
        return None
    if unit not in _OF_DATES:
        raise LogError(f"time column '{name}' holds {dtype}, expected times to the day or finer")
    return _OF_DATES[unit] / count


def _numbers(column: Column, name: str) -> Column:
    """Return the column in 64 bits: today's date in nanoseconds does not fit a float64."""
    if column.dtype.kind in "iu":
        return column.astype(np.int64 if column.dtype.kind == "i" else np.uint64, copy=False)
    if column.dtype.kind != "f":
        raise LogError(f"time column '{name}' holds {column.dtype}, expected numbers")
    with np.errstate(over="ignore"):
        column = column.astype(np.float64, copy=False)
    _check_whole(np.isfinite(column), name)
    return column


def _since(column: Column, name: str) -> _Counts:
    """Return the counts since the first, exact where they are whole numbers."""
    if column.dtype.kind == "f":
        with np.errstate(over="ignore"):
            return column - column[0] if column[0] else column
    if int(column.max()) - int(column.min()) > np.iinfo(np.int64).max:
        raise LogError(f"time column '{name}' spans more than 64 bits can count")
    since: npt.NDArray[np.int64] = (column - column[0]).view(np.int64)
    return since


def _unwrapped(since: _Counts, first: float) -> tuple[_Counts, int]:
    """Return the counts of a 32-bit counter as if it had more bits, and how often it wrapped."""
    most = first + float(since.max())
    if not (_WRAP / 2 < most < _WRAP and first + float(since.min()) >= 0.0):
        return since, 0
    steps = np.diff(since)
    back = np.flatnonzero(steps < -_WRAP / 2)
    if not back.size or not (middle := _middle_step(since)):
        return since, 0
    back = back[steps[back] + _WRAP <= _NEAR * middle]
    turns = np.zeros(len(since), since.dtype)
    turns[back + 1] = _WRAP
    return since + np.cumsum(turns, dtype=since.dtype), len(back)


def _on_wraps(name: str, wraps: int) -> str:
    times = "once" if wraps == 1 else f"{wraps} times"
    return f"time column '{name}' began anew at 2^32 {times}, as counters of 32 bits do; it goes on"


def _check_whole(there: Booleans, name: str) -> None:
    if not there.all():
        bad = np.flatnonzero(~there)
        raise LogError(
            f"time column '{name}' is not finite in row {bad[0]} (counting from 0), "
            "expected a timestamp in every row"
        )


def _read_as(name: str, first: float, since: _Counts, rate: float | None) -> tuple[str, str | None]:
    """Return the unit of numbers, and a sentence on how it was found unless it is plain."""
    named, dated = time_unit(name), _unit_of_dates(first, since)
    column = f"time column '{name}'"
    if named is not None:
        if dated in (None, named):
            return named, None
        if first / _PER_SECOND[named] >= _DATES[1]:
            raise LogError(
                f"{column} is in {named} by its name, but holds dates in {dated}; rename it"
            )
        return named, f"{column} read as {named}, as its name says; in {dated} it would hold dates"
    judged, by = _unit_of_step(since, rate)
    if dated is not None:
        plain_ = dated == judged == "s"
        return dated, None if plain_ else f"{column} read as {dated}: in that unit it holds dates"
    return judged, None if judged == "s" else f"{column} read as {judged}, judged by {by}"


def _unit_of_dates(first: float, since: _Counts) -> str | None:
    """Return the unit in which the stamps are dates of this century, None if there is none."""
    # Of three stamps one may be wild.
    middle = first + sorted(float(since[i]) for i in (0, len(since) // 2, -1))[1]
    for unit, per_second in _PER_SECOND.items():
        if _DATES[0] <= middle / per_second < _DATES[1]:
            return unit if _middle_step(since) <= _SLOWEST * per_second else None
    return None


def _unit_of_step(since: _Counts, rate: float | None) -> tuple[str, str]:
    """Return the unit that the rate, else the step tells, and which of them it was."""
    if (ends := _steps_between(since)) is not None:
        low, high = (_unit_of(step, rate) for step in ends)
        # Nothing but that unit lies between two ends so close.
        if low == high:
            return low
    return _unit_of(_middle_step(since), rate)


def _middle_step(since: _Counts) -> float:
    """Return the median of the steps forward, 0 if there are none."""
    if (ends := _steps_between(since)) is not None:
        return ends[0]
    steps = np.diff(since).astype(np.float64)
    steps = steps[steps > 0]
    return float(np.median(steps)) if steps.size else 0.0


def _unit_of(step: float, rate: float | None) -> tuple[str, str]:
    if rate is not None:
        for unit, per_second in _PER_SECOND.items():
            if abs(step * rate / per_second - 1) < 0.01:
                return unit, "the rate stated"
    return next(unit for unit, bound in _STEP_BELOW if step < bound), "its step"


def _steps_between(since: _Counts) -> tuple[float, float] | None:
    """Return the least and the largest step, None unless they are positive and all but equal."""
    least, most = np.inf, -np.inf
    for first in range(0, len(since) - 1, _BLOCK):
        steps = np.diff(since[first : first + _BLOCK + 1])
        least, most = min(least, float(steps.min())), max(most, float(steps.max()))
        if not 0.0 < most <= (1.0 + _ALIKE) * least:
            return None
    return (least, most) if len(since) > 1 else None
