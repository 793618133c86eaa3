"""Date of a log."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.findings.autopilot import rows_of
from zerorate.findings.imus import start_time
from zerorate.record.recording import Recording

_UNIX_TIME_RANGE_S: Final = (946_684_800.0, 4_102_444_800.0)
"""Unix times of the years 2000 and 2100, s: numbers between them are dates."""
_RECEIVER_TOPICS: Final = ("vehicle_gps_position", "sensor_gps")


def find_start_date(recording: Recording) -> float | None:
    """Return the Unix time at which a log begins, s; None if it is unknown."""
    start = start_time(recording)
    if _UNIX_TIME_RANGE_S[0] < start < _UNIX_TIME_RANGE_S[1]:
        return start
    for _, rows in rows_of(recording, _RECEIVER_TOPICS):
        utc = rows.columns.get("time_utc_usec")
        if utc is not None:
            seconds = 1e-6 * utc
            dated = np.flatnonzero(
                (seconds > _UNIX_TIME_RANGE_S[0]) & (seconds < _UNIX_TIME_RANGE_S[1])
            )
            if dated.size:
                return float(seconds[dated[0]] - rows.times[dated[0]])
    return None
