"""``zerorate navigate``: track of a vehicle, from inertial sensors and a receiver."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, Literal

from zerorate.cli.errors import UsageFault
from zerorate.cli.filter_options import TableOptions
from zerorate.cli.options import (
    CalibrationOption,
    ClippedOption,
    Fix,
    LogArgument,
    ReferenceOffset,
    Tum,
)
from zerorate.cli.outputs import LogAndPanels, check_outputs, of_sensor, print_result, run_and_save
from zerorate.cli.parameters import Argument, Option, option
from zerorate.cli.reading import PANEL, Reading, ReadingOptions
from zerorate.cli.values import parse_numbers
from zerorate.io.mounting import mounting_of
from zerorate.navigation.aids import OUTPUTS
from zerorate.navigation.options import NAVIGATION_OPTIONS
from zerorate.record.mounting import Mounting
from zerorate.tasks.navigate import navigate as find_track

_FILTER: Final = "Navigation"
"""Panel of help with the filter's options."""
_COURSE: Final = "course"
_AUTO: Final = "auto"
_NONE: Final = "none"
_BY_METADATA: Final = Mounting()
_MAPS: Final = ("geojson", "gpx")
_MAX_HEADING_DEG: Final = 360.0


def _parse_lengths(flag: str, text: str) -> list[float]:
    expected = "lengths in s, such as 10,30,60,"
    lengths = parse_numbers(flag, text, text.count(",") + 1, expected)
    if min(lengths) <= 0.0:
        raise UsageFault(f"{flag} takes lengths above 0 s, got '{text}'")
    return lengths


def _parse_limits(flag: str, text: str) -> dict[str, float]:
    pairs = [part.partition("=") for part in text.split(",")]
    limits = {name.strip(): _number(value) for name, _, value in pairs}
    if not set(limits) <= set(OUTPUTS) or not all(0.0 < one < math.inf for one in limits.values()):
        raise UsageFault(
            f"{flag} takes limits above 0 such as position=5,heading=0.1, of "
            f"{', '.join(OUTPUTS)}, got '{text}'"
        )
    return limits


def _parse_heading(flag: str, text: str) -> float | str:
    if text == _COURSE:
        return text
    degrees = _number(text)
    if not abs(degrees) <= _MAX_HEADING_DEG:
        raise UsageFault(f"{flag} takes deg within 360, or 'course', got '{text}'")
    return math.radians(degrees)


def _parse_span(flag: str, text: str) -> tuple[float, float]:
    start, stop = parse_numbers(flag, text, 2, "two times, such as 0,20,")
    if not stop > start:
        raise UsageFault(f"{flag} must end after it begins, got '{text}'")
    return start, stop


_PARSE_VECTOR: Final = partial(parse_numbers, count=3, expected="three numbers")


def _parse_mount(_: str, text: str) -> Mounting | None:
    """Return the stated mounting; None for "none", which also ignores the recording's mounting."""
    return None if text == _NONE else mounting_of(text)


def _parse_offset(flag: str, text: str) -> float | str:
    if text == _AUTO:
        return text
    offset = _number(text)
    if not math.isfinite(offset):
        raise UsageFault(f"{flag} takes seconds, or 'auto', got '{text}'")
    return offset


