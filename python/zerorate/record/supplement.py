"""Contents of a source other than its logs, each read at first access."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from zerorate.record.fixes import Fixes
    from zerorate.record.mounting import Mounting

TableColumns = Mapping[str, npt.NDArray[np.generic]]
Tables = Iterable[tuple[str, TableColumns]]
_T = TypeVar("_T")


def return_none() -> None:
    """Return None, for a part that a source does not have."""


def no_tables(prefixes: tuple[str, ...]) -> Tables:
    """Return no tables."""
    return ()


@dataclass(frozen=True, eq=False)
class Supplement:
    """Contents of a source other than its logs.

    Parameters
    ----------
    read_fixes, read_mounting, read_device : callable
        Readers of each part; they return None if the source does not have it.
    read_tables : callable
        Function that reads the tables with given name prefixes, with all columns.
    """

    read_fixes: Callable[[], Fixes | None] = return_none
    read_mounting: Callable[[], Mounting | None] = return_none
    read_device: Callable[[], str | None] = return_none
    read_tables: Callable[[tuple[str, ...]], Tables] = no_tables

    @classmethod
    def of(cls, *, fixes: Fixes | None = None, mounting: Mounting | None = None) -> Supplement:
        """Return the supplement with objects in memory."""
        return cls(partial(_identity, fixes), partial(_identity, mounting))

    @cached_property
    def fixes(self) -> Fixes | None:
        """The fixes of the receiver, read once."""
        return self.read_fixes()

    @cached_property
    def mounting(self) -> Mounting | None:
        """The mounting of the sensors, read once."""
        return self.read_mounting()

    def in_body_axes(self) -> Supplement:
        """Return the supplement for sensors already rotated to body axes: without the rotation."""
        return replace(self, read_mounting=partial(_without_rotation, self))


def _identity(value: _T) -> _T:
    return value


def _without_rotation(whole: Supplement) -> Any:  # noqa: ANN401  # its class imports recordings
    mounting = whole.mounting
    return None if mounting is None else replace(mounting, body_from_sensor=None)
