"""Conversion of timestamps (numbers, dates, times of day) to seconds since the first stamp."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.clocks.iso8601 import parse_date_column
from zerorate.io.clocks.names import find_time_unit
from zerorate.io.clocks.units import (
    DATE_RANGE_S,
    PER_SECOND,
    Counts,
    Unit,
    find_date_unit,
    find_rate_unit,
    find_unit,
    median_step,
    row_step,
    unit_argument,
)
from zerorate.io.clocks.written import unpack_dates, unpack_times
from zerorate.io.table import Column
from zerorate.record.log import LogError
from zerorate.record.missing import without_masks
from zerorate.types import Booleans, Floats

UnitHint = Callable[[Sequence[str]], tuple[str, str] | None]
"""Function of possible units that returns the right one and the clock that shows it, or None."""

_BLOCK_ROWS: Final = 1 << 16
_DATE_COUNTS_PER_SECOND: Final = {
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
_MAX_SPAN_S = 1e10
WRAP_COUNTS: Final = (1 << 32, 1 << 31, 1 << 24, 1 << 16)
"""Counts at which counters wrap; 32 bits of microseconds wrap after 71.6 minutes."""
_MAX_WRAP_STEPS: Final = 1000
"""Largest distance from a wrap, in steps; a reset counter is further away."""
_WRAP_DIVISOR: Final = 8
"""Divisor of the counter's range for this distance: a wrap happens near the range's end."""
DAY_S: Final = 86_400.0
_LEAP_WINDOW_ROWS: Final = 15
"""Rows on each side of a jump to test if it lasts."""
_MAX_ROWS_PER_STAMP: Final = 10
"""Largest number of rows that may share a stamp because of its precision."""


@dataclass(frozen=True)
class Stamps:
    """Seconds since the first stamp, shape (n,), with the first stamp and the assumptions."""

    seconds: Floats
    start: float
    note: str | None


def to_seconds(
    column: Column,
    name: str,
    rate: float | None,
    unit: str | None = None,
    unit_hint: UnitHint | None = None,
) -> Stamps:
    """Return the stamps in seconds.

    Dates (also as text) and durations have a unit. The unit of numbers is found in this order:

    - the stated unit
    - the unit in the name
    - the unit in which they are dates of this century, with steps of at most a minute
    - the unit in which the rows have the stated ``rate``
    - the only unit in which the rows have a rate from 0.5 Hz to 32 kHz
    - of several such units, the one that agrees with another clock

    Raises
    ------
    LogError
        If a stamp is missing, is no number or date, or is too far from the first. Also if stamps
        are dates in a smaller unit than in their name, or if no single unit is possible.
    """
    column = convert_texts(column, name)
    notes: list[str | None] = []
    count_unit: Unit | None = None
    if column.dtype.kind in "Mm":
        _check_finite(~np.isnat(column), name)
        per_second = _date_counts_per_second(column.dtype, name)
        count_unit = None if per_second is None else Unit(per_second)
        column = column.view(np.int64)
    numbers = _to_64_bits(column, name)
    first = float(numbers[0])
    since = _subtract_first(numbers, name)
    if count_unit is None and unit is None and (packed := _unpack_times(numbers, name)) is not None:
        since, first, count_unit = packed
        notes.append(count_unit.note)
    if count_unit is None:
        since, sentence = _unwrap(since, first, name)
        _check_resolution(numbers, since, name)
        count_unit = _choose_unit(name, numbers, since, rate, unit, unit_hint)
        notes += [sentence, count_unit.note]
    seconds = since.astype(np.float64, copy=False)
    if count_unit.per_second != 1.0:
        seconds = seconds / count_unit.per_second
    if not np.ptp(seconds) < _MAX_SPAN_S:
        raise LogError(f"time column '{name}' spans more than 300 years")
    seconds, sentence = _unwrap_midnights(seconds, name)
    note = "; ".join(filter(None, (*notes, sentence)))
    return Stamps(seconds, first / count_unit.per_second + count_unit.epoch, note or None)


def _unpack_times(numbers: Column, name: str) -> tuple[Counts, float, Unit] | None:
    """Return times of day in numbers such as 120059990, in seconds; None for other numbers."""
    if (
        find_time_unit(name) not in (None, "s")
        or median_step(_subtract_first(numbers, name)) <= 0.0
    ):
        return None
    dates = unpack_dates(numbers)
    times = unpack_times(numbers) if dates is None else dates
    if times is None:
        return None
    parts = "hours" if dates is None else "date, hours"
    note = f"time column '{name}' read as {parts}, minutes and seconds in one number"
    return times - times[0], float(times[0]), Unit(1.0, 0.0, note)


def convert_texts(column: Column, name: str) -> Column:
    """Return stamps with texts converted to dates; LogError if a text is no date."""
    column = without_masks(column)
    return parse_date_column(column, name) if column.dtype.kind in "SUO" else column


def _date_counts_per_second(dtype: np.dtype[np.generic], name: str) -> float | None:
    """Return the counts per second of dates or durations; None if they have no unit."""
    unit, count = np.datetime_data(dtype)  # type: ignore[arg-type]
    if unit == "generic":
        return None
    if unit not in _DATE_COUNTS_PER_SECOND:
        raise LogError(f"time column '{name}' holds {dtype}, expected times to the day or finer")
    return _DATE_COUNTS_PER_SECOND[unit] / count


def _to_64_bits(column: Column, name: str) -> Column:
    """Return the column in 64 bits; float64 is too coarse for a date in nanoseconds."""
    if column.dtype.kind in "iu":
        return column.astype(np.int64 if column.dtype.kind == "i" else np.uint64, copy=False)
    if column.dtype.kind != "f":
        raise LogError(f"time column '{name}' holds {column.dtype}, expected numbers")
    with np.errstate(over="ignore"):
        column = column.astype(np.float64, copy=False)
    _check_finite(np.isfinite(column), name)
    return column


def _subtract_first(column: Column, name: str) -> Counts:
    """Return the counts since the first stamp, exact for integers."""
    if column.dtype.kind == "f":
        with np.errstate(over="ignore"):
            return column - column[0] if column[0] else column
    if int(column.max()) - int(column.min()) > np.iinfo(np.int64).max:
        raise LogError(f"time column '{name}' spans more than 64 bits can count")
    since: Counts = (column - column[0]).view(np.int64)
    return since


def _unwrap(since: Counts, first: float, name: str) -> tuple[Counts, str | None]:
    """Return the counts of a wrapping counter as a continuous count, and a sentence on wraps."""
    largest, smallest = first + float(since.max()), first + float(since.min())
    for wrap in WRAP_COUNTS:
        signed = smallest < 0.0
        low, high = (-wrap / 2, wrap / 2) if signed else (0.0, float(wrap))
        if not (high - wrap / 2 < largest < high and smallest >= low):
            continue
        steps = np.diff(since)
        back = np.flatnonzero(steps < -wrap / 2)
        if not back.size:
            continue
        back = back[steps[back] + wrap <= _max_wrap_step(wrap, median_step(since))]
        if not back.size:
            continue
        wraps = np.zeros(len(since), since.dtype)
        wraps[back + 1] = wrap
        return since + np.cumsum(wraps, dtype=since.dtype), _describe_wraps(name, wrap, len(back))
    return since, None


def _max_wrap_step(wrap: int, step: float) -> float:
    """Return the largest counts by which a counter with such steps can jump across its wrap."""
    near = _MAX_WRAP_STEPS * step
    return near if wrap == WRAP_COUNTS[0] else min(near, wrap / _WRAP_DIVISOR)


def is_wrap(wrap: int, last: float, count: float, step: float) -> bool:
    """Return True if a counter went from `last` to the lower `count` by a wrap, given its step.

    Examples
    --------
    >>> from zerorate.io.clocks.stamps import is_wrap
    >>> is_wrap(1 << 16, 65_530, 4, 10.0), is_wrap(1 << 16, 40_000, 0, 10.0)
    (True, False)
    """
    low, high = (-wrap / 2, wrap / 2) if count < 0 else (0.0, float(wrap))
    inside = high - wrap / 2 < last < high and count >= low
    return inside and 0.0 <= count - last + wrap <= _max_wrap_step(wrap, step)


def _describe_wraps(name: str, wrap: int, wraps: int) -> str:
    times, bits = "once" if wraps == 1 else f"{wraps} times", wrap.bit_length() - 1
    return (
        f"time column '{name}' wrapped at 2^{bits} {times}, as counters of {bits} bits do; it "
        "goes on"
    )


def _check_resolution(numbers: Column, since: Counts, name: str) -> None:
    """Raise LogError if many rows share a stamp because of float32."""
    if numbers.dtype.kind != "f" or len(numbers) < 2:
        return
    largest = float(np.abs(numbers[[0, -1]]).max())
    max_float32 = float(np.finfo(np.float32).max)
    spacing = float(np.spacing(np.float32(largest))) if largest < max_float32 else 0.0
    step = row_step(since)
    if not _MAX_ROWS_PER_STAMP * step < spacing or (step == 0.0 and spacing < 1.0):
        return
    with np.errstate(over="ignore"):
        if (numbers.astype(np.float32) == numbers).all():
            raise LogError(
                make_sentence(
                    f"time column '{name}' was kept in float32, where numbers as large as "
                    f"{largest:.6g} are {spacing:g} apart: too coarse for rows {step:.4g} apart. "
                    "Write it in float64 or as whole numbers, or since the start of the log; or "
                    "read the log without it, by ",
                    keyword_argument("time", "none", "time=False"),
                    " and ",
                    keyword_argument("rate"),
                )
            )


def _find_large_steps(seconds: Floats, bound: float) -> Iterator[int]:
    """Yield the rows that differ from the row before by `bound` seconds or more."""
    for first in range(0, len(seconds) - 1, _BLOCK_ROWS):
        steps = np.diff(seconds[first : first + _BLOCK_ROWS + 1])
        yield from (first + 1 + np.flatnonzero(np.abs(steps) >= bound)).tolist()


def _unwrap_midnights(seconds: Floats, name: str) -> tuple[Floats, str | None]:
    """Return times of day continued across midnight, and a sentence on it.

    Raises
    ------
    LogError
        If times jump forward by a day or more, and stay there.
    """
    if len(seconds) < 2 * _LEAP_WINDOW_ROWS or not np.ptp(seconds) >= 0.99 * DAY_S:
        return seconds, None
    midnights = []
    for row in _find_large_steps(seconds, 0.99 * DAY_S):
        before = float(np.median(seconds[max(0, row - _LEAP_WINDOW_ROWS) : row]))
        after = float(np.median(seconds[row : row + _LEAP_WINDOW_ROWS]))
        leap = float(seconds[row] - seconds[row - 1])
        if abs(after - before) < 0.9 * DAY_S or min(row, len(seconds) - row) < 3:
            continue  # only one or two outliers
        if abs(leap + DAY_S) < 0.01 * DAY_S:
            midnights.append(row)
        elif leap > 0.0 and _has_short_steps(seconds, row):
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


def _has_short_steps(seconds: Floats, row: int) -> bool:
    """Return True if the rows before `row` are less than a minute apart."""
    steps = np.diff(seconds[max(0, row - _LEAP_WINDOW_ROWS) : row])
    return bool(steps.size and np.median(steps) < 60.0)


def _check_finite(is_finite: Booleans, name: str) -> None:
    if not is_finite.all():
        bad_rows = np.flatnonzero(~is_finite)
        raise LogError(
            f"time column '{name}' is not finite in row {bad_rows[0]} (counting from 0), "
            "expected a timestamp in every row"
        )


def _choose_unit(
    name: str,
    numbers: Column,
    since: Counts,
    rate: float | None,
    stated_unit: str | None,
    unit_hint: UnitHint | None,
) -> Unit:
    """Return the unit of numeric stamps."""
    column = f"time column '{name}'"
    named, first = find_time_unit(name), float(numbers[0])
    if stated_unit is not None:
        contradiction = f"{column} read as {stated_unit}, as stated; its name says {named}"
        contradicted = named is not None and stated_unit not in (named, "100us")
        return Unit(
            _unit_counts_per_second(stated_unit, rate), 0.0, contradiction if contradicted else None
        )
    dated = find_date_unit(name, first, since)
    if named is not None:
        unit = Unit(PER_SECOND[named])
        if dated is None or dated[0] == named:
            return unit if dated is None else dated[1]._replace(note=None)
        if first / PER_SECOND[named] >= DATE_RANGE_S[1]:
            raise LogError(
                f"{column} is in {named} by its name, but holds dates in {dated[0]}; rename it"
            )
        sentence = f"{column} read as {named}, as its name says; in {dated[0]} it would hold dates"
        return unit._replace(note=sentence)
    step = row_step(since)
    if dated is not None:
        is_plain_seconds = dated[0] == "s" and step < 0.5
        return dated[1]._replace(note=None) if is_plain_seconds else dated[1]
    stated = None if rate is None else find_rate_unit(name, step, rate)
    return stated or find_unit(name, numbers, step, unit_hint)


def _unit_counts_per_second(unit: str, rate: float | None) -> float:
    if unit in PER_SECOND:
        return PER_SECOND[unit]
    if rate is None:
        raise LogError(
            make_sentence(
                unit_argument("samples"),
                " needs ",
                keyword_argument("rate"),
                ", the samples a second",
            )
        )
    return rate
