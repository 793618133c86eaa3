"""``zerorate attitude``: orientation of a body, from a log of its sensors."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from zerorate.attitude.options import ATTITUDE_METHODS, ATTITUDE_OPTIONS
from zerorate.cli.filter_options import TableOptions
from zerorate.cli.options import (
    OUTPUT,
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
        "Axes of the earth. enu: east, north, up; ned: north, east, down; nwu: north, west, up. "
        "North is magnetic unless --declination is given. Default: ned for a log whose axes "
        "point forward, right, down, such as a PX4's; else enu.",
    )
    method: str = option("auto", "Method; auto needs no settings.", choices=ATTITUDE_METHODS)
    offline: bool = option(False, "Smooth: use later samples too (forward-backward).")
    mag: bool = option(
        True,
        "Ignore the magnetometer; the heading then drifts. It is relative to the start.",
        "--no-mag",
    )
    learn_magnetometer: bool = option(
        False,
        "Learn the magnetometer's hard iron from the motion. For a log zerorate calibrate "
        "--magnetometer is more precise.",
    )
    declination: float = option(
        0.0,
        "Declination: magnetic north east of true north, deg. North is then true north.",
        metavar="DEG",
        shown="",
        convert=math.radians,
    )
    at: Sequence[float] | None = option(
        None,
        "Position, deg, for the declination of the World Magnetic Model.",
        metavar="LAT,LON",
        parse=parse_place,
    )
    bias_limit: float | None = option(
        None,
        "Largest possible bias, deg/s. Default 10. A larger steady rate counts as rotation, never "
        "as rest.",
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
        "Ground truth to compare with: a TUM or EuRoC file. On the log's clock, from sensor to "
        "earth; or four columns w,x,y,z of the log. Default: its columns named like one, such as "
        "ref_quat_w.",
        metavar="FILE",
    )
    reference_heading: Literal["aligned", "absolute", "relative"] | None = option(
        None,
        "Comparison of headings. aligned: after the rotation that fits best, for a reference with "
        "its own north; absolute: to the reference's north; relative: to the first sample, for "
        "logs without a magnetometer.",
    )
    reference_offset: ReferenceOffset = 0.0
    reference_frame: Frame | None = option(None, "Earth axes of the reference; by default --frame.")


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
            "Correct the magnetometer first by this calibration. JSON of zerorate calibrate "
            "--magnetometer.",
            metavar="MAG",
            panel=PANEL,
        ),
    ] = None,
    truth: _Truth,
    clipped: ClippedOption = "auto",
    fix: Fix = False,
    written: LogAndFigure,
    tum: Tum = False,
    view: Annotated[
        bool,
        Option("Write a page with the body in 3D and a time slider.", panel=OUTPUT),
    ] = False,
) -> None:
    """Estimate the orientation of a body from gyro, accelerometer and, if present, magnetometer.

    Writes quaternion and Euler angles with their standard deviations, rest, magnetic disturbance
    and the learned errors of the gyro. Prints a table, with errors if there is a reference.
    """
    place = written.place(f"{log.stem}-zerorate-attitude")
    files = partial(written.at, others=[*([".tum"] if tum else []), *([".html"] if view else [])])
    parts = parts_of([(log, place)], reading, files, calibration, magnetometer)
    written.preload("attitude_figure")
    arguments = {**vars(filter), **vars(truth), **constants, **reading.arguments}
    task = partial(
        estimate_attitude, gyro=gyro, accel=accel, calibration=calibration,
        magnetometer=magnetometer, clipped=clipped, fix=fix, **arguments,
    )  # fmt: skip
    for part in parts:
        print_result(*part.run(task, tum=tum, view=view))
