"""``zerorate attitude``: which way a body points, from a log of its sensors."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from zerorate.attitude.estimate import METHODS, AttitudeEstimate, estimate_attitude
from zerorate.attitude.options import ATTITUDE_OPTIONS
from zerorate.calibration.calibration import Calibration
from zerorate.cli.calibrations import naming, read_calibration, read_imu
from zerorate.cli.checking import checked, print_alarms, said_first
from zerorate.cli.clipping import Clipped, ClippedOption, restored
from zerorate.cli.errors import UsageFault, as_usage
from zerorate.cli.magnetometer import read_magnetometer
from zerorate.cli.mounts import place_with_field
from zerorate.cli.options import (
    PANEL,
    AccelName,
    CalibrationOption,
    Fix,
    FrameName,
    GyroName,
    LogArgument,
    Reading,
    parse_columns,
    with_group,
    with_options,
    with_reading_options,
)
from zerorate.cli.outputs import LogAndFigure, check_outputs, print_written, progress_bar
from zerorate.cli.records import print_title, records
from zerorate.cli.references import ReferenceHeading, ReferenceOffset, Tum, reference_poses
from zerorate.cli.standard import tell
from zerorate.geometry import earth_field
from zerorate.io import write_log
from zerorate.options import check_used
from zerorate.progress import Progress
from zerorate.record import Recording
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.saving import Outputs, text_writer
from zerorate.units import convert

_FILTER: Final = "Attitude"
"""The panel of help with what is asked for."""


_NAMED: Any = StrEnum
_METHODS: Any = _NAMED("Method", [(name, name) for name in METHODS])
_AUTO: Final = _METHODS("auto")
_CONSTANTS: Final = {name: one for name, one in ATTITUDE_OPTIONS.items() if name != "method"}


@dataclass(frozen=True)
class _Filter:
    """What is typed of the filter."""

    frame: Annotated[
        FrameName | None,
        typer.Option(
            help="Axes of the earth: east, north, up; north, east, down; or north, west, up. "
            "North is the magnetic one, unless --declination is given. By default ned for a log "
            "whose axes are known to point forward, right, down, as those of a PX4; else enu."
        ),
    ] = None
    method: Annotated[_METHODS, typer.Option(help="How it is found. Auto needs no settings.")] = (
        _AUTO
    )
    offline: Annotated[
        bool,
        typer.Option(
            help="See each sample in the light of the whole log, also of what comes later."
        ),
    ] = False
    no_mag: Annotated[
        bool,
        typer.Option(
            help="Leave out the magnetometer: the heading is then against the start, and drifts."
        ),
    ] = False
    learn_magnetometer: Annotated[
        bool,
        typer.Option(
            help="Learn the magnetometer's hard iron from the motion, as a live filter can; "
            "of a log zerorate calibrate --magnetometer knows more."
        ),
    ] = False
    declination: Annotated[
        float,
        typer.Option(
            metavar="DEG",
            help="How far magnetic north lies east of true north, deg, at the place: north is then "
            "the true one.",
            show_default=False,
        ),
    ] = 0.0
    at: Annotated[
        str | None,
        typer.Option(
            "--at",
            metavar="LAT,LON",
            help="The place, deg, in place of --declination: that of the World Magnetic Model.",
        ),
    ] = None
    bias_limit: Annotated[
        float | None,
        typer.Option(
            metavar="DEG/S",
            min=0.0,
            help="The largest bias that such a gyro has, deg/s: a steadier rate beyond is a turn, "
            "never a rest. Default 10.",
        ),
    ] = None

    def arguments(self, constants: Mapping[str, Any]) -> dict[str, Any]:
        """Return those of `estimate_attitude`; a usage fault for a constant without effect."""
        with as_usage():
            check_used(constants, [str(self.method)], ATTITUDE_OPTIONS)
        asked = {
            "frame": None if self.frame is None else str(self.frame),
            "method": str(self.method),
            "offline": self.offline,
            "mag": not self.no_mag,
            "declination": self._declination(),
            **constants,
        }
        if self.learn_magnetometer:
            if self.no_mag:
                raise UsageFault("--learn-magnetometer has no effect with --no-mag")
            asked["learn_magnetometer"] = True
        if self.bias_limit is not None:
            asked["bias_limit"] = convert(self.bias_limit, "deg/s", "rad/s")
        return asked

    def _declination(self) -> float:
        """Return what was typed, or what the model of the earth's field has at the place, rad."""
        place = place_with_field(self.at)
        if place is None:
            return math.radians(self.declination)
        if self.declination:
            raise UsageFault("--at tells the declination: give it, or --declination")
        if self.no_mag:
            raise UsageFault("--at has no effect with --no-mag")
        with as_usage():
            there = earth_field(*place)
        east = math.degrees(there.declination)
        tell(f"magnetic north lies {east:.1f} deg east of true north, by the {there.model}")
        return there.declination


