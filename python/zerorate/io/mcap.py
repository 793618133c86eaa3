"""Logs as MCAP for Foxglove and PlotJuggler: messages of ROS 2 with their schemas.

The names of columns determine the topics:

- ``/imu``: a gyro with three axes, and its accelerometer
- ``/pose``: quaternions
- ``/fix``: latitude, longitude, height
- ``/bias``: three axes
- ``/status``: all other columns

All messages of a row have a fixed length and are written together by NumPy. See
https://mcap.dev/spec.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Final

import numpy as np

from zerorate._native import pack_lz4
from zerorate.io.gyroflow import find_triad
from zerorate.io.table import Column
from zerorate.record.log import Log, LogError
from zerorate.record.names import is_quaternion, to_snake_case
from zerorate.types import Integers
from zerorate.units import convert

_MAGIC: Final = b"\x89MCAP0\r\n"
_CHUNK_ROWS: Final = 8192
"""Rows per chunk; readers load a whole chunk."""
_COMPRESSION: Final = "lz4"
_CDR: Final = b"\x00\x01\x00\x00"
_TOPIC_FRAMES: Final = {"/pose": b"global\0"}
_FRAME: Final = b"sensor\0"
"""Name of the frame; it has the same length in all topics, for the alignment of the fields."""
_STAMP: Final = "builtin_interfaces/Time"
_SEPARATOR: Final = "\n" + "=" * 80 + "\n"
_HEADER: Final = (
    f"{_SEPARATOR}MSG: std_msgs/Header\n{_STAMP} stamp\nstring frame_id"
    f"{_SEPARATOR}MSG: {_STAMP}\nint32 sec\nuint32 nanosec"
)
_QUATERNION: Final = (
    f"{_SEPARATOR}MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w"
)
_VECTOR: Final = f"{_SEPARATOR}MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z"
_POINT: Final = f"{_SEPARATOR}MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z"
_SCHEMAS: Final = {
    "sensor_msgs/msg/Imu": "std_msgs/Header header\n"
    "geometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
    "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance"
    + _HEADER
    + _QUATERNION
    + _VECTOR,
    "geometry_msgs/msg/PoseStamped": "std_msgs/Header header\ngeometry_msgs/Pose pose"
    + _HEADER
    + f"{_SEPARATOR}MSG: geometry_msgs/Pose\n"
    + "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation"
    + _POINT
    + _QUATERNION,
    "geometry_msgs/msg/Vector3Stamped": "std_msgs/Header header\ngeometry_msgs/Vector3 vector"
    + _HEADER
    + _VECTOR,
    "sensor_msgs/msg/NavSatFix": "std_msgs/Header header\nsensor_msgs/NavSatStatus status\n"
    "float64 latitude\nfloat64 longitude\nfloat64 altitude\n"
    "float64[9] position_covariance\nuint8 position_covariance_type"
    + _HEADER
    + f"{_SEPARATOR}MSG: sensor_msgs/NavSatStatus\nint8 status\nuint16 service",
}
_BIAS: Final = re.compile(r"^(?:gyro_)?bias_(?:gyro_)?([xyz])_(radps|dps|degph)$")
_UNITS: Final = {"radps": "rad/s", "dps": "deg/s", "degph": "deg/h"}


@dataclass(frozen=True)
class _Topic:
    """Messages of a topic: after the header, each number is a constant or a column's value."""

    name: str
    schema: str
    text: str
    fields: Sequence[tuple[str, str]]
    """Columns' names (empty for constants) and types, in the order of the bytes."""
    values: dict[str, Column]
    constants: Mapping[int, float]


def write_mcap(log: Log, path: Path, names: Sequence[str]) -> None:
    """Write a log and its extra columns.

    Raises
    ------
    LogError
        If a time is negative, which MCAP cannot store.
    """
    if log.n and log.sampled[0] < 0:
        raise LogError(f"MCAP has no times before 0, got {log.sampled[0]:g} s")
    # Doubles resolve nanoseconds up to a hundred days, and only microseconds for dates since 1970.
    step = 1 if log.sampled.max(initial=0.0) < 1e-9 * 2**53 else 1000
    stamps = np.rint(log.sampled * (1e9 / step)).astype(np.int64) * step
    columns = {**dict(zip(names, log.data.T, strict=True)), **log.extra}
    topics = _make_topics(columns)
    with path.open("wb") as file:
        _McapWriter(file, topics, stamps).write()


def _make_topics(columns: dict[str, Column]) -> list[_Topic]:
    """Return the topics; each column is in one of them."""
    remaining = dict(columns)
    topics = []
    for make in (_make_imu, _make_pose, _make_fix, _make_bias):
        topic = make(remaining)
        if topic is not None:
            topics.append(topic)
            remaining = {
                name: values for name, values in remaining.items() if name not in topic.values
            }
    if remaining:
        topics.append(_make_status(remaining))
    return topics


