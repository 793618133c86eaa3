"""``zerorate attitude``: which way a body points, from a log of its sensors."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from zerorate.attitude.options import ATTITUDE_METHODS, ATTITUDE_OPTIONS
from zerorate.cli.filter_options import TableOptions
from zerorate.cli.options import (
    AccelName,
    CalibrationOption,
    ClippedOption,
    Fix,
    GyroName,
    LogArgument,
    ReferenceOffset,
    Tum,
)
from zerorate.cli.outputs import LogAndFigure, parts_of, print_result
from zerorate.cli.parameters import Option, option
from zerorate.cli.reading import PANEL, Reading, ReadingOptions
from zerorate.cli.values import parse_place
from zerorate.geometry.frames import Frame
from zerorate.tasks.attitude import estimate_attitude
from zerorate.units import convert

_CONSTANTS = {name: one for name, one in ATTITUDE_OPTIONS.items() if name != "method"}


@dataclass(frozen=True)
class _Filter:
    """Options of the filter, named as arguments of `zerorate.estimate_attitude`."""

    panel: ClassVar = "Attitude"

    frame: Frame | None = option(
        None,
        "Axes of the earth: east, north, up; north, east, down; or north, west, up. "
        "North is the magnetic one, unless --declination is given. By default ned for a log "
        "whose axes are known to point forward, right, down, as those of a PX4; else enu.",
    )
    method: str = option(
        "auto", "How it is found. Auto needs no settings.", choices=ATTITUDE_METHODS
    )
    offline: bool = option(
        False, "See each sample in the light of the whole log, also of what comes later."
    )
    mag: bool = option(
        True,
        "Leave out the magnetometer: the heading is then against the start, and drifts.",
        "--no-mag",
    )
    learn_magnetometer: bool = option(
        False,
        "Learn the magnetometer's hard iron from the motion, as a live filter can; "
        "of a log zerorate calibrate --magnetometer knows more.",
    )
    declination: float = option(
        0.0,
        "How far magnetic north lies east of true north, deg, at the place: north is then "
        "the true one.",
        metavar="DEG",
        shown="",
        convert=math.radians,
    )
    at: Sequence[float] | None = option(
        None,
        "The place, deg, in place of --declination: that of the World Magnetic Model.",
        metavar="LAT,LON",
        parse=parse_place,
    )
    bias_limit: float | None = option(
        None,
        "The largest bias that such a gyro has, deg/s: a steadier rate beyond is a turn, "
        "never a rest. Default 10.",
        metavar="DEG/S",
        min=0.0,
        convert=partial(convert, from_unit="deg/s", to_unit="rad/s"),
    )


@dataclass(frozen=True)
class _Truth:
    """Options of the true orientation, named as arguments of `zerorate.estimate_attitude`."""

    panel: ClassVar = PANEL

    reference: str | None = option(
        None,
        "True orientation, from sensor to earth, to tell the errors by: a file of TUM's "
        "text or EuRoC's table on the clock of the log, or four columns w,x,y,z of the log. "
        "Default: its columns named like one, such as ref_quat_w.",
        metavar="FILE",
    )
    reference_heading: Literal["aligned", "absolute", "relative"] | None = option(
        None,
        "How headings are compared: aligned, turned to fit best, as is usual for a file, "
        "whose north is its own; absolute, by the reference's north; relative, to the first "
        "sample, as is usual without a magnetometer.",
    )
    reference_offset: ReferenceOffset = 0.0
    reference_frame: Frame | None = option(
        None, "Axes of the earth that the reference is to; by default those of --frame."
    )


def attitude(
    *,
    log: LogArgument,
    reading: Annotated[Reading, ReadingOptions(imu=True)],
    filter: _Filter,
    constants: Annotated[Mapping[str, Any], TableOptions(_CONSTANTS)],
    gyro: GyroName = None,
    accel: AccelName = None,
    calibration: CalibrationOption = None,
    magnetometer: Annotated[
        Path | None,
        Option(
            "Take hard and soft iron off the magnetometer first, by this calibration (JSON of "
            "zerorate calibrate --magnetometer).",
            metavar="MAG",
            panel=PANEL,
        ),
    ] = None,
    truth: _Truth,
    clipped: ClippedOption = "auto",
    fix: Fix = False,
    written: LogAndFigure,
    tum: Tum = False,
) -> None:
    """Estimate the orientation of a body from gyro, accelerometer and, if present, magnetometer.

    Writes quaternion and Euler angles with their standard deviations, rest, magnetic disturbance
    and what was learned of the gyro; prints a table, with the errors where the log has a reference.
    """
    place = written.place(f"{log.stem}-zerorate-attitude")
    files = partial(written.at, others=(".tum",) if tum else ())
    parts = parts_of([(log, place)], reading, files, calibration, magnetometer)
    written.preload("attitude_figure")
    arguments = {**vars(filter), **vars(truth), **constants, **reading.arguments}
    task = partial(
        estimate_attitude, gyro=gyro or "gyro", accel=accel, calibration=calibration,
        magnetometer=magnetometer, clipped=clipped, fix=fix, **arguments,
    )  # fmt: skip
    for part in parts:
        print_result(*part.run(task, tum=tum))
