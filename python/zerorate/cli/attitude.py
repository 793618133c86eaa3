"""``zerorate attitude``: which way a body points, from a log of its sensors."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from zerorate.attitude.estimate import METHODS, AttitudeEstimate, estimate_attitude
from zerorate.attitude.options import ATTITUDE_OPTIONS
from zerorate.calibration.calibration import Calibration
from zerorate.cli.calibrations import naming, read_calibration, read_imu
from zerorate.cli.checking import Fix, checked, print_alarms, said_first
from zerorate.cli.errors import UsageFault, as_usage
from zerorate.cli.options import (
    PANEL,
    AccelName,
    CalibrationOption,
    FigureFormat,
    FigureFormatOption,
    Force,
    FrameName,
    GyroName,
    LogArgument,
    LogFormat,
    LogFormatOption,
    NoFigure,
    Output,
    Reading,
    parse_columns,
    with_options,
    with_reading_options,
)
from zerorate.cli.outputs import (
    Destination,
    Outputs,
    check_outputs,
    preload_figure,
    print_written,
    progress_bar,
    text_writer,
)
from zerorate.cli.records import print_title, records
from zerorate.cli.references import ReferenceHeading, ReferenceOffset, Tum, reference_poses
from zerorate.io import Recording, write_log
from zerorate.options import check_used
from zerorate.progress import Progress
from zerorate.run.interrupts import in_background
from zerorate.units import convert

_FILTER: Final = "Attitude"
"""The panel of help with what is asked for."""


_NAMED: Any = StrEnum
_METHODS: Any = _NAMED("Method", [(name, name) for name in METHODS])
_AUTO: Final = _METHODS("auto")
_CONSTANTS: Final = {name: one for name, one in ATTITUDE_OPTIONS.items() if name != "method"}


@with_options(_CONSTANTS, "constants")
@with_reading_options(
    imu=True,
)
def attitude(
    *,
    log: LogArgument,
    reading: Reading,
    output: Output = ".",
    frame: Annotated[
        FrameName | None,
        typer.Option(
            help="Axes of the earth: east, north, up; north, east, down; or north, west, up. "
            "North is the magnetic one, unless --declination is given. By default ned for a log "
            "whose axes are known to point forward, right, down, as those of a PX4; else enu.",
            show_default=False,
            rich_help_panel=_FILTER,
        ),
    ] = None,
    method: Annotated[
        _METHODS,
        typer.Option(help="How it is found. Auto needs no settings.", rich_help_panel=_FILTER),
    ] = _AUTO,
    constants: Mapping[str, Any],
    offline: Annotated[
        bool,
        typer.Option(
            "--offline",
            help="See each sample in the light of the whole log, also of what comes later.",
            rich_help_panel=_FILTER,
        ),
    ] = False,
    no_mag: Annotated[
        bool,
        typer.Option(
            "--no-mag",
            help="Leave out the magnetometer: the heading is then against the start, and drifts.",
            rich_help_panel=_FILTER,
        ),
    ] = False,
    declination: Annotated[
        float,
        typer.Option(
            metavar="DEG",
            help="How far magnetic north lies east of true north, deg, at the place: north is then "
            "the true one.",
            show_default=False,
            rich_help_panel=_FILTER,
        ),
    ] = 0.0,
    gyro: GyroName = None,
    accel: AccelName = None,
    bias_limit: Annotated[
        float | None,
        typer.Option(
            metavar="DEG/S",
            min=0.0,
            help="The largest bias that such a gyro has, deg/s: a steadier rate beyond is a turn, "
            "never a rest. Default 10.",
            rich_help_panel=_FILTER,
        ),
    ] = None,
    calibration: CalibrationOption = None,
    reference: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="True orientation, from sensor to earth, to tell the errors by: a file of TUM's "
            "text or EuRoC's table on the clock of the log, or four columns w,x,y,z of the log. "
            "Default: its columns named like one, such as ref_quat_w.",
            rich_help_panel=PANEL,
        ),
    ] = None,
    reference_heading: Annotated[
        ReferenceHeading | None,
        typer.Option(
            help="How headings are compared: aligned, turned to fit best, as is usual for a file, "
            "whose north is its own; absolute, by the reference's north; relative, to the first "
            "sample, as is usual without a magnetometer.",
            show_default=False,
            rich_help_panel=PANEL,
        ),
    ] = None,
    reference_offset: ReferenceOffset = 0.0,
    tum: Tum = False,
    reference_frame: Annotated[
        FrameName | None,
        typer.Option(
            help="Axes of the earth that the reference is to; by default those of --frame.",
            show_default=False,
            rich_help_panel=PANEL,
        ),
    ] = None,
    fix: Fix = False,
    format: LogFormatOption = None,
    figure_format: FigureFormatOption = None,
    no_figure: NoFigure = False,
    force: Force = False,
) -> None:
    """Find which way a body points, from gyro, accelerometer and, if there is one, magnetometer.

    Writes quaternion and Euler angles with their standard deviations, rest, magnetic disturbance
    and what was learned of the gyro; prints a table, with the errors where the log has a reference.
    """
    poses = reference_poses(reference, reference_offset)
    truth = None if poses is not None else parse_columns(reference, "--reference")
    if poses is None and reference_offset:
        raise UsageFault("--reference-offset acts on a file that --reference names")
    with as_usage():
        check_used(constants, [str(method.value)], ATTITUDE_OPTIONS)
    known = None if calibration is None else read_calibration(calibration)
    asked: dict[str, Any] = {
        "frame": None if frame is None else str(frame),
        "method": str(method),
        "offline": offline,
        "mag": not no_mag,
        "declination": math.radians(declination),
        "gyro": gyro or "gyro",
        "accel": accel,
        "reference": poses,
        "reference_frame": None if reference_frame is None else str(reference_frame),
        **constants,
    }
    if bias_limit is not None:
        asked["bias_limit"] = convert(bias_limit, "deg/s", "rad/s")
    suffixes = [*LogFormat, *(() if no_figure else FigureFormat)]
    place = Destination.of(output, f"{log.stem}-zerorate-attitude", suffixes)
    shape = (format, None if no_figure else figure_format, not no_figure, force)
    found = records(log, reading.group_by)
    beside = ("tum",) if tum else ()
    outputs = [Outputs.of(place.of_part(one.ending), *shape, beside=beside) for one in found]
    check_outputs([path for files in outputs for path in files.paths], force, log, calibration)
    if not no_figure:
        preload_figure("attitude_figure")
    for one, files in zip(found, outputs, strict=True):
        with progress_bar() as progress:
            recording = read_imu(reading, one.source, truth)
            with naming(recording):
                if known is not None:
                    recording = _corrected(known, recording, gyro, accel)
                recording, alarms = checked(recording, fix, gyro, accel)
            with said_first(alarms), naming(recording):
                work = partial(estimate_attitude, recording, progress=progress, **asked)
                estimate = in_background(work)
                if reference_heading is not None:
                    if estimate.reference is None:
                        raise UsageFault("--reference-heading needs a reference")
                    estimate = replace(estimate, compared_heading=reference_heading.value)
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

    log, beside = estimate.to_log()
    writers: list[Callable[[Path], object]] = [partial(write_log, log, beside=beside)]
    if outputs.beside:
        writers.append(text_writer(estimate.poses().to_tum()))
    outputs.write(
        writers,
        lambda path: save_figure(estimate.plot(), path),
        progress,
    )