def _make_imu(columns: dict[str, Column]) -> _Topic | None:
    gyro = find_triad(columns, "gyro", "rad/s")
    if gyro is None:
        return None
    accel = find_triad(columns, "accel", "m/s^2") or {}
    fields = [("", "f8")] * 13 + [(name, "f8") for name in gyro] + [("", "f8")] * 9
    fields += [(name, "f8") for name in accel] or [("", "f8")] * 3
    fields += [("", "f8")] * 9
    # ROS convention for quantities that are not measured.
    constants: dict[int, float] = {3: 1.0, 4: -1.0} | ({} if accel else {28: -1.0})
    name = "sensor_msgs/msg/Imu"
    return _Topic("/imu", name, _SCHEMAS[name], fields, {**gyro, **accel}, constants)


def _make_pose(columns: dict[str, Column]) -> _Topic | None:
    columns_by_axis = {name[-1]: name for name in columns if is_quaternion(name)}
    if set(columns_by_axis) != set("wxyz"):
        return None
    fields = [("", "f8")] * 3 + [(columns_by_axis[axis], "f8") for axis in "xyzw"]
    values = {name: columns[name] for name in columns_by_axis.values()}
    name = "geometry_msgs/msg/PoseStamped"
    return _Topic("/pose", name, _SCHEMAS[name], fields, values, {})


def _make_fix(columns: dict[str, Column]) -> _Topic | None:
    wanted = ("latitude_deg", "longitude_deg", "height_m")
    if not set(wanted) <= set(columns):
        return None
    fields = [("", "i1"), ("", "u2"), ("", "V2"), *((column, "f8") for column in wanted)]
    fields += [("", "f8")] * 9 + [("", "u1")]
    name = "sensor_msgs/msg/NavSatFix"
    values = {column: columns[column] for column in wanted}
    return _Topic("/fix", name, _SCHEMAS[name], fields, values, {1: 1})


def _make_bias(columns: dict[str, Column]) -> _Topic | None:
    columns_by_axis = {
        match[1]: (name, match[2]) for name in columns if (match := _BIAS.match(name))
    }
    if set(columns_by_axis) != set("xyz"):
        return None
    values = {
        name: convert(columns[name], _UNITS[unit], "rad/s")
        for name, unit in (columns_by_axis[axis] for axis in "xyz")
    }
    fields = [(name, "f8") for name in values]
    name = "geometry_msgs/msg/Vector3Stamped"
    return _Topic("/bias", name, _SCHEMAS[name], fields, values, {})


def _make_status(columns: dict[str, Column]) -> _Topic:
    """Return the messages with a number for each remaining column, in a schema of zerorate."""
    fields = [(name, "f8") for name, v in columns.items() if v.dtype.kind != "b"]
    fields += [(name, "u1") for name, v in columns.items() if v.dtype.kind == "b"]
    ros_types = {"f8": "float64", "u1": "bool"}
    lines = [f"{ros_types[kind]} {_field_name(name, i)}" for i, (name, kind) in enumerate(fields)]
    text = "\n".join(["std_msgs/Header header", *lines]) + _HEADER
    return _Topic("/status", "zerorate_msgs/msg/Status", text, fields, columns, {})


def _field_name(name: str, index: int) -> str:
    """Return a column's name as a valid and unique ROS name."""
    bare = re.sub(r"_+", "_", re.sub(r"[^a-z0-9_]", "_", to_snake_case(name))).strip("_")
    return bare if re.match(r"[a-z]", bare) and bare == name else f"c{index}_{bare}".rstrip("_")


