"""The beginning of a navigation: axes, clock, antenna and start, found where nothing states them.

The task, the report and the outages begin here, so that all of them navigate alike.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any, Final, Literal, Self, TypeAlias

import numpy as np
import numpy.typing as npt

from zerorate._native import NavigationFilter
from zerorate.faults import ArgumentError, Sentence, given, said
from zerorate.navigation.alignment import Alignment, align
from zerorate.navigation.axes import Axes
from zerorate.navigation.clock import find_time_offset
from zerorate.navigation.selfcheck import (
    NavigationChecks,
    NavigationFinding,
    check_navigation,
)
from zerorate.navigation.start import find_start
from zerorate.record.fixes import Fixes
from zerorate.record.mounting import Mounting, body_axes, rotation
from zerorate.record.offset import TimeOffset
from zerorate.record.recording import Recording
from zerorate.types import Floats

Mount: TypeAlias = npt.ArrayLike | Literal["auto", "none"]
"""Rotation from the sensors' axes to the body's; to be found; or the axes are the body's."""
Offset: TypeAlias = float | TimeOffset | Literal["auto"]
"""What is added to the times of fixes, s, or that it is to be found."""
Heading: TypeAlias = float | Literal["course"] | None
"""At the start, rad from north over east; the direction of the first motion; or to be found."""

_STATED_SIGMA_M: Final = 0.05
_UNKNOWN_SIGMA_M: Final = 1.0
"""Standard deviation of an antenna's place that is stated, and of one that is not."""
_COARSE_S: Final = 1.0
"""Difference of two clocks from which on they were never meant to be one."""
_MIN_TURN: Final = math.radians(3.0)
"""Rotation below which found axes are left alone: a road slopes by as much."""
_MIN_OFFSET_S: Final = 0.02
"""Offset of a clock below which it is left alone."""


@dataclass(frozen=True, eq=False)
class Vehicle:
    """What is stated of a vehicle, by a person or by the metadata of its recording.

    Attributes
    ----------
    matrix : ndarray, shape (3, 3), or None
        Rotation from the sensors' axes to forward, right, down; None where nothing states it.
    plain : bool
        The axes of the sensors are said to be those of the body.
    antenna : ndarray, shape (3,)
        From the sensors to the antenna, m; zero where nothing states it.
    antenna_sigma : float
        Its standard deviation, m.
    time_offset : float or TimeOffset
        To be added to the times of fixes, s; zero where nothing states it.
    offset_from : {"argument", "metadata", ""}
        Who states it.
    note : str
        A sentence on what the metadata state.
    """

    matrix: Floats | None
    plain: bool
    antenna: Floats
    antenna_sigma: float
    time_offset: float | TimeOffset
    offset_from: Literal["argument", "metadata", ""]
    note: str

    @classmethod
    def of(
        cls,
        recording: Recording,
        mount: Mount,
        antenna: npt.ArrayLike | None,
        time_offset: Offset,
    ) -> Self:
        """Return what arguments state, and metadata where these state nothing."""
        stated = recording.mounting or Mounting()
        automatic = isinstance(mount, str) and mount == "auto"
        matrix = stated.body_from_sensor if automatic else _matrix(mount)
        arm = stated.antenna if antenna is None else _arm(antenna)
        typed = not isinstance(time_offset, str)
        own = stated.time_offset
        offset = time_offset if not isinstance(time_offset, str) else (own or 0.0)
        used = {
            "mounting": automatic and matrix is not None,
            "antenna": antenna is None and arm is not None,
            "time offset": not typed and own is not None,
        }
        lever = np.zeros(3) if arm is None else arm
        return cls(
            matrix,
            isinstance(mount, str) and mount == "none",
            lever,
            _UNKNOWN_SIGMA_M if arm is None else _STATED_SIGMA_M,
            offset,
            "argument" if typed else "" if own is None else "metadata",
            _on_metadata(recording, used, lever, own),
        )

    def checked(self, recording: Recording, fixes: Fixes) -> NavigationChecks:
        """Return what sensors and fixes say of each other, in the axes that are stated."""
        body = recording if self.matrix is None else body_axes(recording, self.matrix)
        offset = TimeOffset.of(self.time_offset)
        return check_navigation(body, fixes, time_offset=offset.seconds)

    def turned(self, checks: NavigationChecks) -> Floats | None:
        """Return the axes that the motion shows, where nothing states them and they are certain."""
        axes = checks.axes
        if self.matrix is not None or self.plain or axes is None or not axes.certain:
            return None
        return axes.body_from_sensor if axes.turn > max(_MIN_TURN, 3.0 * axes.yaw_sigma) else None

    def mistakes(self, checks: NavigationChecks) -> tuple[NavigationFinding, ...]:
        """Return the mistakes, without axes that `find_beginning` turns as the motion shows."""
        found = self.turned(checks) is not None
        return tuple(one for one in checks.mistakes if one.what != "mount" or not found)


