"""Telemetry logs of ground stations, ``.tlog``: MAVLink packets with times of arrival.

A record is a time in microseconds since 1970 (eight bytes, high byte first) and a packet of MAVLink
1 or 2. Packets of sensors, receivers and attitudes are read. Their checksum is CRC-16/MCRF4XX of
the packet without its first byte, followed by a byte for the message's layout. See
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
from zerorate.io.signatures import MAVLINK_1 as _V1
from zerorate.io.signatures import MAVLINK_2 as _V2
from zerorate.io.signatures import PACKET_OFFSET as _STAMP
from zerorate.io.table import Column, Content, Metadata, Table
from zerorate.record.log import FORWARD_RIGHT_DOWN, LogError
from zerorate.types import Floats

_Rows = npt.NDArray[np.void]
_Bytes = npt.NDArray[np.uint8]
_Columns = dict[str, Callable[[_Rows], Column]]

_V1_HEAD_BYTES, _V2_HEAD_BYTES, _CRC_BYTES = 6, 10, 2
_SIGNATURE_BYTES: Final = 13
_AXES: Final = "xyz"


class _MessageKind(NamedTuple):
    """Kind of message: number, byte of the layout, fields, and columns."""

    number: int
    crc_extra: int
    fields: np.dtype[np.void]
    columns: _Columns


def _dtype(fields: Sequence[tuple[str, str]]) -> np.dtype[np.void]:
    return np.dtype([(name, f"<{code}") for names, code in fields for name in names.split()])


def _multiply(name: str, factor: float) -> Callable[[_Rows], Column]:
    return lambda rows: rows[name] * factor if factor != 1.0 else rows[name].astype(np.float64)


def _nan_if_zero(name: str, factor: float) -> Callable[[_Rows], Column]:
    """Return a function for a column that is NaN if all its values are 0, thus not measured."""

    def column(rows: _Rows) -> Column:
        values = rows[name] * factor
        return values if values.any() else np.full(len(rows), np.nan)

    return column


def _make_imu_columns(gyro: float, accel: float, mag: float, degrees: float) -> _Columns:
    columns: _Columns = {}
    for field, name, factor in (
        ("gyro", "gyro_{}_radps", gyro),
        ("acc", "accel_{}_mps2", accel),
        ("mag", "mag_{}_gauss", mag),
    ):
        make = _nan_if_zero if field == "mag" else _multiply
        columns |= {name.format(axis): make(f"{axis}{field}", factor) for axis in _AXES}
    return columns | {"temperature_degc": _nan_if_zero("temperature", degrees)}


def _mask_without_fix(rows: _Rows, column: Column) -> Floats:
    return np.where(rows["fix_type"] >= 2, column, np.nan)


def _make_coordinate(name: str, factor: float) -> Callable[[_Rows], Column]:
    return lambda rows: _mask_without_fix(rows, rows[name] * factor)


def _make_velocity(part: Callable[[Floats], Floats]) -> Callable[[_Rows], Column]:
    def column(rows: _Rows) -> Column:
        is_known = (rows["vel"] != 0xFFFF) & (rows["cog"] != 0xFFFF)
        speed = rows["vel"] * 1e-2 * part(np.radians(rows["cog"] * 1e-2))
        return np.where(is_known, _mask_without_fix(rows, speed), np.nan)

    return column


_FIX_COLUMNS: Final[_Columns] = {
    "latitude_deg": _make_coordinate("lat", 1e-7),
    "longitude_deg": _make_coordinate("lon", 1e-7),
    "altitude_msl_m": _make_coordinate("alt", 1e-3),
    "velocity_north_mps": _make_velocity(np.cos),
    "velocity_east_mps": _make_velocity(np.sin),
    "satellites": _multiply("satellites_visible", 1.0),
    "fix_type": _multiply("fix_type", 1.0),
}


def _make_quaternion(component: int) -> Callable[[_Rows], Column]:
    def column(rows: _Rows) -> Column:
        angles = (rows[name].astype(np.float64) for name in ("roll", "pitch", "yaw"))
        return np.asarray(from_euler_angles(*angles)[:, component])

    return column


_ATTITUDE_COLUMNS: Final[_Columns] = {
    f"ref_quat_{axis}": _make_quaternion(i) for i, axis in enumerate("wxyz")
}
_IMU_FIELDS: Final = "xacc yacc zacc xgyro ygyro zgyro xmag ymag zmag"
_M_S2_PER_MG: Final = 9.80665e-3
_SCALED_IMU_FIELDS: Final = _dtype([("time_boot_ms", "u4"), (f"{_IMU_FIELDS} temperature", "i2")])
_SCALED_IMU_COLUMNS: Final = _make_imu_columns(1e-3, _M_S2_PER_MG, 1e-3, 1e-2)

_KINDS: Final = {
    "HIGHRES_IMU": _MessageKind(
        105,
        93,
        _dtype(
            [
                ("time_usec", "u8"),
                (f"{_IMU_FIELDS} abs_pressure diff_pressure pressure_alt temperature", "f4"),
                ("fields_updated", "u2"),
                ("id", "u1"),
            ]
        ),
        _make_imu_columns(1.0, 1.0, 1.0, 1.0),
    ),
    "RAW_IMU": _MessageKind(
        27,
        144,
        _dtype([("time_usec", "u8"), (_IMU_FIELDS, "i2"), ("id", "u1"), ("temperature", "i2")]),
        _SCALED_IMU_COLUMNS,
    ),
    "SCALED_IMU": _MessageKind(26, 170, _SCALED_IMU_FIELDS, _SCALED_IMU_COLUMNS),
    "SCALED_IMU2": _MessageKind(116, 76, _SCALED_IMU_FIELDS, _SCALED_IMU_COLUMNS),
    "SCALED_IMU3": _MessageKind(129, 46, _SCALED_IMU_FIELDS, _SCALED_IMU_COLUMNS),
    "GPS_RAW_INT": _MessageKind(
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
        _FIX_COLUMNS,
    ),
    "ATTITUDE": _MessageKind(
        30,
        39,
        _dtype([("time_boot_ms", "u4"), ("roll pitch yaw rollspeed pitchspeed yawspeed", "f4")]),
        _ATTITUDE_COLUMNS,
    ),
}
"""Messages that are read. Further fields of newer versions are ignored."""
_BY_NUMBER: Final = {kind.number: name for name, kind in _KINDS.items()}
_EQUIVALENT_TOPICS: Final = ("RAW_IMU", "SCALED_IMU")
"""Messages with the same sensor."""
_STAMP_COLUMNS: Final = {"time_usec": "timestamp_us", "time_boot_ms": "timestamp_ms"}


def read(path: Path) -> Content:
    """Return a table for each kind of message and each sender."""
    log = _Log(np.fromfile(path, np.uint8))
    tables = dict(sorted(log.tables(), key=lambda item: list(_KINDS).index(item[0].split("/")[0])))
    if not tables:
        raise LogError("no packet of an IMU, a receiver or an attitude is in it")
    return Content(tables, partial(_choose_topic, tables), _choose_sensors(tables))


@dataclass
class _Log:
    """Bytes of a log, and the positions of known packets."""

    raw: _Bytes

    def tables(self) -> Iterator[tuple[str, Table]]:
        """Yield a table for each kind of message of each vehicle."""
        packets, notes = self._sound_payloads
        systems = Counter(system for system, _ in packets for _ in packets[system, _])
        for (system, number), rows in packets.items():
            name = _BY_NUMBER[number]
            main_system = max(systems, key=lambda one: (systems[one], -one))
            topic = name if system == main_system else f"{name}/{system}"
            yield topic, _make_table(topic, _KINDS[name], rows, notes)

    @cached_property
    def _sound_payloads(self) -> tuple[dict[tuple[int, int], _Rows], tuple[str, ...]]:
        """Return the payloads with a correct checksum by vehicle and message, and notes."""
        frames, lost = _find_frames(self.raw.tobytes())
        sound: dict[tuple[int, int], _Rows] = {}
        damaged = 0
        for (system, number), offsets in frames.items():
            rows = _read_payloads(self.raw, np.array(offsets), _KINDS[_BY_NUMBER[number]])
            damaged += len(offsets) - len(rows)
            if len(rows):
                sound[system, number] = rows
        notes = []
        if lost:
            notes.append(f"{lost} bytes are no packet: they are left out")
        if damaged:
            notes.append(f"{damaged} packets have a wrong checksum: they are left out")
        return sound, tuple(notes)


def _find_frames(raw: bytes) -> tuple[dict[tuple[int, int], list[tuple[int, int, int]]], int]:
    """Return the offset, header length and payload length of packets, by vehicle and message.

    The second value is the number of bytes outside packets. A packet counts only if the next one
    follows directly.
    """
    frames: dict[tuple[int, int], list[tuple[int, int, int]]] = {}
    position, lost, size = 0, 0, len(raw)
    while (begin := position + _STAMP) < size:
        end = _find_end(raw, begin)
        after = end + _STAMP
        if not end or end > size or (after < size and raw[after] not in (_V1, _V2)):
            position, lost = position + 1, lost + 1
            continue
        head = _V1_HEAD_BYTES if raw[begin] == _V1 else _V2_HEAD_BYTES
        numbered = (
            slice(begin + 5, begin + 6) if head == _V1_HEAD_BYTES else slice(begin + 7, begin + 10)
        )
        number = int.from_bytes(raw[numbered], "little")
        if number in _BY_NUMBER:
            system = raw[begin + (3 if head == _V1_HEAD_BYTES else 5)]
            frames.setdefault((system, number), []).append((begin, head, raw[begin + 1]))
        position = end
    return frames, lost + size - position


def _find_end(raw: bytes, begin: int) -> int:
    """Return the end of the packet at `begin`; 0 if there is no packet."""
    if begin + _V2_HEAD_BYTES > len(raw):
        return 0
    if raw[begin] == _V1:
        return begin + _V1_HEAD_BYTES + raw[begin + 1] + _CRC_BYTES
    if raw[begin] == _V2:
        signed = _SIGNATURE_BYTES if raw[begin + 2] & 1 else 0
        return begin + _V2_HEAD_BYTES + raw[begin + 1] + _CRC_BYTES + signed
    return 0


def _read_payloads(raw: _Bytes, places: npt.NDArray[np.int64], kind: _MessageKind) -> _Rows:
    """Return the rows of packets with a correct checksum, in the order of the file.

    Missing bytes at the end of a packet are zeros. Additional bytes are ignored.
    """
    size = kind.fields.itemsize
    rows = np.zeros((len(places), size), np.uint8)
    sound = np.zeros(len(places), bool)
    for head, length in {(head, length) for _, head, length in places.tolist()}:
        rows_of_length = np.flatnonzero((places[:, 1] == head) & (places[:, 2] == length))
        bytes_ = raw[places[rows_of_length, :1] + np.arange(head + length + _CRC_BYTES)]
        crc = _checksum(bytes_[:, 1 : head + length], kind.crc_extra)
        stated_crc = bytes_[:, -2].astype(np.uint16) | bytes_[:, -1].astype(np.uint16) << 8
        sound[rows_of_length] = crc == stated_crc
        copied_bytes = min(size, length)
        rows[rows_of_length, :copied_bytes] = bytes_[:, head : head + copied_bytes]
    return rows[sound].reshape(-1).view(kind.fields)


def _checksum(packets: _Bytes, crc_extra: int) -> npt.NDArray[np.uint16]:
    """Return CRC-16/MCRF4XX of each row with one more byte at its end."""
    crc = np.full(len(packets), 0xFFFF, np.uint16)
    for byte in (*packets.T, np.full(len(packets), crc_extra, np.uint8)):
        part = (byte ^ crc).astype(np.uint8)
        part ^= part << np.uint8(4)
        wide = part.astype(np.uint16)
        crc = (crc >> 8) ^ (wide << 8) ^ (wide << 3) ^ (wide >> 4)
    return crc


def _make_table(topic: str, kind: _MessageKind, rows: _Rows, notes: tuple[str, ...]) -> Table:
    stamp = next(name for name in _STAMP_COLUMNS if name in (kind.fields.names or ()))
    getters: _Columns = {
        _STAMP_COLUMNS[stamp]: lambda rows: rows[stamp].astype(np.int64),
        **kind.columns,
    }
    names = tuple(getters)
    if topic.startswith("ATTITUDE"):
        notes = (*notes, "the attitude is the autopilot's own estimate, not a reference")
    meta = Metadata(sensor=topic, axes=FORWARD_RIGHT_DOWN, notes=notes)

    def load(wanted: Sequence[int]) -> list[Column]:
        return [getters[names[i]](rows) for i in wanted]

    return Table(len(names), load, names=names, meta=meta, time=0)


def _choose_sensors(tables: Mapping[str, Table]) -> tuple[str, ...]:
    """Return the tables for a recording: each sensor of the main vehicle once."""
    own_names = [name for name in tables if "/" not in name]
    duplicates = [name for name in _EQUIVALENT_TOPICS if name in own_names]
    if "HIGHRES_IMU" in own_names:
        dropped = {*_EQUIVALENT_TOPICS}
    else:
        dropped = set(sorted(duplicates, key=lambda name: -_row_count(tables[name]))[1:])
    return tuple(name for name in own_names if name not in dropped)


def _row_count(table: Table) -> int:
    return len(table.load([0])[0])


def _choose_topic(tables: Mapping[str, Table], topic: str | None) -> str:
    if topic in tables:
        return str(topic)
    if topic is not None:
        raise LogError(f"there is no topic '{topic}'; the log has: {', '.join(tables)}", "topic")
    gyro_topic = next((name for name in _choose_sensors(tables) if "IMU" in name), None)
    if gyro_topic is None:
        raise LogError(f"no packet holds a gyro; the log has: {', '.join(tables)}")
    return gyro_topic
