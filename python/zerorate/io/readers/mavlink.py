"""Telemetry logs of ground stations, ``.tlog``: MAVLink packets, each behind the time it came.

A record is the time in microseconds since 1970 as eight bytes, high ones first, then a packet of
MAVLink 1 or 2. Packets of sensors, receivers and attitudes are read; their checksum is CRC-16 of
MCRF4XX over the packet without its first byte, and a byte that stands for the message's layout. See
https://mavlink.io/en/guide/serialization.html.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.geometry.rotations import from_euler_angles
from zerorate.io.beginnings import BEHIND_STAMP as _STAMP
from zerorate.io.beginnings import MAVLINK_1 as _V1
from zerorate.io.beginnings import MAVLINK_2 as _V2
from zerorate.io.table import Column, Content, Metadata, Table
from zerorate.record.log import FORWARD_RIGHT_DOWN, LogError
from zerorate.types import Floats

_Rows = npt.NDArray[np.void]
_Bytes = npt.NDArray[np.uint8]
_Columns = dict[str, Callable[[_Rows], Column]]

_V1_HEAD, _V2_HEAD, _CRC = 6, 10, 2
_SIGNATURE: Final = 13
_AXES: Final = "xyz"


class _Kind(NamedTuple):
    """A kind of message: its number, the layout's byte, its fields, and what columns they make."""

    number: int
    seed: int
    fields: np.dtype[np.void]
    columns: _Columns


def _dtype(fields: Sequence[tuple[str, str]]) -> np.dtype[np.void]:
    return np.dtype([(name, f"<{code}") for names, code in fields for name in names.split()])


def _times(name: str, factor: float) -> Callable[[_Rows], Column]:
    return lambda rows: rows[name] * factor if factor != 1.0 else rows[name].astype(np.float64)


def _known(name: str, factor: float) -> Callable[[_Rows], Column]:
    """Return a column that is missing as a whole where it is always 0: nobody measures it."""

    def column(rows: _Rows) -> Column:
        found = rows[name] * factor
        return found if found.any() else np.full(len(rows), np.nan)

    return column


def _imu(gyro: float, accel: float, mag: float, degrees: float) -> _Columns:
    columns: _Columns = {}
    for field, name, factor in (
        ("gyro", "gyro_{}_radps", gyro),
        ("acc", "accel_{}_mps2", accel),
        ("mag", "mag_{}_gauss", mag),
    ):
        make = _known if field == "mag" else _times
        columns |= {name.format(axis): make(f"{axis}{field}", factor) for axis in _AXES}
    return columns | {"temperature_degc": _known("temperature", degrees)}


def _where_fixed(rows: _Rows, column: Column) -> Floats:
    return np.where(rows["fix_type"] >= 2, column, np.nan)


def _place(name: str, factor: float) -> Callable[[_Rows], Column]:
    return lambda rows: _where_fixed(rows, rows[name] * factor)


def _speed(part: Callable[[Floats], Floats]) -> Callable[[_Rows], Column]:
    def column(rows: _Rows) -> Column:
        told = (rows["vel"] != 0xFFFF) & (rows["cog"] != 0xFFFF)
        speed = rows["vel"] * 1e-2 * part(np.radians(rows["cog"] * 1e-2))
        return np.where(told, _where_fixed(rows, speed), np.nan)

    return column


_FIXES: Final[_Columns] = {
    "latitude_deg": _place("lat", 1e-7),
    "longitude_deg": _place("lon", 1e-7),
    "altitude_msl_m": _place("alt", 1e-3),
    "velocity_north_mps": _speed(np.cos),
    "velocity_east_mps": _speed(np.sin),
    "satellites": _times("satellites_visible", 1.0),
    "fix_type": _times("fix_type", 1.0),
}


def _turned(component: int) -> Callable[[_Rows], Column]:
    def column(rows: _Rows) -> Column:
        angles = (rows[name].astype(np.float64) for name in ("roll", "pitch", "yaw"))
        return np.asarray(from_euler_angles(*angles)[:, component])

    return column


_ATTITUDE: Final[_Columns] = {f"ref_quat_{axis}": _turned(i) for i, axis in enumerate("wxyz")}
_NINE: Final = "xacc yacc zacc xgyro ygyro zgyro xmag ymag zmag"
_G: Final = 9.80665e-3
_SCALED: Final = _dtype([("time_boot_ms", "u4"), (f"{_NINE} temperature", "i2")])
_OF_COUNTS: Final = _imu(1e-3, _G, 1e-3, 1e-2)

