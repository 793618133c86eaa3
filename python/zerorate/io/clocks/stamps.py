"""Timestamps in seconds since the first one, from numbers, dates and times of day of any unit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.faults import given, said
from zerorate.io.clocks.iso8601 import dates_in
from zerorate.io.clocks.names import time_unit
from zerorate.io.clocks.units import (
    DATES,
    PER_SECOND,
    Counts,
    Unit,
    date_unit,
    in_unit,
    middle_step,
    row_step,
    unit_of,
    unit_of_rate,
)
from zerorate.io.clocks.written import unpacked_times
from zerorate.io.table import Column
from zerorate.record.log import LogError
from zerorate.record.missing import without_masks
from zerorate.types import Booleans, Floats

Beside = Callable[[Sequence[str]], tuple[str, str] | None]
"""Returns which of some units another clock tells, and its name."""

_BLOCK: Final = 1 << 16
_OF_DATES: Final = {
    "D": 1 / 86_400,
    "h": 1 / 3_600,
    "m": 1 / 60,
    "s": 1.0,
    "ms": 1e3,
    "us": 1e6,
    "ns": 1e9,
    "ps": 1e12,
    "fs": 1e15,
    "as": 1e18,
}
_LONGEST = 1e10
WRAPS: Final = (1 << 32, 1 << 31, 1 << 24, 1 << 16)
"""Counts after which counters begin anew: microseconds of 32 bits after 71.6 minutes."""
_NEAR: Final = 1000
"""Steps by which a counter may pass over its wrap; one that was reset is further off."""
_CLOSE: Final = 8
"""Part of a wrap within which it passes over, so that a short counter is told from a reset."""
DAY_S: Final = 86_400.0
_AROUND: Final = 15
"""Rows on each side of a leap that show whether it lasts."""
_COARSE: Final = 10
"""Rows that may share a stamp for no more digits are kept."""


@dataclass(frozen=True)
class Stamps:
    """Seconds since the first stamp, shape (n,), the first stamp itself, and what was assumed."""

    seconds: Floats
    start: float
    note: str | None


def to_seconds(
    column: Column,
    name: str,
    rate: float | None,
    unit: str | None = None,
    beside: Beside | None = None,
) -> Stamps:
    """Return the stamps in seconds.

    Dates, as text as well, and durations have a unit. That of numbers is the one that is given;
    else the name's; else that in which they are dates of this century, in steps of a minute at
    most; else the one in which the rows have the ``rate`` stated; else the only one in which they
    have one of 0.5 Hz to 32 kHz; else the one of these that another clock tells.

    Raises
    ------
    LogError
        If a stamp is missing, is no number or date, or stands too far from the first; if they
        are dates in a smaller unit than their name tells; or if no unit remains or several do.
    """
    column = without_texts(column, name)
    notes: list[str | None] = []
    found: Unit | None = None
    if column.dtype.kind in "Mm":
        _check_whole(~np.isnat(column), name)
        per_second = _per_second(column.dtype, name)
        found = None if per_second is None else Unit(per_second)
        column = column.view(np.int64)
    numbers = _numbers(column, name)
    first = float(numbers[0])
    since = _since(numbers, name)
    if found is None and unit is None and (packed := _packed(numbers, name)) is not None:
        since, first, found = packed
        notes.append(found.note)
    if found is None:
        since, told = _unwrapped(since, first, name)
        _check_fine(numbers, since, name)
        found = _read_as(name, numbers, since, rate, unit, beside)
        notes += [told, found.note]
    seconds = since.astype(np.float64, copy=False)
    if found.per_second != 1.0:
        seconds = seconds / found.per_second
    if not np.ptp(seconds) < _LONGEST:
        raise LogError(f"time column '{name}' spans more than 300 years")
    seconds, told = _through_midnights(seconds, name)
    note = "; ".join(filter(None, (*notes, told)))
    return Stamps(seconds, first / found.per_second + found.epoch, note or None)


def _packed(numbers: Column, name: str) -> tuple[Counts, float, Unit] | None:
    """Return the times of day in numbers such as 120059990, in seconds; None for all others."""
    if time_unit(name) not in (None, "s") or middle_step(_since(numbers, name)) <= 0.0:
        return None
    times = unpacked_times(numbers)
    if times is None:
        return None
    said = f"time column '{name}' read as hours, minutes and seconds in one number"
    return times - times[0], float(times[0]), Unit(1.0, 0.0, said)


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


def _since(column: Column, name: str) -> Counts:
    """Return the counts since the first, exact where they are whole numbers."""
    if column.dtype.kind == "f":
        with np.errstate(over="ignore"):
            return column - column[0] if column[0] else column
    if int(column.max()) - int(column.min()) > np.iinfo(np.int64).max:
        raise LogError(f"time column '{name}' spans more than 64 bits can count")
    since: Counts = (column - column[0]).view(np.int64)
    return since


def _unwrapped(since: Counts, first: float, name: str) -> tuple[Counts, str | None]:
    """Return the counts of a counter of few bits as if it had more, and a sentence on its wraps."""
    most, least = first + float(since.max()), first + float(since.min())
    for wrap in WRAPS:
        signed = least < 0.0
        low, high = (-wrap / 2, wrap / 2) if signed else (0.0, float(wrap))
        if not (high - wrap / 2 < most < high and least >= low):
            continue
        steps = np.diff(since)
        back = np.flatnonzero(steps < -wrap / 2)
        if not back.size:
            continue
        back = back[steps[back] + wrap <= _near(wrap, middle_step(since))]
        if not back.size:
            continue
        turns = np.zeros(len(since), since.dtype)
        turns[back + 1] = wrap
        return since + np.cumsum(turns, dtype=since.dtype), _on_wraps(name, wrap, len(back))
    return since, None


def _near(wrap: int, step: float) -> float:
    """Return the counts by which a counter in such steps may pass over its wrap."""
    near = _NEAR * step
    return near if wrap == WRAPS[0] else min(near, wrap / _CLOSE)


def is_wrap(wrap: int, last: float, count: float, step: float) -> bool:
    """Return True if a counter in steps of so many went from one count to a lower one by a wrap.

    Examples
    --------
    >>> from zerorate.io.clocks.stamps import is_wrap
    >>> is_wrap(1 << 16, 65_530, 4, 10.0), is_wrap(1 << 16, 40_000, 0, 10.0)
    (True, False)
    """
    low, high = (-wrap / 2, wrap / 2) if count < 0 else (0.0, float(wrap))
    inside = high - wrap / 2 < last < high and count >= low
    return inside and 0.0 <= count - last + wrap <= _near(wrap, step)


def _on_wraps(name: str, wrap: int, wraps: int) -> str:
    times, bits = "once" if wraps == 1 else f"{wraps} times", wrap.bit_length() - 1
    return (
        f"time column '{name}' began anew at 2^{bits} {times}, as counters of {bits} bits do; it "
        "goes on"
    )


def _check_fine(numbers: Column, since: Counts, name: str) -> None:
    """Raise LogError if many rows share a stamp for they were kept in 32 bits."""
    if numbers.dtype.kind != "f" or len(numbers) < 2:
        return
    largest = float(np.abs(numbers[[0, -1]]).max())
    most = float(np.finfo(np.float32).max)
    apart = float(np.spacing(np.float32(largest))) if largest < most else 0.0
    step = row_step(since)
    if not _COARSE * step < apart or (step == 0.0 and apart < 1.0):
        return
    with np.errstate(over="ignore"):
        if (numbers.astype(np.float32) == numbers).all():
            raise LogError(
                said(
                    f"time column '{name}' was kept in float32, where numbers as large as "
                    f"{largest:.6g} are {apart:g} apart: too coarse for rows {step:.4g} apart. "
                    "Write it in float64 or as whole numbers, or since the start of the log; or "
                    "read the log without it, by ",
                    given("time", "none", "time=False"),
                    " and ",
                    given("rate"),
                )
            )


def _large_steps(seconds: Floats, bound: float) -> Iterator[int]:
    """Yield the rows that lie so many seconds or more from the one before."""
    for first in range(0, len(seconds) - 1, _BLOCK):
        steps = np.diff(seconds[first : first + _BLOCK + 1])
        yield from (first + 1 + np.flatnonzero(np.abs(steps) >= bound)).tolist()


def _through_midnights(seconds: Floats, name: str) -> tuple[Floats, str | None]:
    """Return times of day that go on at midnight, and a sentence on it.

    Raises
    ------
    LogError
        If they leap by a day or more, and stay there.
    """
    if len(seconds) < 2 * _AROUND or not np.ptp(seconds) >= 0.99 * DAY_S:
        return seconds, None
    midnights = []
    for row in _large_steps(seconds, 0.99 * DAY_S):
        before = float(np.median(seconds[max(0, row - _AROUND) : row]))
        after = float(np.median(seconds[row : row + _AROUND]))
        leap = float(seconds[row] - seconds[row - 1])
        if abs(after - before) < 0.9 * DAY_S or min(row, len(seconds) - row) < 3:
            continue  # a stamp that is wild, or two
        if abs(leap + DAY_S) < 0.01 * DAY_S:
            midnights.append(row)
        elif leap > 0.0 and _steps_are_short(seconds, row):
            raise LogError(
                f"time column '{name}' leaps by {leap / DAY_S:.6g} days before row {row} (counting "
                "from 0): cut the log there"
            )
    if not midnights:
        return seconds, None
    days = np.zeros(len(seconds))
    days[midnights] = DAY_S
    times = "once" if len(midnights) == 1 else f"{len(midnights)} times"
    return seconds + np.cumsum(days), f"time column '{name}' passes midnight {times}; it goes on"


def _steps_are_short(seconds: Floats, row: int) -> bool:
    """Whether rows before one are closer together than minutes."""
    steps = np.diff(seconds[max(0, row - _AROUND) : row])
    return bool(steps.size and np.median(steps) < 60.0)


def _check_whole(there: Booleans, name: str) -> None:
    if not there.all():
        bad = np.flatnonzero(~there)
        raise LogError(
            f"time column '{name}' is not finite in row {bad[0]} (counting from 0), "
            "expected a timestamp in every row"
        )


def _read_as(
    name: str,
    numbers: Column,
    since: Counts,
    rate: float | None,
    given: str | None,
    beside: Beside | None,
) -> Unit:
    """Return the unit of numbers."""
    column = f"time column '{name}'"
    named, first = time_unit(name), float(numbers[0])
    if given is not None:
        told = f"{column} read as {given}, as stated; its name says {named}"
        contradicted = named is not None and given not in (named, "100us")
        return Unit(_per_second_of(given, rate), 0.0, told if contradicted else None)
    dated = date_unit(name, first, since)
    if named is not None:
        unit = Unit(PER_SECOND[named])
        if dated is None or dated[0] == named:
            return unit if dated is None else dated[1]._replace(note=None)
        if first / PER_SECOND[named] >= DATES[1]:
            raise LogError(
                f"{column} is in {named} by its name, but holds dates in {dated[0]}; rename it"
            )
        said = f"{column} read as {named}, as its name says; in {dated[0]} it would hold dates"
        return unit._replace(note=said)
    step = row_step(since)
    if dated is not None:
        plain = dated[0] == "s" and step < 0.5
        return dated[1]._replace(note=None) if plain else dated[1]
    stated = None if rate is None else unit_of_rate(name, step, rate)
    return stated or unit_of(name, numbers, step, beside)


def _per_second_of(unit: str, rate: float | None) -> float:
    if unit in PER_SECOND:
        return PER_SECOND[unit]
    if rate is None:
        raise LogError(said(in_unit("samples"), " needs ", given("rate"), ", the samples a second"))
    return rate
