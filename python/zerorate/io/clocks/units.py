"""Unit of unnamed timestamps: the unit in which they are the clock of a sensor.

Each possible unit is tested by the dates that result, by the stated rate, and by the rate of the
rows. If two units remain, the error names both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.faults import Argument, keyword_argument, make_sentence
from zerorate.io.clocks.names import UNITS, has_time_name
from zerorate.record.log import LogError
from zerorate.types import Floats

Counts = npt.NDArray[np.float64 | np.int64]

PER_SECOND: Final = {
    "s": 1.0,
    "ms": 1e3,
    "us": 1e6,
    "ns": 1e9,
    "100us": 1e4,
    "min": 1 / 60,
    "h": 1 / 3600,
    "days": 1 / 86_400,
}
SAMPLES: Final = "samples"
TIME_UNITS: Final = (*PER_SECOND, SAMPLES)
"""Values of ``time_unit=``; samples are counted at the stated rate."""
_DECIMAL_UNITS: Final = ("s", "ms", "us", "ns")
"""Units of a clock without a stated unit; larger units need a name."""
DATE_RANGE_S: Final = (946_684_800, 4_102_444_800)
"""Unix times of the years 2000 and 2100, s; the ranges in different units do not overlap."""
_DAY_EPOCHS: Final = {
    "days since 1900": 25_569.0,
    "days since year 0": 719_529.0,
    "Julian days": 2_440_587.5,
}
"""Day number of 1 January 1970 in spreadsheets, in MATLAB and as Julian date."""
_MAX_DATED_STEP_S: Final = 60.0
"""Longest step of dates, s. Counters with the same numbers have longer steps."""
_MAX_STEP_DAYS: Final = 2.0 / 86_400
"""Longest step of day numbers; as seconds, they would have a rate above 43 kHz."""
_RATE_RANGE_HZ: Final = (0.5, 32_000.0)
"""Range of sampling rates of inertial sensors, Hz."""
_RATE_TOLERANCE: Final = 0.05
"""Largest relative difference between the rate of late stamps and a stated rate."""
_LAG_ROWS: Final = 512
"""Number of rows over which late and coarse stamps average out."""
_HEAD_ROWS: Final = 1 << 16
_MIN_MICROSECOND_STEP: Final = 8_000.0
"""Smallest SampleTimeFine step in microseconds: 120 Hz at most. Steps of 0.1 ms are smaller."""


class Unit(NamedTuple):
    """Counts per second, Unix time of zero, s, and a sentence on the origin, if any."""

    per_second: float
    epoch: float = 0.0
    note: str | None = None


class AmbiguousUnitError(LogError):
    """Error for timestamps that could have several units."""

    def __init__(self, message: str, units: tuple[str, ...]) -> None:
        """Store the possible units."""
        super().__init__(message)
        self.units = units


def check_time_unit(unit: str | None) -> str | None:
    """Return the standard spelling of a unit of time; a ValueError lists the known units."""
    if unit is None or unit in TIME_UNITS:
        return unit
    for known, spellings in UNITS.items():
        if isinstance(unit, str) and unit.lower() in spellings:
            return known
    raise ValueError(
        make_sentence(
            keyword_argument("time_unit"), f" must be one of {', '.join(TIME_UNITS)}, got {unit!r}"
        )
    )


def find_date_unit(name: str, first: float, since: Counts) -> tuple[str, Unit] | None:
    """Return the unit in which the stamps are dates of this century; None if there is none."""
    # One of three stamps may be an outlier.
    median_count = first + sorted(float(since[i]) for i in (0, len(since) // 2, -1))[1]
    for unit in _DECIMAL_UNITS:
        if DATE_RANGE_S[0] <= median_count / PER_SECOND[unit] < DATE_RANGE_S[1]:
            step = median_step(since)
            slow = step > _MAX_DATED_STEP_S * PER_SECOND[unit]
            # A counter since power-on can have the same numbers.
            counts = step * _RATE_RANGE_HZ[0] > PER_SECOND[unit] and not has_time_name(name)
            counts = counts and bool(plausible_units(step, since))
            return (
                None
                if slow or counts
                else (unit, Unit(PER_SECOND[unit], 0.0, _describe_dates(name, unit)))
            )
    for epoch_name, zero in _DAY_EPOCHS.items():
        dated = DATE_RANGE_S[0] <= 86_400 * (median_count - zero) < DATE_RANGE_S[1]
        if dated and 0.0 < median_step(since) <= _MAX_STEP_DAYS:
            note = _describe_dates(name, f"days ({epoch_name})")
            return "days", Unit(PER_SECOND["days"], -zero * 86_400, note)
    return None


def _describe_dates(name: str, unit: str) -> str:
    return f"time column '{name}' read as {unit}: in that unit it holds dates"


def find_rate_unit(name: str, step: float, rate: float) -> Unit | None:
    """Return the unit in which a step fits the stated rate; None if there is none."""
    for unit in _DECIMAL_UNITS:
        if abs(step * rate / PER_SECOND[unit] - 1) < _RATE_TOLERANCE:
            note = f"time column '{name}' read as {unit}, by the rate stated"
            return Unit(PER_SECOND[unit], 0.0, None if unit == "s" else note)
    return None


def find_unit(
    name: str,
    column: npt.NDArray[np.generic],
    step: float,
    unit_hint: Callable[[Sequence[str]], tuple[str, str] | None] | None,
) -> Unit:
    """Return the unit in which the step between rows fits an inertial sensor.

    Parameters
    ----------
    name, column
        Name and values of the timestamps.
    step
        Step between rows, counts.
    unit_hint
        Function that chooses a unit by another clock of the table, and returns that clock's name.

    Raises
    ------
    AmbiguousUnitError
        If two units are possible.
    LogError
        If no unit is possible.
    """
    prefix = f"time column '{name}' read as"
    if name.lower().replace("_", "").endswith("sampletimefine"):
        unit = "us" if step >= _MIN_MICROSECOND_STEP else "100us"
        return Unit(PER_SECOND[unit], 0.0, f"{prefix} {unit}, as its steps of {step:g} are")
    if step <= 0.0:
        return Unit(1.0)
    units = plausible_units(step, column)
    if units == ["s"] == _with_sensible_rate(step):
        return Unit(1.0)
    if len(units) == 1:
        note = f"{prefix} {units[0]}, by its step: {_format_rate(units[0], step)}"
        return Unit(PER_SECOND[units[0]], 0.0, note)
    if units and unit_hint is not None and (hint := unit_hint(units)) is not None:
        unit, other = hint
        return Unit(PER_SECOND[unit], 0.0, f"{prefix} {unit}, as column '{other}' shows")
    raise _make_unit_error(name, units, step)


def plausible_units(step: float, column: npt.NDArray[np.generic]) -> list[str]:
    """Return the units in which a step between rows fits the rate of a sensor."""
    units = _with_sensible_rate(step)
    if len(units) > 1 and _has_fractions(column):
        # Only seconds have decimals below one; other units count.
        return ["s"] if step < 0.5 and "s" in units else [u for u in units if u in ("s", "ms")]
    return units


def _with_sensible_rate(step: float) -> list[str]:
    return [
        u
        for u in _DECIMAL_UNITS
        if _RATE_RANGE_HZ[0] <= PER_SECOND[u] / step <= _RATE_RANGE_HZ[1] * 1.001
    ]


def _make_unit_error(name: str, units: Sequence[str], step: float) -> LogError:
    if not units:
        readings = " or ".join(f"{_format_rate(u, step)} in {u}" for u in ("s", "ms"))
        return LogError(
            make_sentence(
                f"time column '{name}' is in no unit the clock of a sensor of 0.5 Hz to 32 kHz (it "
                f"would be {readings}); ",
                keyword_argument("time_unit"),
                " says its unit",
            )
        )
    readings = " or ".join(f"{u} ({_format_rate(u, step)})" for u in units)
    counted = (
        ", or count samples (",
        unit_argument(SAMPLES),
        " and ",
        keyword_argument("rate"),
        ")",
    )
    counter = counted if step == 1.0 else ()
    first, *others = map(unit_argument, units)
    listed = [part for unit in others for part in (" or ", unit)]
    parts = (f"time column '{name}' may be in {readings}", *counter, ": say which by ")
    return AmbiguousUnitError(make_sentence(*parts, first, *listed), tuple(units))


def unit_argument(unit: str) -> Argument:
    """Return the argument that states a unit of timestamps."""
    return keyword_argument("time_unit", unit, f"time_unit={unit!r}")


def _format_rate(unit: str, step: float) -> str:
    return f"{PER_SECOND[unit] / step:.4g} Hz"


def _has_fractions(column: npt.NDArray[np.generic]) -> bool:
    if column.dtype.kind != "f":
        return False
    head: Floats = column[:_HEAD_ROWS].astype(np.float64)
    return bool((head != np.rint(head)).any())


def row_step(since: Counts) -> float:
    """Return the step between rows, insensitive to late, coarse and missing stamps, counts."""
    lag = min(_LAG_ROWS, max(1, len(since) // 8))
    if len(since) < 2:
        return 0.0
    head = slice(None, 4 * _HEAD_ROWS)
    lag_steps = (since[lag:][head] - since[:-lag][head]).astype(np.float64)
    typical = float(np.median(lag_steps)) / lag
    middle = median_step(since)
    # If hardly any step is shorter, rows are missing and none are late.
    return middle if middle > 0.0 and 0.5 * middle < typical < 2.0 * middle else typical


def median_step(since: Counts) -> float:
    """Return the median of the forward steps, 0 if there are none."""
    steps = np.diff(since[: 4 * _HEAD_ROWS]).astype(np.float64)
    steps = steps[steps > 0]
    return float(np.median(steps)) if steps.size else 0.0
