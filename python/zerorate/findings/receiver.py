"""Findings on the receiver: checks against the sensors, clock, stated standard deviations."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.checks.held import drop_held_fixes
from zerorate.findings.aids import aid_findings
from zerorate.findings.finding import Finding, as_sentence
from zerorate.findings.imus import Imu, Sensor, cut_log
from zerorate.findings.limits import LIMITS, Severity
from zerorate.navigation.begin import Vehicle, find_beginning
from zerorate.navigation.selfcheck import NavigationChecks, NavigationFinding
from zerorate.navigation.track import Track
from zerorate.numerals import format_with_error, shorten
from zerorate.record.fixes import Fixes
from zerorate.record.log import LogError
from zerorate.record.offset import TimeOffset
from zerorate.record.recording import Recording
from zerorate.types import Floats

SECTION: Final = "Receiver"
_MAX_NAVIGATED_S: Final = 900.0
"""Largest duration of the navigated part, s."""
_LEAD_S: Final = 60.0
"""Time before the first motion in this part, s."""
_MIN_FIXES: Final = 30
"""Smallest number of fixes for a finding."""
_COARSE_OFFSET_S: Final = 1.0
_CHI2_MEDIAN: Final = 2.366
"""Median of chi-squared with three degrees of freedom, for innovations of position or velocity."""


def _read_fixes(recording: Recording) -> Fixes | None:
    """Return the readable fixes of a recording, None if there are none."""
    try:
        return recording.fixes if "position" in recording else None
    except (LogError, OSError):
        return None


def receiver_findings(
    recording: Recording, imus: Sequence[Imu], fixes: Fixes | None
) -> Iterator[Finding]:
    """Yield findings on a receiver: contradictions, its clock, innovations."""
    imu = next((candidate for candidate in imus if candidate.still.size), None)
    if imu is None or imu.gyro is None or imu.accel is None:
        return
    all_fixes = _read_fixes(recording) if fixes is None else fixes
    if all_fixes is None:
        return
    fixes, held_notes = drop_held_fixes(all_fixes)
    if len(fixes) < _MIN_FIXES:
        return
    gyro = imu.gyro
    for note in held_notes:
        yield Finding(SECTION, "held fixes", "good", as_sentence(note), figure=gyro.figure)
    step = float(np.median(np.diff(fixes.time)))
    yield Finding(
        SECTION, "fixes", "good",
        f"{len(fixes)} fixes, one in {shorten(step, 3)} s, "
        f"{'with' if fixes.velocity is not None else 'without'} velocities.",
        float(len(fixes)), figure=gyro.figure,
    )  # fmt: skip
    sensors = _select_imu(recording, imu)
    try:
        vehicle = Vehicle.of(sensors, "auto", None, "auto")
        checks = vehicle.check(sensors, fixes)
        mistakes = vehicle.mistakes(checks)
        yield from _describe_mistakes(checks, mistakes, gyro)
        if all(candidate.what == "clock" for candidate in mistakes):
            track = yield from _check_navigation(sensors, fixes, checks, gyro)
            yield from aid_findings(recording, fixes, track, SECTION, gyro)
    except LogError:
        text = "Fixes and sensors give no track: clock and errors of the fixes are unknown."
        yield Finding(SECTION, "track", "good", text, figure=gyro.figure)


def _select_imu(recording: Recording, imu: Imu) -> Recording:
    """Return a recording of one IMU."""
    assert imu.gyro is not None
    assert imu.accel is not None
    logs = {"gyro": recording[imu.gyro.name], "accel": recording[imu.accel.name]}
    return replace(recording, logs=logs)


def _describe_mistakes(
    checks: NavigationChecks, mistakes: Sequence[NavigationFinding], gyro: Sensor
) -> Iterator[Finding]:
    doubts = [finding for finding in checks.findings if finding.status != "mistake"]
    for finding in (*mistakes, *doubts):
        known = math.isfinite(finding.value)
        severity: Severity = "good" if finding.status != "mistake" else "act" if known else "look"
        yield Finding(
            SECTION, f"receiver: {finding.what}", severity,
            f"{finding.text[0].upper()}{finding.text[1:].rstrip('.')}.",
            finding.value if known else None, "", None, (), gyro.figure,
            "Correct it in the logger, or with the options of `zerorate navigate`.",
        )  # fmt: skip
    if not mistakes and not doubts:
        text = "Sensors and fixes agree in units, signs, axes and clocks."
        yield Finding(SECTION, "receiver", "good", text, figure=gyro.figure)


def _check_navigation(
    sensors: Recording, fixes: Fixes, checks: NavigationChecks, gyro: Sensor
) -> Generator[Finding, None, Track]:
    """Yield findings on clock and innovations of a part that is navigated; return its track."""
    coarse_offset = checks.lag if abs(checks.lag) > _COARSE_OFFSET_S else 0.0
    sensors, fixes = _select_navigable_part(sensors, fixes, coarse_offset)
    start = find_beginning(sensors, fixes, noise="stated", checks=checks)
    if fixes.velocity is not None:
        yield from _describe_clock(start.clock, gyro, known=bool(checks.mistakes))
    nav = start.filter(adapt="fixed")
    offset = start.time_offset
    track = nav.process(start.recording, fixes, time_offset=offset, keep="track")
    yield from _check_innovations(track, fixes, gyro)
    return track


def _select_navigable_part(
    sensors: Recording, fixes: Fixes, coarse_offset: float
) -> tuple[Recording, Fixes]:
    """Return recording and fixes of up to 15 minutes, from a minute before the first motion."""
    log = sensors["gyro"]
    if log.duration <= _MAX_NAVIGATED_S:
        return sensors, fixes
    first = _motion_start(fixes) - _LEAD_S
    last = first + _MAX_NAVIGATED_S
    logs = {
        name: cut_log(one, first + coarse_offset, last + coarse_offset)
        for name, one in sensors.items()
    }
    return replace(sensors, logs=logs), fixes.between(first, last)


def _motion_start(fixes: Fixes) -> float:
    """Return the time of the receiver's first motion by some metres, s."""
    positions = fixes.position[:, :2]
    is_displaced = (
        np.abs(positions - np.nanmedian(positions[:_MIN_FIXES], axis=0)).max(axis=1) > 1e-4
    )
    displaced_rows = np.flatnonzero(is_displaced)
    return float(fixes.time[displaced_rows[0]] if displaced_rows.size else fixes.time[0])


