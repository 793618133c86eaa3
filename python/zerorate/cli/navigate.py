"""``zerorate navigate``: the track of a vehicle, from its inertial sensors and its receiver."""

import json
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import typer

from zerorate._native import NavigationFilter
from zerorate.cli.calibrations import naming, read_calibration, read_imu
from zerorate.cli.checking import Fix, checked, print_alarms, said_first
from zerorate.cli.clipping import Clipped, ClippedOption, restored
from zerorate.cli.errors import (
    DataFault,
    UsageFault,
    as_usage,
    of_a_file,
    read_faults,
)
from zerorate.cli.mounts import Mounted, numbers
from zerorate.cli.options import (
    PANEL,
    CalibrationOption,
    LogArgument,
    Reading,
    with_group,
    with_options,
    with_reading_options,
)
from zerorate.cli.outputs import LogAndPanels, check_outputs, print_written, progress_bar
from zerorate.cli.references import ReferenceOffset, Tum, reference_poses
from zerorate.faults import said
from zerorate.io import read_log, write_log
from zerorate.io.fixes import read_fixes
from zerorate.metrics.tracks import TrackErrors, ate, rpe
from zerorate.navigation.alignment import Alignment, align
from zerorate.navigation.axes import Axes
from zerorate.navigation.clock import find_time_offset
from zerorate.navigation.options import NAVIGATION_OPTIONS
from zerorate.navigation.outage import Gaps, Outages
from zerorate.navigation.selfcheck import NavigationChecks, check_navigation
from zerorate.navigation.start import find_start
from zerorate.navigation.track import Track, not_begun
from zerorate.navigation.tracks import write_geojson, write_gpx
from zerorate.navigation.wheels import Wheels
from zerorate.noise import NoiseModel, worst_axis
from zerorate.progress import Progress
from zerorate.record import LogError, Poses, Recording
from zerorate.record.fixes import Fixes
from zerorate.record.mounting import body_axes
from zerorate.record.offset import TimeOffset
from zerorate.record.samples import Samples
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.saving import Outputs, text_writer
from zerorate.types import Floats

_FILTER: Final = "Navigation"
_VEHICLE: Final = "The vehicle"
_COURSE: Final = "course"
_COARSE: Final = 1.0
"""Seconds between clocks from which on these are not meant to be one."""
_TURNED: Final = math.radians(3.0)
"""Rotation that is worth it: less is within what a road is sloped."""
_CLOCK_OFF: Final = 0.02
"""Seconds by which the clock of the fixes may be off before it is said."""
_MAPS: Final = ("geojson", "gpx")


class _Vehicle(StrEnum):
    wheeled = "wheeled"


@dataclass(frozen=True)
class _Run:
    """What is typed of a run of the filter."""

    lengths: Annotated[
        str | None,
        typer.Option(
            "--outages",
            metavar="S,S",
            help="Withhold fixes for so many seconds at a time, e.g. 10,30,60, and tell the error.",
        ),
    ] = None
    smooth: Annotated[
        bool,
        typer.Option(
            help="See each sample in the light of all fixes, also of those that come later."
        ),
    ] = False
    heading: Annotated[
        str | None,
        typer.Option(
            metavar="DEG",
            help="Heading at the start, deg from north over east; or 'course': the direction in "
            "which the vehicle first moves. By default the motion tells it.",
        ),
    ] = None
    rest: Annotated[
        str | None,
        typer.Option(
            metavar="START,STOP",
            help="When the vehicle rests at the start, s after the first sample. By default before "
            "the receiver moves, if it rests for 3 s; else it starts in motion.",
        ),
    ] = None
    gyro_noise: Annotated[
        Path | None,
        typer.Option(
            metavar="MODEL",
            help="Noise of the gyro (JSON of NoiseModel, or of zerorate allan --export json). By "
            "default that of a consumer sensor.",
        ),
    ] = None
    accel_noise: Annotated[
        Path | None, typer.Option(metavar="MODEL", help="Noise of the accelerometer, likewise.")
    ] = None


