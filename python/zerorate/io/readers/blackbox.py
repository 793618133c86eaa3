"""Blackbox logs of Betaflight, INAV and others: gyro and accelerometer of a flight controller."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from zerorate._native import read_blackbox
from zerorate.io.readers.rows import make_content
from zerorate.io.table import Column, Content, Metadata, Table
from zerorate.record.log import LogError
from zerorate.texts import escape_line

_FIELDS: Final = {
    "gyro": ("gyroADC", "gyro_{}_dps"),
    "gyro_unfiltered": ("gyroUnfilt", "gyro_{}_dps"),
    "accel": ("accSmooth", "accel_{}_g"),
}
"""Fields of each sensor, and the names of its columns."""
_MAX_RADIANS_PER_US: Final = 1e-6
"""Largest scale of a gyro, rad/us, that old firmware states; newer firmware states deg/s."""
_HIGH_RESOLUTION: Final = 10.0
"""Factor of gyro values with the header ``blackbox_high_resolution``."""


class _Log(NamedTuple):
    """One log of a file: from arming to disarming."""

    headers: Mapping[str, str]
    columns: Mapping[str, Column]
    lost_bytes: int
    all_bytes: int

    @property
    def rows(self) -> int:
        """Number of main frames."""
        return len(self.columns.get("time", ()))

    @property
    def firmware(self) -> str:
        """Firmware and board, for a sentence."""
        words = (self.headers.get("Firmware revision"), self.headers.get("Board information"))
        return escape_line(", ".join(word for word in words if word)) or "unknown firmware"


def read(path: Path) -> Content:
    """Return a table of each sensor; of several logs in a file, the longest is the default.

    The sensors of the other logs have the log's number before their name, such as ``2/gyro``.

    Raises
    ------
    LogError
        If no log has a gyro.
    """
    raw = np.asarray(np.memmap(path, np.uint8, "r"))
    logs = [
        _Log(dict(headers), dict(zip(names, columns, strict=True)), lost, size)
        for headers, names, columns, lost, size in read_blackbox(
            raw, [f for f, _ in _FIELDS.values()]
        )
    ]
    longest = max(range(len(logs)), key=lambda index: logs[index].rows)
    tables = _make_tables(logs[longest], _describe_logs(len(logs), longest))
    if "gyro" not in tables and "gyro_unfiltered" not in tables:
        firmware, rows = logs[longest].firmware, logs[longest].rows
        raise LogError(f"no gyro is found in this log of {firmware}; it has {rows} frames")
    names = tuple(name for name in tables if name != "gyro_unfiltered" or "gyro" not in tables)
    for index, log in enumerate(logs):
        if index != longest:
            tables |= {f"{index + 1}/{name}": table for name, table in _make_tables(log).items()}
    content = make_content(tables)
    return Content(content.tables, content.find_topic, names)


def _describe_logs(count: int, longest: int) -> tuple[str, ...]:
    if count == 1:
        return ()
    return (f"the file has {count} logs: log {longest + 1}, the longest, is read",)


def _make_tables(log: _Log, notes: Sequence[str] = ()) -> dict[str, Table]:
    """Return the tables of the sensors that a log has."""
    if log.lost_bytes:
        notes = (
            *notes,
            f"{log.lost_bytes} of {log.all_bytes} bytes are damaged: they are left out",
        )
    scales = {"accSmooth": _accel_scale(log)}
    tables = {}
    for sensor, (field, name) in _FIELDS.items():
        fields = [f"{field}[{axis}]" for axis in range(3)]
        scale = scales.get(field, _gyro_scale(log))
        if log.rows < 2 or not all(key in log.columns for key in fields) or scale is None:
            continue
        filtered = "the flight controller has filtered this gyro"
        own = (*notes, filtered) if sensor == "gyro" else notes
        meta = Metadata(
            sensor=f"{log.firmware} {sensor}",
            axes="those of the flight controller",
            notes=tuple(own),
        )
        columns = [log.columns["time"], *(scale * log.columns[key] for key in fields)]
        names = ("timestamp_us", *(name.format(axis) for axis in "xyz"))
        tables[sensor] = _make_table(names, columns, meta)
    return tables


def _make_table(names: tuple[str, ...], columns: Sequence[Column], meta: Metadata) -> Table:
    def load(wanted: Sequence[int]) -> list[Column]:
        return [columns[i] for i in wanted]

    return Table(len(names), load, names=names, meta=meta, time=0)


def _gyro_scale(log: _Log) -> float:
    """Return the deg/s of one count."""
    text = log.headers.get("gyro_scale", log.headers.get("gyro.scale", ""))
    try:
        scale = struct.unpack(">f", struct.pack(">I", int(text, 16)))[0] if text else 1.0
    except (ValueError, struct.error):
        raise ValueError(f"its gyro_scale is '{escape_line(text)}'") from None
    if 0.0 < scale < _MAX_RADIANS_PER_US:
        scale = float(np.degrees(1e6 * scale))
    if log.headers.get("blackbox_high_resolution", "0").strip() not in ("", "0"):
        scale /= _HIGH_RESOLUTION
    return float(scale)


def _accel_scale(log: _Log) -> float | None:
    """Return the g of one count, None if it is not stated."""
    text = log.headers.get("acc_1G", "")
    return 1.0 / int(text) if text.isdigit() and int(text) > 0 else None
