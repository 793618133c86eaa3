"""The magnetometer's disturbance: what the gyro says of its iron, and when no iron explains it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np

from zerorate.calibration.magnet.spans import Span
from zerorate.calibration.magnetometer import MagnetometerCalibration, calibrate_magnetometer
from zerorate.findings.finding import Finding, counted
from zerorate.findings.imus import BLOCK, Imu, Sensor, part
from zerorate.findings.limits import LIMITS
from zerorate.numerals import with_error
from zerorate.record.log import LogError
from zerorate.record.recording import Recording

SECTION: Final = "Magnetometer"
_LONGEST: Final = 240.0
"""Seconds of which iron is found in a second or two."""


def magnetometer(recording: Recording, found: Sequence[Imu]) -> Iterator[Finding]:
    """Yield what turning shows of the iron near the first magnetometer, and of its field."""
    imu = next((one for one in found if one.still.size), None)
    if imu is None or imu.gyro is None or recording.mag is None:
        return
    gyro = imu.gyro
    try:
        judged = _turning(recording, gyro)
        calibration = calibrate_magnetometer(judged, gyro=gyro.name)
    except LogError:
        return
    if all(span.kind == "still" for span in calibration.spans):
        yield Finding(
            SECTION, "magnetometer", "good",
            "The magnetometer: this log hardly turns, so neither iron nor field is known.",
            figure=gyro.figure,
        )  # fmt: skip
        return
    yield from _irons(calibration, gyro)
    yield from _disturbed(calibration, gyro)


def _turning(recording: Recording, gyro: Sensor) -> Recording:
    """Return the part of a long recording that turns most."""
    width = round(_LONGEST / BLOCK)
    turns = np.linalg.norm(np.nan_to_num(gyro.blocks.mean), axis=1)
    if len(turns) <= width:
        return recording
    sums = np.concatenate([[0.0], np.cumsum(turns)])
    first = int(np.argmax(sums[width:] - sums[:-width]))
    begin = gyro.start + BLOCK * first
    chosen = (gyro.name, gyro.name.replace("gyro", "accel", 1), "mag")
    logs = {name: part(recording[name], begin, begin + _LONGEST) for name in chosen}
    return replace(recording, logs=logs)


def _irons(found: MagnetometerCalibration, gyro: Sensor) -> Iterator[Finding]:
    if not found.valid:
        text = f"The magnetometer: {found.problems[0]}."
        yield Finding(SECTION, "magnetometer", "look", text, figure=gyro.figure)
        return
    dip, field = math.degrees(found.dip.value), found.field
    if field.identifiable and found.dip.identifiable:
        yield Finding(
            SECTION, "field", "good",
            f"The field that the magnetometer shows is {with_error(field.value, field.sigma)} "
            f"{found.unit}, {abs(dip):.3g} deg {'below' if dip > 0 else 'above'} the level.",
            field.value, found.unit, field.sigma, figure=gyro.figure,
        )  # fmt: skip
    errors = [
        (math.degrees(float(found.heading_error(True, k).max())), k)
        for k, group in enumerate(found.groups)
        if group.applied
    ]
    if not errors:
        text = "The magnetometer's samples turn as the gyro says: no hard iron is to be taken off."
        yield Finding(SECTION, "heading error", "good", text, figure=gyro.figure)
        return
    worst, group = max(errors)
    size = math.hypot(*found.groups[group].hard_iron)
    yield Finding(
        SECTION, "heading error", LIMITS["heading error"].severity(worst),
        f"A hard iron of {size:.3g} {found.unit} turns the heading of a level sensor by up to "
        f"{worst:.2g} deg, where no one takes it off.",
        worst, "deg", None, _spans(found, gyro, lambda one: one.group == group), gyro.figure,
        "Calibrate the magnetometer where it is mounted: "
        "`zerorate.calibration.calibrate_magnetometer`.",
    )  # fmt: skip


def _disturbed(found: MagnetometerCalibration, gyro: Sensor) -> Iterator[Finding]:
    known = [one for one in found.spans if one.kind != "disturbed"]
    changes = [other for one, other in pairwise(known) if one.group != other.group]
    if changes:
        starts = tuple((one.start - gyro.start, one.start - gyro.start + 1.0) for one in changes)
        yield Finding(
            SECTION, "iron changes", LIMITS["iron changes"].severity(len(changes)),
            f"The hard iron of the magnetometer changes {counted(len(changes), 'time')}.",
            float(len(changes)), "", None, starts, gyro.figure,
            "Record again with everything that carries current or iron where it stays.",
        )  # fmt: skip
    if found.disturbed:
        share = 100.0 * found.disturbed
        yield Finding(
            SECTION, "disturbed", LIMITS["disturbed"].severity(share),
            f"No hard iron explains the magnetometer's field in {share:.2g} % of the log.",
            share, "%", None, _spans(found, gyro, lambda one: one.kind == "disturbed"), gyro.figure,
            "Leave these spans out of any heading.",
        )  # fmt: skip


def _spans(
    found: MagnetometerCalibration, gyro: Sensor, chosen: Callable[[Span], bool]
) -> tuple[tuple[float, float], ...]:
    return tuple(
        (round(one.start - gyro.start, 3), round(one.stop - gyro.start, 3))
        for one in found.spans
        if chosen(one)
    )
