"""Contract of a command that a batch runs on each log."""

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
"""A log of a batch: a file, or its address in a store."""

Row = Mapping[str, str | float | int | bool | None]
"""Measures of one axis by the names of the columns; None where a number means nothing."""


class LogOutput(NamedTuple):
    """Result of a log: one row for each axis, and notes."""

    rows: tuple[Row, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Quantity:
    """A column in which logs are compared with each other.

    Parameters
    ----------
    column : str
        Its name.
    unit : str
        Its unit; ``{}`` stands for the log's unit.
    sigma : str, optional
        The column of its standard error.
    signed : bool
        True if values can be negative: logs are then compared by differences, not by ratios.
    two_sided : bool
        True if values below those of other logs are outliers, too.
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
        As users write it.
    mark : str
        Text that its file names add to the name of the log.
    ending : callable
        Returns the rest of the output's name for the requested format.
    work : callable
        Reads a log with the settings, writes the output, and returns rows and notes.
    columns : mapping of str to type
        Columns of the rows besides axis and unit: int, float, bool or str.
    quantities : tuple of Quantity
        Quantities in which a log can be an outlier.
    """

    name: str
    mark: str
    ending: Callable[[str], str]
    work: Callable[["Settings", LogPath, Path], LogOutput]
    columns: Mapping[str, type]
    quantities: tuple[Quantity, ...]

    def paths(self, log: Path, format: str) -> tuple[Path, Path]:
        """Return the paths of the output and of its record for a log of this name."""
        base = f"{log.stem}{self.mark}"
        return log.with_name(f"{base}{self.ending(format)}"), log.with_name(f"{base}.json")


def recording_arguments(reading: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments of `zerorate.read_recording`, where each sensor has its own unit."""
    arguments = dict(reading)
    if arguments["unit"] is not None:
        units = map(canonical_unit, arguments["unit"].split(","))
        arguments["unit"] = {
            "accel" if kind(unit) == "acceleration" else "gyro": unit for unit in units
        }
    return arguments


def finite_or_none(value: float) -> float | None:
    """Return a measure, or None if it is NaN or infinite, which JSON cannot hold."""
    return float(value) if math.isfinite(value) else None
