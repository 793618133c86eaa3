"""Packets as devices send them, written from their makers' descriptions."""

import json
import struct


def mtdata2(counter, gyro, accel, mag=None, form=0, fine=None):
    """Return a message of an Xsens MTi, numbers as single (0), fixed (1, 2) or double (3)."""

    def item(kind, raw):
        return struct.pack(">HB", kind, len(raw)) + raw

    items = item(0x1020, struct.pack(">H", counter % 65536))
    if fine is not None:
        items += item(0x1060, struct.pack(">I", fine))
    for kind, triad in ((0x8020, gyro), (0x4020, accel), (0xC020, mag)):
        if triad is not None:
            items += item(kind | form, b"".join(_number(value, form) for value in triad))
    long = len(items) >= 255
    length = b"\xff" + struct.pack(">H", len(items)) if long else bytes([len(items)])
    body = b"\xff\x36" + length + items
    return b"\xfa" + body + bytes([-sum(body) % 256])


def _number(value, form):
    if form == 0:
        return struct.pack(">f", value)
    if form == 1:
        return struct.pack(">i", round(value * 2**20))
    if form == 3:
        return struct.pack(">d", value)
    whole, low = divmod(round(value * 2**32), 2**32)
    return struct.pack(">Ih", low, whole)


def wit(kind, numbers, fourth=0):
    """Return a packet of eleven bytes of a WitMotion."""
    raw = struct.pack("<BB4h", 0x55, kind, *numbers, fourth)
    return raw + bytes([sum(raw) % 256])


def wit_bluetooth(accel, gyro, angle=(0, 0, 0)):
    """Return the packet of a WitMotion by Bluetooth, in counts."""
    return struct.pack("<BB9h", 0x55, 0x61, *accel, *gyro, *angle)


def ximu3(letter, stamp, numbers):
    """Return a binary message of an x-IMU3."""
    raw = bytes([ord(letter) | 0x80]) + struct.pack(f"<Q{len(numbers)}f", stamp, *numbers)
    return raw.replace(b"\xdb", b"\xdb\xdd").replace(b"\n", b"\xdb\xdc") + b"\n"


def sensor_server(kind, stamp, values):
    """Return an event of SensorServer."""
    event = {"type": f"android.sensor.{kind}", "timestamp": stamp, "values": list(values)}
    return json.dumps(event).encode()


def sensor_logger(events):
    """Return what Sensor Logger pushes: events of name, time and three values."""
    payload = [
        {"name": name, "time": stamp, "values": dict(zip("xyz", values, strict=True))}
        for name, stamp, values in events
    ]
    return json.dumps({"messageId": 1, "sessionId": "s", "payload": payload}).encode()
