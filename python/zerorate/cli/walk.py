"""``zerorate walk``: where a sensor on a foot went, from its gyro and accelerometer alone."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final

import typer

from zerorate.cli.clipping import Clipped, ClippedOption
from zerorate.cli.errors import print_alarms
from zerorate.cli.mounts import numbers
from zerorate.cli.options import (
    CalibrationOption,
    Fix,
    LogArgument,
    Reading,
    with_group,
    with_options,
    with_reading_options,
)
from zerorate.cli.outputs import LogAndFigure, check_outputs, print_written, progress_bar
from zerorate.navigation.options import FOOT_OPTIONS
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.saving import files_of
from zerorate.tasks.walk import walk as find_track

_FILTER: Final = "Walk"
_MAPS: Final = ("geojson", "gpx")


@dataclass(frozen=True)
class _Start:
    """What is typed of where the walk starts on the earth."""

    at: Annotated[
        str | None,
        typer.Option(
            metavar="LAT,LON",
            help="Where it starts, deg: writes the track for maps, as GeoJSON and GPX.",
        ),
    ] = None
    heading: Annotated[
        float | None,
        typer.Option(
            metavar="DEG",
            help="With --at: where the sensor's first axis looks at the start, deg from north over "
            "east. Default 0.",
        ),
    ] = None
    height: Annotated[
        float | None,
        typer.Option(metavar="M", help="With --at: height of the start, m. Default 0."),
    ] = None

    def arguments(self) -> dict[str, Any]:
        """Return those of `zerorate.walk`."""
        place = "latitude and longitude, deg,"
        return {
            "at": None if self.at is None else numbers("--at", self.at, 2, place),
            "heading": None if self.heading is None else math.radians(self.heading),
            "height": self.height,
        }


@with_group(LogAndFigure, "written")
@with_group(_Start, "origin", _FILTER)
@with_options(FOOT_OPTIONS, "constants", panel=_FILTER)
@with_reading_options(imu=True, without=("group_by",))
def walk(
    *,
    log: LogArgument,
    reading: Reading,
    constants: Mapping[str, Any],
    smooth: Annotated[
        bool,
        typer.Option(
            "--smooth",
            help="See each sample in the light of the whole log, also of what comes later.",
            rich_help_panel=_FILTER,
        ),
    ] = False,
    origin: _Start,
    calibration: CalibrationOption = None,
    clipped: ClippedOption = Clipped.auto,
    fix: Fix = False,
    written: LogAndFigure,
) -> None:
    """Find where a sensor on a foot went: no receiver, but now and then the foot stands.

    Writes place, velocity and orientation with their standard deviations, and a figure; with --at
    the track for maps. Prints how far it went, where it ends, and the strides in numbers.
    """
    asked = {**origin.arguments(), **constants}
    maps = () if origin.at is None else _MAPS
    outputs = written.at(written.place(f"{log.stem}-zerorate-walk", *maps), maps)
    check_outputs(outputs.paths, written.force, log, calibration)
    written.preload("foot_figure")
    with progress_bar() as progress:
        track = in_background(
            lambda: find_track(
                log, smooth=smooth, calibration=calibration, clipped=clipped.value, fix=fix,
                progress=progress, **asked, **reading.arguments,
            )
        )  # fmt: skip
        outputs.save(files_of(track), progress, done=0.8)
    print_alarms(track.alarms)
    print(track)
    print_written(outputs.paths)
