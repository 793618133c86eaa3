"""``zerorate navigate``: the track of a vehicle, from its inertial sensors and its receiver."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from zerorate.cli.clipping import Clipped, ClippedOption
from zerorate.cli.errors import UsageFault, print_alarms
from zerorate.cli.mounts import antenna_of, mounting_of, numbers, offset_of
from zerorate.cli.options import (
    PANEL,
    CalibrationOption,
    Fix,
    LogArgument,
    Reading,
    with_group,
    with_options,
    with_reading_options,
)
from zerorate.cli.outputs import LogAndPanels, check_outputs, print_written, progress_bar
from zerorate.cli.references import ReferenceOffset, Tum, existing
from zerorate.navigation.options import NAVIGATION_OPTIONS
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.navigate import navigate as find_track
from zerorate.tasks.saving import files_of

_FILTER: Final = "Navigation"
_VEHICLE: Final = "The vehicle"
_COURSE: Final = "course"
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

    def arguments(self) -> dict[str, Any]:
        """Return those of `zerorate.navigate`."""
        return {
            "outages": _lengths(self.lengths),
            "smooth": self.smooth,
            "heading": _heading(self.heading),
            "rest": _span(self.rest),
            "gyro_noise": self.gyro_noise,
            "accel_noise": self.accel_noise,
        }


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

    def arguments(self) -> dict[str, Any]:
        """Return those of `zerorate.navigate`; a file of --mount may state antenna and clock."""
        stated = mounting_of(self.mount)
        axle = None if self.axle is None else numbers("--axle", self.axle, 3, "three numbers")
        return {
            "vehicle": None if self.vehicle is None else str(self.vehicle),
            "axle": axle,
            "wheel_speed": self.wheel_speed,
            "wheel_ticks": self.wheel_ticks,
            "tick": self.tick,
            "antenna": antenna_of(self.antenna, stated),
            "mount": stated.mount,
            "time_offset": offset_of(self.time_offset, stated),
        }


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
            help="Ground truth to compare with: a TUM or EuRoC trajectory (same clock as the log, "
            "z up, any origin and heading), or the fixes of a better receiver.",
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
    far the track is off without them, next to a position and a velocity that are held.
    """
    asked = {**run.arguments(), **body.arguments()}
    truth = existing(reference)
    place = written.place(f"{log.stem}-zerorate-navigate", *_MAPS)
    outputs = written.at(place, (*_MAPS, *(("tum",) if tum else ())))
    check_outputs(outputs.paths, written.force, log, gnss, calibration)
    panels = "all" if written.everything else "usual"
    written.preload("navigation_figure")
    with progress_bar() as progress:
        found = in_background(
            lambda: find_track(
                log, gnss, calibration=calibration, clipped=clipped.value, fix=fix,
                reference=truth, reference_offset=reference_offset, progress=progress, **constants,
                **asked, **reading.arguments,
            )
        )  # fmt: skip
        outputs.save(files_of(found, tum=tum, panels=panels), progress, done=0.8)
    print_alarms(found.alarms)
    print(found)
    print_written(outputs.paths)


def _lengths(text: str | None) -> list[float]:
    if text is None:
        return []
    found = numbers("--outages", text, text.count(",") + 1, "lengths in s, such as 10,30,60,")
    if min(found) <= 0.0:
        raise UsageFault(f"--outages takes lengths above 0 s, got '{text}'")
    return found


def _heading(text: str | None) -> float | str | None:
    if text is None or text == _COURSE:
        return text
    try:
        degrees = float(text)
    except ValueError:
        degrees = math.nan
    if not abs(degrees) <= 360.0:
        raise UsageFault(f"--heading takes deg within 360, or 'course', got '{text}'")
    return math.radians(degrees)


def _span(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    start, stop = numbers("--rest", text, 2, "two times, such as 0,20,")
    if not stop > start:
        raise UsageFault(f"--rest must end after it begins, got '{text}'")
    return start, stop
