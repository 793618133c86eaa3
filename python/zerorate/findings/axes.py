"""Units, signs and axes that motion contradicts, and the scale of the gyro: `zerorate.check`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.checks.preparation import checked_axes, steady_of
from zerorate.checks.result import Checks
from zerorate.checks.result import Finding as Checked
from zerorate.findings.finding import Finding
from zerorate.findings.imus import BLOCK, Imu, Sensor, part
from zerorate.numerals import with_error
from zerorate.record.log import LogError
from zerorate.record.recording import Recording

SECTION: Final = "Units and axes"
_LONGEST: Final = 7200.0
"""Seconds that tell units and axes as well as a day does."""
_SHOWN: Final = ("agrees", "partly seen")


def axes(recording: Recording, found: Sequence[Imu]) -> Iterator[Finding]:
    """Yield what motion shows of the axes of the first IMU, and of a magnetometer."""
    if not found or found[0].gyro is None or found[0].accel is None:
        return
    name = found[0].gyro.name
    checks = checked_axes(_liveliest(recording, found[0].gyro), name)
    start = found[0].gyro.start
    # A steady rate at rest is a bias, of which the rests tell.
    steady = steady_of(recording, name, found[0].accel.name)
    for one in (checks.magnetometer,) if steady else (checks.gyro, checks.magnetometer):
        if one.alarm or one.status in _SHOWN:
            yield _on(one, found[0], start)
    for note in (*checks.notes, *filter(None, (checks.clock,))):
        yield Finding(SECTION, "size", "look", f"{note[0].upper()}{note[1:]}.")
    yield from _numbers(checks, found[0])


def _liveliest(recording: Recording, gyro: Sensor) -> Recording:
    """Return the two hours in which a gyro turns most, of a longer recording."""
    seconds = float(gyro.log.sampled[-1]) - gyro.start
    if seconds <= _LONGEST:
        return recording
    sizes = np.nan_to_num(np.linalg.norm(gyro.blocks.mean, axis=1)).cumsum()
    width = round(_LONGEST / BLOCK)
    first = int(np.argmax(sizes[width:] - sizes[:-width]))
    begin = gyro.start + BLOCK * first
    logs = {}
    for name, log in recording.items():
        with suppress(LogError):
            logs[name] = part(log, begin, begin + _LONGEST)
    return replace(recording, logs=logs)


def _on(one: Checked, imu: Imu, start: float) -> Finding:
    spans = tuple((round(a - start, 3), round(b - start, 3)) for a, b in one.spans)
    return Finding(
        SECTION, "axes", "act" if one.alarm else "good",
        f"{one.text[0].upper()}{one.text[1:]}.",
        one.ratio if one.alarm else None, "times worse" if one.alarm else "", None, spans,
        imu.sensors[0].figure,
        "Other commands take --fix, which puts right what is exact." if one.alarm else "",
    )  # fmt: skip


def _numbers(checks: Checks, imu: Imu) -> Iterator[Finding]:
    for axis, scale in zip("xyz", checks.scale, strict=True):
        if scale.identifiable:
            yield Finding(
                SECTION, f"scale {axis}", "good",
                f"The scale of the gyro's {axis} is {with_error(scale.value, scale.sigma)} of the "
                "accelerometer's turns.",
                scale.value, "", scale.sigma, (), imu.sensors[0].figure,
            )  # fmt: skip