@dataclass(frozen=True, eq=False)
class Beginning:
    """Where and how a navigation begins, as `find_beginning` returns it.

    Attributes
    ----------
    recording : Recording
        In the axes of the body: forward, right, down.
    start : Alignment
        For `zerorate.NavigationFilter`.
    time_offset : float or TimeOffset
        To be added to the times of the fixes, s.
    clock : TimeOffset or None
        The offset with which sensors and fixes fit best; None where it is not identifiable.
    antenna : ndarray, shape (3,)
        From the sensors to the antenna, m, and in ``antenna_sigma`` its standard deviation.
    checks : NavigationChecks
        What sensors and fixes say of each other.
    alarms, notes : tuple of str
        What contradicts the recording, and what was found or assumed.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=120.0, seed=1)
    >>> begun = zr.navigation.find_beginning(drive.recording(), drive.fixes)
    >>> nav = begun.filter(gate=30.0)
    >>> track = nav.process(begun.recording, drive.fixes, time_offset=begun.time_offset)
    """

    recording: Recording
    start: Alignment
    time_offset: float | TimeOffset
    clock: TimeOffset | None
    antenna: Floats
    antenna_sigma: float
    checks: NavigationChecks
    alarms: tuple[str, ...]
    notes: tuple[str, ...]

    def filter(self, **options: Any) -> NavigationFilter:  # noqa: ANN401
        """Return a filter that begins so, with further options of `zerorate.NavigationFilter`."""
        spread = {"antenna_sigma": self.antenna_sigma, **options}
        return NavigationFilter(self.start, antenna=self.antenna, **spread)


def find_beginning(
    recording: Recording,
    fixes: Fixes,
    *,
    mount: Mount = "auto",
    antenna: npt.ArrayLike | None = None,
    time_offset: Offset = "auto",
    heading: Heading = None,
    rest: tuple[float, float] | None = None,
    checks: NavigationChecks | None = None,
    alarms: list[str] | None = None,
    **options: Any,  # noqa: ANN401
) -> Beginning:
    """Find axes, clock and start of a navigation, where neither arguments nor metadata state them.

    Parameters
    ----------
    recording : Recording
        With a gyro and an accelerometer, in the axes of the sensors.
    fixes : Fixes
        Of the receiver.
    mount : array_like, shape (3, 3), "auto" or "none"
        Rotation from the sensors' axes to forward, right, down. "auto": as the recording's metadata
        say, or else as the motion shows it. "none": the sensors' axes are the body's.
    antenna : array_like, shape (3,), optional
        From the sensors to the antenna, m forward, right, down. Default: as the metadata say, or at
        the sensors, with a standard deviation of 1 m.
    time_offset : float, TimeOffset or "auto"
        Added to the times of the fixes, s. "auto": as sensors and fixes fit best.
    heading : float or "course", optional
        As of `find_start`, rad.
    rest : tuple of float, optional
        When the vehicle stands at the start, s after the first sample. Default: found.
    checks : NavigationChecks, optional
        Of a longer part of the recording, where that was checked before.
    alarms : list of str, optional
        Where alarms are added as soon as they are known, before a fault that may come of them.
    **options
        Of `zerorate.NavigationFilter`, with which clock and heading are found.

    Raises
    ------
    LogError
        If there is no start, or a sensor is missing.
    ValueError
        If an argument is out of range.

    Examples
    --------
    >>> import zerorate as zr
    >>> from zerorate.navigation import find_beginning
    >>> drive = zr.simulate_drive(duration=180.0, seed=5)
    >>> begun = find_beginning(drive.recording(), drive.fixes.shifted(0.3))
    >>> round(zr.record.TimeOffset.of(begun.time_offset).seconds, 1)
    -0.3
    """
    vehicle = Vehicle.of(recording, mount, antenna, time_offset)
    found = checks or vehicle.checked(recording, fixes)
    said_first = tuple(_alarms(found, vehicle))
    if alarms is not None:
        alarms.extend(said_first)
    matrix = vehicle.turned(found) if vehicle.matrix is None else vehicle.matrix
    body = recording if matrix is None else body_axes(recording, matrix)
    search = _Search(body, fixes, vehicle, heading, rest, options)
    start, offset, clock, sentence = search.begun(found)
    on_axes = "" if vehicle.matrix is not None or matrix is None else _on_axes(found.axes)
    doubts = (one.text for one in found.findings if one.status == "cannot tell")
    notes = (vehicle.note, on_axes, *doubts, sentence)
    return Beginning(
        body,
        start,
        offset,
        clock,
        vehicle.antenna,
        vehicle.antenna_sigma,
        found,
        said_first,
        tuple(filter(None, notes)),
    )