_KINDS: Final = {
    "HIGHRES_IMU": _Kind(
        105,
        93,
        _dtype(
            [
                ("time_usec", "u8"),
                (f"{_NINE} abs_pressure diff_pressure pressure_alt temperature", "f4"),
                ("fields_updated", "u2"),
                ("id", "u1"),
            ]
        ),
        _imu(1.0, 1.0, 1.0, 1.0),
    ),
    "RAW_IMU": _Kind(
        27,
        144,
        _dtype([("time_usec", "u8"), (_NINE, "i2"), ("id", "u1"), ("temperature", "i2")]),
        _OF_COUNTS,
    ),
    "SCALED_IMU": _Kind(26, 170, _SCALED, _OF_COUNTS),
    "SCALED_IMU2": _Kind(116, 76, _SCALED, _OF_COUNTS),
    "SCALED_IMU3": _Kind(129, 46, _SCALED, _OF_COUNTS),
    "GPS_RAW_INT": _Kind(
        24,
        24,
        _dtype(
            [
                ("time_usec", "u8"),
                ("lat lon alt", "i4"),
                ("eph epv vel cog", "u2"),
                ("fix_type satellites_visible", "u1"),
            ]
        ),
        _FIXES,
    ),
    "ATTITUDE": _Kind(
        30,
        39,
        _dtype([("time_boot_ms", "u4"), ("roll pitch yaw rollspeed pitchspeed yawspeed", "f4")]),
        _ATTITUDE,
    ),
}
"""Messages that are read. Fields that a message may have beyond these are not."""
_BY_NUMBER: Final = {kind.number: name for name, kind in _KINDS.items()}
_FIRST: Final = ("RAW_IMU", "SCALED_IMU")
"""The same sensor, told twice."""
_STAMPS: Final = {"time_usec": "timestamp_us", "time_boot_ms": "timestamp_ms"}


def read(path: Path) -> Content:
    """Return a table of each kind of messages and each sender."""
    log = _Log(np.fromfile(path, np.uint8))
    tables = dict(sorted(log.tables(), key=lambda item: list(_KINDS).index(item[0].split("/")[0])))
    if not tables:
        raise LogError("no packet of an IMU, a receiver or an attitude is in it")
    return Content(tables, partial(_chosen, tables), _sensors(tables))


@dataclass
class _Log:
    """The bytes of a log, and where packets that are read stand in it."""

    raw: _Bytes

    def tables(self) -> Iterator[tuple[str, Table]]:
        """Yield a table for each kind of message of each vehicle."""
        packets, notes = self._sound
        systems = Counter(system for system, _ in packets for _ in packets[system, _])
        for (system, number), rows in packets.items():
            name = _BY_NUMBER[number]
            most = max(systems, key=lambda one: (systems[one], -one))
            topic = name if system == most else f"{name}/{system}"
            yield topic, _table(topic, _KINDS[name], rows, notes)

    @cached_property
    def _sound(self) -> tuple[dict[tuple[int, int], _Rows], tuple[str, ...]]:
        """Return the payloads by vehicle and message whose checksum is right."""
        found, lost = _frames(self.raw.tobytes())
        sound: dict[tuple[int, int], _Rows] = {}
        damaged = 0
        for (system, number), places in found.items():
            rows = _payloads(self.raw, np.array(places), _KINDS[_BY_NUMBER[number]])
            damaged += len(places) - len(rows)
            if len(rows):
                sound[system, number] = rows
        notes = []
        if lost:
            notes.append(f"{lost} bytes are no packet: they are left out")
        if damaged:
            notes.append(f"{damaged} packets have a wrong checksum: they are left out")
        return sound, tuple(notes)


def _frames(raw: bytes) -> tuple[dict[tuple[int, int], list[tuple[int, int, int]]], int]:
    """Return by vehicle and message where packets begin, their heads' and payloads' lengths.

    And how many bytes belong to none. A packet counts if the next begins where it ends.
    """
    found: dict[tuple[int, int], list[tuple[int, int, int]]] = {}
    place, lost, size = 0, 0, len(raw)
    while (begin := place + _STAMP) < size:
        end = _end(raw, begin)
        after = end + _STAMP
        if not end or end > size or (after < size and raw[after] not in (_V1, _V2)):
            place, lost = place + 1, lost + 1
            continue
        head = _V1_HEAD if raw[begin] == _V1 else _V2_HEAD
        numbered = slice(begin + 5, begin + 6) if head == _V1_HEAD else slice(begin + 7, begin + 10)
        number = int.from_bytes(raw[numbered], "little")
        if number in _BY_NUMBER:
            system = raw[begin + (3 if head == _V1_HEAD else 5)]
            found.setdefault((system, number), []).append((begin, head, raw[begin + 1]))
        place = end
    return found, lost + size - place


