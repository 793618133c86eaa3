"""Recordings of ROS 1 and 2, and MCAP files: messages of inertial sensors."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.readers.isolated import run_isolated
from zerorate.io.readers.mcap_file import McapReader
from zerorate.io.readers.ros_messages import MessagePlan, decode_columns, make_plan
from zerorate.io.table import Column, Content, Metadata, Table
from zerorate.record.log import LogError
from zerorate.texts import describe_missing_extra

_Reader = Any
_Connection = Any

_IMU_TYPE = "sensor_msgs/msg/Imu"
_AXES = "xyz"
_VALUE_NAMES = (
    *(f"angular_velocity_{axis}_radps" for axis in _AXES),
    *(f"linear_acceleration_{axis}_mps2" for axis in _AXES),
)
_NAMES = ("stamp_ns", *_VALUE_NAMES)
_HALF: Final = {"gyro": "angular_velocity", "accel": "linear_acceleration"}
_MARK: Final = -1.0
"""First covariance value that marks a quantity as absent."""
_ROW_DTYPE = np.dtype(
    [
        ("seconds", np.int64),
        ("nanoseconds", np.int64),
        *((name, np.float64) for name in _VALUE_NAMES),
    ]
)


def read(path: Path) -> Content:
    """Return a table for each topic with ``sensor_msgs/Imu`` or with another sensor."""
    if find_spec("rosbags") is None:
        raise ImportError(describe_missing_extra("rosbags", "ros", "a ROS recording"))
    infos, _ = run_isolated("bag_topics", path)
    tables = {info["topic"]: _make_table(path, info) for info in infos}
    what = _IMU_TYPE if any(info["names"] is None for info in infos) else "a gyro"
    imus = [
        info["topic"] for info in infos if info["names"] is None and "gyro" not in info["absent"]
    ]
    gyros = imus or [info["topic"] for info in infos if info["gyro"]]
    others = [
        info["topic"]
        for info in infos
        if info["topic"] not in gyros and (not info["gyro"] or info.get("absent"))
    ]
    return Content(
        tables, lambda asked: _choose_topic(gyros, list(tables), what, asked), (*gyros, *others)
    )


def _make_table(path: Path, info: Mapping[str, Any]) -> Table:
    topic, names = info["topic"], info["names"]

    absent = info.get("absent", ())
    there = [i for i, name in enumerate(_NAMES) if not any(_HALF[kind] in name for kind in absent)]

    def load(wanted: Sequence[int]) -> list[Column]:
        places = [there[i] for i in wanted] if absent else list(wanted)
        return run_isolated("bag_columns", path, topic, places)[1]

    kind_words = {"gyro": "gyro", "accel": "accelerometer"}
    notes = tuple(
        f"{topic}: its {kind_words[kind]} is constant zero or marked as absent" for kind in absent
    )
    if names is not None and info["gyro"]:
        notes = (f"{topic} holds {info['type']}, read by the names of its fields",)
    meta = Metadata(sensor=topic, notes=notes)
    names = tuple(_NAMES[i] for i in there) if names is None else tuple(names)
    if "gyro" in absent:
        # Without a gyro, "linear" acceleration would be taken as without gravity.
        names = tuple(name.replace("linear_acceleration", "acceleration") for name in names)
    return Table(len(names), load, names=names, meta=meta, time=0)


def list_topics(path: Path) -> list[dict[str, Any]]:
    """Return the topics of a recording with messages of a sensor; `_IMU_TYPE` comes first.

    Each has its type, a flag for a gyro, and the names of its columns (None for `_IMU_TYPE`). This
    function and `read_columns` run in a separate process, because unpacked chunks can be very
    large.
    """
    infos: dict[str, dict[str, Any]] = {}
    plans: dict[str, MessagePlan | None] = {}
    with _open_reader(path) as reader:
        for connection in sorted(reader.connections, key=lambda c: (not _is_imu(c), c.topic)):
            info = {"topic": connection.topic, "type": connection.msgtype}
            if _is_imu(connection):
                if connection.topic not in infos:
                    own: dict[str, Any] = {"gyro": True, "names": None}
                    own["absent"] = _absent(path, connection.topic)
                    infos[connection.topic] = info | own
            elif _is_decoded(connection) and connection.topic not in infos:
                if connection.msgtype not in plans:
                    plans[connection.msgtype] = make_plan(connection)
                plan = plans[connection.msgtype]
                if plan is not None:
                    own = {"gyro": plan.has_gyro, "names": plan.names}
                    infos[connection.topic] = info | own
    return list(infos.values())


def _absent(path: Path, topic: str) -> list[str]:
    """Return the half of a topic's messages that is marked as absent, or zero in all messages."""
    with _open_reader(path) as reader:
        on_topic = [c for c in reader.connections if c.topic == topic and _is_imu(c)]
        if isinstance(reader, McapReader):
            # A few messages suffice for most recordings.
            first = _halves_seen(read_cdr_imus(reader, on_topic, _FIRST_MESSAGES))
            seen = first if all(first) else _halves_seen(read_cdr_imus(reader, on_topic))
            return _name_absent(seen)
        decoded, seen = _decoder_of(path), [False, False]
        for _, _, raw in reader.messages(connections=on_topic):
            numbers = decoded(raw, _MARKED)[2:]
            for i, half in enumerate((numbers[:4], numbers[4:])):
                seen[i] |= half[3] != _MARK and any(half[:3])
            if all(seen):
                return []
    return _name_absent(seen)


