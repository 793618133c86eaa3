"""Interface of the commands that a batch runs on each log."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from zerorate.record.names import canonical_unit
from zerorate.units import kind

if TYPE_CHECKING:
    from zerorate.tasks.batch.task import Settings

LogPath = Path | str
"""Log of a batch: a file, or its address in an object store."""

Row = Mapping[str, str | float | int | bool | None]
"""Measures of one axis by column; None for a measure without a meaning."""


class LogOutput(NamedTuple):
    """Output of a log: one row for each axis, and notes."""

    rows: tuple[Row, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Quantity:
    """Column in which logs are compared with each other.

    Parameters
    ----------
    column : str
        Name of the column.
    unit : str
        Unit of the column; ``{}`` is replaced by the log's unit.
    sigma : str, optional
        Column with the standard error.
    signed : bool
        True if values can be negative; then logs are compared by differences instead of ratios.
    two_sided : bool
        True if small values are outliers, too.
    """

    column: str
    unit: str
    sigma: str | None = None
    signed: bool = False
    two_sided: bool = False


@dataclass(frozen=True)
class Command:
    """Command that a batch runs on each log.

    Parameters
    ----------
    name : str
        Name of the command.
    mark : str
        Text that is added to the log's name for its files.
    ending : callable
        Function of the format that returns the rest of the output's name.
    work : callable
        Function of settings, log and output; it writes the output and returns rows and notes.
    columns : mapping of str to type
        Types of the columns, except axis and unit: int, float, bool or str.
    quantities : tuple of Quantity
        Quantities that are compared between logs.
    """

    name: str
    mark: str
    ending: Callable[[str], str]
    work: Callable[["Settings", LogPath, Path], LogOutput]
    columns: Mapping[str, type]
    quantities: tuple[Quantity, ...]

    def paths(self, log: Path, format: str) -> tuple[Path, Path]:
        """Return the paths of the output and its record for a log with this name."""
        base = f"{log.stem}{self.mark}"
        return log.with_name(f"{base}{self.ending(format)}"), log.with_name(f"{base}.json")


def recording_arguments(reading: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments of `zerorate.read_recording`, with a unit for each sensor."""
    arguments = dict(reading)
    if arguments["unit"] is not None:
        units = map(canonical_unit, arguments["unit"].split(","))
        arguments["unit"] = {
            "accel" if kind(unit) == "acceleration" else "gyro": unit for unit in units
        }
    return arguments


def finite_or_none(value: float) -> float | None:
    """Return a measure; None if it is NaN or infinite, because JSON has neither."""
    return float(value) if math.isfinite(value) else None
