"""Channels of aids for navigation: named by the user, or found in a recording."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, MutableMapping
from dataclasses import dataclass
from typing import Any, Final, Literal, Self, TypeAlias, TypedDict

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.io.reading import read_log
from zerorate.navigation.aid_channels import PRESSURE_UNITS, Channel
from zerorate.navigation.aids import Aid
from zerorate.record.log import Log
from zerorate.record.recording import Recording
from zerorate.record.samples import Samples
from zerorate.tasks.source import Source

Readings: TypeAlias = str | npt.ArrayLike | Aid | None
"""Readings of an aid: name of a column, values at the gyro's samples, or values with times."""
AidChoice: TypeAlias = Literal["auto", "stated"]
""""auto": use aids that are found by name, too; "stated": use only aids in arguments."""

_SI_UNITS: Final = {"pressure": "Pa", "height": "m", "heading": "rad", "baseline": "m"}
_ARGUMENTS: Final = {
    "pressure": "pressure",
    "height": "baro_height",
    "heading": "compass",
    "baseline": "baseline_columns",
}
"""Arguments of `zerorate.navigate` for each kind of aid."""


class AidArguments(TypedDict, total=False):
    """Arguments of `zerorate.navigate` on readings of aids."""

    pressure: Readings
    pressure_unit: str | None
    baro_height: Readings
    compass: Readings
    compass_unit: str | None
    baseline_columns: Readings
    aids: AidChoice
    mag: bool
    baseline: npt.ArrayLike | None
    limits: Mapping[str, float] | None


@dataclass(frozen=True, eq=False)
class AidRequest:
    """Aids named by the user, their units, and a flag to find others by name."""

    pressure: Readings = None
    height: Readings = None
    heading: Readings = None
    baseline: Readings = None
    pressure_unit: str | None = None
    compass_unit: str | None = None
    choice: AidChoice = "auto"

    @classmethod
    def take(cls, options: MutableMapping[str, Any]) -> Self:
        """Remove the arguments on aids from the options, and return them as a request."""
        fields = {argument: kind for kind, argument in _ARGUMENTS.items()} | {"aids": "choice"}
        names = (*fields, "pressure_unit", "compass_unit")
        return cls(
            **{fields.get(name, name): options.pop(name) for name in names if name in options}
        )

    def __post_init__(self) -> None:
        """Check the arguments."""
        if self.choice not in ("auto", "stated"):
            raise ArgumentError("aids", f"must be 'auto' or 'stated', got {self.choice!r}")
        if self.pressure_unit not in (None, *PRESSURE_UNITS):
            listed = ", ".join(PRESSURE_UNITS)
            raise ArgumentError(
                "pressure_unit", f"must be one of {listed}, got {self.pressure_unit!r}"
            )
        if self.compass_unit not in (None, "deg", "rad"):
            raise ArgumentError("compass_unit", f"must be deg or rad, got {self.compass_unit!r}")

    def channels(self, source: Source, recording: Recording) -> list[Channel]:
        """Return the channels, at most one per kind; pressure is preferred to height."""
        found = {channel.kind: channel for channel in self._find(source, recording)}
        if "pressure" in found and "height" in found and not found["height"].is_requested:
            del found["height"]
        return list(found.values())

    def _find(self, source: Source, recording: Recording) -> Iterator[Channel]:
        units = {"pressure": self.pressure_unit, "heading": self.compass_unit}
        for kind, argument in _ARGUMENTS.items():
            readings = getattr(self, kind)
            if readings is None and (self.choice == "stated" or kind not in recording):
                continue
            channel = (
                Channel.of(kind, recording[kind])
                if readings is None
                else _read(kind, argument, readings, source, recording)
            )
            unit = units.get(kind)
            yield channel if unit is None else channel._replace(unit=unit)


def _read(
    kind: str, argument: str, readings: str | npt.ArrayLike | Aid, source: Source, of: Recording
) -> Channel:
    """Return the channel from a column, values at the gyro's samples, or values with times."""
    if isinstance(readings, Aid):
        spread = np.asarray(readings.sigma)
        return Channel(
            kind,
            np.asarray(readings.time),
            np.asarray(readings.value),
            _SI_UNITS[kind],
            argument,
            True,
            None if np.isnan(spread).all() else spread,
        )
    if isinstance(readings, str):
        return Channel.of(kind, _read_column(argument, readings, source, of), True)
    time = Samples.of(of, mag=False, what="navigation").time
    values = np.asarray(readings, dtype=np.float64)
    expected = (len(time), 3) if kind == "baseline" else (len(time),)
    if values.shape != expected:
        raise ArgumentError(argument, f"must have shape {expected}, got {values.shape}")
    present = np.isfinite(values.reshape(len(time), -1)).all(axis=1)
    unit = "" if kind in ("pressure", "heading") else _SI_UNITS[kind]
    return Channel(kind, time[present], values[present], unit, argument, True)


def _read_column(argument: str, name: str, source: Source, of: Recording) -> Log:
    if name in of:
        return of[name]
    if isinstance(source, Recording | Log):
        listed = ", ".join(of)
        raise ArgumentError(argument, f"must name a log of the recording, {listed}, or be an array")
    return read_log(source, columns=name)
