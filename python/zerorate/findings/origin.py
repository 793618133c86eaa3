"""The day on which a log was written."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.findings.autopilot import rows_of
from zerorate.findings.imus import beginning
from zerorate.record.recording import Recording

_DATES: Final = (946_684_800.0, 4_102_444_800.0)
"""Seconds from 1970 to the years 2000 and 2100, between which numbers are dates."""
_RECEIVERS: Final = ("vehicle_gps_position", "sensor_gps")


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
