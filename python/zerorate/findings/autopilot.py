"""Vibration and clipping that PX4 or ArduPilot logged at the sensor's rate."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Final, NamedTuple

import numpy as np

from zerorate.findings.finding import Finding, Spans
from zerorate.findings.imus import start_time
from zerorate.findings.limits import LIMITS
from zerorate.numerals import shorten
from zerorate.record.log import LogError
from zerorate.record.recording import Recording
from zerorate.record.runs import runs
from zerorate.record.supplement import TableColumns
from zerorate.types import Booleans, Floats

SECTION: Final = "What the autopilot wrote"
_STATUS_TOPIC, _ESTIMATOR_TOPIC = "vehicle_imu_status", "estimator_status"
_VIBE_TOPIC: Final = "VIBE"
_FORMATS: Final = ("ulog", "dataflash", "dataflash text")
_MIN_ROWS: Final = 5
"""Smallest number of rows of a topic for a finding."""


class TopicRows(NamedTuple):
    """Seconds since the beginning, and columns by their names, each (n,)."""

    times: Floats
    columns: Mapping[str, Floats]


def autopilot_findings(recording: Recording) -> Iterator[Finding]:
    """Yield findings on vibration and clipping from the log of an autopilot."""
    for name, rows in rows_of(recording, (_STATUS_TOPIC, _ESTIMATOR_TOPIC, _VIBE_TOPIC)):
        yield from _check_vibe(rows) if name == _VIBE_TOPIC else _check_topic(name, rows)


def rows_of(recording: Recording, topics: tuple[str, ...]) -> Iterator[tuple[str, TopicRows]]:
    """Yield the rows of topics with a name prefix; the log is opened again."""
    if all(log.meta.get("format") not in _FORMATS for log in recording.values()):
        return
    start = start_time(recording)
    # A file that changed since it was read gives no finding.
    with suppress(LogError, OSError):
        for name, columns in recording.tables(*topics):
            rows = _read_rows(columns, start)
            if rows is not None:
                yield name, rows


def _read_rows(columns: TableColumns, start: float) -> TopicRows | None:
    """Return the rows of a topic, None if there are too few."""
    numbers = dict(columns)
    times = 1e-6 * numbers.pop("timestamp_us").astype(np.float64) - start
    if len(times) < _MIN_ROWS:
        return None
    return TopicRows(times, {label: column.astype(np.float64) for label, column in numbers.items()})


def _check_vibe(rows: TopicRows) -> Iterator[Finding]:
    """Yield findings on ArduPilot's rows: one for each numbered IMU, or counters of all IMUs."""
    numbers = rows.columns.get("IMU", np.zeros(len(rows.times)))
    for number in np.unique(numbers):
        of_imu = numbers == number
        times = rows.times[of_imu]
        columns = {name: column[of_imu] for name, column in rows.columns.items()}
        axes = [columns[f"Vibe{axis}"] for axis in "XYZ" if f"Vibe{axis}" in columns]
        if axes and len(times) >= _MIN_ROWS:
            yield from _check_level(
                f"VIBE of IMU {number:.0f}", "vibration", np.max(axes, axis=0), times
            )
        for name in ("Clip", "Clip0", "Clip1", "Clip2"):
            if name in columns and len(times) >= _MIN_ROWS:
                imu_number = number if name == "Clip" else float(name[-1])
                yield _check_clips(f"VIBE of IMU {imu_number:.0f}", "accel", columns[name], times)


def _check_topic(name: str, rows: TopicRows) -> Iterator[Finding]:
    columns = rows.columns
    if name.startswith(_STATUS_TOPIC) and "accel_vibration_metric" in columns:
        yield from _check_level(
            name, "vibration metric", columns["accel_vibration_metric"], rows.times
        )
    elif name.startswith(_ESTIMATOR_TOPIC) and "vibe[2]" in columns:
        yield from _check_level(name, "estimator vibration", columns["vibe[2]"], rows.times)
    for sensor in ("accel", "gyro"):
        clips = [
            columns[key] for key in (f"{sensor}_clipping[{i}]" for i in range(3)) if key in columns
        ]
        if clips:
            yield _check_clips(name, sensor, np.sum(clips, axis=0), rows.times)


def _check_level(name: str, kind: str, values: Floats, times: Floats) -> Iterator[Finding]:
    finite = np.isfinite(values)
    if np.count_nonzero(finite) < _MIN_ROWS:
        return
    values, times = values[finite], times[finite]
    limit, level = LIMITS[kind], float(np.quantile(values, 0.95))
    severity = limit.severity(level)
    bound = limit.act if severity == "act" else limit.look
    over = values >= bound
    text = f"{name}: {limit.what}, is {shorten(level, 3)} {limit.unit}"
    if over.any():
        share = 100.0 * float(over.mean())
        first = float(times[over][0])
        text += f"; {bound:g} and more in {shorten(share)} % of its rows, first at {first:.1f} s"
    yield Finding(
        SECTION, kind, severity, f"{text}.", level, limit.unit, None, _spans_where(times, over), "",
        "Log raw samples of a hover and compare their spectra before and after a change.",
    )  # fmt: skip


def _check_clips(name: str, sensor: str, counts: Floats, times: Floats) -> Finding:
    """Return the increase of a counter that may restart."""
    steps = np.diff(counts)
    steps = np.where(steps < 0, counts[1:], steps)
    growth, limit = float(steps.sum()), LIMITS["clips"]
    return Finding(
        SECTION, "clips", limit.severity(growth),
        f"{name}: the counters of clipped {sensor} samples grew by {growth:.0f}.",
        growth, "", None, _spans_where(times[1:], steps > 0), "",
        "Exclude these spans from integration, and set a wider range.",
    )  # fmt: skip


def _spans_where(times: Floats, where: Booleans) -> Spans:
    """Return the first and last rows of runs with a True mask."""
    return tuple(
        (round(float(times[a]), 3), round(float(times[b - 1]), 3)) for a, b in runs(where).tolist()
    )
