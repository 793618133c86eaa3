"""Detection of formats without a fixed signature: texts, telemetry, videos."""

import re
from typing import Final

_HEAD_BYTES: Final = 1 << 17
_VIDEO_BOXES: Final = (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip")
"""Types of the boxes at the beginning of videos."""
_GYROFLOW_MARK: Final = b"GYROFLOW IMU LOG"

MAVLINK_1, MAVLINK_2 = 0xFE, 0xFD
"""First bytes of MAVLink packets."""
PACKET_OFFSET: Final = 8
"""Offset of the packet in a record of telemetry, bytes."""


def is_text(raw: bytes) -> bool:
    """Return True if bytes may belong to a text rather than a binary file."""
    head = raw[:_HEAD_BYTES]
    control_count = sum(
        head.count(bytes([code])) for code in range(32) if code not in (9, 10, 11, 12, 13)
    )
    return b"\0" not in head and control_count <= 0.01 * len(head)


def is_dataflash_text(head: bytes) -> bool:
    """Return True if a text begins with the declarations of a DataFlash log."""
    return re.match(rb"\s*FMT\s*,\s*\d+\s*,\s*\d+\s*,\s*\w+\s*,", head) is not None


def is_telemetry(head: bytes) -> bool:
    """Return True if a file begins with a time of this century and a packet of MAVLink."""
    packet = (MAVLINK_1, MAVLINK_2)
    return len(head) > PACKET_OFFSET and head[0] == 0 and head[PACKET_OFFSET] in packet


def is_camera_file(head: bytes) -> bool:
    """Return True if a file begins as a video or as a log for Gyroflow."""
    return head[4:8] in _VIDEO_BOXES or head.startswith(_GYROFLOW_MARK[: len(head)])
