"""``zerorate attitude``: which way a body points, from a log of its sensors."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from zerorate.attitude.estimate import METHODS
from zerorate.attitude.options import ATTITUDE_OPTIONS
from zerorate.cli.clipping import Clipped, ClippedOption
from zerorate.cli.errors import print_alarms
from zerorate.cli.mounts import numbers
from zerorate.cli.options import (
    PANEL,
    AccelName,
    CalibrationOption,
    Fix,
    FrameName,
    GyroName,
    LogArgument,
    Reading,
    with_group,
    with_options,
    with_reading_options,
)
from zerorate.cli.outputs import LogAndFigure, check_outputs, print_written, progress_bar
from zerorate.cli.records import print_title, records
from zerorate.cli.references import ReferenceHeading, ReferenceOffset, Tum
from zerorate.tasks.attitude import estimate_attitude
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.saving import files_of
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

    def arguments(self) -> dict[str, Any]:
        """Return those of `zerorate.estimate_attitude`."""
        place = "latitude and longitude, deg,"
        limit = self.bias_limit
        return {
            "frame": None if self.frame is None else str(self.frame),
            "method": str(self.method),
            "offline": self.offline,
            "mag": not self.no_mag,
            "learn_magnetometer": self.learn_magnetometer,
            "declination": math.radians(self.declination),
            "at": None if self.at is None else numbers("--at", self.at, 2, place),
            "bias_limit": None if limit is None else convert(limit, "deg/s", "rad/s"),
        }


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

    def arguments(self) -> dict[str, Any]:
        """Return those of `zerorate.estimate_attitude`."""
        frame, heading = self.reference_frame, self.reference_heading
        return {
            "reference": self.reference,
            "reference_offset": self.reference_offset,
            "reference_frame": None if frame is None else str(frame),
            "reference_heading": None if heading is None else heading.value,
        }


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
    asked = {**filter.arguments(), **truth.arguments(), **constants}
    place = written.place(f"{log.stem}-zerorate-attitude")
    found = records(log, reading.group_by)
    beside = ("tum",) if tum else ()
    outputs = [written.at(place.of_part(one.ending), beside) for one in found]
    paths = [path for files in outputs for path in files.paths]
    check_outputs(paths, written.force, log, calibration, magnetometer)
    written.preload("attitude_figure")
    for one, files in zip(found, outputs, strict=True):
        with progress_bar() as progress:
            work = partial(
                estimate_attitude, one.source, gyro=gyro or "gyro", accel=accel,
                calibration=calibration, magnetometer=magnetometer, clipped=clipped.value, fix=fix,
                progress=progress, **asked, **reading.arguments,
            )  # fmt: skip
            estimate = in_background(work)
            files.save(files_of(estimate, tum=tum), progress)
        print_title(one, first=one is found[0])
        print_alarms(estimate.alarms)
        print(estimate)
        print_written(files.paths)
