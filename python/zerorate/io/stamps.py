"""Timestamps of any unit to seconds since the first one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from zerorate.io.columns import plain
from zerorate.io.errors import LogError
from zerorate.io.steady import steps_between
from zerorate.io.table import Column

_PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
_SPELLINGS = {
    "s": ("s", "sec", "secs", "second", "seconds"),
    "ms": ("ms", "msec", "msecs", "millis"),
    "us": ("us", "µs", "usec", "usecs", "micros"),
    "ns": ("ns", "nsec", "nsecs", "nanos"),
}
_UNIT = {spelling: unit for unit, all_ in _SPELLINGS.items() for spelling in all_}
_LONGEST = 1e10
# The steps of clocks from 10 Hz to 10 kHz: one range a unit, seconds reaching down to 2 Hz.
_STEP_BELOW = (("s", 0.5), ("ms", 100.0), ("us", 1e5), ("ns", np.inf))


@dataclass(frozen=True)
class Stamps:
    """Seconds since the first stamp, shape (n,), the first stamp itself, and what was assumed."""

    seconds: npt.NDArray[np.float64]
    start: float
    note: str | None


def to_seconds(column: Column, name: str, rate: float | None) -> Stamps:
    """Return the stamps in seconds.

    The unit is that of the name's suffix; without one, that whose clock comes within 1 % of
    ``rate``; without that, the step decides: below 0.5 it is seconds, below 100 milliseconds,
    below 100 000 microseconds, and nanoseconds above.
    """
    if column.dtype.kind in "Mm":
        kind = "datetime64[ns]" if column.dtype.kind == "M" else "timedelta64[ns]"
        column, unit, assumed = column.astype(kind).view(np.int64), "ns", False
    else:
        column = _wide(column, name)
        known = _unit_of_name(name)
        unit, assumed = known or _unit_of_step(column, rate), known is None
    per_second = _PER_SECOND[unit]
    with np.errstate(over="ignore"):
        since = column - column[0] if column[0] else column
        seconds = since.astype(np.float64, copy=False)
    if per_second != 1.0:
        seconds = seconds / per_second
    if not np.ptp(seconds) < _LONGEST:
        raise LogError(f"time column '{name}' spans more than 300 years in {unit}")
    note = f"time column '{name}' read as {unit}, judged by its step" if assumed else None
    return Stamps(seconds, float(column[0]) / per_second, note if unit != "s" else None)


def _wide(column: Column, name: str) -> Column:
    if column.dtype.kind in "iu":
        return column.astype(
            np.int64, copy=False
        )  # nanoseconds of today's date do not fit a float64
    if column.dtype.kind != "f":
        raise LogError(f"time column '{name}' holds {column.dtype}, expected numbers")
    there = np.isfinite(column)
    if not there.all():
        bad = np.flatnonzero(~there)
        raise LogError(
            f"time column '{name}' is not finite in row {bad[0]} (counting from 0), "
            "expected a timestamp in every row"
        )
    return column.astype(np.float64, copy=False)


def _unit_of_name(name: str) -> str | None:
    words = plain(name).split("_")
    return _UNIT.get(words[-1]) if len(words) > 1 else None


def _unit_of_step(column: Column, rate: float | None) -> str:
    ends = steps_between(column)
    units = [_unit_of(step, rate) for step in ends or ()]
    # Nothing but that unit lies between two ends so close.
    if units and units[0] == units[1]:
        return units[0]
    steps = np.diff(column).astype(np.float64)
    steps = steps[steps > 0]
    return _unit_of(float(np.median(steps)), rate) if steps.size else "s"


def _unit_of(step: float, rate: float | None) -> str:
    if rate is not None:
        for unit, per_second in _PER_SECOND.items():
            if abs(step * rate / per_second - 1) < 0.01:
                return unit
    return next(unit for unit, bound in _STEP_BELOW if step < bound)