@dataclass(frozen=True)
class _Body:
    """What is typed of the vehicle, and of what it carries where."""

    vehicle: Annotated[
        _Vehicle | None,
        typer.Option(help="Wheeled: it neither slips sideways nor leaves the ground."),
    ] = None
    axle: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="Of a wheeled vehicle: from the sensors to the axle that does not steer, m "
            "forward, right, down.",
        ),
    ] = None
    wheel_speed: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMN",
            help="Column of the log with the speed of the wheels, m/s: of a vehicle on wheels, "
            "whose scale and mounting are estimated.",
        ),
    ] = None
    wheel_ticks: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMN",
            help="Column of the log with the ticks of a wheel so far, instead of its speed.",
        ),
    ] = None
    tick: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            help="Of --wheel-ticks: metres a tick, to some percent. By default as the receiver's "
            "speed tells it.",
        ),
    ] = None
    antenna: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="From the sensors to the antenna, m forward, right, down. By default as the "
            "file's metadata say, or about 0,0,0. It is estimated: within --antenna-sigma, by "
            "default 0.05 m where it is told and 1 m where it is not.",
        ),
    ] = None
    mount: Annotated[
        str | None,
        typer.Option(
            metavar="MATRIX",
            help="Rotation from the axes of the sensors to forward, right, down: nine numbers row "
            "by row, with commas, or a file with them or with metadata that say it; 'none' for "
            "none. By default as the file's metadata say.",
        ),
    ] = None
    time_offset: Annotated[
        str | None,
        typer.Option(
            metavar="S",
            help="Added to the times of the fixes; or 'auto': as sensors and fixes fit best. By "
            "default auto, searched from what the file's metadata say.",
        ),
    ] = None


@with_group(LogAndPanels, "written")
@with_group(_Run, "run", _FILTER)
@with_group(_Body, "body", _VEHICLE)
@with_options(NAVIGATION_OPTIONS, "constants", panel=_FILTER)
@with_reading_options(
    imu=True,
    without=("group_by",),
)
def navigate(
    *,
    log: LogArgument,
    gnss: Annotated[
        Path | None,
        typer.Argument(
            help="Fixes of the receiver: NMEA, RTKLIB, NavSatFix or a table. By default they are "
            "in the recording.",
            show_default=False,
        ),
    ] = None,
    reading: Reading,
    run: _Run,
    constants: Mapping[str, Any],
    body: _Body,
    reference: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="True track, to tell the errors by: TUM's text or EuRoC's table, on the clock of "
            "the log, in axes of its own whose z is up; or positions of a better receiver.",
            rich_help_panel=PANEL,
        ),
    ] = None,
    reference_offset: ReferenceOffset = 0.0,
    tum: Tum = False,
    calibration: CalibrationOption = None,
    clipped: ClippedOption = Clipped.auto,
    fix: Fix = False,
    written: LogAndPanels,
) -> None:
    """Find the track of a vehicle from gyro, accelerometer and the fixes of a receiver.

    Writes position, velocity, attitude and biases with their standard deviations, the track for
    maps as GeoJSON and GPX, and a figure. Prints what became of the fixes, and with --outages how
    far the track is off without them, beside a position and a velocity that are held.
    """
    asked = _Asked.of(log, run, constants, body)
    known = None if calibration is None else read_calibration(calibration)
    everything = written.everything
    place = written.place(f"{log.stem}-zerorate-navigate", *_MAPS)
    files = written.at(place, (*_MAPS, *(("tum",) if tum else ())))
    truth = None if reference is None else _truth(reference, reference_offset)
    check_outputs(files.paths, written.force, log, gnss, calibration)
    written.preload("navigation_figure")
    with progress_bar() as progress:
        recording = read_imu(reading, log)
        fixes = _read_fixes(log, gnss)
        with naming(recording):
            corrected = recording if known is None else known.apply(recording)
            corrected, alarms = checked(corrected, fix)
            corrected, told = restored(corrected, clipped)
            alarms += told
            checks = asked.checked(corrected, fixes)
            alarms += tuple(asked.alarms(checks))
        with said_first(alarms), naming(recording):
            found = in_background(lambda: asked.navigated(corrected, fixes, checks, progress))
        _write(files, found, everything, progress)
    print_alarms(alarms)
    print(found.text(truth))
    print_written(files.paths)


def _lengths(text: str | None) -> list[float]:
    if text is None:
        return []
    count = text.count(",") + 1
    found = numbers("--outages", text, count, "lengths in s, such as 10,30,60,")
    if min(found) <= 0.0:
        raise UsageFault(f"--outages takes lengths above 0 s, got '{text}'")
    return found


def _heading(text: str) -> float | str:
    if text == _COURSE:
        return text
    try:
        degrees = float(text)
    except ValueError:
        degrees = math.nan
    if not abs(degrees) <= 360.0:
        raise UsageFault(f"--heading takes deg within 360, or 'course', got '{text}'")
    return math.radians(degrees)


