"""Findings on units, signs and axes, and on the scale of the gyro, from `zerorate.check`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.checks.preparation import check_axes, find_steady_rate
from zerorate.checks.result import Checks
from zerorate.checks.result import Finding as Checked
from zerorate.findings.finding import Finding
from zerorate.findings.imus import BLOCK_S, Imu, Sensor, cut_log
from zerorate.numerals import format_with_error
from zerorate.record.log import LogError
from zerorate.record.recording import Recording

SECTION: Final = "Units and axes"
_MAX_CHECKED_S: Final = 7200.0
"""Longest part of a log used to check units and axes, s."""
_REPORTED_STATUSES: Final = ("agrees", "partly seen")


def axes_findings(recording: Recording, imus: Sequence[Imu]) -> Iterator[Finding]:
    """Yield findings on the axes of the first IMU and of a magnetometer, from motion."""
    if not imus or imus[0].gyro is None or imus[0].accel is None:
        return
    name = imus[0].gyro.name
    checks = check_axes(_select_liveliest_part(recording, imus[0].gyro), name)
    start = imus[0].gyro.start
    # A steady rate at rest is a bias, which the rests report.
    steady = find_steady_rate(recording, name, imus[0].accel.name)
    for check in (checks.magnetometer,) if steady else (checks.gyro, checks.magnetometer):
        if check.alarm or check.status in _REPORTED_STATUSES:
            yield _describe_check(check, imus[0], start)
    for note in (*checks.notes, *filter(None, (checks.clock,))):
        yield Finding(SECTION, "size", "look", f"{note[0].upper()}{note[1:]}.")
    yield from _describe_scales(checks, imus[0])


def _select_liveliest_part(recording: Recording, gyro: Sensor) -> Recording:
    """Return the two hours with the most rotation of a longer recording."""
    seconds = float(gyro.log.sampled[-1]) - gyro.start
    if seconds <= _MAX_CHECKED_S:
        return recording
    sizes = np.nan_to_num(np.linalg.norm(gyro.blocks.mean, axis=1)).cumsum()
    width = round(_MAX_CHECKED_S / BLOCK_S)
    first = int(np.argmax(sizes[width:] - sizes[:-width]))
    begin = gyro.start + BLOCK_S * first
    logs = {}
    for name, log in recording.items():
        with suppress(LogError):
            logs[name] = cut_log(log, begin, begin + _MAX_CHECKED_S)
    return replace(recording, logs=logs)


def _describe_check(check: Checked, imu: Imu, start: float) -> Finding:
    spans = tuple((round(a - start, 3), round(b - start, 3)) for a, b in check.spans)
    return Finding(
        SECTION, "axes", "act" if check.alarm else "good",
        f"{check.text[0].upper()}{check.text[1:]}.",
        check.ratio if check.alarm else None, "times worse" if check.alarm else "", None, spans,
        imu.sensors[0].figure,
        "Correct what is certain with the option --fix of other commands." if check.alarm else "",
    )  # fmt: skip


def _describe_scales(checks: Checks, imu: Imu) -> Iterator[Finding]:
    for axis, scale in zip("xyz", checks.scale, strict=True):
        if scale.identifiable:
            yield Finding(
                SECTION, f"scale {axis}", "good",
                f"The scale of the gyro's {axis} is "
                f"{format_with_error(scale.value, scale.sigma)} of the "
                "accelerometer's turns.",
                scale.value, "", scale.sigma, (), imu.sensors[0].figure,
            )  # fmt: skip
