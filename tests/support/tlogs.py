"""Telemetry logs of MAVLink, byte by byte; the checksum bit by bit, as the page has it."""

import struct

LAYOUTS = {
    "RAW_IMU": (27, 144, "<Q9hBh"),
    "SCALED_IMU": (26, 170, "<I9hh"),
    "SCALED_IMU2": (116, 76, "<I9hh"),
    "HIGHRES_IMU": (105, 93, "<Q13fHB"),
    "GPS_RAW_INT": (24, 24, "<Q3i4HBB"),
    "ATTITUDE": (30, 39, "<I6f"),
    "HEARTBEAT": (0, 50, "<I5B"),
}


def checksum(raw):
    """Return CRC-16/MCRF4XX."""
    crc = 0xFFFF
    for byte in raw:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc


def packet(name, *values, version=2, system=1, signed=False):
    """Return a packet of MAVLink; version 2 leaves zeros at its end out."""
    number, seed, layout = LAYOUTS[name]
    payload = struct.pack(layout, *values)
    if version == 1:
        head = bytes([len(payload), 0, system, 1, number])
        mark = b"\xfe"
    else:
        payload = payload.rstrip(b"\0") or b"\0"
        head = bytes([len(payload), int(signed), 0, 0, system, 1]) + number.to_bytes(3, "little")
        mark = b"\xfd"
    crc = checksum(head + payload + bytes([seed]))
    return mark + head + payload + struct.pack("<H", crc) + (bytes(13) if signed else b"")


def record(stamp, raw):
    """Return a packet behind the time it came, s."""
    return struct.pack(">Q", round(1.7e15 + stamp * 1e6)) + raw


def write_tlog(path, n):
    """Write a log of an IMU at 50 Hz with so many samples."""
    packets = (packet("SCALED_IMU", i * 20, *range(i, i + 9), 2500) for i in range(n))
    path.write_bytes(b"".join(record(i / 50, one) for i, one in enumerate(packets)))