def _alarms(checks: NavigationChecks, vehicle: Vehicle) -> Iterator[str]:
    """Yield a line for each mistake, with what is done about it or may be typed."""
    for one in vehicle.mistakes(checks):
        advice: str | Sentence = ""
        if one.what == "mount":
            advice = said(": ", given("mount", "", "mount"), " says how")
        elif one.what == "clock" and not vehicle.offset_from:
            advice = ": they are moved by that"
        elif one.what == "clock":
            advice = said(": ", given("time_offset", "auto", "time_offset='auto'"), " moves them")
        yield said(f"{checks.source}: {one.text}", advice)


@dataclass(frozen=True, eq=False)
class _Search:
    """The search for a start and a clock, in the axes of the body."""

    recording: Recording
    fixes: Fixes
    vehicle: Vehicle
    heading: Heading
    rest: tuple[float, float] | None
    options: dict[str, Any]

    def begun(
        self, checks: NavigationChecks
    ) -> tuple[Alignment, float | TimeOffset, TimeOffset | None, str]:
        """Return where the filter begins, on which clock, which fits best, and a sentence on it."""
        vehicle = self.vehicle
        stated = vehicle.time_offset
        if isinstance(stated, TimeOffset):
            return self._start(stated), stated, None, ""
        about = stated
        if not vehicle.offset_from and abs(checks.lag) > _COARSE_S:
            about = checks.lag
        start = self._start(about)
        found = self._clock(start, about)
        if found is None or not found.differs(about, _MIN_OFFSET_S):
            return start, about, found, ""
        values = ", ".join(f"{name} {x:.3g} (sigma {s:.1g})" for name, x, s in found.parts)
        if vehicle.offset_from == "argument":
            automatic = given("time_offset", "auto", "time_offset='auto'")
            fit = f"the fixes fit best with {values}, not {stated:g} s: "
            return start, about, found, said(fit, automatic)
        sentence: str = f"the clock is as sensors and fixes fit best: {values}"
        if vehicle.offset_from:
            typed = given("time_offset", f"{stated:g}")
            not_it = f"{sentence}; not {stated:g} s, as the metadata say: "
            sentence = said(not_it, typed, " takes that")
        return self._start(found), found, found, sentence

    def _start(self, offset: float | TimeOffset) -> Alignment:
        if self.rest is None:
            return find_start(
                self.recording,
                self.fixes,
                heading=self.heading,
                time_offset=offset,
                antenna=self.vehicle.antenna,
                **self._without("antenna_sigma"),
            )
        gyro = self.recording.gyro
        first = 0.0 if gyro is None else float(gyro.time[0])
        return align(
            self.recording,
            latitude=float(self.fixes.position[0, 0]),
            heading="course" if self.heading is None else self.heading,
            span=(first + self.rest[0], first + self.rest[1]),
        )

    def _clock(self, start: Alignment, about: float) -> TimeOffset | None:
        """Return the clock of the fixes, None where it is not identifiable."""
        options = self._without("gate", "adapt", "antenna_sigma")
        try:
            found = find_time_offset(
                self.recording,
                self.fixes,
                start,
                time_offset=about,
                antenna=self.vehicle.antenna,
                **options,
            )
        except ValueError:
            # A receiver without velocities does not show it.
            return None
        return found if found.identifiable else None

    def _without(self, *names: str) -> dict[str, Any]:
        return {name: value for name, value in self.options.items() if name not in names}


def _matrix(mount: Mount) -> Floats | None:
    if isinstance(mount, str):
        if mount != "none":
            text = f"must be a rotation, 'auto' or 'none', got {mount!r}"
            raise ArgumentError("mount", text)
        return None
    return rotation(mount)


def _arm(antenna: npt.ArrayLike) -> Floats:
    try:
        arm = np.asarray(antenna, dtype=np.float64)
    except (TypeError, ValueError):
        arm = np.empty(0)
    if arm.shape != (3,) or not np.isfinite(arm).all():
        raise ArgumentError("antenna", f"must be three finite numbers, got {antenna!r}")
    return arm


def _on_metadata(
    recording: Recording, used: dict[str, bool], arm: Floats, offset: float | None
) -> str:
    named = [name for name, there in used.items() if there]
    if not named:
        return ""
    values = f"antenna {', '.join(f'{x:g}' for x in arm)} m"
    if offset is not None:
        values += f", time offset {offset:g} s"
    listed = " and ".join(filter(None, (", ".join(named[:-1]), named[-1])))
    return f"{listed} by the metadata of {PurePath(recording.source).name} ({values})"


def _on_axes(axes: Axes | None) -> str:
    if axes is None:
        return ""
    forward = f"{math.degrees(axes.yaw):.1f} deg (sigma {math.degrees(axes.yaw_sigma):.1f})"
    tilt = math.degrees(math.acos(max(-1.0, min(1.0, float(axes.body_from_sensor[2, 2])))))
    plain = given("mount", "none", "mount='none'")
    found = (
        f"axes by the motion, for nothing states them: forward is {forward} to the right of the "
        f"sensors' x, down {tilt:.1f} deg from their z; "
    )
    return said(found, plain, " leaves them")