def _number(text: str) -> float:
    """Return the number in a text; NaN for other texts."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def _parse_file(flag: str, text: str) -> Path:
    if not Path(text).exists():
        raise UsageFault(f"{flag} names {text}, which does not exist")
    return Path(text)


@dataclass(frozen=True)
class _Run:
    """Options of the filter, named as arguments of `zerorate.navigate`."""

    panel: ClassVar = _FILTER

    outages: Sequence[float] = option(
        (),
        "Withhold fixes for e.g. 10,30,60 s; print the errors.",
        metavar="S,S",
        parse=_parse_lengths,
    )
    smooth: bool = option(False, "Smooth: use later fixes too (forward-backward pass).")
    heading: float | str | None = option(
        None,
        "Initial heading, deg from north over east; or course. 'course' is the direction of the "
        "first motion. Default: determined from the motion.",
        metavar="DEG",
        parse=_parse_heading,
    )
    rest: tuple[float, float] | None = option(
        None,
        "Start and end of the rest at the start, s after the first sample. Default: before the "
        "receiver moves, if for 3 s or more; else the filter starts in motion.",
        metavar="START,STOP",
        parse=_parse_span,
    )
    gyro_noise: Path | None = option(
        None,
        "Gyro noise (JSON of zerorate allan --export json, or Kalibr's imu.yaml). By default that "
        "of a consumer sensor.",
        metavar="MODEL",
    )
    accel_noise: Path | None = option(
        None, "Accelerometer noise (file as for --gyro-noise).", metavar="MODEL"
    )
    noise: Literal["auto", "stated"] = option(
        "auto",
        "Process noise. auto: fitted so that errors without fixes agree with their sigma; stated "
        "models are only increased. stated: exactly as the models.",
    )


@dataclass(frozen=True)
class _Body:
    """Options of the vehicle and of its sensors' positions."""

    panel: ClassVar = "The vehicle"

    vehicle: Literal["wheeled"] | None = option(
        None, "wheeled: the vehicle does not slip sideways or jump."
    )
    axle: Sequence[float] | None = option(
        None,
        "Vector from the sensors to the unsteered axle, m. Forward, right, down; for --vehicle "
        "wheeled.",
        metavar="X,Y,Z",
        parse=_PARSE_VECTOR,
    )
    wheel_speed: str | None = option(
        None,
        "Column of the wheels' speed, m/s. For vehicles with wheels; scale and mounting are "
        "estimated.",
        metavar="COLUMN",
    )
    wheel_ticks: str | None = option(
        None,
        "Column of a wheel's tick count, instead of its speed.",
        metavar="COLUMN",
    )
    tick: float | None = option(
        None,
        "Metres for each tick of --wheel-ticks, to some per cent. Default: from the receiver's "
        "speed.",
        metavar="M",
    )
    pressure: str | None = option(
        None,
        "Column of a barometer's pressure. By default it is found by its name, e.g. pressure_hpa.",
        metavar="COLUMN",
    )
    pressure_unit: Literal["Pa", "hPa", "kPa", "bar", "inHg", "mmHg", "psi"] | None = option(
        None,
        "Unit of the pressure. Default: from the column's name, or from the values at the fixes' "
        "height.",
    )
    baro_height: str | None = option(
        None,
        "Column of a barometer's height, m, instead of its pressure. By default it is found by its "
        "name, e.g. baro_alt_m.",
        metavar="COLUMN",
    )
    compass: str | None = option(
        None,
        "Column of a compass's heading, or that of two antennas. By default it is found by its "
        "name, e.g. heading_deg.",
        metavar="COLUMN",
    )
    compass_unit: Literal["deg", "rad"] | None = option(
        None, "Unit of the heading. Default: from the column's name, the values or the motion."
    )
    mag: bool = option(False, "Use the magnetometer as a compass, calibrated from the motion.")
    baseline: Sequence[float] | None = option(
        None,
        "Vector from the first to the second antenna, m. Forward, right, down; for measured "
        "vectors between two antennas.",
        metavar="X,Y,Z",
        parse=_PARSE_VECTOR,
    )
    baseline_columns: str | None = option(
        None,
        "Columns of the measured vector north, east, down, m. By default they are found by name, "
        "e.g. baseline_north_m.",
        metavar="N,E,D",
    )
    aids: Literal["auto", "stated"] = option(
        "auto", "Aids to use. stated: those of the options above; auto: also those found by name."
    )
    limits: Mapping[str, float] | None = option(
        None,
        "Largest standard deviations of usable outputs, e.g. position=5,heading=0.1. Names: "
        "position, height (m), velocity (m/s), attitude, heading (rad).",
        metavar="NAME=LIMIT",
        parse=_parse_limits,
    )
    antenna: Sequence[float] | None = option(
        None,
        "Vector from the sensors to the antenna, m. Forward, right, down. Default: from the "
        "file's metadata, or else 0,0,0. It is the start of an estimate with the standard "
        "deviation --antenna-sigma: by default 0.05 m if the vector is stated, otherwise 1 m.",
        metavar="X,Y,Z",
        parse=_PARSE_VECTOR,
    )
    mount: Mounting | None = option(
        _BY_METADATA,
        "Rotation from the sensors to forward, right, down. Nine numbers row by row, with "
        "commas, or a file with them or with such metadata; 'none' for no rotation. Default: as "
        "in the recording's metadata.",
        metavar="MATRIX",
        shown="",
        parse=_parse_mount,
    )
    time_offset: float | str | None = option(
        None,
        "Seconds to add to the times of the fixes, or auto. auto, the default, searches the best "
        "fit of sensors and fixes near the offset in the metadata.",
        metavar="S",
        parse=_parse_offset,
    )

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of `zerorate.navigate`; --mount may add antenna and clock."""
        stated = self.mount or _BY_METADATA
        matrix, antenna, offset = stated.body_from_sensor, stated.antenna, stated.time_offset
        mount = _NONE if self.mount is None else _AUTO if matrix is None else matrix
        return {
            **vars(self),
            "mount": mount,
            "antenna": antenna if self.antenna is None else self.antenna,
            "time_offset": next((t for t in (self.time_offset, offset) if t is not None), _AUTO),
        }


def navigate(
    *,
    log: LogArgument,
    gnss: Annotated[
        Path | None,
        Argument(
            "Fixes of the receiver: NMEA, RTKLIB, NavSatFix or a table. By default they are "
            "in the recording."
        ),
    ] = None,
    reading: Annotated[Reading, ReadingOptions(imu=True, without=("group_by",))],
    run: _Run,
    constants: Annotated[Mapping[str, Any], TableOptions(NAVIGATION_OPTIONS, _FILTER)],
    body: _Body,
    reference: Annotated[
        Path | None,
        Option(
            "Ground truth to compare with: a TUM or EuRoC trajectory (same clock as the log, "
            "z up, any origin and heading), or the fixes of a better receiver.",
            metavar="FILE",
            parse=_parse_file,
            panel=PANEL,
        ),
    ] = None,
    reference_offset: ReferenceOffset = 0.0,
    tum: Tum = False,
    calibration: CalibrationOption = None,
    clipped: ClippedOption = "auto",
    fix: Fix = False,
    written: LogAndPanels,
) -> None:
    """Find the track of a vehicle from gyro, accelerometer and the fixes of a receiver.

    Writes position, velocity, attitude and biases with their standard deviations, the track for
    maps as GeoJSON and GPX, and a figure. Prints the numbers of used and rejected fixes. With
    --outages, also prints the errors without fixes, compared with a constant position and a
    constant velocity.
    """
    place = of_sensor(written.place(f"{log.stem}-zerorate-navigate", *_MAPS), reading)
    others = [f".{one}" for one in (*_MAPS, *(("tum",) if tum else ()))]
    outputs = written.at(place, others)
    check_outputs(outputs.paths, written.force, log, gnss, calibration)
    panels = written.panels
    written.preload("navigation_figure")
    task = partial(
        find_track, log, gnss, reference=reference, reference_offset=reference_offset,
        calibration=calibration, clipped=clipped, fix=fix,
        **constants, **vars(run), **body.arguments(), **reading.arguments,
    )  # fmt: skip
    print_result(*run_and_save(task, outputs, 0.8, tum=tum, panels=panels))
