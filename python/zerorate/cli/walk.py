"""``zerorate walk``: the track of a sensor on a foot from gyro and accelerometer only."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, ClassVar, Final

from zerorate.cli.filter_options import TableOptions
from zerorate.cli.options import CalibrationOption, ClippedOption, Fix, LogArgument
from zerorate.cli.outputs import LogAndFigure, check_outputs, of_sensor, print_result, run_and_save
from zerorate.cli.parameters import Option, option
from zerorate.cli.reading import Reading, ReadingOptions
from zerorate.cli.values import parse_place
from zerorate.navigation.options import FOOT_OPTIONS
from zerorate.tasks.walk import walk as find_track

_PANEL: Final = "Walk"
_MAPS: Final = ("geojson", "gpx")


@dataclass(frozen=True)
class _Start:
    """Start of the walk on the earth, named as arguments of `zerorate.walk`."""

    panel: ClassVar = _PANEL

    at: Sequence[float] | None = option(
        None,
        "Start position, deg. The track is also written as GeoJSON and GPX.",
        metavar="LAT,LON",
        parse=parse_place,
    )
    heading: float | None = option(
        None,
        "Initial direction of the sensor's first axis, deg. From north over east; with --at. "
        "Default 0.",
        metavar="DEG",
        convert=math.radians,
    )
    height: float | None = option(
        None, "Height of the start, m; with --at. Default 0.", metavar="M"
    )


def walk(
    *,
    log: LogArgument,
    reading: Annotated[Reading, ReadingOptions(imu=True, without=("group_by",))],
    constants: Annotated[Mapping[str, Any], TableOptions(FOOT_OPTIONS, _PANEL)],
    smooth: Annotated[
        bool,
        Option("Smooth: use later samples too (forward-backward).", panel=_PANEL),
    ] = False,
    assume_foot: Annotated[
        bool, Option("Navigate even if the motion is not that of a foot.", panel=_PANEL)
    ] = False,
    start: _Start,
    calibration: CalibrationOption = None,
    clipped: ClippedOption = "auto",
    fix: Fix = False,
    written: LogAndFigure,
) -> None:
    """Find the track of a sensor on a foot without a receiver, from the foot's stance phases.

    Writes position, velocity and orientation with their standard deviations, and a figure. With
    --at, also writes the track for maps. Prints the distance, the end point, and statistics of the
    strides.
    """
    maps = () if start.at is None else _MAPS
    outputs = written.at(
        of_sensor(written.place(f"{log.stem}-zerorate-walk", *maps), reading),
        [f".{one}" for one in maps],
    )
    check_outputs(outputs.paths, written.force, log, calibration)
    written.preload("foot_figure")
    task = partial(
        find_track, log, smooth=smooth, assume_foot=assume_foot, calibration=calibration,
        clipped=clipped, fix=fix, **vars(start), **constants, **reading.arguments,
    )  # fmt: skip
    print_result(*run_and_save(task, outputs, 0.8))
