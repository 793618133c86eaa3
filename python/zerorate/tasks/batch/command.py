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

Row = Mapping[str, str | float | int | bool | None]
"""Measures of one axis by the names of the columns; None where a number means nothing."""


class LogOutput(NamedTuple):
    """Result of a log: one row an axis, and notes."""

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
        Its unit, with ``{}`` for that of the log.
    sigma : str, optional
        The column of its standard error.
    signed : bool
        True if it has either sign: logs are compared by differences, not by ratios.
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
        What the names of its files add to the name of the log.
    ending : callable
        Gives the rest of the output's name, by the requested format.
    work : callable
        Reads a log by the settings, writes the output, and returns rows and notes.
    columns : mapping of str to type
        Those of the rows next to axis and unit: int, float, bool or str.
    quantities : tuple of Quantity
        In what a log may stand out.
    """

    name: str
    mark: str
    ending: Callable[[str], str]
    work: Callable[["Settings", Path, Path], LogOutput]
    columns: Mapping[str, type]
    quantities: tuple[Quantity, ...]

    def paths(self, log: Path, format: str) -> tuple[Path, Path]:
        """Return the output and its record for a log of this name, in the same folder."""
        base = f"{log.stem}{self.mark}"
        return log.with_name(f"{base}{self.ending(format)}"), log.with_name(f"{base}.json")


def recording_arguments(reading: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments of `zerorate.read_recording`, for which a unit belongs to a sensor."""
    arguments = dict(reading)
    if arguments["unit"] is not None:
        units = map(canonical_unit, arguments["unit"].split(","))
        arguments["unit"] = {
            "accel" if kind(unit) == "acceleration" else "gyro": unit for unit in units
        }
    return arguments


def finite_or_none(value: float) -> float | None:
    """Return a measure as a record keeps it: JSON knows neither NaN nor infinity."""
    return float(value) if math.isfinite(value) else None