class _McapWriter:
    """Writer of the file's records."""

    def __init__(self, file: IO[bytes], topics: Sequence[_Topic], stamps: Integers) -> None:
        self._file, self._topics, self._stamps = file, topics, stamps
        self._chunks: list[bytes] = []
        self._row = _make_row_type(topics)
        self._rows = np.zeros(min(_CHUNK_ROWS, len(stamps)), self._row)
        for number, topic in enumerate(topics, 1):
            _fill_constants(self._rows[f"m{number}"], number, topic)

    def write(self) -> None:
        """Write all records."""
        self._file.write(
            _MAGIC + _encode_record(0x01, _encode_text("ros2") + _encode_text("zerorate"))
        )
        declared = b"".join(self._declarations())
        self._file.write(declared)
        for first in range(0, len(self._stamps), _CHUNK_ROWS):
            self._chunk(slice(first, first + _CHUNK_ROWS))
        self._file.write(_encode_record(0x0F, struct.pack("<I", 0)))
        begins = self._file.tell()
        summary = declared + _encode_record(0x0B, self._statistics()) + b"".join(self._chunks)
        footer = struct.pack("<QQ", begins, 0)
        # The checksum also covers the footer up to the checksum itself.
        checked = summary + b"\x02" + struct.pack("<Q", 20) + footer
        footer += struct.pack("<I", zlib.crc32(checked))
        self._file.write(summary + _encode_record(0x02, footer) + _MAGIC)

    def _declarations(self) -> list[bytes]:
        records = []
        for number, topic in enumerate(self._topics, 1):
            text = (
                _encode_text(topic.schema)
                + _encode_text("ros2msg")
                + _encode_bytes(topic.text.encode())
            )
            records.append(_encode_record(0x03, struct.pack("<H", number) + text))
            text = _encode_text(topic.name) + _encode_text("cdr") + _encode_bytes(b"")
            records.append(_encode_record(0x04, struct.pack("<HH", number, number) + text))
        return records

    def _chunk(self, part: slice) -> None:
        stamps = self._stamps[part]
        rows = self._rows[: len(stamps)]
        for number, topic in enumerate(self._topics, 1):
            _fill_values(rows[f"m{number}"], topic, stamps, part)
        raw = rows.view(np.uint8)
        packed = pack_lz4(raw)
        span = struct.pack("<QQ", stamps.min(), stamps.max())
        at = self._file.tell()
        head = (
            span + struct.pack("<QI", len(raw), zlib.crc32(raw.data)) + _encode_text(_COMPRESSION)
        )
        self._file.write(_encode_record(0x06, head + struct.pack("<Q", len(packed)) + packed))
        index_offsets, indexed = b"", self._file.tell()
        for number in range(1, len(self._topics) + 1):
            index_offsets += struct.pack("<HQ", number, self._file.tell())
            begins = np.arange(len(stamps)) * self._row.itemsize
            offset = self._row.fields[f"m{number}"][1] if self._row.fields else 0
            entries = np.column_stack([stamps, begins + offset]).astype("<u8").tobytes()
            self._file.write(
                _encode_record(0x07, struct.pack("<H", number) + _encode_bytes(entries))
            )
        self._chunks.append(
            _encode_record(
                0x08,
                span
                + struct.pack("<QQ", at, indexed - at)
                + _encode_bytes(index_offsets)
                + struct.pack("<Q", self._file.tell() - indexed)
                + _encode_text(_COMPRESSION)
                + struct.pack("<QQ", len(packed), len(raw)),
            )
        )

    def _statistics(self) -> bytes:
        topics, rows = len(self._topics), len(self._stamps)
        first, last = (self._stamps.min(), self._stamps.max()) if rows else (0, 0)
        counts = b"".join(struct.pack("<HQ", i, rows) for i in range(1, topics + 1))
        head = struct.pack("<QHIIII", topics * rows, topics, topics, 0, 0, len(self._chunks))
        return head + struct.pack("<QQ", first, last) + _encode_bytes(counts)


def _make_row_type(topics: Sequence[_Topic]) -> np.dtype[Any]:
    """Return the type of a row: one message record per topic."""
    fields = []
    for number, topic in enumerate(topics, 1):
        message_fields = [("op", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4")]
        message_fields += [("logged", "<u8"), ("published", "<u8"), ("cdr", "V4")]
        message_fields += [
            ("seconds", "<i4"),
            ("nanoseconds", "<u4"),
            ("size", "<u4"),
            ("frame", "V7"),
        ]
        # Align the 8-byte numbers: 12 bytes of stamp and size, 7 bytes of the frame come before.
        fill = [("fill", "V5")] if topic.fields[0][1] == "f8" else []
        message_fields += fill + [(f"f{i}", f"<{k}") for i, (_, k) in enumerate(topic.fields)]
        fields.append((f"m{number}", np.dtype(message_fields)))
    return np.dtype(fields)


def _fill_constants(messages: np.ndarray[Any, Any], number: int, topic: _Topic) -> None:
    """Fill in the fields that are the same in all messages of a topic."""
    messages["op"], messages["channel"] = 0x05, number
    messages["length"] = messages.dtype.itemsize - 9
    messages["cdr"] = np.void(_CDR)
    messages["size"] = len(_FRAME)
    messages["frame"] = np.void(_TOPIC_FRAMES.get(topic.name, _FRAME))
    for i, value in topic.constants.items():
        messages[f"f{i}"] = value


def _fill_values(
    messages: np.ndarray[Any, Any], topic: _Topic, stamps: Integers, part: slice
) -> None:
    messages["logged"] = messages["published"] = stamps
    messages["seconds"], messages["nanoseconds"] = np.divmod(stamps, 1_000_000_000)
    for i, (name, _) in enumerate(topic.fields):
        if name:
            messages[f"f{i}"] = topic.values[name][part]


def _encode_record(kind: int, raw: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(raw)) + raw


def _encode_text(text: str) -> bytes:
    return _encode_bytes(text.encode())


def _encode_bytes(raw: bytes) -> bytes:
    return struct.pack("<I", len(raw)) + raw
