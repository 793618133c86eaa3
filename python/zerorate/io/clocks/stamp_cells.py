"""Stamps in a stream of lines, converted to seconds since the first stamp as for a log."""

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
"""Tolerance around a backward step of one day that counts as midnight, days."""


class StampCells:
    """Reader of stamps: numbers in any unit, dates and times of day.

    The unit is the stated unit, or else the unit in the column's name. Without either, it is the
    unit in which the first non-zero step is closest to the period of the rate. Integers are exact.
    Times continue when a counter wraps at 2^16, 2^24, 2^31 or 2^32, and at midnight.

    Parameters
    ----------
    rate : float
        Stated rate, Hz.
    unit : str, optional
        Stated unit, one of `zerorate.io.clocks.units.TIME_UNITS`.
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
        # Counts to subtract from a stamp, and counts per second.
        self._zero: float = 0
        self._per_second: float | None = None
        self.wrap_count = 0
        self._set_unit(unit or (None if name is None else find_time_unit(name)))

    @property
    def start(self) -> float:
        """Time of the first stamp, s."""
        return 0.0 if self._first is None else float(self._first) / (self._per_second or 1.0)

    def seconds(self, cell: str) -> float | None:
        """Return the time since the first stamp, s; None if the stamp is missing.

        Raises
        ------
        LogError
            If the cell contains no time.
        """
        count = int(cell) if cell.isdecimal() else self._parse_count(cell)
        if count is None:
            return None
        if self._per_second is None or self._first is None or count < self._last:
            self._update_reference(count)
        self._last = count
        return (count - self._zero) / (self._per_second or 1.0)

    def _update_reference(self, count: float) -> None:
        """Set the first stamp, find the unit, or continue after a wrap."""
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
        """Return the state for JSON."""
        return dict(vars(self))

    @classmethod
    def of_state(cls, rate: float, state: Mapping[str, Any]) -> Self:
        """Return the reader with a saved state; ValueError if the state is not valid."""
        cells = cls(rate)
        if vars(cells).keys() != state.keys() or state["_rate"] != rate:
            raise ValueError("the state is that of other stamps")
        vars(cells).update(state)
        return cells

    def _parse_count(self, cell: str) -> float | None:
        """Return the number in a cell, exact for integers; None if it is missing."""
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
        """Continue after the wrap of a counter or the end of a day."""
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
        """Return the unit in which a step is closest to the period of the rate."""
        periods = {unit: step * self._rate / PER_SECOND[unit] for unit in _DECIMAL_UNITS}
        return min(periods, key=lambda unit: abs(math.log(periods[unit])))


def _finite_or_none(number: float) -> float | None:
    return number if math.isfinite(number) else None
