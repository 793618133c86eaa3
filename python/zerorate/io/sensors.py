"""Gyros and accelerometers of one file, each as a log of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from zerorate.io.columns import looks_like_accelerometer, looks_like_gyro, looks_like_sensor
from zerorate.io.errors import LogError
from zerorate.io.log import Log
from zerorate.io.quantity import canonical_unit, common_unit, split_unit
from zerorate.io.reading import Group, read_groups
from zerorate.io.sources import LogSource

__all__ = ["read_sensors"]

_KIND: Final = {
    "rad/s": "angular rate",
    "deg/s": "angular rate",
    "deg/h": "angular rate",
    "g": "acceleration",
    "m/s^2": "acceleration",
}

_KINDS: Final = tuple(dict.fromkeys(_KIND.values()))


def read_sensors(
    source: LogSource,
    rate: float | None = None,
    columns: Sequence[str | int] | None = None,
    units: Sequence[str] = (),
    topic: str | None = None,
) -> tuple[Log, ...]:
    """Return the gyros of a recording as one log, and its accelerometers as another.

    Parameters
    ----------
    source, rate, topic
        As of `read_log`.
    columns
        Names or indices. By default every column named like a gyro or an accelerometer; in a
        table without names every column but the time.
    units
        Where the file does not say them: at most one of an angular rate and one of an
        acceleration. A column that neither its name nor its suffix places is of the first.

    Returns
    -------
    tuple of Log
        One or two, on one clock: gyros first.

    Raises
    ------
    LogError, ValueError, TypeError, OSError, ImportError
        As `read_log`, and if two units of one kind, or of a kind without columns, are given.
    """
    given = _by_kind([canonical_unit(unit) for unit in units])

    def grouped(names: list[str], file_unit: str | None) -> list[Group]:
        return _groups(names, file_unit, given)

    return tuple(read_groups(source, rate, columns, grouped, looks_like_sensor, topic))


def _by_kind(units: list[str]) -> dict[str, str]:
    given = {_KIND[unit]: unit for unit in units}
    if len(given) < len(units):
        raise ValueError(f"unit= takes one unit of each kind, got {', '.join(units)}")
    return given


def _groups(names: list[str], file_unit: str | None, given: dict[str, str]) -> list[Group]:
    fallback = next(iter(given), _KIND.get(file_unit or "", "angular rate"))
    kinds = [_kind(name, fallback) for name in names]
    for kind, unit in given.items():
        if kind not in kinds:
            raise LogError(f"unit '{unit}' was given, but no column holds an {kind}")
    groups = []
    for kind in (kind for kind in _KINDS if kind in kinds):
        places = tuple(i for i, own in enumerate(kinds) if own == kind)
        # What the file says of its unit is of no help to the other kind.
        stated = file_unit if _KIND.get(file_unit or "", kind) == kind else None
        unit = common_unit([names[i] for i in places], given.get(kind), stated)
        groups.append(Group(places, unit))
    return groups


def _kind(name: str, fallback: str) -> str:
    unit = split_unit(name)[1]
    if unit is None:
        tests = zip(_KINDS, (looks_like_gyro, looks_like_accelerometer), strict=True)
        return next((kind for kind, looks_like in tests if looks_like(name)), fallback)
    if unit not in _KIND:
        raise LogError(f"column '{name}' is in {unit}, expected an angular rate or an acceleration")
    return _KIND[unit]
