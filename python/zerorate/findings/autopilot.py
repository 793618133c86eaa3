"""What PX4 or ArduPilot wrote of vibration and clipping into its log, at the sensor's rate."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Final, NamedTuple

import numpy as np

from zerorate.findings.finding import Finding, Spans
from zerorate.findings.imus import beginning
from zerorate.findings.limits import LIMITS
from zerorate.record.log import LogError
from zerorate.record.recording import Recording
from zerorate.record.runs import runs
from zerorate.record.supplement import TableColumns
from zerorate.types import Booleans, Floats

SECTION: Final = "What the autopilot wrote"
_STATUS, _ESTIMATOR = "vehicle_imu_status", "estimator_status"
_VIBE: Final = "VIBE"
_FORMATS: Final = ("ulog", "dataflash", "dataflash text")
_LEAST: Final = 5
"""Rows of a topic without which nothing is told."""


class Rows(NamedTuple):
    """Seconds since the beginning, and columns by their names, each (n,)."""

    times: Floats
    columns: Mapping[str, Floats]


def autopilot(recording: Recording) -> Iterator[Finding]:
    """Yield what the log of an autopilot says of vibration and clipping."""
    for name, rows in rows_of(recording, (_STATUS, _ESTIMATOR, _VIBE)):
        yield from _of_vibe(rows) if name == _VIBE else _of_topic(name, rows)


def rows_of(recording: Recording, topics: tuple[str, ...]) -> Iterator[tuple[str, Rows]]:
    """Yield the rows of an autopilot's topics whose names begin so; the log is opened again."""
    if all(log.meta.get("format") not in _FORMATS for log in recording.values()):
        return
    start = beginning(recording)
    # What has become of the file since it was read is no finding.
    with suppress(LogError, OSError):
        for name, columns in recording.tables(*topics):
            rows = _rows(columns, start)
            if rows is not None:
                yield name, rows


def _rows(columns: TableColumns, start: float) -> Rows | None:
    """Return the rows of a topic, None where there are too few."""
    found = dict(columns)
    times = 1e-6 * found.pop("timestamp_us").astype(np.float64) - start
    if len(times) < _LEAST:
        return None
    return Rows(times, {label: column.astype(np.float64) for label, column in found.items()})


def _of_vibe(rows: Rows) -> Iterator[Finding]:
    """Yield what ArduPilot says: a row an IMU with its number, or rows with counters of all."""
    numbers = rows.columns.get("IMU", np.zeros(len(rows.times)))
    for number in np.unique(numbers):
        which = numbers == number
        times = rows.times[which]
        columns = {name: column[which] for name, column in rows.columns.items()}
        axes = [columns[f"Vibe{axis}"] for axis in "XYZ" if f"Vibe{axis}" in columns]
        if axes and len(times) >= _LEAST:
            yield from _level(f"VIBE of IMU {number:.0f}", "vibration", np.max(axes, axis=0), times)
        for name in ("Clip", "Clip0", "Clip1", "Clip2"):
            if name in columns and len(times) >= _LEAST:
                of = number if name == "Clip" else float(name[-1])
                yield _clips(f"VIBE of IMU {of:.0f}", "accel", columns[name], times)


def _of_topic(name: str, rows: Rows) -> Iterator[Finding]:
    columns = rows.columns
    if name.startswith(_STATUS) and "accel_vibration_metric" in columns:
        yield from _level(name, "vibration metric", columns["accel_vibration_metric"], rows.times)
    elif name.startswith(_ESTIMATOR) and "vibe[2]" in columns:
        yield from _level(name, "estimator vibration", columns["vibe[2]"], rows.times)
    for sensor in ("accel", "gyro"):
        clips = [
            columns[key] for key in (f"{sensor}_clipping[{i}]" for i in range(3)) if key in columns
        ]
        if clips:
            yield _clips(name, sensor, np.sum(clips, axis=0), rows.times)


def _level(name: str, kind: str, values: Floats, times: Floats) -> Iterator[Finding]:
    there = np.isfinite(values)
    if np.count_nonzero(there) < _LEAST:
        return
    values, times = values[there], times[there]
    limit, level = LIMITS[kind], float(np.quantile(values, 0.95))
    how = limit.severity(level)
    bound = limit.act if how == "act" else limit.look
    over = values >= bound
    told = f"{name}: {limit.what}, is {level:.3g} {limit.unit}"
    if over.any():
        share = 100.0 * float(over.mean())
        first = float(times[over][0])
        told += f"; {bound:g} and more in {share:.2g} % of its rows, first at {first:.1f} s"
    yield Finding(
        SECTION, kind, how, f"{told}.", level, limit.unit, None, _spans(times, over), "",
        "Log raw samples of a hover and compare their spectra before and after a change.",
    )  # fmt: skip


def _clips(name: str, sensor: str, counts: Floats, times: Floats) -> Finding:
    """Return by how much a counter grew, which may begin anew."""
    steps = np.diff(counts)
    steps = np.where(steps < 0, counts[1:], steps)
    grew, limit = float(steps.sum()), LIMITS["clips"]
    return Finding(
        SECTION, "clips", limit.severity(grew),
        f"{name}: the counters of clipped {sensor} samples grew by {grew:.0f}.",
        grew, "", None, _spans(times[1:], steps > 0), "",
        "Leave these spans out of any integral, and set a wider range.",
    )  # fmt: skip


def _spans(times: Floats, where: Booleans) -> Spans:
    """Return from which row to which something holds, without a break."""
    return tuple(
        (round(float(times[a]), 3), round(float(times[b - 1]), 3)) for a, b in runs(where).tolist()
    )
