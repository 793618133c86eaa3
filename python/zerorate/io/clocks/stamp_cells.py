"""Stamps in the cells of lines that come one by one: seconds since the first, as a log's are."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, Self

import numpy as np

from zerorate.io.clocks.iso8601 import is_date, parse_date_column
from zerorate.io.clocks.names import find_time_unit
from zerorate.io.clocks.stamps import DAY_S, WRAP_COUNTS, is_wrap
from zerorate.io.clocks.units import DATE_RANGE_S, PER_SECOND, SAMPLES
from zerorate.record.log import LogError

_DECIMAL_UNITS: Final = ("s", "ms", "us", "ns")
_MIDNIGHT_PART: Final = 0.01
"""Part of a day within which a step back of a day is midnight."""


class StampCells:
    """Reads stamps: numbers of any unit, whole ones exactly, dates and times of day.

    The unit is the one stated, else the one of the column's name; else the one in which the first
    step that is none of zero is nearest to a period of the rate. Counters that wrap at 2^16, 2^24,
    2^31 or 2^32, and times of day that pass midnight, go on.

    Parameters
    ----------
    rate : float
        Rate stated, Hz.
    unit : str, optional
        Unit stated, of `zerorate.io.clocks.units.TIME_UNITS`.
    name : str, optional
        Name of the column.

    Examples
    --------
    >>> from zerorate.io.clocks.stamp_cells import StampCells
    >>> cells = StampCells(100.0, "us")
    >>> [cells.seconds(cell) for cell in ("4294957296", "4294967295", "9999")]
    [0.0, 0.009999, 0.019999]
    """

    def __init__(self, rate: float, unit: str | None = None, name: str | None = None) -> None:
        self._rate = rate
        self._first: float | None = None
        self._last: float = 0
        # Counts to subtract from a stamp, and their number a second.
        self._zero: float = 0
        self._per_second: float | None = None
        self.wrap_count = 0
        self._set_unit(unit or (None if name is None else find_time_unit(name)))

    @property
    def start(self) -> float:
        """Time of the first stamp, s."""
        return 0.0 if self._first is None else float(self._first) / (self._per_second or 1.0)

    def seconds(self, cell: str) -> float | None:
        """Return seconds since the first stamp, None where a stamp is missing.

        Raises
        ------
        LogError
            If the cell holds no time.
        """
        count = int(cell) if cell.isdecimal() else self._parse_count(cell)
        if count is None:
            return None
        if self._per_second is None or self._first is None or count < self._last:
            self._update_reference(count)
        self._last = count
        return (count - self._zero) / (self._per_second or 1.0)

    def _update_reference(self, count: float) -> None:
        """Begin, find the unit, or go on where a counter wrapped."""
        if self._first is None:
            self._first = self._last = self._zero = count
            if self._per_second is None and DATE_RANGE_S[0] <= count < DATE_RANGE_S[1]:
                self._set_unit("s")
        elif count < self._last:
            self._unwrap(count)
        elif count > self._last and self._per_second is None:
            self._set_unit(self._guess_unit(count - self._last))

    def _set_unit(self, unit: str | None) -> None:
        if unit is not None:
            self._per_second = self._rate if unit == SAMPLES else PER_SECOND[unit]

    def state(self) -> dict[str, Any]:
        """Return the state, as JSON stores it."""
        return dict(vars(self))

    @classmethod
    def of_state(cls, rate: float, state: Mapping[str, Any]) -> Self:
        """Return the stamps of a state; ValueError if it is of none."""
        cells = cls(rate)
        if vars(cells).keys() != state.keys() or state["_rate"] != rate:
            raise ValueError("the state is that of other stamps")
        vars(cells).update(state)
        return cells

    def _parse_count(self, cell: str) -> float | None:
        """Return the number in a cell, exact where it is whole; None where it is missing."""
        try:
            return int(cell) if cell[1:].isdecimal() else _finite_or_none(float(cell or "nan"))
        except ValueError:
            return self._parse_date(cell)

    def _parse_date(self, cell: str) -> int:
        if not is_date(cell):
            raise LogError("its time is no number and no date")
        self._set_unit("ns")
        times = parse_date_column(np.array([cell], dtype=object), "time")
        return int(times.astype(f"{times.dtype.str[:2]}8[ns]").view(np.int64)[0])

    def _unwrap(self, count: float) -> None:
        """Go on where a counter wrapped, or a day ended."""
        per_second = self._per_second or 1.0
        day = DAY_S * per_second
        wraps = [w for w in WRAP_COUNTS if is_wrap(w, self._last, count, per_second / self._rate)]
        midnight = abs(count - self._last + day) < _MIDNIGHT_PART * day
        if midnight and 0 <= count < _MIDNIGHT_PART * day:
            wraps.append(round(day))
        if wraps:
            self._zero -= wraps[0]
            self.wrap_count += 1

    def _guess_unit(self, step: float) -> str:
        """Return the unit in which a step is nearest to a period of the rate."""
        periods = {unit: step * self._rate / PER_SECOND[unit] for unit in _DECIMAL_UNITS}
        return min(periods, key=lambda unit: abs(math.log(periods[unit])))


def _finite_or_none(number: float) -> float | None:
    return number if math.isfinite(number) else None
