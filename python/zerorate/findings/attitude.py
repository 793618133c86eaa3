"""The attitude: inclination against gravity when rests begin, and the log's own estimate."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from zerorate._native import Attitude
from zerorate.attitude.events import Event, event_mask
from zerorate.checks.stillness import bias_limit_advice
from zerorate.faults import make_sentence
from zerorate.findings.autopilot import rows_of
from zerorate.findings.finding import Finding, Spans, count_noun
from zerorate.findings.imus import BLOCK_S, Imu, Sensor, start_time
from zerorate.findings.limits import LIMITS
from zerorate.findings.rests import rest_mean, rest_spans
from zerorate.numerals import format_with_error, shorten
from zerorate.record.log import Log
from zerorate.record.recording import Recording
from zerorate.record.runs import runs
from zerorate.record.samples import Samples
from zerorate.types import Booleans, Floats

SECTION: Final = "Attitude"
_CHUNK_ROWS: Final = 1 << 17
_MIN_RATE_HZ: Final = 10.0
_STEP_S: Final = 0.1
"""Seconds of a course's step: a filter that notices a rest leads the attitude to gravity soon."""
_SETTLING_TIME_S: Final = 10.0
"""Seconds after which an attitude is no longer that of a beginning."""
_MAX_TILT_SIGMA_RAD: Final = math.radians(5.0)
"""Standard deviation of an inclination from which on it is not trusted."""
_MIN_REST_S: Final = 5.0
"""Seconds of a rest after which the log's own inclination is tested, as it has to settle."""
_MIN_ROWS: Final = 10
_MIN_UNCLEAR_S: Final = 1.0
"""Seconds of a rest that may be a rate table, for a finding."""
_SIGNIFICANCE_SIGMAS: Final = 3.0
"""Of its own standard deviations by which an inclination must be off."""


class Course(NamedTuple):
    """The upward direction in the sensor's axes at some times, with its sigma.

    Shapes (m,), (m, 3), (m,), (m,) in rad, and (m,): True for a rest that may be a rate table.
    """

    times: Floats
    up: Floats
    tilt_sigma: Floats
    heading_sigma: Floats
    unclear: Booleans


def attitude_findings(recording: Recording, imus: Sequence[Imu]) -> Iterator[Finding]:
    """Yield findings on the inclination, from the first IMU and from the log's estimate."""
    imu = next((imu_candidate for imu_candidate in imus if imu_candidate.still.size), None)
    if imu is None or imu.gyro is None or imu.accel is None:
        return
    course = _estimate_course(recording, imu.gyro, imu.accel)
    yield from _check_arrivals(imu, imu.accel, course)
    yield from _check_unclear_rest(imu.gyro, course)
    yield from _check_trust(imu.gyro, course)
    for name, vertical in _read_log_verticals(recording):
        yield from _check_log_inclination(name, imu, imu.accel, vertical)
        yield from _compare_verticals(name, imu.gyro, vertical, course)


