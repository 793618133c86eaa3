"""Options for reading a log: columns, units, clock, parts."""

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
"""Panel of help for these options."""


def _parse_columns(flag: str, text: str) -> tuple[str | int, ...]:
    return tuple(parse_columns(flag, text))


def _parse_first(flag: str, text: str) -> str | int:
    return parse_columns(flag, text)[0]


def _parse_time(flag: str, text: str) -> str | int:
    """Return the column of the timestamps; False for none."""
    column = _parse_first(flag, text)
    return False if column == "none" else column


_OPTIONS: Final = (
    Option(
        "Gyro columns, by name or position, e.g. gx,gy,gz. Positions count from 0 over all "
        "columns. Default: the three axes of one gyro, by their names.",
        name="columns",
        parse=_parse_columns,
        metavar="NAMES",
    ),
    Option(
        "Accelerometer columns, by name or position.",
        name="accel_columns",
        parse=parse_columns,
        metavar="NAMES",
    ),
    Option(
        "Magnetometer columns, by name or position.",
        name="mag_columns",
        parse=parse_columns,
        metavar="NAMES",
    ),
    Option(
        "Unit of the gyro: rad/s, deg/s or deg/h. Needed if the columns' names lack it; values "
        "are not converted.",
        name="unit",
        metavar="UNIT",
    ),
    Option(
        "Samples per second, for logs without timestamps.",
        name="rate",
        metavar="HZ",
        kind=float,
    ),
    Option(
        "Column of timestamps, by name or position, or none. With none, timestamps are ignored "
        "and --rate is used.",
        name="time",
        parse=_parse_time,
        metavar="NAME",
    ),
    Option(
        "Unit of timestamps: s, ms, us, ns, 100us, min, h, days, or samples of --rate.",
        name="time_unit",
        metavar="UNIT",
    ),
    Option(
        "Skip incomplete rows of a text file. By default an incomplete row inside a log is an "
        "error.",
        name="torn",
        choices=("skip",),
    ),
    Option(
        "Factor of the values, e.g. 1/131 for raw counts. The result is in --unit.",
        name="scale",
        parse=partial(parse_fractions, example="0.0076, 1/131 or 1/131,1/16384"),
        metavar="FACTOR",
    ),
    Option(
        "Sensor of raw counts, e.g. MPU-6050; with --range. They become deg/s by its data sheet.",
        name="device",
        metavar="NAME",
    ),
    Option(
        "Range setting of the --device's gyro, deg/s, e.g. 250.",
        name="range",
        parse=partial(parse_fractions, example="250 or 250,2"),
        metavar="DEG/S",
    ),
    Option(
        "Sensor to read from a table with several, e.g. imu2; or all. Sensors are named by words "
        "of their columns, such as left_ankle or raw.",
        name="sensor",
        metavar="NAME",
    ),
    Option(
        "Start of the part to read, s after the first sample.",
        name="start",
        metavar="S",
        kind=float,
    ),
    Option(
        "End of the part to read, s after the first sample.", name="stop", metavar="S", kind=float
    ),
    Option(
        "Topic of a ROS or PX4 log, if several have an IMU.",
        name="topic",
        metavar="TOPIC",
    ),
    Option(
        "Split the table by this column into one log for each value.",
        name="group_by",
        parse=_parse_first,
        metavar="COLUMN",
    ),
)

READING: Final = tuple(one.name for one in _OPTIONS)
"""Names of the options for reading a log."""

_COLUMNS_OF: Final = {"accel_columns": "accel", "mag_columns": "mag"}
"""Options for columns of other sensors than the gyro, with the kinds."""

OF_IMU: Final = {
    "unit": "Units of gyro and accelerometer, e.g. deg/s,g. Gyro: rad/s, deg/s or deg/h; "
    "accelerometer: g or m/s^2. Needed if the columns' names lack them.",
    "scale": "Factors of gyro and accelerometer: 1/131,1/16384. The results are in --unit.",
    "device": "Sensor of raw counts, e.g. MPU-6050; with --range. They become deg/s and g by its "
    "data sheet.",
    "range": "Ranges set on the --device, deg/s and g, e.g. 250,2.",
}
"""Help texts for commands that read gyro and accelerometer."""


@dataclass(frozen=True)
class Reading:
    """Data to read from a log.

    Attributes
    ----------
    arguments : mapping
        Arguments of `zerorate.read_log` and of the other readers.
    group_by : str or int or None
        Column that distinguishes several logs in a file; None without one.
    """

    arguments: Mapping[str, Any]
    group_by: str | int | None = None


@dataclass(frozen=True)
class ReadingOptions:
    """Options for reading a log; a command receives them as a `Reading`.

    Parameters
    ----------
    imu : bool
        True if the command reads all sensors of a recording, with columns for each.
    without : sequence of str
        Options without effect for the command.
    help : mapping of str to str
        Help texts in place of the common ones.
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
        """Return the data to read."""
        known = {one.name: typed.get(one.name) for one in self.options()}
        others = {sensor: known.pop(name, None) for name, sensor in _COLUMNS_OF.items()}
        if any(others.values()):
            known["columns"] = {"gyro": known["columns"], **others}
        known["scale"] = _scale(known["scale"], known.pop("device"), known.pop("range"))
        return Reading(known, known.pop("group_by", None))


def _scale(factors: list[float] | None, device: str | None, ranges: list[float] | None) -> Scale:
    """Return the factor of raw counts, as stated or from a device and its ranges."""
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
    """Data that are read as one log.

    Attributes
    ----------
    source : LogSource
        File, or a part of it.
    title : str
        Title of the results; empty for a whole file.
    ending : str
        Ending of file names; empty for a whole file.
    """

    source: LogSource
    title: str = ""
    ending: str = ""


def records(log: Path, group_by: str | int | None) -> Sequence[Record]:
    """Return the records in a file: the file itself, or one for each value of a column."""
    if group_by is None:
        return [Record(log)]
    parts = split_log(log, group_by)
    endings: dict[str, None] = {}
    for name in parts:
        ending = "-" + re.sub(r"[^\w.-]+", "_", name)[:40]
        # Different values can give equal file names.
        endings[f"{ending}-{len(endings)}" if ending in endings else ending] = None
    return [
        Record(part, part.label, ending)
        for part, ending in zip(parts.values(), endings, strict=True)
    ]
