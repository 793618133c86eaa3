"""``zerorate walk``: where a sensor on a foot went, from its gyro and accelerometer alone."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, ClassVar, Final

from zerorate.cli.filter_options import TableOptions
from zerorate.cli.options import CalibrationOption, ClippedOption, Fix, LogArgument
from zerorate.cli.outputs import LogAndFigure, check_outputs, print_result, run_and_save
from zerorate.cli.parameters import Option, option
from zerorate.cli.reading import Reading, ReadingOptions
from zerorate.cli.values import parse_place
from zerorate.navigation.options import FOOT_OPTIONS
from zerorate.tasks.walk import walk as find_track

_PANEL: Final = "Walk"
_MAPS: Final = ("geojson", "gpx")


@dataclass(frozen=True)
class _Start:
    """Where the walk starts on the earth: arguments of `zerorate.walk`."""

    panel: ClassVar = _PANEL

    at: Sequence[float] | None = option(
        None,
        "Where it starts, deg: writes the track for maps, as GeoJSON and GPX.",
        metavar="LAT,LON",
        parse=parse_place,
    )
    heading: float | None = option(
        None,
        "With --at: where the sensor's first axis looks at the start, deg from north over "
        "east. Default 0.",
        metavar="DEG",
        convert=math.radians,
    )
    height: float | None = option(
        None, "With --at: height of the start, m. Default 0.", metavar="M"
    )


def walk(
    *,
    log: LogArgument,
    reading: Annotated[Reading, ReadingOptions(imu=True, without=("group_by",))],
    constants: Annotated[Mapping[str, Any], TableOptions(FOOT_OPTIONS, _PANEL)],
    smooth: Annotated[
        bool,
        Option(
            "See each sample in the light of the whole log, also of what comes later.", panel=_PANEL
        ),
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
    """Find where a sensor on a foot went: no receiver, but now and then the foot stands.

    Writes place, velocity and orientation with their standard deviations, and a figure; with --at
    the track for maps. Prints how far it went, where it ends, and the strides in numbers.
    """
    maps = () if start.at is None else _MAPS
    outputs = written.at(
        written.place(f"{log.stem}-zerorate-walk", *maps), [f".{one}" for one in maps]
    )
    check_outputs(outputs.paths, written.force, log, calibration)
    written.preload("foot_figure")
    task = partial(
        find_track, log, smooth=smooth, assume_foot=assume_foot, calibration=calibration,
        clipped=clipped, fix=fix, **vars(start), **constants, **reading.arguments,
    )  # fmt: skip
    print_result(*run_and_save(task, outputs, 0.8))
