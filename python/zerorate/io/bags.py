"""Recordings of ROS 1 and 2, and MCAP files: the messages of one inertial sensor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from zerorate.io.errors import LogError
from zerorate.io.imu_message import imu_of_cdr, imu_of_ros1
from zerorate.io.table import Column, Metadata, Table

__all__ = ["read_bag"]

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


def read_bag(path: Path, topic: str | None) -> Table:
    """Return the table of the messages ``sensor_msgs/Imu`` on a topic, None for the only one."""
    with _opened(path) as reader:
        topic = _chosen(_topics(reader), topic)

    def load(wanted: Sequence[int]) -> list[Column]:
        rows = _messages(path, topic)
        stamps = rows["seconds"] * 1_000_000_000 + rows["nanoseconds"]
        columns = [stamps, *(rows[name] for name in _VALUES)]
        return [columns[i] for i in wanted]

    return Table(len(_NAMES), load, names=_NAMES, meta=Metadata(sensor=topic), time=0)


def _topics(reader: _Reader) -> list[str]:
    return sorted({c.topic for c in reader.connections if _is_imu(c)})


def _is_imu(connection: _Connection) -> bool:
    # An MCAP file may hold messages in JSON and others.
    encoding = getattr(connection.ext, "serialization_format", "cdr")
    return connection.msgtype == _IMU and encoding == "cdr"


def _chosen(topics: list[str], asked: str | None) -> str:
    listed = ", ".join(topics)
    if not topics:
        raise LogError(f"no topic holds {_IMU}, expected the messages of a gyro")
    if asked is not None and asked not in topics:
        raise LogError(f"there is no topic '{asked}' of {_IMU}; the recording has: {listed}")
    if asked is None and len(topics) > 1:
        raise LogError(f"{len(topics)} topics hold {_IMU}; choose with topic= from: {listed}")
    return topics[0] if asked is None else asked


def _messages(path: Path, topic: str) -> npt.NDArray[np.void]:
    """Return the messages of a topic, (n,), as rows of named fields."""
    decoded = imu_of_ros1 if path.suffix.lower() == ".bag" else imu_of_cdr
    with _opened(path) as reader:
        on_topic = [c for c in reader.connections if c.topic == topic and _is_imu(c)]
        messages = (decoded(raw) for _, _, raw in reader.messages(connections=on_topic))
        return np.fromiter(messages, _ROW)


@contextmanager
def _opened(path: Path) -> Iterator[_Reader]:
    try:
        from rosbags import rosbag1, rosbag2
    except ImportError:
        raise ImportError("a ROS recording needs rosbags: pip install 'zerorate[ros]'") from None
    package = rosbag1 if path.suffix.lower() == ".bag" else rosbag2
    try:
        with package.Reader(path) as reader:
            yield reader
    except (LogError, MemoryError):
        raise
    except Exception as error:  # what damaged bytes raise there has no common base
        reason = str(error).partition("\n")[0].rstrip(".") or type(error).__name__
        raise LogError(
            f"cannot be read as a ROS recording: truncated, damaged or of a foreign kind ({reason})"
        ) from None
