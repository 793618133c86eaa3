"""Options that select the data to read from a log: columns, units, clock, parts."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from zerorate.cli.errors import UsageFault
from zerorate.cli.parameters import Option, Typed
from zerorate.cli.values import parse_columns, parse_fractions
from zerorate.io import raw_counts, split_log
from zerorate.io.counts import Scale
from zerorate.io.formats import LogSource

PANEL: Final = "Reading the log"
"""The panel of help."""


def _parse_columns(flag: str, text: str) -> tuple[str | int, ...]:
    return tuple(parse_columns(flag, text))


def _parse_first(flag: str, text: str) -> str | int:
    return parse_columns(flag, text)[0]


def _parse_time(flag: str, text: str) -> str | int:
    """Return the column of the timestamps, False for none of them."""
    column = _parse_first(flag, text)
    return False if column == "none" else column


_OPTIONS: Final = (
    Option(
        "Names, or positions counted from 0 over all columns, e.g. gx,gy,gz. Default: the three "
        "axes of one gyro, by their names.",
        name="columns",
        parse=_parse_columns,
        metavar="NAMES",
    ),
    Option(
        "The same of the accelerometer.", name="accel_columns", parse=parse_columns, metavar="NAMES"
    ),
    Option(
        "The same of the magnetometer.", name="mag_columns", parse=parse_columns, metavar="NAMES"
    ),
    Option(
        "Unit of the gyro columns if their names do not say: rad/s, deg/s or deg/h. Values are "
        "not converted.",
        name="unit",
        metavar="UNIT",
    ),
    Option(
        "Samples per second. Needed where the log has no timestamps.",
        name="rate",
        metavar="HZ",
        kind=float,
    ),
    Option(
        "Column of the timestamps, by name or position; none reads the log without, by --rate.",
        name="time",
        parse=_parse_time,
        metavar="NAME",
    ),
    Option(
        "Unit of timestamps that do not say it: s, ms, us, ns, 100us, min, h, days, or samples of "
        "--rate.",
        name="time_unit",
        metavar="UNIT",
    ),
    Option(
        "Leave out lines of a text that are not whole rows: --torn skip. By default such a line "
        "inside a log is an error.",
        name="torn",
        choices=("skip",),
    ),
    Option(
        "What the values are multiplied by, e.g. 1/131 for raw counts; --unit says what they are "
        "then.",
        name="scale",
        parse=partial(parse_fractions, example="0.0076, 1/131 or 1/131,1/16384"),
        metavar="FACTOR",
    ),
    Option(
        "Sensor whose raw counts become deg/s by the numbers of its data sheet, e.g. MPU-6050; "
        "with --range.",
        name="device",
        metavar="NAME",
    ),
    Option(
        "Range that the gyro of --device was set to, e.g. 250.",
        name="range",
        parse=partial(parse_fractions, example="250 or 250,2"),
        metavar="DEG/S",
    ),
    Option(
        "Which sensor of several in one table: words of its columns' names, e.g. imu2, left_ankle, "
        "raw; or all.",
        name="sensor",
        metavar="NAME",
    ),
    Option("Begin so many seconds after the first sample.", name="start", metavar="S", kind=float),
    Option("End so many seconds after the first sample.", name="stop", metavar="S", kind=float),
    Option(
        "Topic of a ROS recording or a PX4 log, where several hold an IMU.",
        name="topic",
        metavar="TOPIC",
    ),
    Option(
        "Column that tells several sensors or recordings apart: each is a log.",
        name="group_by",
        parse=_parse_first,
        metavar="COLUMN",
    ),
)

READING: Final = tuple(one.name for one in _OPTIONS)
"""Names of the options of reading a log."""

_COLUMNS_OF: Final = {"accel_columns": "accel", "mag_columns": "mag"}
"""Options with columns of another sensor than the gyro, and its kind."""

OF_IMU: Final = {
    "unit": "Unit of the gyro columns if their names do not say: rad/s, deg/s or deg/h; with a "
    "comma between that of the accelerometer, g or m/s^2: deg/s,g.",
    "scale": "What the values of the gyro are multiplied by, e.g. 1/131 for raw counts, and with a "
    "comma between those of the accelerometer: 1/131,1/16384. --unit says what they are then.",
    "device": "Sensor whose raw counts become deg/s and g by the numbers of its data sheet, e.g. "
    "MPU-6050; with --range.",
    "range": "Range that the gyro of --device was set to, deg/s, and that of the accelerometer, g, "
    "e.g. 250,2.",
}
"""Help of those that say more where a command reads gyro and accelerometer."""


@dataclass(frozen=True)
class Reading:
    """Selection of the data to read from a log.

    Attributes
    ----------
    arguments : mapping
        Those of `zerorate.read_log` and of the other readers.
    group_by : str or int or None
        Column that tells several logs in a file apart.
    """

    arguments: Mapping[str, Any]
    group_by: str | int | None = None


@dataclass(frozen=True)
class ReadingOptions:
    """The options of reading a log, which a command takes as a `Reading`.

    Parameters
    ----------
    imu : bool
        True if the command reads all sensors of a recording, whose columns may be named.
    without : sequence of str
        Options that mean nothing to the command.
    help : mapping of str to str
        Texts for some options instead of the common ones.
    """

    imu: bool = False
    without: Sequence[str] = ()
    help: Mapping[str, str] = field(default_factory=dict)

    def options(self) -> Iterator[Option]:
        """Yield the options."""
        texts = {**(OF_IMU if self.imu else {}), **self.help}
        for one in _OPTIONS:
            if one.name not in self.without and (self.imu or one.name not in _COLUMNS_OF):
                text = texts.get(one.name, one.help)
                yield replace(one, help=text, default=None, panel=PANEL)

    def value(self, typed: Typed) -> Reading:
        """Return the selection of the data to read."""
        known = {one.name: typed.get(one.name) for one in self.options()}
        others = {sensor: known.pop(name, None) for name, sensor in _COLUMNS_OF.items()}
        if any(others.values()):
            known["columns"] = {"gyro": known["columns"], **others}
        known["scale"] = _scale(known["scale"], known.pop("device"), known.pop("range"))
        return Reading(known, known.pop("group_by", None))


def _scale(factors: list[float] | None, device: str | None, ranges: list[float] | None) -> Scale:
    """Return the factor of raw counts, given as it is or by a device and its ranges."""
    if (device is None) != (ranges is None):
        missing, there = ("--device", "--range") if device is None else ("--range", "--device")
        raise UsageFault(f"{there} needs {missing}, as in --device MPU-6050 --range 250")
    if device is not None and ranges is not None:
        if factors is not None:
            raise UsageFault("give either --scale or --device with --range, not both")
        return raw_counts(device, *ranges)
    if factors is None:
        return None
    first, *more = factors
    return {"gyro": first, "accel": more[0]} if more else first


@dataclass(frozen=True)
class Record:
    """Data read as one log.

    Attributes
    ----------
    source : LogSource
        The file, or a part of it.
    title : str
        Of its results; empty for a whole file.
    ending : str
        Of the names of its files; empty for a whole file.
    """

    source: LogSource
    title: str = ""
    ending: str = ""


def records(log: Path, group_by: str | int | None) -> Sequence[Record]:
    """Return the records in a file: itself, or one for each value in a column."""
    if group_by is None:
        return [Record(log)]
    parts = split_log(log, group_by)
    endings: dict[str, None] = {}
    for name in parts:
        ending = "-" + re.sub(r"[^\w.-]+", "_", name)[:40]
        # Names may differ in what no file's name should hold.
        endings[f"{ending}-{len(endings)}" if ending in endings else ending] = None
    return [
        Record(part, part.label, ending)
        for part, ending in zip(parts.values(), endings, strict=True)
    ]