@dataclass(frozen=True)
class _Truth:
    """What is typed of the true orientation."""

    reference: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="True orientation, from sensor to earth, to tell the errors by: a file of TUM's "
            "text or EuRoC's table on the clock of the log, or four columns w,x,y,z of the log. "
            "Default: its columns named like one, such as ref_quat_w.",
        ),
    ] = None
    reference_heading: Annotated[
        ReferenceHeading | None,
        typer.Option(
            help="How headings are compared: aligned, turned to fit best, as is usual for a file, "
            "whose north is its own; absolute, by the reference's north; relative, to the first "
            "sample, as is usual without a magnetometer."
        ),
    ] = None
    reference_offset: ReferenceOffset = 0.0
    reference_frame: Annotated[
        FrameName | None,
        typer.Option(
            help="Axes of the earth that the reference is to; by default those of --frame."
        ),
    ] = None

    def found(self) -> tuple[dict[str, Any], list[str | int] | None]:
        """Return what `estimate_attitude` is told of it, and the columns of the log it is in."""
        poses = reference_poses(self.reference, self.reference_offset)
        if poses is None and self.reference_offset:
            raise UsageFault("--reference-offset acts on a file that --reference names")
        frame = None if self.reference_frame is None else str(self.reference_frame)
        columns = parse_columns(self.reference, "--reference") if poses is None else None
        return {"reference": poses, "reference_frame": frame}, columns

    def compared(self, estimate: AttitudeEstimate) -> AttitudeEstimate:
        """Return an estimate that compares headings as is asked; a usage fault without any."""
        if self.reference_heading is None:
            return estimate
        if estimate.reference is None:
            raise UsageFault("--reference-heading needs a reference")
        return replace(estimate, compared_heading=self.reference_heading.value)


@with_group(LogAndFigure, "written")
@with_group(_Filter, "filter", _FILTER)
@with_options(_CONSTANTS, "constants")
@with_group(_Truth, "truth", PANEL)
@with_reading_options(imu=True)
def attitude(
    *,
    log: LogArgument,
    reading: Reading,
    filter: _Filter,
    constants: Mapping[str, Any],
    gyro: GyroName = None,
    accel: AccelName = None,
    calibration: CalibrationOption = None,
    magnetometer: Annotated[
        Path | None,
        typer.Option(
            metavar="MAG",
            help="Take hard and soft iron off the magnetometer first, by this calibration (JSON of "
            "zerorate calibrate --magnetometer).",
            rich_help_panel=PANEL,
        ),
    ] = None,
    truth: _Truth,
    clipped: ClippedOption = Clipped.auto,
    fix: Fix = False,
    written: LogAndFigure,
    tum: Tum = False,
) -> None:
    """Find which way a body points, from gyro, accelerometer and, if there is one, magnetometer.

    Writes quaternion and Euler angles with their standard deviations, rest, magnetic disturbance
    and what was learned of the gyro; prints a table, with the errors where the log has a reference.
    """
    true, columns = truth.found()
    asked = {**filter.arguments(constants), **true, "gyro": gyro or "gyro", "accel": accel}
    known = None if calibration is None else read_calibration(calibration)
    if magnetometer is not None:
        if filter.no_mag:
            raise UsageFault("--magnetometer has no effect with --no-mag")
        asked["magnetometer"] = read_magnetometer(magnetometer)
    place = written.place(f"{log.stem}-zerorate-attitude")
    found = records(log, reading.group_by)
    beside = ("tum",) if tum else ()
    outputs = [written.at(place.of_part(one.ending), beside) for one in found]
    paths = [path for files in outputs for path in files.paths]
    check_outputs(paths, written.force, log, calibration, magnetometer)
    written.preload("attitude_figure")
    for one, files in zip(found, outputs, strict=True):
        with progress_bar() as progress:
            recording = read_imu(reading, one.source, columns)
            with naming(recording):
                if known is not None:
                    recording = _corrected(known, recording, gyro, accel)
                recording, alarms = checked(recording, fix, gyro, accel)
                recording, told = restored(recording, clipped, gyro)
                alarms += told
            with said_first(alarms), naming(recording):
                work = partial(estimate_attitude, recording, progress=progress, **asked)
                estimate = truth.compared(in_background(work))
            _write(files, estimate, progress)
        print_title(one, first=one is found[0])
        print_alarms(alarms)
        print(estimate.table())
        print_written(files.paths)


def _corrected(
    known: Calibration, recording: Recording, gyro: str | None, accel: str | None
) -> Recording:
    named = {"gyro": gyro, "accel": accel}
    return known.apply(recording, **{kind: name for kind, name in named.items() if name})


def _write(outputs: Outputs, estimate: AttitudeEstimate, progress: Progress) -> None:
    from zerorate.show import save_figure

    writers: list[Callable[[Path], object]] = [partial(write_log, estimate.to_log())]
    if outputs.others:
        writers.append(text_writer(estimate.poses().to_tum()))
    outputs.write(
        writers,
        lambda path: save_figure(estimate.plot(), path),
        progress,
    )
