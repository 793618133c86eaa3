"""``zerorate walk``: where a sensor on a foot went, from its gyro and accelerometer alone."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from zerorate.cli.calibrations import naming, read_calibration, read_imu
from zerorate.cli.checking import checked, print_alarms, said_first
from zerorate.cli.clipping import Clipped, ClippedOption
from zerorate.cli.errors import UsageFault
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
from zerorate.foot.foot import FootNavigation, FootTrack, PlacedTrack
from zerorate.io import write_log
from zerorate.navigation.options import FOOT_OPTIONS
from zerorate.navigation.tracks import write_geojson, write_gpx
from zerorate.progress import Progress
from zerorate.record import Recording
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.saving import Outputs

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

    def placed(self) -> dict[str, float] | None:
        """Return the arguments of `FootTrack.placed`, None without any; or raise a usage fault."""
        if self.at is None:
            for name, value in (("heading", self.heading), ("height", self.height)):
                if value is not None:
                    raise UsageFault(f"--{name} needs --at")
            return None
        latitude, longitude = numbers("--at", self.at, 2, "latitude and longitude, deg,")
        if abs(latitude) > 89.5 or abs(longitude) > 360.0:
            raise UsageFault(f"--at takes deg, latitude within 89.5 first, got '{self.at}'")
        heading = self.heading or 0.0
        if not abs(heading) <= 360.0:
            raise UsageFault(f"--heading takes deg within 360, got {heading:g}")
        return {
            "latitude": latitude,
            "longitude": longitude,
            "heading": heading,
            "height": self.height or 0.0,
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
    on_earth = origin.placed()
    known = None if calibration is None else read_calibration(calibration)
    maps = () if on_earth is None else _MAPS
    files = written.at(written.place(f"{log.stem}-zerorate-walk", *maps), maps)
    check_outputs(files.paths, written.force, log, calibration)
    written.preload("foot_figure")
    nav = FootNavigation(restore=clipped is not Clipped.leave, **constants)
    with progress_bar() as progress:
        recording = read_imu(reading, log)
        with naming(recording):
            corrected = recording if known is None else known.apply(recording)
            corrected, alarms = checked(corrected, fix)
        with said_first(alarms), naming(recording):
            track = in_background(lambda: _walked(nav, corrected, smooth, progress))
            placed = None if on_earth is None else track.placed(**on_earth)
        _write(files, track, placed, progress)
    print_alarms(alarms)
    print(track.table())
    print_written(files.paths)


def _walked(
    nav: FootNavigation, recording: Recording, smooth: bool, progress: Progress
) -> FootTrack:
    progress("navigating", 0.1)
    track = nav.process(recording, keep="all" if smooth else "track")
    if not smooth:
        return track
    progress("smoothing", 0.5)
    return track.smooth()


def _write(
    outputs: Outputs, track: FootTrack, placed: PlacedTrack | None, progress: Progress
) -> None:
    from zerorate.show import save_figure

    writers: list[Callable[[Path], object]] = [partial(write_log, track.to_log())]
    if placed is not None:
        writers += [
            lambda path: write_geojson(path, placed, force=True),
            lambda path: write_gpx(path, placed, force=True),
        ]
    outputs.write(writers, lambda path: save_figure(track.plot(), path), progress, done=0.8)