def _describe_clock(offset: TimeOffset | None, gyro: Sensor, known: bool) -> Iterator[Finding]:
    if offset is None:
        yield Finding(
            SECTION, "receiver's clock", "good",
            "The offset of the receiver's clock is not identifiable in this log.",
            figure=gyro.figure, advice="Speed up, brake and turn.",
        )  # fmt: skip
        return
    size = abs(offset.seconds)
    text = (
        f"Fixes are stamped {format_with_error(size, offset.sigma)} s "
        f"{_early_or_late(offset.seconds)}"
    )
    if math.isfinite(offset.velocity_seconds):
        late = offset.velocity_seconds
        text += (
            f", their velocities {format_with_error(abs(late), offset.velocity_sigma)} s "
            f"{_early_or_late(late)}"
        )
    text += ", against the sensors"
    if offset.rate:
        drift = format_with_error(1e6 * offset.rate, 1e6 * offset.rate_sigma)
        text += f"; the offset grows by {drift} microseconds a second"
    # A large offset has its own finding.
    severity = "good" if known else LIMITS["receiver's clock"].severity(size, offset.sigma)
    yield Finding(
        SECTION, "receiver's clock", severity, f"{text}.",
        size, "s", offset.sigma, (), gyro.figure,
        "Set this offset in the filter: `--time-offset auto`, EKF2_GPS_DELAY (PX4), GPS1_DELAY_MS "
        "(ArduPilot).",
    )  # fmt: skip


def _early_or_late(seconds: float) -> str:
    return "late" if seconds < 0.0 else "early"


def _check_innovations(track: Track, fixes: Fixes, gyro: Sensor) -> Iterator[Finding]:
    """Yield the ratio of innovations to the receiver's standard deviations."""
    stated_sigmas = (fixes.position_sigma, fixes.velocity_sigma)
    for what, values, sigma in zip(
        ("positions", "velocities"), track.nis().T, stated_sigmas, strict=True
    ):
        finite = values[np.isfinite(values)]
        if len(finite) < _MIN_FIXES:
            continue
        ratio, error = _innovation_ratio(finite)
        expectation = (
            "their stated standard deviations" if sigma is not None else "usual standard deviations"
        )
        yield Finding(
            SECTION, "innovations", LIMITS["innovations"].severity(ratio),
            f"Innovations of {what} are {format_with_error(ratio, error)} times as large "
            f"as {expectation} let "
            "expect.",
            ratio, "", error, (), gyro.figure,
            "Set larger standard deviations, or let the filter adapt them (`adapt='inflate'`).",
        )  # fmt: skip


def _innovation_ratio(nis: Floats) -> tuple[float, float]:
    """Return the root of the median squared innovation over its expectation, in ten blocks."""
    parts = [float(np.median(one)) for one in (nis, *np.array_split(nis, 10))]
    value, *tenths = np.sqrt(np.array(parts) / _CHI2_MEDIAN).tolist()
    return value, float(np.std(tenths, ddof=1)) / math.sqrt(len(tenths))
