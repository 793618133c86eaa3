"""Findings on the magnetometer: hard and soft iron, from the gyro, and unexplained spans."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.calibration.magnet.calibrate import calibrate_magnetometer
from zerorate.calibration.magnet.spans import Span
from zerorate.calibration.magnetometer import MagnetometerCalibration
from zerorate.findings.finding import Finding
from zerorate.findings.imus import BLOCK_S, Imu, Sensor, cut_log
from zerorate.findings.limits import LIMITS
from zerorate.numerals import format_with_error, shorten
from zerorate.record.log import LogError
from zerorate.record.recording import Recording

SECTION: Final = "Magnetometer"
_MAX_CALIBRATED_S: Final = 240.0
"""Longest analysed part, s; it takes a second or two to compute."""


def magnetometer_findings(recording: Recording, imus: Sequence[Imu]) -> Iterator[Finding]:
    """Yield findings on iron near the first magnetometer and on its field, from rotation."""
    imu = next((candidate for candidate in imus if candidate.still.size), None)
    if imu is None or imu.gyro is None or recording.mag is None:
        return
    gyro = imu.gyro
    try:
        excerpt = _select_turning_part(recording, gyro)
        calibration = calibrate_magnetometer(excerpt, gyro=gyro.name)
    except LogError:
        return
    if all(span.kind == "still" for span in calibration.spans):
        yield Finding(
            SECTION, "magnetometer", "good",
            "The magnetometer: this log has too little rotation to determine iron or field.",
            figure=gyro.figure,
        )  # fmt: skip
        return
    yield from _check_iron(calibration, gyro)
    yield from _check_disturbance(calibration, gyro)


def _select_turning_part(recording: Recording, gyro: Sensor) -> Recording:
    """Return the part of a long recording with the most rotation."""
    width = round(_MAX_CALIBRATED_S / BLOCK_S)
    rates = np.linalg.norm(np.nan_to_num(gyro.blocks.mean), axis=1)
    if len(rates) <= width:
        return recording
    sums = np.concatenate([[0.0], np.cumsum(rates)])
    first = int(np.argmax(sums[width:] - sums[:-width]))
    begin = gyro.start + BLOCK_S * first
    sensor_names = (gyro.name, gyro.name.replace("gyro", "accel", 1), "mag")
    logs = {
        name: cut_log(recording[name], begin, begin + _MAX_CALIBRATED_S) for name in sensor_names
    }
    return replace(recording, logs=logs)


def _check_iron(calibration: MagnetometerCalibration, gyro: Sensor) -> Iterator[Finding]:
    if not calibration.valid:
        text = f"The magnetometer: {calibration.problems[0]}."
        yield Finding(SECTION, "magnetometer", "look", text, figure=gyro.figure)
        return
    dip, field = math.degrees(calibration.dip.value), calibration.field
    if field.identifiable and calibration.dip.identifiable:
        yield Finding(
            SECTION, "field", "good",
            "The field that the magnetometer shows is "
            f"{format_with_error(field.value, field.sigma)} "
            f"{calibration.unit}, {shorten(abs(dip), 3)} deg {'below' if dip > 0 else 'above'} the "
            "level.",
            field.value, calibration.unit, field.sigma, figure=gyro.figure,
        )  # fmt: skip
    errors = [
        (math.degrees(float(calibration.heading_error(True, k).max())), k)
        for k, group in enumerate(calibration.groups)
        if group.applied
    ]
    if not errors:
        text = (
            "The magnetometer has no hard iron to subtract: its samples follow the gyro's rotation."
        )
        yield Finding(SECTION, "heading error", "good", text, figure=gyro.figure)
        return
    worst, group = max(errors)
    size = math.hypot(*calibration.groups[group].hard_iron)
    yield Finding(
        SECTION, "heading error", LIMITS["heading error"].severity(worst),
        f"A hard iron of {shorten(size, 3)} {calibration.unit} turns the heading of a level sensor "
        "by up to "
        f"{shorten(worst)} deg if it is not subtracted.",
        worst, "deg", None, _spans_where(calibration, gyro, lambda span: span.group == group),
        gyro.figure,
        "Calibrate the magnetometer where it is mounted: "
        "`zerorate.calibration.calibrate_magnetometer`.",
    )  # fmt: skip


def _check_disturbance(calibration: MagnetometerCalibration, gyro: Sensor) -> Iterator[Finding]:
    if changes := calibration.iron_changes:
        times = [start - gyro.start for start, _ in changes]
        starts = tuple((time, time + 1.0) for time in times)
        listed = ", ".join(
            f"by {size:.3g} {calibration.unit} at {time:.0f} s"
            for time, (_, size) in zip(times, changes, strict=True)
        )
        yield Finding(
            SECTION, "iron changes", LIMITS["iron changes"].severity(len(changes)),
            f"The hard iron of the magnetometer changes {listed}.",
            float(len(changes)), "", None, starts, gyro.figure,
            "Record again with all wires and iron parts fixed in their final places.",
        )  # fmt: skip
    if calibration.disturbed:
        share = 100.0 * calibration.disturbed
        yield Finding(
            SECTION, "disturbed", LIMITS["disturbed"].severity(share),
            f"No hard iron explains the magnetometer's field in {shorten(share)} % of the log.",
            share, "%", None,
            _spans_where(calibration, gyro, lambda span: span.kind == "disturbed"),
            gyro.figure, "Do not use the magnetometer for heading in these spans.",
        )  # fmt: skip


def _spans_where(
    calibration: MagnetometerCalibration, gyro: Sensor, condition: Callable[[Span], bool]
) -> tuple[tuple[float, float], ...]:
    return tuple(
        (round(span.start - gyro.start, 3), round(span.stop - gyro.start, 3))
        for span in calibration.spans
        if condition(span)
    )
