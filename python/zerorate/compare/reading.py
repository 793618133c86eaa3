"""Reading gyros together with what they are compared with."""

import os
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.compare.recording import Orientation, Recording, Reference
from zerorate.compare.slope import slope
from zerorate.io import Log, LogError
from zerorate.io.names import (
    UNKNOWN,
    canonical_unit,
    common_unit,
    looks_like_gyro,
    plain,
    split_unit,
)
from zerorate.io.reading import Group, read_groups
from zerorate.units import UNITS, convert

__all__ = ["read_recording"]

_QUATERNION: Final = re.compile(r"quat(ernion)?_?[wxyz]$")


def read_recording(
    path: str | os.PathLike[str],
    rate: float | None = None,
    columns: Sequence[str | int] | None = None,
    unit: str | None = None,
    reference: str | None = None,
    quaternion: Sequence[str] | None = None,
    topic: str | None = None,
) -> Recording:
    """Return the gyros of a log with the reference that it holds.

    Parameters
    ----------
    path, rate, columns, unit, topic
        As of `zerorate.read_log`.
    reference : str, optional
        Column of an angle or a rate about the axis of one gyro, from a shaft encoder or a rate
        table. It is a rate if its unit or its name says so, else an angle, in deg unless its name
        ends in rad. Scale and sign may differ from the gyro's.
    quaternion : sequence of str, optional
        Four columns w, x, y, z of the orientation from sensor to world. Unless `columns` are
        chosen, those whose names end so after ``quat``, such as ``ref_quat_w``, are found.

    Returns
    -------
    Recording
        In rad/s where the unit is known.

    Raises
    ------
    LogError, ValueError, OSError, ImportError
        As `zerorate.read_log`; also if a reference and a quaternion are given, one of them is not
        there or is not what its name says, or the gyros beside it are of no known unit.
    """
    request = _Request(columns, unit, reference, quaternion)
    gyros, *others = read_groups(path, rate, request.asked, request.groups, request.wants, topic)
    log = _in_si(gyros)
    if not others:
        return Recording(log)
    if log.unit != "rad/s":
        raise LogError(f"{path}: motion needs gyros of a known unit, got '{log.unit}'; give unit=")
    if reference is None:
        return Recording(log, orientation=Orientation(others[0].names, others[0].data))
    return Recording(log, Reference(reference, _reference_rate(path, others[0])))


class _Request:
    """Which columns are gyros, and which the truth."""

    def __init__(
        self,
        columns: Sequence[str | int] | None,
        unit: str | None,
        reference: str | None,
        quaternion: Sequence[str] | None,
    ) -> None:
        if reference is not None and quaternion is not None:
            raise ValueError("a log is compared with a reference or a quaternion, not with both")
        if quaternion is not None and len(quaternion) != 4:
            raise ValueError(f"a quaternion has four columns w, x, y, z, got {len(quaternion)}")
        self._unit = None if unit is None else canonical_unit(unit)
        self._truth = [reference] if reference is not None else list(quaternion or ())
        self.asked = None if columns is None else [*columns, *self._truth]

    def wants(self, name: str) -> bool:
        """Whether a column is read where none are chosen."""
        found = not self._truth and _is_quaternion(name)
        return looks_like_gyro(name) or name in self._truth or found

    def groups(self, names: list[str], file_unit: str | None) -> list[Group]:
        """Return the gyros and, where there is one, the truth."""
        for name in self._truth:
            if name not in names:
                raise LogError(f"there is no column '{name}'")
        truth = self._truth
        if not truth and self.asked is None:
            truth = _quaternion_of(names)
        gyros = [name for name in names if name not in truth]
        if not gyros:
            raise LogError("no column looks like a gyro; choose with columns=")
        groups = [_group(names, gyros, common_unit(gyros, self._unit, file_unit))]
        if truth:
            groups.append(_group(names, truth, split_unit(truth[0])[1] or UNKNOWN))
        return groups


def _group(names: list[str], wanted: Sequence[str], unit: str) -> Group:
    return Group(tuple(names.index(name) for name in wanted), unit)


def _is_quaternion(name: str) -> bool:
    return _QUATERNION.search(plain(name)) is not None


def _quaternion_of(names: list[str]) -> list[str]:
    """Return the columns w, x, y, z of the one quaternion, if there is one."""
    found = sorted(
        (plain(name)[:-1], plain(name)[-1], name) for name in names if _is_quaternion(name)
    )
    if not found:
        return []
    if [(stem, letter) for stem, letter, _ in found] != [(found[0][0], x) for x in "wxyz"]:
        listed = ", ".join(name for *_, name in found)
        raise LogError(f"these columns are not one quaternion w, x, y, z: {listed}")
    return [name for *_, name in found]


def _in_si(log: Log) -> Log:
    if log.unit not in UNITS or UNITS[log.unit].kind != "rate":
        return log
    return replace(log, data=convert(log.data, log.unit, "rad/s"), unit="rad/s")


def _reference_rate(path: str | os.PathLike[str], log: Log) -> npt.NDArray[np.float64]:
    """Return a reference in rad/s where its unit is known; an angle without one is in deg."""
    rate = _in_si(log)
    if rate.unit == "rad/s" or (log.unit == UNKNOWN and looks_like_gyro(log.names[0])):
        return rate.data[:, 0]
    unit = "deg" if log.unit == UNKNOWN else log.unit
    if unit not in UNITS or UNITS[unit].kind != "angle":
        raise LogError(f"{path}: column '{log.names[0]}' is in {unit}, expected an angle or a rate")
    return slope(convert(log.data[:, 0], unit, "rad"), log.rate)
