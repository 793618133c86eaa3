"""Recordings of ROS 1 and 2, and MCAP files: the messages of inertial sensors."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import given, said
from zerorate.io.readers.apart import asked
from zerorate.io.readers.ros_messages import Plan, columns_of, plan_of
from zerorate.io.table import Column, Content, Metadata, Table
from zerorate.record.log import LogError
from zerorate.texts import extra_needed

_Reader = Any
_Connection = Any

_IMU = "sensor_msgs/msg/Imu"
_AXES = "xyz"
_VALUES = (
    *(f"angular_velocity_{axis}_radps" for axis in _AXES),
    *(f"linear_acceleration_{axis}_mps2" for axis in _AXES),
)
_NAMES = ("stamp_ns", *_VALUES)
_ROW = np.dtype(
    [("seconds", np.int64), ("nanoseconds", np.int64), *((name, np.float64) for name in _VALUES)]
)


def read(path: Path) -> Content:
    """Return a table of each topic whose messages are ``sensor_msgs/Imu`` or tell of a sensor."""
    if find_spec("rosbags") is None:
        raise ImportError(extra_needed("rosbags", "ros", "a ROS recording"))
    told, _ = asked("bag_topics", path)
    tables = {one["topic"]: _table(path, one) for one in told}
    imus = [one["topic"] for one in told if one["names"] is None]
    what = _IMU if imus else "a gyro"
    gyros = imus or [one["topic"] for one in told if one["gyro"]]
    others = [one["topic"] for one in told if one["topic"] not in gyros and not one["gyro"]]
    return Content(
        tables, lambda asked: _chosen(gyros, list(tables), what, asked), (*gyros, *others)
    )


def _table(path: Path, told: Mapping[str, Any]) -> Table:
    topic, names = told["topic"], told["names"]

    def load(wanted: Sequence[int]) -> list[Column]:
        return asked("bag_columns", path, topic, list(wanted))[1]

    notes: tuple[str, ...] = ()
    if names is not None and told["gyro"]:
        notes = (f"{topic} holds {told['type']}, read by the names of its fields",)
    meta = Metadata(sensor=topic, notes=notes)
    names = _NAMES if names is None else tuple(names)
    return Table(len(names), load, names=names, meta=meta, time=0)


def topics(path: Path) -> list[dict[str, Any]]:
    """Return the topics of a recording that hold messages of a sensor, those of `_IMU` first.

    Each has its type, whether there is a gyro in it, and the names of its columns, None for `_IMU`.
    This and `columns` run in a process of its own: chunks may swell when they are unpacked.
    """
    found: dict[str, dict[str, Any]] = {}
    plans: dict[str, Plan | None] = {}
    with _opened(path) as reader:
        for connection in sorted(reader.connections, key=lambda c: (not _is_imu(c), c.topic)):
            told = {"topic": connection.topic, "type": connection.msgtype}
            if _is_imu(connection):
                found.setdefault(connection.topic, told | {"gyro": True, "names": None})
            elif _is_decoded(connection) and connection.topic not in found:
                if connection.msgtype not in plans:
                    plans[connection.msgtype] = plan_of(connection)
                plan = plans[connection.msgtype]
                if plan is not None:
                    own = {"gyro": plan.has_gyro, "names": plan.names}
                    found[connection.topic] = told | own
    return list(found.values())


def columns(path: Path, topic: str, wanted: Sequence[int]) -> list[Column]:
    """Return the stamps, ns, and the values of a topic's messages, those of them asked for."""
    with _opened(path) as reader:
        on_topic = [c for c in reader.connections if c.topic == topic]
        if not any(map(_is_imu, on_topic)):
            (plan, kind) = next((p, c.msgtype) for c in on_topic if (p := plan_of(c)) is not None)
            own = [c for c in on_topic if c.msgtype == kind and _is_decoded(c)]
            return columns_of(plan, reader.messages(connections=own), wanted)
    rows = _messages(path, topic)
    stamps = rows["seconds"] * 1_000_000_000 + rows["nanoseconds"]
    found = [stamps, *(rows[name] for name in _VALUES)]
    return [found[i] for i in wanted]


def _is_imu(connection: _Connection) -> bool:
    return connection.msgtype == _IMU and _is_decoded(connection)


def _is_decoded(connection: _Connection) -> bool:
    # An MCAP file may hold messages in JSON and others.
    return getattr(connection.ext, "serialization_format", "cdr") == "cdr"


def _chosen(gyros: list[str], topics: list[str], what: str, asked: str | None) -> str:
    listed = ", ".join(gyros)
    if asked is not None:
        if asked in topics:
            return asked
        raise LogError(
            f"there is no topic '{asked}' of {_IMU}; the recording has: {', '.join(topics)}",
            "topic",
        )
    if not gyros:
        raise LogError(
            f"no topic holds {_IMU}, expected the messages of a gyro, or others with fields that "
            "tell, such as angular_velocity"
        )
    if len(gyros) > 1:
        raise LogError(
            said(
                f"{len(gyros)} topics hold {what}; choose with ",
                given("topic"),
                f" from: {listed}",
            )
        )
    return gyros[0]


def _messages(path: Path, topic: str) -> npt.NDArray[np.void]:
    """Return the messages of a topic, (n,), as rows of named fields."""
    decoded = imu_of_ros1 if path.suffix.lower() == ".bag" else imu_of_cdr
    with _opened(path) as reader:
        on_topic = [c for c in reader.connections if c.topic == topic and _is_imu(c)]
        messages = (decoded(raw) for _, _, raw in reader.messages(connections=on_topic))
        return np.fromiter(messages, _ROW)


@contextmanager
def _opened(path: Path) -> Iterator[_Reader]:
    from rosbags import rosbag1, rosbag2

    package = rosbag1 if path.suffix.lower() == ".bag" else rosbag2
    with package.Reader(path) as reader:
        yield reader


# The message `sensor_msgs/Imu` is read from its bytes; to make objects of it would take the most
# time. Behind the header stand 37 numbers: the orientation (4), the angular velocity (3) and the
# acceleration (3), each followed by its covariance (9).
#
# Seconds and nanoseconds of the stamp, rad/s (3), m/s^2 (3).
Imu = tuple[int, int, float, float, float, float, float, float]

_STAMP: Final = {order: struct.Struct(f"{order}iII") for order in "<>"}
_NUMBERS: Final = {order: struct.Struct(f"{order}104x3d72x3d72x") for order in "<>"}
# Four bytes come first: the sequence number in ROS 1, the encapsulation in CDR.
_HEADER = 4
_TEXT = _HEADER + 12


def imu_of_ros1(raw: bytes) -> Imu:
    """Return the stamp and the values of a message of ROS 1, which is packed."""
    seconds, nanoseconds, length = _STAMP["<"].unpack_from(raw, _HEADER)
    return (seconds, nanoseconds, *_NUMBERS["<"].unpack_from(raw, _TEXT + length))


def imu_of_cdr(raw: bytes) -> Imu:
    """Return the stamp and the values of a message of ROS 2, where numbers of 8 bytes align."""
    order = "<" if raw[1] & 1 else ">"
    seconds, nanoseconds, length = _STAMP[order].unpack_from(raw, _HEADER)
    aligned = -(-(_TEXT - _HEADER + length) // 8) * 8
    return (seconds, nanoseconds, *_NUMBERS[order].unpack_from(raw, _HEADER + aligned))
