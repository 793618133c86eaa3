"""The attitude: inclination against gravity as rests begin, trust, and the log's own estimate."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from zerorate._native import Attitude
from zerorate.findings.autopilot import rows_of
from zerorate.findings.finding import Finding, Spans, counted
from zerorate.findings.imus import BLOCK, Imu, Sensor, beginning
from zerorate.findings.limits import LIMITS
from zerorate.findings.rests import means, spans
from zerorate.numerals import with_error
from zerorate.record.log import Log
from zerorate.record.recording import Recording
from zerorate.record.runs import runs
from zerorate.record.samples import Samples
from zerorate.types import Booleans, Floats

SECTION: Final = "Attitude"
_PIECE: Final = 1 << 17
_SLOWEST: Final = 10.0
_STEP: Final = 0.1
"""Seconds of a course's step: a filter that notices a rest leads the attitude to gravity soon."""
_SETTLED: Final = 10.0
"""Seconds after which an attitude is no longer that of a beginning."""
_TRUSTED: Final = math.radians(5.0)
"""Standard deviation of an inclination from which on it is not trusted."""
_REST: Final = 5.0
"""Seconds of a rest by which the log's own inclination is judged, as it needs some to settle."""
_ROWS: Final = 10
_SURE: Final = 3.0
"""Of its own standard deviations by which an inclination must be off."""


class Course(NamedTuple):
    """Up in the axes of the sensor at some times since the beginning, and how well it is known.

    Shapes (m,), (m, 3), (m,) and (m,), the last two in rad.
    """

    times: Floats
    up: Floats
    tilt_sigma: Floats
    heading_sigma: Floats


def attitude(recording: Recording, found: Sequence[Imu]) -> Iterator[Finding]:
    """Yield what the sensors of the first IMU, and the log itself, say of the inclination."""
    imu = next((one for one in found if one.still.size), None)
    if imu is None or imu.gyro is None or imu.accel is None:
        return
    course = _course(recording, imu.gyro, imu.accel)
    yield from _arrivals(imu, imu.accel, course)
    yield from _trust(imu.gyro, course)
    for name, own in _own(recording):
        yield from _at_rests(name, imu, imu.accel, own)
        yield from _apart(name, imu.gyro, own, course)


