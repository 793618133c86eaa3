"""Where a log is from: which device wrote it, and on which day."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import numpy as np

from zerorate.findings.autopilot import rows_of
from zerorate.findings.imus import beginning
from zerorate.record.recording import Recording

_HEAD: Final = 1 << 18
_UUID: Final = re.compile(rb"I.char\[(\d{1,3})\] sys_uuid", re.DOTALL)
"""The message of a ULog with the number of the board."""
_DATES: Final = (946_684_800.0, 4_102_444_800.0)
"""Seconds from 1970 to the years 2000 and 2100, between which numbers are dates."""
_RECEIVERS: Final = ("vehicle_gps_position", "sensor_gps")


def device_of(recording: Recording) -> str | None:
    """Return the number of the device that a log holds, None where it holds none."""
    path = Path(recording.source)
    if path.suffix.lower() != ".ulg" or not path.is_file():
        return None
    with path.open("rb") as file:
        head = file.read(_HEAD)
    found = _UUID.search(head)
    if found is None:
        return None
    text = head[found.end() : found.end() + int(found[1])]
    return text.decode("ascii", "replace").strip("\0 ") or None


def began(recording: Recording) -> float | None:
    """Return the Unix time at which a log begins, s, None where neither clock nor receiver tell."""
    start = beginning(recording)
    if _DATES[0] < start < _DATES[1]:
        return start
    for _, rows in rows_of(recording, _RECEIVERS):
        utc = rows.columns.get("time_utc_usec")
        if utc is not None:
            seconds = 1e-6 * utc
            dated = np.flatnonzero((seconds > _DATES[0]) & (seconds < _DATES[1]))
            if dated.size:
                return float(seconds[dated[0]] - rows.times[dated[0]])
    return None
