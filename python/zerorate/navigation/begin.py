"""Start of a navigation: finds axes, clock, antenna, alignment and noise, unless stated.

The task, the report and the outages all use this module, so that they navigate in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Any, Final, Literal, Self, TypeAlias

import numpy as np
import numpy.typing as npt

from zerorate._native import NavigationFilter
from zerorate.faults import ArgumentError, Sentence, keyword_argument, make_sentence
from zerorate.geometry.scipy_rotation import RotationLike
from zerorate.navigation.alignment import Alignment, align
from zerorate.navigation.axes import Axes
from zerorate.navigation.clock import find_time_offset
from zerorate.navigation.coarse_start import find_start
from zerorate.navigation.coasting import FoundNoise, find_noise
from zerorate.navigation.selfcheck import (
    NavigationChecks,
    NavigationFinding,
    check_navigation,
)
from zerorate.numerals import format_with_error, shorten
from zerorate.record.fixes import Fixes
from zerorate.record.mounting import Mounting, body_axes, check_rotation
from zerorate.record.offset import TimeOffset
from zerorate.record.recording import Recording
from zerorate.types import Floats

Mount: TypeAlias = RotationLike | Literal["auto", "none"]
"""Rotation from sensor axes to body axes; "auto" finds it; "none": both axes are the same."""
Offset: TypeAlias = float | TimeOffset | Literal["auto"]
"""Offset to add to the times of fixes, s; "auto" finds it."""
Heading: TypeAlias = float | Literal["course"] | None
"""Heading at the start, rad; "course": direction of the first motion; None: find it."""

ProcessNoise: TypeAlias = Literal["auto", "stated"]
"""Source of the process noise: errors while coasting, or the stated models."""

_STATED_SIGMA_M: Final = 0.05
_UNKNOWN_SIGMA_M: Final = 1.0
"""Standard deviation of the antenna position, m: stated position and unknown position."""
_SEPARATE_CLOCK_S: Final = 1.0
"""Clock difference, s, above which the fixes are treated as having their own clock."""
_MIN_MOUNT_ANGLE_RAD: Final = math.radians(3.0)
"""Smallest rotation for which estimated axes are used; the slope of a road can be as large."""
_MAX_NOISE_FACTOR: Final = 0.5
"""Factor on white noise below which clock and antenna are estimated a second time."""
_MIN_OFFSET_S: Final = 0.02
"""Smallest clock offset that is corrected, s."""


@dataclass(frozen=True, eq=False)
class Vehicle:
    """Mounting of the sensors in a vehicle, from arguments or from the recording's metadata.

    Attributes
    ----------
    matrix : ndarray, shape (3, 3), or None
        Rotation from the sensors' axes to forward, right, down. None if it is not stated.
    axes_are_body : bool
        True if the sensors' axes are stated to be the body's axes.
    antenna : ndarray, shape (3,)
        Vector from the sensors to the antenna, m. Zero if it is not stated.
    antenna_sigma : float
        Standard deviation of `antenna`, m.
    time_offset : float or TimeOffset
        Offset to add to the times of fixes, s. Zero if it is not stated.
    offset_source : {"argument", "metadata", ""}
        Source of `time_offset`.
    note : str
        A sentence that lists the values from the metadata.
    """

    matrix: Floats | None
    axes_are_body: bool
    antenna: Floats
    antenna_sigma: float
    time_offset: float | TimeOffset
    offset_source: Literal["argument", "metadata", ""]
    note: str

    @classmethod
    def of(
        cls,
        recording: Recording,
        mount: Mount,
        antenna: npt.ArrayLike | None,
        time_offset: Offset,
    ) -> Self:
        """Return the mounting. The metadata replace missing arguments."""
        stated = recording.mounting or Mounting()
        automatic = isinstance(mount, str) and mount == "auto"
        matrix = stated.body_from_sensor if automatic else _check_mount(mount)
        arm = stated.antenna if antenna is None else _check_antenna(antenna)
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
            _describe_metadata(recording, used, lever, own),
        )

    def check(self, recording: Recording, fixes: Fixes) -> NavigationChecks:
        """Check sensors and fixes against each other, in the stated axes."""
        body = recording if self.matrix is None else body_axes(recording, self.matrix)
        offset = TimeOffset.of(self.time_offset)
        return check_navigation(body, fixes, time_offset=offset.seconds)

    def estimate_mount(self, checks: NavigationChecks) -> Floats | None:
        """Return the axes estimated from motion, if they are certain and no axes were stated."""
        axes = checks.axes
        if self.matrix is not None or self.axes_are_body or axes is None or not axes.certain:
            return None
        return (
            axes.body_from_sensor
            if axes.turn > max(_MIN_MOUNT_ANGLE_RAD, 3.0 * axes.yaw_sigma)
            else None
        )

    def mistakes(self, checks: NavigationChecks) -> tuple[NavigationFinding, ...]:
        """Return the mistakes, without wrong axes that `find_beginning` corrects."""
        has_mount = self.estimate_mount(checks) is not None
        return tuple(
            finding for finding in checks.mistakes if finding.what != "mount" or not has_mount
        )


@dataclass(frozen=True, eq=False)
class Beginning:
    """Start of a navigation, as `find_beginning` returns it.

    Attributes
    ----------
    recording : Recording
        Recording, rotated to the body's axes forward, right, down.
    start : Alignment
        Alignment at the start, for `zerorate.NavigationFilter`.
    time_offset : float or TimeOffset
        Offset to add to the times of the fixes, s.
    clock : TimeOffset or None
        Clock offset at which sensors and fixes agree best. None if it cannot be identified.
    antenna : ndarray, shape (3,)
        Vector from the sensors to the antenna, m.
    antenna_sigma : ndarray, shape (3,)
        Standard deviations of `antenna`, m.
    consider_antenna : bool
        True if `antenna` was estimated together with the time offset. The filter then includes
        `antenna_sigma` but does not estimate the antenna.
    checks : NavigationChecks
        Results of the checks of sensors and fixes against each other.
    noise : FoundNoise or None
        Process noise, estimated from the errors while coasting. None if it was not estimated.
    alarms : tuple of str
        Sentences on contradictions in the recording.
    notes : tuple of str
        Sentences on estimates and assumptions.

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
    antenna_sigma: Floats
    consider_antenna: bool
    checks: NavigationChecks
    noise: FoundNoise | None
    alarms: tuple[str, ...]
    notes: tuple[str, ...]

    def filter(self, **options: Any) -> NavigationFilter:  # noqa: ANN401
        """Return a filter with this start and options of `zerorate.NavigationFilter`."""
        known = {"antenna_sigma": self.antenna_sigma, "consider_antenna": self.consider_antenna}
        options = {**known, **options}
        if self.noise is not None and not self.noise.kept:
            options |= self.noise.models
        return NavigationFilter(self.start, antenna=self.antenna, **options)