def _name_absent(seen: Sequence[bool]) -> list[str]:
    return [kind for kind, there in zip(_HALF, seen, strict=True) if any(seen) and not there]


def _halves_seen(rows: npt.NDArray[np.void]) -> list[bool]:
    """Return flags for gyro and accelerometer: True if any message has values."""
    return [
        bool(np.any((rows[f"{kind}_mark"] != _MARK) & np.any(rows[kind] != 0.0, axis=1)))
        for kind in _HALF
    ]


def read_columns(path: Path, topic: str, wanted: Sequence[int]) -> list[Column]:
    """Return the stamps, ns, and the requested values of a topic's messages."""
    with _open_reader(path) as reader:
        on_topic = [c for c in reader.connections if c.topic == topic]
        if not any(map(_is_imu, on_topic)):
            (plan, kind) = next((p, c.msgtype) for c in on_topic if (p := make_plan(c)) is not None)
            own_connections = [c for c in on_topic if c.msgtype == kind and _is_decoded(c)]
            return decode_columns(plan, reader.messages(connections=own_connections), wanted)
        if isinstance(reader, McapReader):
            own_rows = read_cdr_imus(reader, [c for c in on_topic if _is_imu(c)])
            stamps = own_rows["seconds"] * np.int64(1_000_000_000) + own_rows["nanoseconds"]
            values = [own_rows[kind][:, i].astype(np.float64) for kind in _HALF for i in range(3)]
            return [values[i - 1] if i else stamps for i in wanted]
    rows = _read_messages(path, topic)
    stamps = rows["seconds"] * 1_000_000_000 + rows["nanoseconds"]
    stamped_values = [stamps, *(rows[name] for name in _VALUE_NAMES)]
    return [stamped_values[i] for i in wanted]


def _is_imu(connection: _Connection) -> bool:
    return connection.msgtype == _IMU_TYPE and _is_decoded(connection)


def _is_decoded(connection: _Connection) -> bool:
    # An MCAP file can also have messages in JSON and other encodings.
    return getattr(connection.ext, "serialization_format", "cdr") == "cdr"


def _choose_topic(gyros: list[str], topics: list[str], what: str, topic: str | None) -> str:
    listed = ", ".join(gyros)
    if topic is not None:
        if topic in topics:
            return topic
        raise LogError(
            f"there is no topic '{topic}' of {_IMU_TYPE}; the recording has: {', '.join(topics)}",
            "topic",
        )
    if not gyros:
        raise LogError(
            f"no topic holds {_IMU_TYPE}, expected the messages of a gyro, or others with "
            "fields that "
            "show a sensor, such as angular_velocity"
        )
    if len(gyros) > 1:
        raise LogError(
            make_sentence(
                f"{len(gyros)} topics hold {what}; choose with ",
                keyword_argument("topic"),
                f" from: {listed}",
            )
        )
    return gyros[0]


def _decoder_of(path: Path) -> Callable[..., Any]:
    return decode_ros1_imu if path.suffix.lower() == ".bag" else decode_cdr_imu


def _read_messages(path: Path, topic: str) -> npt.NDArray[np.void]:
    """Return the messages of a topic, (n,), as rows of named fields."""
    decode = _decoder_of(path)
    with _open_reader(path) as reader:
        on_topic = [c for c in reader.connections if c.topic == topic and _is_imu(c)]
        messages = (decode(raw) for _, _, raw in reader.messages(connections=on_topic))
        return np.fromiter(messages, _ROW_DTYPE)