def _course(recording: Recording, gyro: Sensor, accel: Sensor) -> Course:
    """Return the attitude by gyro and accelerometer every tenth of a second, about."""
    rates, forces = _together(recording, gyro, accel)
    steps, every = gyro.log.steps, max(1, round(_STEP * gyro.log.rate))
    filter_ = Attitude(gyro.log.rate, mag=False)
    kept: list[Sequence[Floats]] = []
    size = max(1, _PIECE // every) * every
    for first in range(0, gyro.log.n, size):
        part = slice(first, first + size)
        with warnings.catch_warnings():
            # Of a wrong gravity, which has a finding of its own.
            warnings.simplefilter("ignore")
            traced = filter_.trace(
                (gyro.factor or 1.0) * rates[part],
                (accel.factor or 1.0) * forces[part],
                None,
                None if steps is None else steps[part],
            )
        chosen = slice(every - 1, None, every)
        names = ("quaternion", "tilt_sigma", "heading_sigma")
        # Copies: a view would keep the whole trace.
        kept.append([traced[name][chosen].copy() for name in names])  # type: ignore[literal-required]
    quaternion, tilt, heading = (np.concatenate(one) for one in zip(*kept, strict=True))
    return Course(gyro.log.sampled[every - 1 :: every] - gyro.start, up(quaternion), tilt, heading)


def _together(recording: Recording, gyro: Sensor, accel: Sensor) -> tuple[Floats, Floats]:
    """Return the samples of both on the clock of the gyro, in their own units."""
    one, other = gyro.log, accel.log
    if one.n == other.n and np.array_equal(one.sampled, other.sampled):
        return one.data, other.data
    samples = Samples.of(recording, gyro.name, accel.name, mag=False)
    return one.data, samples.aligned(other)


def up(quaternions: Floats) -> Floats:
    """Return where an earth's third axis points in the axes of the sensor, shape (m, 3)."""
    w, x, y, z = quaternions.T
    size = np.maximum((quaternions**2).sum(axis=1), np.finfo(float).tiny)
    row = [2 * (x * z - w * y), 2 * (y * z + w * x), size - 2 * (x * x + y * y)]
    return np.asarray(np.stack(row, axis=1) / size[:, np.newaxis])


def _angles(one: Floats, other: Floats) -> Floats:
    """Return the angles between unit vectors, deg, shape (m,)."""
    cross = np.linalg.norm(np.cross(one, other), axis=-1)
    return np.asarray(np.degrees(np.arctan2(cross, (one * other).sum(axis=-1))))


def _arrivals(imu: Imu, accel: Sensor, course: Course) -> Iterator[Finding]:
    """Yield how far the inclination is off as each rest begins that motion comes before."""
    later = [rest for rest in imu.rests if BLOCK * rest.first > _SETTLED]
    if not later:
        return
    # The half-second before a rest has its gravity already, else the rest began later.
    at = np.searchsorted(course.times, [BLOCK * rest.first for rest in later]) - 1
    forces = np.array([means(accel, rest)[0] for rest in later])
    off = _angles(course.up[at], forces / np.linalg.norm(forces, axis=1, keepdims=True))
    middle, worst = float(np.median(off)), int(np.argmax(off))
    sigma = _of_median(off)
    # What a filter knows of its own error in motion is no fault of the sensors.
    surely = float(np.median(off / np.degrees(course.tilt_sigma[at]))) > _SURE
    yield Finding(
        SECTION, "arrivals", LIMITS["arrivals"].severity(middle) if surely else "good",
        f"{imu.name}: by gyro and accelerometer the inclination is {_told(middle, sigma)} deg from "
        f"gravity as a rest begins (median of {counted(len(off), 'rest')}, {off[worst]:.2g} at "
        "most).",
        middle, "deg", sigma, spans([later[worst]]), accel.figure,
        "Rest before the motion too, so that the gyro's bias is known, and calibrate its scale.",
    )  # fmt: skip


def _of_median(values: Floats) -> float | None:
    """Return the standard error of a median, None of a single value."""
    if len(values) < 2:
        return None
    return float(1.2533 * np.std(values, ddof=1) / math.sqrt(len(values)))


def _told(value: float, sigma: float | None) -> str:
    return f"{value:.2g}" if not sigma else with_error(value, sigma)


def _trust(gyro: Sensor, course: Course) -> Iterator[Finding]:
    settled = course.times > _SETTLED
    if np.count_nonzero(settled) < _ROWS:
        return
    doubt = settled & ~(course.tilt_sigma < _TRUSTED)
    share = 100.0 * float(doubt.sum() / settled.sum())
    heading = math.degrees(float(course.heading_sigma[-1]))
    middle = math.degrees(float(np.median(course.tilt_sigma[settled])))
    told = "" if not doubt.any() else f", worse than 5 deg for {share:.2g} % of the time"
    turned = f"known to {heading:.2g} deg" if heading < 90.0 else "not known"
    yield Finding(
        SECTION, "trust", LIMITS["trust"].severity(share),
        f"Gyro and accelerometer give the inclination to {middle:.2g} deg (median of its standard "
        f"deviation){told}; the heading against the start is {turned} at the end.",
        share, "%", None, _runs(course.times, doubt), gyro.figure,
        "Rest for some seconds now and then, and log at 100 Hz or more.",
    )  # fmt: skip


def _runs(times: Floats, where: Booleans) -> Spans:
    """Return from when to when something holds, those next to each other as one."""
    return tuple(
        (round(max(0.0, float(times[a]) - _STEP), 3), round(float(times[b - 1]), 3))
        for a, b in runs(where).tolist()
    )


class _Own(NamedTuple):
    """The log's own up or down in the axes of the sensor, and times since the beginning."""

    times: Floats
    axis: Floats

    def at(self, times: Floats) -> tuple[Floats, Booleans]:
        """Return the row at or before each time, and whether there is one that is not old."""
        rows = np.clip(np.searchsorted(self.times, times, "right") - 1, 0, None)
        fresh = np.abs(times - self.times[rows]) < 2.0 * BLOCK
        return self.axis[rows], fresh & (times >= self.times[0])


def _own(recording: Recording) -> Iterator[tuple[str, _Own]]:
    """Yield the orientations that the log has: a reference's, or those of a PX4's estimator."""
    start = beginning(recording)
    for log in recording.of_kind("reference"):
        if log.channels == 4 and (own := _of_log(log, start)) is not None:
            yield "the log's orientation", own
    for name, rows in rows_of(recording, ("vehicle_attitude",)):
        keys = [f"q[{i}]" for i in range(4)]
        if name == "vehicle_attitude" and all(key in rows.columns for key in keys):
            values = np.stack([rows.columns[key] for key in keys], axis=1)
            yield "the autopilot's attitude", _Own(rows.times, up(values))


def _of_log(log: Log, start: float) -> _Own | None:
    there = np.isfinite(log.data).all(axis=1)
    if np.count_nonzero(there) < _ROWS:
        return None
    return _Own(log.sampled[there] - start, up(log.data[there]))


def _at_rests(name: str, imu: Imu, accel: Sensor, own: _Own) -> Iterator[Finding]:
    """Yield how far the log's own vertical is from gravity, whichever way its axes point."""
    off, where = [], []
    for rest in imu.rests:
        times = BLOCK * np.arange(rest.first + 1, rest.last + 1)
        axis, fresh = own.at(np.asarray(times, dtype=np.float64))
        if rest.seconds >= _REST and fresh.any():
            force = means(accel, rest)[0]
            mean = axis[fresh].mean(axis=0)
            off.append(_of_axes(mean / np.linalg.norm(mean), force / np.linalg.norm(force)))
            where.append(rest)
    if not off:
        return
    middle, sigma = float(np.median(off)), _of_median(np.array(off).ravel())
    yield Finding(
        SECTION, "log inclination", LIMITS["log inclination"].severity(middle, sigma or 0.0),
        f"{name[0].upper()}{name[1:]} is {_told(middle, sigma)} deg from gravity at rest (median "
        f"of {counted(len(off), 'rest')} of {_REST:g} s and more).",
        middle, "deg", sigma, spans(where), accel.figure,
        "Level the vehicle and calibrate its horizon; a sensor that is mounted askew shows here.",
    )  # fmt: skip


def _of_axes(one: Floats, other: Floats) -> Floats:
    """Return the angle between two lines, deg: up and down count alike."""
    angle = _angles(one, other)
    return np.asarray(np.minimum(angle, 180.0 - angle))


def _apart(name: str, gyro: Sensor, own: _Own, course: Course) -> Iterator[Finding]:
    axis, fresh = own.at(course.times)
    known = fresh & (course.times > _SETTLED) & (course.tilt_sigma < _TRUSTED)
    if np.count_nonzero(known) < _ROWS:
        return
    off = _of_axes(axis, course.up)
    off = np.where(known, off, 0.0)
    most = float(np.quantile(off[known], 0.95))
    limit = LIMITS["attitudes apart"]
    yield Finding(
        SECTION, "attitudes apart", limit.severity(most),
        f"{name[0].upper()}{name[1:]} and that of {gyro.name} and its accelerometer have their "
        f"verticals {most:.2g} deg apart (95 % of where the latter is trusted; median "
        f"{np.median(off[known]):.2g}).",
        most, "deg", None, _runs(course.times, off >= limit.look), gyro.figure,
        "Compare both with a level surface at rest.",
    )  # fmt: skip