def find_beginning(
    recording: Recording,
    fixes: Fixes,
    *,
    mount: Mount = "auto",
    antenna: npt.ArrayLike | None = None,
    time_offset: Offset = "auto",
    heading: Heading = None,
    rest: tuple[float, float] | None = None,
    noise: ProcessNoise = "auto",
    checks: NavigationChecks | None = None,
    alarms: list[str] | None = None,
    **options: Any,  # noqa: ANN401
) -> Beginning:
    """Find axes, clock, alignment and noise of a navigation, unless they are stated.

    Parameters
    ----------
    recording : Recording
        Recording with a gyro and an accelerometer, in the axes of the sensors.
    fixes : Fixes
        Fixes of the receiver.
    mount : array_like, shape (3, 3), "auto" or "none"
        Rotation from the sensors' axes to forward, right, down. "auto" takes it from the
        recording's metadata, or else from the motion. "none" means that the sensors' axes are the
        body's axes.
    antenna : array_like, shape (3,), optional
        Vector from the sensors to the antenna: forward, right, down (m). Default: the recording's
        metadata, or else zero with a standard deviation of 1 m.
    time_offset : float, TimeOffset or "auto"
        Offset to add to the times of the fixes, s. "auto" finds the offset at which sensors and
        fixes agree best.
    heading : float or "course", optional
        Heading at the start, rad, as in `find_start`.
    rest : tuple of float, optional
        Start and end of the first rest, s after the first sample. Default: the rest is detected.
    noise : {"auto", "stated"}
        "auto" estimates the process noise with `find_noise`. "stated" uses the models in the
        options.
    checks : NavigationChecks, optional
        Results of earlier checks on a longer part of the recording. Default: the checks are run
        here.
    alarms : list of str, optional
        List that collects the alarms. Each alarm is added at once, even if an error follows.
    **options
        Options of `zerorate.NavigationFilter`. They apply while clock, heading and noise are
        estimated.

    Raises
    ------
    LogError
        If no start is found, or a sensor is missing.
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
    nav_checks = checks or vehicle.check(recording, fixes)
    first_alarms = tuple(_describe_mistakes(nav_checks, vehicle))
    if alarms is not None:
        alarms.extend(first_alarms)
    matrix = vehicle.estimate_mount(nav_checks) if vehicle.matrix is None else vehicle.matrix
    body = recording if matrix is None else body_axes(recording, matrix)
    search = _Search(body, fixes, vehicle, heading, rest, options)
    start, offset, clock, sentence = search.find_start_and_clock(nav_checks)
    arm = search.arm(clock, offset)
    found = search.find_noise(start, offset, arm) if noise == "auto" else None
    if clock is not None and found is not None and min(found.factors[:2]) < _MAX_NOISE_FACTOR:
        # Sensors that are better than assumed give a more accurate clock and antenna position.
        search = replace(search, options={**options, **found.white_models})
        start, offset, clock, sentence = search.find_start_and_clock(nav_checks)
        arm = search.arm(clock, offset)
    on_axes = (
        "" if vehicle.matrix is not None or matrix is None else _describe_axes(nav_checks.axes)
    )
    doubts = (finding.text for finding in nav_checks.findings if finding.status == "cannot tell")
    notes = (
        vehicle.note, on_axes, *doubts, sentence, arm.note, "" if found is None else str(found),
    )  # fmt: skip
    return Beginning(
        body,
        start,
        offset,
        clock,
        arm.place,
        arm.sigma,
        arm.is_found,
        nav_checks,
        found,
        first_alarms,
        tuple(filter(None, notes)),
    )


@dataclass(frozen=True, eq=False)
class _Arm:
    """Antenna position, m, with its standard deviation; the filter estimates or considers it."""

    place: Floats
    sigma: Floats
    is_found: bool
    note: str = ""

    @classmethod
    def found(cls, clock: TimeOffset) -> _Arm:
        """Return the antenna position that was estimated together with a clock."""
        place, sigma = np.array(clock.antenna), np.array(clock.antenna_sigma)
        fitted = ", ".join(map(format_with_error, place, sigma))
        note = f"the antenna is {fitted} m forward, right and down of the sensors, from the fixes"
        return cls(place, sigma, True, f"{note} best")


def _describe_mistakes(checks: NavigationChecks, vehicle: Vehicle) -> Iterator[str]:
    """Yield a line per mistake, with the correction made or the option to type."""
    for finding in vehicle.mistakes(checks):
        advice: str | Sentence = ""
        if finding.what == "mount":
            advice = make_sentence(": ", keyword_argument("mount", "", "mount"), " says how")
        elif finding.what == "clock" and not vehicle.offset_source:
            advice = ": they are moved by that"
        elif finding.what == "clock":
            advice = make_sentence(
                ": ", keyword_argument("time_offset", "auto", "time_offset='auto'"), " moves them"
            )
        yield make_sentence(f"{checks.source}: {finding.text}", advice)


@dataclass(frozen=True, eq=False)
class _Search:
    """Search for alignment and clock, in the axes of the body."""

    recording: Recording
    fixes: Fixes
    vehicle: Vehicle
    heading: Heading
    rest: tuple[float, float] | None
    options: dict[str, Any]

    def find_start_and_clock(
        self, checks: NavigationChecks
    ) -> tuple[Alignment, float | TimeOffset, TimeOffset | None, str]:
        """Return the alignment, the offset in use, the best-fitting offset, and a sentence."""
        vehicle = self.vehicle
        stated = vehicle.time_offset
        if isinstance(stated, TimeOffset):
            return self._find_start(stated), stated, None, ""
        initial_offset = stated
        if not vehicle.offset_source and abs(checks.lag) > _SEPARATE_CLOCK_S:
            initial_offset = checks.lag
        start = self._find_start(initial_offset)
        clock = self._find_clock(start, initial_offset)
        if clock is None or not clock.differs(initial_offset, _MIN_OFFSET_S):
            if clock is not None and self._takes_arm(clock):
                # Take clock and antenna from one estimate: the data may not separate them.
                return self._find_start(clock), clock, clock, ""
            return start, initial_offset, clock, ""
        values = ", ".join(
            f"{name} {shorten(x, 3)} (sigma {shorten(s, 1)})" for name, x, s in clock.parts
        )
        if vehicle.offset_source == "argument":
            automatic = keyword_argument("time_offset", "auto", "time_offset='auto'")
            fit = f"the fixes fit best with {values}, not {stated:g} s: "
            return start, initial_offset, clock, make_sentence(fit, automatic)
        sentence: str = (
            f"the clock offset is the one with the best fit of sensors and fixes: {values}"
        )
        if vehicle.offset_source:
            typed = keyword_argument("time_offset", f"{stated:g}")
            not_it = f"{sentence}; not {stated:g} s, as the metadata say: "
            sentence = make_sentence(not_it, typed, " takes that")
        return self._find_start(clock), clock, clock, sentence

    def _takes_arm(self, clock: TimeOffset) -> bool:
        """Return True if clock and antenna were found together and neither was stated."""
        free = self.vehicle.antenna_sigma > _STATED_SIGMA_M and "antenna_sigma" not in self.options
        return free and clock.antenna is not None and self.vehicle.offset_source != "argument"

    def arm(self, clock: TimeOffset | None, offset: float | TimeOffset) -> _Arm:
        """Return the antenna position: estimated with the clock in use, or else stated."""
        if clock is not None and clock is offset and self._takes_arm(clock):
            return _Arm.found(clock)
        vehicle = self.vehicle
        return _Arm(vehicle.antenna, np.full(3, vehicle.antenna_sigma), False)

    def _find_start(self, offset: float | TimeOffset) -> Alignment:
        if self.rest is None:
            return find_start(
                self.recording,
                self.fixes,
                heading=self.heading,
                time_offset=offset,
                **self._options_at(offset),
            )
        gyro = self.recording.gyro
        first = 0.0 if gyro is None else float(gyro.time[0])
        return align(
            self.recording,
            latitude=float(self.fixes.position[0, 0]),
            heading="course" if self.heading is None else self.heading,
            span=(first + self.rest[0], first + self.rest[1]),
        )

    def _find_clock(self, start: Alignment, initial_offset: float) -> TimeOffset | None:
        """Return the clock offset of the fixes. None if it cannot be identified."""
        options = self._options_with_antenna()
        options.pop("gate", None)
        options.pop("adapt", None)
        try:
            offset = find_time_offset(
                self.recording,
                self.fixes,
                start,
                time_offset=initial_offset,
                **options,
            )
        except ValueError:
            # The filter did not start.
            return None
        return offset if offset.identifiable else None

    def find_noise(self, start: Alignment, offset: float | TimeOffset, arm: _Arm) -> FoundNoise:
        """Return the process noise from coasting; the error of a stated antenna is neglected."""
        options = {**self._options_with_antenna(), "antenna": arm.place}
        spread = 0.0 if arm.is_found else options["antenna_sigma"]
        options["antenna_sigma"] = spread if spread > _STATED_SIGMA_M else 0.0
        return find_noise(self.recording, self.fixes, start, time_offset=offset, **options)

    def _options_with_antenna(self) -> dict[str, Any]:
        """Return the filter's options, with the standard deviation of the antenna position."""
        vehicle = self.vehicle
        known = {"antenna": vehicle.antenna, "antenna_sigma": vehicle.antenna_sigma}
        return {**known, **self.options}

    def _options_at(self, offset: float | TimeOffset) -> dict[str, Any]:
        """Return the filter's options, with the antenna position that was found, if any."""
        options = self._options_with_antenna()
        if isinstance(offset, TimeOffset) and self._takes_arm(offset):
            options["antenna"] = np.array(offset.antenna)
            options["antenna_sigma"] = np.array(offset.antenna_sigma)
            options["consider_antenna"] = True
        return options