def _end(raw: bytes, begin: int) -> int:
    """Return where a packet ends, 0 where none begins."""
    if begin + _V2_HEAD > len(raw):
        return 0
    if raw[begin] == _V1:
        return begin + _V1_HEAD + raw[begin + 1] + _CRC
    if raw[begin] == _V2:
        signed = _SIGNATURE if raw[begin + 2] & 1 else 0
        return begin + _V2_HEAD + raw[begin + 1] + _CRC + signed
    return 0


def _payloads(raw: _Bytes, places: npt.NDArray[np.int64], kind: _Kind) -> _Rows:
    """Return the rows of packets with a right checksum, in the order of the file.

    What a packet leaves out at its end is zero, and what it has beyond our fields is left out.
    """
    size = kind.fields.itemsize
    rows = np.zeros((len(places), size), np.uint8)
    sound = np.zeros(len(places), bool)
    for head, length in {(head, length) for _, head, length in places.tolist()}:
        of = np.flatnonzero((places[:, 1] == head) & (places[:, 2] == length))
        bytes_ = raw[places[of, :1] + np.arange(head + length + _CRC)]
        crc = _checksum(bytes_[:, 1 : head + length], kind.seed)
        told = bytes_[:, -2].astype(np.uint16) | bytes_[:, -1].astype(np.uint16) << 8
        sound[of] = crc == told
        kept = min(size, length)
        rows[of, :kept] = bytes_[:, head : head + kept]
    return rows[sound].reshape(-1).view(kind.fields)


def _checksum(packets: _Bytes, seed: int) -> npt.NDArray[np.uint16]:
    """Return CRC-16/MCRF4XX of each row and a last byte."""
    crc = np.full(len(packets), 0xFFFF, np.uint16)
    for byte in (*packets.T, np.full(len(packets), seed, np.uint8)):
        part = (byte ^ crc).astype(np.uint8)
        part ^= part << np.uint8(4)
        wide = part.astype(np.uint16)
        crc = (crc >> 8) ^ (wide << 8) ^ (wide << 3) ^ (wide >> 4)
    return crc


def _table(topic: str, kind: _Kind, rows: _Rows, notes: tuple[str, ...]) -> Table:
    stamp = next(name for name in _STAMPS if name in (kind.fields.names or ()))
    ways: _Columns = {_STAMPS[stamp]: lambda rows: rows[stamp].astype(np.int64), **kind.columns}
    names = tuple(ways)
    if topic.startswith("ATTITUDE"):
        notes = (*notes, "the attitude is the autopilot's own estimate, no reference to judge by")
    meta = Metadata(sensor=topic, axes=FORWARD_RIGHT_DOWN, notes=notes)

    def load(wanted: Sequence[int]) -> list[Column]:
        return [ways[names[i]](rows) for i in wanted]

    return Table(len(names), load, names=names, meta=meta, time=0)


def _sensors(tables: Mapping[str, Table]) -> tuple[str, ...]:
    """Return the tables that make a recording, each sensor of the first vehicle once."""
    own = [name for name in tables if "/" not in name]
    twice = [name for name in _FIRST if name in own]
    if "HIGHRES_IMU" in own:
        dropped = {*_FIRST}
    else:
        dropped = set(sorted(twice, key=lambda name: -_length(tables[name]))[1:])
    return tuple(name for name in own if name not in dropped)


def _length(table: Table) -> int:
    return len(table.load([0])[0])


def _chosen(tables: Mapping[str, Table], asked: str | None) -> str:
    if asked in tables:
        return str(asked)
    if asked is not None:
        raise LogError(f"there is no topic '{asked}'; the log has: {', '.join(tables)}", "topic")
    found = next((name for name in _sensors(tables) if "IMU" in name), None)
    if found is None:
        raise LogError(f"no packet holds a gyro; the log has: {', '.join(tables)}")
    return found