def _estimate_course(recording: Recording, gyro: Sensor, accel: Sensor) -> Course:
    """Return the attitude by gyro and accelerometer every tenth of a second, about."""
    rates, forces = _align_samples(recording, gyro, accel)
    steps, every = gyro.log.steps, max(1, round(_STEP_S * gyro.log.rate))
    filter_ = Attitude(gyro.log.rate, mag=False)
    chunks: list[Sequence[Floats]] = []
    size = max(1, _CHUNK_ROWS // every) * every
    for first in range(0, gyro.log.n, size):
        part = slice(first, first + size)
        with warnings.catch_warnings():
            # Of a wrong gravity, which has a finding of its own.
            warnings.simplefilter("ignore")
            trace = filter_.trace(
                (gyro.factor or 1.0) * rates[part],
                (accel.factor or 1.0) * forces[part],
                None,
                None if steps is None else steps[part],
            )
        step_rows = slice(every - 1, None, every)
        names = ("quaternion", "tilt_sigma", "heading_sigma", "events")
        # Copies: a view would keep the whole trace.
        chunks.append([trace[name][step_rows].copy() for name in names])  # type: ignore[literal-required]
    quaternion, tilt, heading, events = (np.concatenate(one) for one in zip(*chunks, strict=True))
    return Course(
        gyro.log.sampled[every - 1 :: every] - gyro.start, up_direction(quaternion), tilt, heading,
        event_mask(events.astype(np.uint16), Event.UNCLEAR_REST),
    )  # fmt: skip


def _align_samples(recording: Recording, gyro: Sensor, accel: Sensor) -> tuple[Floats, Floats]:
    """Return the samples of both on the clock of the gyro, in their own units."""
    one, other = gyro.log, accel.log
    if one.n == other.n and np.array_equal(one.sampled, other.sampled):
        return one.data, other.data
    samples = Samples.of(recording, gyro.name, accel.name, mag=False)
    return one.data, samples.align(other)


def up_direction(quaternions: Floats) -> Floats:
    """Return the direction of an earth's third axis in the axes of the sensor, shape (m, 3)."""
    w, x, y, z = quaternions.T
    size = np.maximum((quaternions**2).sum(axis=1), np.finfo(float).tiny)
    row = [2 * (x * z - w * y), 2 * (y * z + w * x), size - 2 * (x * x + y * y)]
    return np.asarray(np.stack(row, axis=1) / size[:, np.newaxis])


def _angles_between(one: Floats, other: Floats) -> Floats:
    """Return the angles between unit vectors, deg, shape (m,)."""
    cross = np.linalg.norm(np.cross(one, other), axis=-1)
    return np.asarray(np.degrees(np.arctan2(cross, (one * other).sum(axis=-1))))


def _check_arrivals(imu: Imu, accel: Sensor, course: Course) -> Iterator[Finding]:
    """Yield the error of the inclination at the beginning of each rest after motion."""
    later = [rest for rest in imu.rests if BLOCK_S * rest.first > _SETTLING_TIME_S]
    if not later:
        return
    # The half-second before a rest has its gravity already, else the rest began later.
    at = np.searchsorted(course.times, [BLOCK_S * rest.first for rest in later]) - 1
    forces = np.array([rest_mean(accel, rest)[0] for rest in later])
    off = _angles_between(course.up[at], forces / np.linalg.norm(forces, axis=1, keepdims=True))
    middle, worst = float(np.median(off)), int(np.argmax(off))
    sigma = _median_sigma(off)
    # What a filter knows of its own error in motion is no fault of the sensors.
    surely = float(np.median(off / np.degrees(course.tilt_sigma[at]))) > _SIGNIFICANCE_SIGMAS
    yield Finding(
        SECTION, "arrivals", LIMITS["arrivals"].severity(middle) if surely else "good",
        f"{imu.name}: by gyro and accelerometer the inclination is "
        f"{_format_median(middle, sigma)} deg from "
        f"gravity as a rest begins (median of {count_noun(len(off), 'rest')}, "
        f"{shorten(off[worst])} at most).",
        middle, "deg", sigma, rest_spans([later[worst]]), accel.figure,
        "Rest before the motion too, so that the gyro's bias is known, and calibrate its scale.",
    )  # fmt: skip


def _median_sigma(values: Floats) -> float | None:
    """Return the standard error of a median, None of a single value."""
    if len(values) < 2:
        return None
    return float(1.2533 * np.std(values, ddof=1) / math.sqrt(len(values)))


def _format_median(value: float, sigma: float | None) -> str:
    return shorten(value) if not sigma else format_with_error(value, sigma)


def _check_trust(gyro: Sensor, course: Course) -> Iterator[Finding]:
    settled = course.times > _SETTLING_TIME_S
    if np.count_nonzero(settled) < _MIN_ROWS:
        return
    doubt = settled & ~(course.tilt_sigma < _MAX_TILT_SIGMA_RAD)
    share = 100.0 * float(doubt.sum() / settled.sum())
    heading = math.degrees(float(course.heading_sigma[-1]))
    middle = math.degrees(float(np.median(course.tilt_sigma[settled])))
    doubt_text = "" if not doubt.any() else f", worse than 5 deg for {shorten(share)} % of the time"
    heading_text = f"known to {shorten(heading)} deg" if heading < 90.0 else "not known"
    yield Finding(
        SECTION, "trust", LIMITS["trust"].severity(share),
        f"Gyro and accelerometer give the inclination to {shorten(middle)} deg (median of its "
        f"standard deviation){doubt_text}; the heading against the start is {heading_text} at the "
        "end.",
        share, "%", None, _spans_where(course.times, doubt), gyro.figure,
        "Rest for some seconds now and then, and log at 100 Hz or more.",
    )  # fmt: skip


def _check_unclear_rest(gyro: Sensor, course: Course) -> Iterator[Finding]:
    """Yield a steady rate that is a bias beyond the largest, or that of a rate table."""
    seconds = _STEP_S * np.count_nonzero(course.unclear)
    if seconds < _MIN_UNCLEAR_S:
        return
    spans = _spans_where(course.times, course.unclear)
    begin, end = max(spans, key=lambda span: span[1] - span[0])
    rate = np.nanmean(gyro.log.data[gyro.rows(begin, end)], axis=0) * (gyro.factor or 1.0)
    size = float(np.linalg.norm(rate))
    yield Finding(
        SECTION, "unclear rest", "look",
        f"{gyro.label} is at rest, or on a rate table, for {seconds:.3g} s: a steady "
        f"{math.degrees(size):.3g} deg/s about the vertical is beyond the largest bias.",
        math.degrees(size), "deg/s", None, spans, gyro.figure,
        make_sentence("On a rate table nothing is to be done; for a bias give ",
                      bias_limit_advice(size), "."),
    )  # fmt: skip


def _spans_where(times: Floats, where: Booleans) -> Spans:
    """Return from when to when something holds, those next to each other as one."""
    return tuple(
        (round(max(0.0, float(times[a]) - _STEP_S), 3), round(float(times[b - 1]), 3))
        for a, b in runs(where).tolist()
    )


class _LogVertical(NamedTuple):
    """The log's own up or down in the axes of the sensor, and times since the beginning."""

    times: Floats
    axis: Floats

    def at(self, times: Floats) -> tuple[Floats, Booleans]:
        """Return the row at or before each time, and True if there is one that is not old."""
        rows = np.clip(np.searchsorted(self.times, times, "right") - 1, 0, None)
        fresh = np.abs(times - self.times[rows]) < 2.0 * BLOCK_S
        return self.axis[rows], fresh & (times >= self.times[0])


def _read_log_verticals(recording: Recording) -> Iterator[tuple[str, _LogVertical]]:
    """Yield the orientations that the log has: a reference's, or those of a PX4's estimator."""
    start = start_time(recording)
    for log in recording.of_kind("reference"):
        if log.channels == 4 and (vertical := _vertical_of_log(log, start)) is not None:
            yield "the log's orientation", vertical
    for name, rows in rows_of(recording, ("vehicle_attitude",)):
        keys = [f"q[{i}]" for i in range(4)]
        if name == "vehicle_attitude" and all(key in rows.columns for key in keys):
            values = np.stack([rows.columns[key] for key in keys], axis=1)
            yield "the autopilot's attitude", _LogVertical(rows.times, up_direction(values))


def _vertical_of_log(log: Log, start: float) -> _LogVertical | None:
    complete = np.isfinite(log.data).all(axis=1)
    if np.count_nonzero(complete) < _MIN_ROWS:
        return None
    return _LogVertical(log.sampled[complete] - start, up_direction(log.data[complete]))


def _check_log_inclination(
    name: str, imu: Imu, accel: Sensor, vertical: _LogVertical
) -> Iterator[Finding]:
    """Yield the angle between the log's own vertical and gravity, for any direction of its axes."""
    off, where = [], []
    for rest in imu.rests:
        times = BLOCK_S * np.arange(rest.first + 1, rest.last + 1)
        axis, fresh = vertical.at(np.asarray(times, dtype=np.float64))
        if rest.seconds >= _MIN_REST_S and fresh.any():
            force = rest_mean(accel, rest)[0]
            mean = axis[fresh].mean(axis=0)
            off.append(
                _angle_between_lines(mean / np.linalg.norm(mean), force / np.linalg.norm(force))
            )
            where.append(rest)
    if not off:
        return
    middle, sigma = float(np.median(off)), _median_sigma(np.array(off).ravel())
    yield Finding(
        SECTION, "log inclination", LIMITS["log inclination"].severity(middle, sigma or 0.0),
        f"{name[0].upper()}{name[1:]} is {_format_median(middle, sigma)} deg from gravity "
        "at rest (median "
        f"of {count_noun(len(off), 'rest')} of {_MIN_REST_S:g} s and more).",
        middle, "deg", sigma, rest_spans(where), accel.figure,
        "Level the vehicle and calibrate its horizon; a sensor that is mounted askew shows here.",
    )  # fmt: skip


def _angle_between_lines(one: Floats, other: Floats) -> Floats:
    """Return the angle between two lines, deg: up and down count the same."""
    angle = _angles_between(one, other)
    return np.asarray(np.minimum(angle, 180.0 - angle))


def _compare_verticals(
    name: str, gyro: Sensor, vertical: _LogVertical, course: Course
) -> Iterator[Finding]:
    axis, fresh = vertical.at(course.times)
    known = fresh & (course.times > _SETTLING_TIME_S) & (course.tilt_sigma < _MAX_TILT_SIGMA_RAD)
    if np.count_nonzero(known) < _MIN_ROWS:
        return
    off = _angle_between_lines(axis, course.up)
    off = np.where(known, off, 0.0)
    worst = float(np.quantile(off[known], 0.95))
    limit = LIMITS["attitudes apart"]
    yield Finding(
        SECTION, "attitudes apart", limit.severity(worst),
        f"{name[0].upper()}{name[1:]} and that of {gyro.label} and its accelerometer have their "
        f"verticals {shorten(worst)} deg apart (95 % of where the latter is trusted; median "
        f"{shorten(np.median(off[known]))}).",
        worst, "deg", None, _spans_where(course.times, off >= limit.look), gyro.figure,
        "Compare both with a level surface at rest.",
    )  # fmt: skip