def _check_mount(mount: Mount) -> Floats | None:
    if isinstance(mount, str):
        if mount != "none":
            text = f"must be a rotation, 'auto' or 'none', got {mount!r}"
            raise ArgumentError("mount", text)
        return None
    return check_rotation(mount)


def _check_antenna(antenna: npt.ArrayLike) -> Floats:
    try:
        arm = np.asarray(antenna, dtype=np.float64)
    except (TypeError, ValueError):
        arm = np.empty(0)
    if arm.shape != (3,) or not np.isfinite(arm).all():
        raise ArgumentError("antenna", f"must be three finite numbers, got {antenna!r}")
    return arm


def _describe_metadata(
    recording: Recording, used: dict[str, bool], lever: Floats, offset: float | None
) -> str:
    named = [name for name, there in used.items() if there]
    if not named:
        return ""
    values = f"antenna {', '.join(f'{x:g}' for x in lever)} m"
    if offset is not None:
        values += f", time offset {offset:g} s"
    listed = " and ".join(filter(None, (", ".join(named[:-1]), named[-1])))
    return f"{listed} by the metadata of {PurePath(recording.source).name} ({values})"


def _describe_axes(axes: Axes | None) -> str:
    if axes is None:
        return ""
    forward = f"{math.degrees(axes.yaw):.1f} deg (sigma {math.degrees(axes.yaw_sigma):.1f})"
    tilt = math.degrees(math.acos(max(-1.0, min(1.0, float(axes.body_from_sensor[2, 2])))))
    option = keyword_argument("mount", "none", "mount='none'")
    text = (
        f"axes from the motion, since nothing states them: forward is {forward} to the right of "
        f"the "
        f"sensors' x, down {tilt:.1f} deg from their z; "
    )
    return make_sentence(text, option, " leaves them")