@contextmanager
def _open_reader(path: Path) -> Iterator[_Reader]:
    from rosbags import rosbag1, rosbag2

    if path.suffix.lower() == ".mcap":
        with McapReader(path) as own_reader:
            yield own_reader
        return
    package = rosbag1 if path.suffix.lower() == ".bag" else rosbag2
    with package.Reader(path) as reader:
        yield reader


# Messages of `sensor_msgs/Imu` are read from their bytes, because Python objects would take most of
# the time. The header is followed by 37 numbers: orientation (4), angular velocity (3) and
# acceleration (3), each with its covariance (9) behind it.
#
# Fields: seconds and nanoseconds of the stamp, rad/s (3), m/s^2 (3).
Imu = tuple[int, int, float, float, float, float, float, float]

_STAMP_STRUCTS: Final = {order: struct.Struct(f"{order}iII") for order in "<>"}
_VALUE_STRUCTS: Final = {order: struct.Struct(f"{order}104x3d72x3d72x") for order in "<>"}
_MARKED: Final = {order: struct.Struct(f"{order}104x4d64x4d64x") for order in "<>"}
"""The same fields, each vector followed by the first number of its covariance."""
# The first four bytes: a sequence number in ROS 1, the encapsulation in CDR.
_PREFIX_BYTES = 4
_FRAME_ID_OFFSET = _PREFIX_BYTES + 12


_FIRST_MESSAGES: Final = 1024
_VALUE_BYTES: Final = 296
_KEPT: Final = ((0, 16), (-192, -160), (-96, -64))
"""Parts of a message: its stamp; rate and acceleration with their first covariances."""
_KEPT_DTYPE: Final = np.dtype(
    [
        ("representation", "u1", 4),
        ("seconds", "<i4"),
        ("nanoseconds", "<u4"),
        ("frame_bytes", "<u4"),
        ("gyro", "<f8", 3),
        ("gyro_mark", "<f8"),
        ("accel", "<f8", 3),
        ("accel_mark", "<f8"),
    ]
)


def decode_ros1_imu(raw: bytes, numbers: Mapping[str, struct.Struct] = _VALUE_STRUCTS) -> Imu:
    """Return the stamp and the values of a ROS 1 message, which is packed."""
    seconds, nanoseconds, length = _STAMP_STRUCTS["<"].unpack_from(raw, _PREFIX_BYTES)
    return (seconds, nanoseconds, *numbers["<"].unpack_from(raw, _FRAME_ID_OFFSET + length))


def decode_cdr_imu(raw: bytes, numbers: Mapping[str, struct.Struct] = _VALUE_STRUCTS) -> Imu:
    """Return the stamp and the values of a ROS 2 message, in which 8-byte numbers are aligned."""
    order = "<" if raw[1] & 1 else ">"
    seconds, nanoseconds, length = _STAMP_STRUCTS[order].unpack_from(raw, _PREFIX_BYTES)
    aligned = -(-(_FRAME_ID_OFFSET - _PREFIX_BYTES + length) // 8) * 8
    return (seconds, nanoseconds, *numbers[order].unpack_from(raw, _PREFIX_BYTES + aligned))


def read_cdr_imus(
    reader: McapReader, connections: Sequence[_Connection], limit: int | None = None
) -> npt.NDArray[np.void]:
    """Return stamp, rate and acceleration of ROS 2 messages from an MCAP file, shape (n,).

    Raises
    ------
    ValueError
        If a message has a wrong length for its type.
    """
    messages = reader.read(connections, limit, _KEPT)
    order = messages.begins // np.uint64(_KEPT_DTYPE.itemsize)
    rows: npt.NDArray[np.void] = messages.raw.view(_KEPT_DTYPE)[order]
    big = rows["representation"][:, 1] & 1 == 0
    if big.any():
        rows[big] = rows[big].view(_KEPT_DTYPE.newbyteorder(">"))
    aligned = -(-(_FRAME_ID_OFFSET - _PREFIX_BYTES + rows["frame_bytes"].astype(np.int64)) // 8) * 8
    if np.any(_PREFIX_BYTES + aligned + _VALUE_BYTES != messages.lengths.astype(np.int64)):
        raise ValueError(f"a message of {_IMU_TYPE} has another length than its type")
    return rows
