"""The receiver: what it and the sensors say of each other, its clock, its own deviations."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.checks.held import without_held
from zerorate.findings.finding import Finding, sentence
from zerorate.findings.imus import Imu, Sensor, part
from zerorate.findings.limits import LIMITS, Severity
from zerorate.navigation.begin import Beginning, Vehicle, find_beginning
from zerorate.navigation.selfcheck import NavigationChecks, NavigationFinding
from zerorate.numerals import with_error
from zerorate.record.fixes import Fixes
from zerorate.record.log import LogError
from zerorate.record.offset import TimeOffset
from zerorate.record.recording import Recording
from zerorate.types import Floats

SECTION: Final = "Receiver"
_LONGEST: Final = 900.0
"""Seconds that are navigated."""
_BEFORE: Final = 60.0
"""Seconds of them before it first moves."""
_FEWEST: Final = 30
"""Fixes without which nothing is told."""
_COARSE: Final = 1.0
_MEDIAN: Final = 2.366
"""Of chi squared of three degrees: of the innovations of a position, or of a velocity."""


def _fixes_of(recording: Recording) -> Fixes | None:
    """Return the fixes of a recording, None if there are none that can be read."""
    try:
        return recording.fixes if "position" in recording else None
    except (LogError, OSError):
        return None


def receiver(recording: Recording, found: Sequence[Imu], fixes: Fixes | None) -> Iterator[Finding]:
    """Yield what is seen of a receiver: contradictions, its clock, innovations."""
    imu = next((one for one in found if one.still.size), None)
    if imu is None or imu.gyro is None or imu.accel is None:
        return
    given = _fixes_of(recording) if fixes is None else fixes
    if given is None:
        return
    fixes, held = without_held(given)
    if len(fixes) < _FEWEST:
        return
    gyro = imu.gyro
    for note in held:
        yield Finding(SECTION, "held fixes", "good", sentence(note), figure=gyro.figure)
    step = float(np.median(np.diff(fixes.time)))
    yield Finding(
        SECTION, "fixes", "good",
        f"{len(fixes)} fixes, one in {step:.3g} s, "
        f"{'with' if fixes.velocity is not None else 'without'} velocities.",
        float(len(fixes)), figure=gyro.figure,
    )  # fmt: skip
    sensors = _of_imu(recording, imu)
    try:
        vehicle = Vehicle.of(sensors, "auto", None, "auto")
        checks = vehicle.checked(sensors, fixes)
        mistakes = vehicle.mistakes(checks)
        yield from _mistakes(checks, mistakes, gyro)
        if all(one.what == "clock" for one in mistakes):
            yield from _navigated(sensors, fixes, checks, gyro)
    except LogError:
        text = "The fixes lead no track in this log: neither their clock nor their errors are told."
        yield Finding(SECTION, "track", "good", text, figure=gyro.figure)


def _of_imu(recording: Recording, imu: Imu) -> Recording:
    """Return a recording of one IMU."""
    assert imu.gyro is not None
    assert imu.accel is not None
    logs = {"gyro": recording[imu.gyro.name], "accel": recording[imu.accel.name]}
    return replace(recording, logs=logs)


def _mistakes(
    checks: NavigationChecks, mistakes: Sequence[NavigationFinding], gyro: Sensor
) -> Iterator[Finding]:
    doubts = [one for one in checks.findings if one.status != "mistake"]
    for one in (*mistakes, *doubts):
        known = math.isfinite(one.value)
        how: Severity = "good" if one.status != "mistake" else "act" if known else "look"
        yield Finding(
            SECTION, f"receiver: {one.what}", how,
            f"{one.text[0].upper()}{one.text[1:].rstrip('.')}.",
            one.value if known else None, "", None, (), gyro.figure,
            "Put it right where the log is written, or by the options of `zerorate navigate`.",
        )  # fmt: skip
    if not mistakes and not doubts:
        text = "Sensors and fixes do not contradict each other in units, signs, axes or clocks."
        yield Finding(SECTION, "receiver", "good", text, figure=gyro.figure)


def _navigated(
    sensors: Recording, fixes: Fixes, checks: NavigationChecks, gyro: Sensor
) -> Iterator[Finding]:
    """Yield clock and innovations of a part that is navigated, where nothing contradicts."""
    about = checks.lag if abs(checks.lag) > _COARSE else 0.0
    sensors, fixes = _navigable(sensors, fixes, about)
    begun = find_beginning(sensors, fixes, checks=checks)
    if fixes.velocity is not None:
        yield from _clock(begun.clock, gyro, known=bool(checks.mistakes))
    yield from _innovations(begun, fixes, gyro)


def _navigable(sensors: Recording, fixes: Fixes, about: float) -> tuple[Recording, Fixes]:
    """Return at most a quarter of an hour of both: from a minute before it first moves."""
    log = sensors["gyro"]
    if log.duration <= _LONGEST:
        return sensors, fixes
    first = _moving(fixes) - _BEFORE
    last = first + _LONGEST
    logs = {name: part(one, first + about, last + about) for name, one in sensors.items()}
    return replace(sensors, logs=logs), fixes.between(first, last)


def _moving(fixes: Fixes) -> float:
    """Return when the receiver first moves by metres, s."""
    place = fixes.position[:, :2]
    far = np.abs(place - np.nanmedian(place[:_FEWEST], axis=0)).max(axis=1) > 1e-4
    moved = np.flatnonzero(far)
    return float(fixes.time[moved[0]] if moved.size else fixes.time[0])


def _clock(found: TimeOffset | None, gyro: Sensor, known: bool) -> Iterator[Finding]:
    if found is None:
        yield Finding(
            SECTION, "receiver's clock", "good",
            "The offset of the receiver's clock is not identifiable in this log.",
            figure=gyro.figure, advice="Speed up, brake and turn.",
        )  # fmt: skip
        return
    size = abs(found.seconds)
    told = f"Fixes are stamped {with_error(size, found.sigma)} s {_sense(found.seconds)}"
    if math.isfinite(found.velocity_seconds):
        late = found.velocity_seconds
        told += f", their velocities {with_error(abs(late), found.velocity_sigma)} s {_sense(late)}"
    told += ", against the sensors"
    if found.rate:
        drift = with_error(1e6 * found.rate, 1e6 * found.rate_sigma)
        told += f"; the offset grows by {drift} microseconds a second"
    # Clocks that are far apart have a finding of their own.
    how = "good" if known else LIMITS["receiver's clock"].severity(size, found.sigma)
    yield Finding(
        SECTION, "receiver's clock", how, f"{told}.",
        size, "s", found.sigma, (), gyro.figure,
        "Give it to the filter: `--time-offset auto`; EKF2_GPS_DELAY of PX4, GPS1_DELAY_MS of "
        "ArduPilot.",
    )  # fmt: skip


def _sense(seconds: float) -> str:
    return "late" if seconds < 0.0 else "early"


def _innovations(begun: Beginning, fixes: Fixes, gyro: Sensor) -> Iterator[Finding]:
    """Yield by how much innovations are larger than the receiver's deviations let expect."""
    nav = begun.filter(adapt="fixed")
    offset = begun.time_offset
    track = nav.process(begun.recording, fixes, time_offset=offset, keep="track")
    told = (fixes.position_sigma, fixes.velocity_sigma)
    for what, values, sigma in zip(("positions", "velocities"), track.nis().T, told, strict=True):
        known = values[np.isfinite(values)]
        if len(known) < _FEWEST:
            continue
        ratio, error = _ratio(known)
        of = "the deviations that they tell" if sigma is not None else "usual ones"
        yield Finding(
            SECTION, "innovations", LIMITS["innovations"].severity(ratio),
            f"Innovations of {what} are {with_error(ratio, error)} times as large as {of} let "
            "expect.",
            ratio, "", error, (), gyro.figure,
            "Tell the filter larger ones, or let it adapt (`adapt='inflate'`).",
        )  # fmt: skip


def _ratio(nis: Floats) -> tuple[float, float]:
    """Return the root of the median innovation squared over its expectation, by ten blocks."""
    parts = [float(np.median(one)) for one in (nis, *np.array_split(nis, 10))]
    value, *tenths = np.sqrt(np.array(parts) / _MEDIAN).tolist()
    return value, float(np.std(tenths, ddof=1)) / math.sqrt(len(tenths))
