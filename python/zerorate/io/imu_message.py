"""The message ``sensor_msgs/Imu`` from its bytes; to make objects of it would take the most time.

Behind the header stand 37 numbers: the orientation (4), the angular velocity (3) and the
acceleration (3), each followed by its covariance (9).
"""

from __future__ import annotations

import struct
from typing import Final

__all__ = ["Imu", "imu_of_cdr", "imu_of_ros1"]

# Seconds and nanoseconds of the stamp, rad/s (3), m/s^2 (3).
Imu = tuple[int, int, float, float, float, float, float, float]

_STAMP: Final = {order: struct.Struct(f"{order}iII") for order in "<>"}
_VALUES: Final = {order: struct.Struct(f"{order}104x3d72x3d72x") for order in "<>"}
# Four bytes come first: the sequence number in ROS 1, the encapsulation in CDR.
_HEADER = 4
_TEXT = _HEADER + 12


def imu_of_ros1(raw: bytes) -> Imu:
    """Return the stamp and the values of a message of ROS 1, which is packed."""
    seconds, nanoseconds, length = _STAMP["<"].unpack_from(raw, _HEADER)
    return (seconds, nanoseconds, *_VALUES["<"].unpack_from(raw, _TEXT + length))


def imu_of_cdr(raw: bytes) -> Imu:
    """Return the stamp and the values of a message of ROS 2, where numbers of 8 bytes align."""
    order = "<" if raw[1] & 1 else ">"
    seconds, nanoseconds, length = _STAMP[order].unpack_from(raw, _HEADER)
    aligned = -(-(_TEXT - _HEADER + length) // 8) * 8
    return (seconds, nanoseconds, *_VALUES[order].unpack_from(raw, _HEADER + aligned))