def _span(text: str) -> tuple[float, float]:
    start, stop = numbers("--rest", text, 2, "two times, such as 0,20,")
    if not stop > start:
        raise UsageFault(f"--rest must end after it begins, got '{text}'")
    return start, stop


def _wheels(vehicle: _Vehicle | None, axle: str | None) -> dict[str, Any]:
    if vehicle is None:
        if axle is not None:
            raise UsageFault("--axle needs --vehicle wheeled")
        return {}
    if axle is None:
        return {"vehicle": str(vehicle)}
    return {"vehicle": str(vehicle), "axle": numbers("--axle", axle, 3, "three numbers")}


def _noises(gyro: Path | None, accel: Path | None) -> dict[str, Any]:
    wanted = {"gyro": (gyro, "angular rate"), "accel": (accel, "acceleration")}
    return {
        sensor: _noise(path, quantity)
        for sensor, (path, quantity) in wanted.items()
        if path is not None
    }


def _noise(path: Path, quantity: str) -> NoiseModel:
    """Return the model in a file, or the worst axis of those of a quantity in one of several."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        axes = content.get("axes") if isinstance(content, dict) else None
        if not isinstance(axes, dict):
            return NoiseModel.from_json(path)
        models = [NoiseModel.from_json(json.dumps(one)) for one in axes.values() if one is not None]
        fitting = [one for one in models if one.quantity == quantity]
        if not fitting:
            raise ValueError(f"no axis has a model of {quantity}")
        return worst_axis(fitting)
    except OSError as error:
        raise DataFault(of_a_file(error)) from None
    except ValueError as error:
        text = str(error)
        raise DataFault(text if text.startswith(str(path)) else f"{path}: {text}") from None


def _read_fixes(log: Path, gnss: Path | None) -> Fixes:
    try:
        with read_faults():
            return read_fixes(log if gnss is None else gnss)
    except DataFault as fault:
        if gnss is not None:
            raise
        raise DataFault(f"{fault}; name the file of the receiver's fixes after the log") from None


def _truth(reference: str, offset: float) -> Poses | Fixes:
    """Return the true track in a file: poses, or positions on the earth."""
    try:
        poses = reference_poses(reference, offset)
    except DataFault as fault:
        try:
            with read_faults():
                fixes = read_fixes(reference)
        except (DataFault, UsageFault):
            raise fault from None
        return fixes.shifted(offset)
    if poses is None:
        raise UsageFault(f"--reference names {reference}, which does not exist")
    return poses


@dataclass(frozen=True)
class _Found:
    """What there is to say and to write."""

    start: Alignment
    track: Track
    nis: Floats
    outages: Outages | None

    def text(self, truth: Poses | Fixes | None) -> str:
        """Return the errors that were asked for, the tables of the track, and the alignment."""
        from zerorate.show import format_outages, format_track
        from zerorate.show.navigation_table import format_errors

        parts = [] if truth is None else [format_errors(*self._errors(truth))]
        if self.outages is not None:
            parts.append(format_outages(self.outages))
        return "\n\n".join((*parts, format_track(self.track, nis=self.nis), self.start.table()))

    def _errors(self, truth: Poses | Fixes) -> tuple[TrackErrors, TrackErrors | None, str]:
        """Return the errors of places and of steps of a second, and how the track was fitted."""
        with as_usage():
            if isinstance(truth, Fixes):
                origin = truth.position[np.isfinite(truth.position).all(axis=1)][0]
                return ate(self.track.poses(origin), truth.poses(origin), align="none"), None, ""
            poses = self.track.poses()
            found = ate(poses, truth, align="yaw")
            turned = np.isfinite(truth.quaternion).all()
            steps = rpe(poses, truth, delta=1.0, unit="s") if turned else None
            angle = math.degrees(2.0 * math.atan2(found.turn[3], found.turn[0]))
            return found, steps, f"turned by {angle:.2f} deg about the vertical, and shifted"


@dataclass(frozen=True)
class _Asked:
    """What the options say of the filter."""

    lengths: Sequence[float]
    smooth: bool
    heading: float | str | None
    rest: tuple[float, float] | None
    filter: dict[str, Any]
    mounting: Mounted
    rolling: "_Rolling | None" = None

    @classmethod
    def of(cls, log: Path, run: _Run, constants: Mapping[str, Any], body: _Body) -> "_Asked":
        """Return what was typed, or raise a usage fault."""
        rolling = _Rolling.of(log, body.wheel_speed, body.wheel_ticks, body.tick)
        vehicle = body.vehicle if rolling is None else _Vehicle.wheeled
        for name in ("wheel_sigma", "speed_sigma"):
            if vehicle is None and name in constants:
                raise UsageFault(f"--{name.replace('_', '-')} needs --vehicle wheeled")
        return cls(
            lengths=_lengths(run.lengths),
            smooth=run.smooth,
            heading=None if run.heading is None else _heading(run.heading),
            rest=None if run.rest is None else _span(run.rest),
            filter={
                **constants,
                **_wheels(vehicle, body.axle),
                **_noises(run.gyro_noise, run.accel_noise),
            },
            mounting=Mounted.of(log, body.mount, body.antenna, body.time_offset),
            rolling=rolling,
        )

    def checked(self, recording: Recording, fixes: Fixes) -> NavigationChecks:
        """Return what sensors and fixes say of each other, in the axes that are told."""
        told = self.mounting.matrix
        return check_navigation(
            recording if told is None else body_axes(recording, told),
            fixes,
            time_offset=self.mounting.time_offset or 0.0,
        )

    def alarms(self, checks: NavigationChecks) -> Iterator[str]:
        """Yield a line for each mistake, with what is done of it or may be typed."""
        for one in checks.mistakes:
            advice = ""
            if one.what == "mount":
                if self._turned(checks) is not None:
                    continue
                advice = ": --mount says how"
            elif one.what == "clock" and self.mounting.time_offset is None:
                advice = ": they are moved by that"
            elif one.what == "clock":
                advice = ": --time-offset auto moves them"
            yield f"{checks.source}: {one.text}{advice}"

    def _turned(self, checks: NavigationChecks) -> Floats | None:
        """Return the axes that the data tell, where nothing else does and they are certain."""
        axes = checks.axes
        untold = self.mounting.matrix is None and not self.mounting.plain
        if not untold or axes is None or not axes.certain:
            return None
        return axes.body_from_sensor if axes.turn > max(_TURNED, 3.0 * axes.yaw_sigma) else None

    def navigated(
        self, recording: Recording, fixes: Fixes, checks: NavigationChecks, progress: Progress
    ) -> _Found:
        """Return the track, and errors in outages if they were asked for."""
        mounted = self.mounting
        notes = [mounted.note]
        matrix = self._turned(checks) if mounted.matrix is None else mounted.matrix
        if matrix is not None:
            recording = body_axes(recording, matrix)
        if mounted.matrix is None and matrix is not None and checks.axes is not None:
            notes.append(_on_axes(checks.axes))
        progress("navigating", 0.1)
        start, offset, sentence = self._begun(recording, fixes, checks)
        notes += [one.text for one in checks.findings if one.status == "cannot tell"]
        spread = {"antenna_sigma": mounted.antenna_sigma, **self.filter}
        nav = NavigationFilter(start, antenna=mounted.antenna, **spread)
        speed = None
        if self.rolling is not None:
            speed = self.rolling.read(recording, TimeOffset.of(offset).applied(fixes))
        track = nav.copy().process(
            recording,
            fixes,
            wheel_speed=speed,
            time_offset=offset,
            keep="all" if self.smooth else "track",
        )
        if not track.navigating.any():
            raise LogError(said("the filter did not begin: ", not_begun(track)))
        nis = track.nis()
        progress("outages", 0.3)
        known = {"rest": None, "wheel_speed": speed, "time_offset": offset}
        errors = self._outages(recording, fixes, nav, track, known, progress)
        if self.smooth:
            progress("smoothing", 0.7)
            track = track.smooth()
        notes.append(sentence)
        track = replace(track, notes=(*filter(None, notes), *track.notes))
        return _Found(start, track, nis, errors)

    def _begun(
        self, recording: Recording, fixes: Fixes, checks: NavigationChecks
    ) -> tuple[Alignment, float | TimeOffset, str]:
        """Return where the filter begins, on which clock, and a sentence on that."""
        told = self.mounting.time_offset
        about = told or 0.0
        if told is None and abs(checks.lag) > _COARSE:
            about = checks.lag
        start = self._start(recording, fixes, about)
        found = self._clock(recording, fixes, start, about)
        if found is None or not found.differs(about, _CLOCK_OFF):
            return start, about, ""
        values = ", ".join(f"{name} {x:.3g} (sigma {s:.1g})" for name, x, s in found.parts)
        if told is not None and self.mounting.offset_typed:
            better = f"the fixes fit best with {values}, not {told:g} s: --time-offset auto"
            return start, about, better
        sentence = f"the clock is as sensors and fixes fit best: {values}"
        if told is not None:
            sentence += f"; not {told:g} s, as the metadata say: --time-offset {told:g} takes that"
        return self._start(recording, fixes, found), found, sentence

    def _start(self, recording: Recording, fixes: Fixes, offset: float | TimeOffset) -> Alignment:
        heading: Any = self.heading
        if self.rest is None:
            return find_start(
                recording,
                fixes,
                heading=heading,
                time_offset=offset,
                antenna=self.mounting.antenna,
                **self._without("antenna_sigma"),
            )
        first = recording.gyro.time[0] if recording.gyro is not None else 0.0
        return align(
            recording,
            latitude=float(fixes.position[0, 0]),
            heading=_COURSE if heading is None else heading,
            span=(first + self.rest[0], first + self.rest[1]),
        )

    def _clock(
        self, recording: Recording, fixes: Fixes, start: Alignment, about: float
    ) -> TimeOffset | None:
        """Return the clock of the fixes, None where it is not told."""
        options = self._without("gate", "adapt", "antenna_sigma")
        lever = self.mounting.antenna
        try:
            found = find_time_offset(
                recording, fixes, start, time_offset=about, antenna=lever, **options
            )
        except ValueError:
            # A receiver without velocities does not tell.
            return None
        return found if found.identifiable else None

    def _without(self, *names: str) -> dict[str, Any]:
        return {name: value for name, value in self.filter.items() if name not in names}

    def _outages(
        self,
        recording: Recording,
        fixes: Fixes,
        nav: NavigationFilter,
        track: Track,
        known: dict[str, Any],
        progress: Progress,
    ) -> Outages | None:
        if not self.lengths:
            return None
        gaps = Gaps(tuple(dict.fromkeys(self.lengths)), self.smooth)
        report = _part(progress, 0.3, 0.7)
        return gaps.run(recording, fixes, nav, track, known, os.cpu_count() or 1, report)


@dataclass(frozen=True)
class _Rolling:
    """The column that tells how fast wheels roll, or how many ticks they have counted."""

    log: Path
    column: str
    ticks: bool
    tick: float | None

    @classmethod
    def of(
        cls, log: Path, speed: str | None, ticks: str | None, tick: float | None
    ) -> "_Rolling | None":
        if tick is not None and ticks is None:
            raise UsageFault("--tick needs --wheel-ticks")
        if tick is not None and not 0.0 < tick < math.inf:
            raise UsageFault(f"--tick takes metres above 0, got {tick:g}")
        if speed is not None and ticks is not None:
            raise UsageFault("--wheel-speed and --wheel-ticks tell the same: give one")
        column = speed if ticks is None else ticks
        return None if column is None else cls(log, column, ticks is not None, tick)

    def read(self, recording: Recording, fixes: Fixes) -> Floats | Wheels:
        """Return the speed at each sample, NaN where there is none, or speeds between counts."""
        with read_faults():
            found = read_log(self.log, columns=self.column)
            samples = Samples.of(recording, mag=False, what="navigation")
            values = samples.aligned(found)[:, 0]
            if not self.ticks:
                return values
            return Wheels.of_ticks(samples.time, values, tick=self.tick, fixes=fixes)


def _on_axes(axes: Axes) -> str:
    forward = f"{math.degrees(axes.yaw):.1f} deg (sigma {math.degrees(axes.yaw_sigma):.1f})"
    tilt = math.degrees(math.acos(max(-1.0, min(1.0, float(axes.body_from_sensor[2, 2])))))
    return (
        f"axes by the motion, for nothing tells them: forward is {forward} to the right of the "
        f"sensors' x, down {tilt:.1f} deg from their z; --mount none leaves them"
    )


def _part(progress: Progress, first: float, last: float) -> Progress:
    return lambda step, done: progress(step, first + (last - first) * done)


def _write(outputs: Outputs, found: _Found, everything: bool, progress: Progress) -> None:
    from zerorate.show import plot_track, save_figure

    track = found.track
    writers: list[Callable[[Path], object]] = [
        partial(write_log, track.to_log()),
        lambda path: write_geojson(path, track, force=True),
        lambda path: write_gpx(path, track, force=True),
    ]

    if any(path.suffix == ".tum" for path in outputs.others):
        writers.append(text_writer(track.poses().to_tum()))

    def draw(path: Path) -> None:
        save_figure(plot_track(track, found.outages, found.nis, everything), path)

    outputs.write(writers, draw, progress, done=0.8)
