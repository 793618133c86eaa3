"""Findings on attitude: inclination error at the start of rests, and the log's own estimate."""

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
"""Step of the estimated attitude, s. It is short, because a filter corrects its attitude soon after
a rest begins.
"""
_SETTLING_TIME_S: Final = 10.0
"""Time for which an attitude counts as settling, s."""
_MAX_TILT_SIGMA_RAD: Final = math.radians(5.0)
"""Standard deviation of an inclination, rad, above which it is not trusted."""
_MIN_REST_S: Final = 5.0
"""Time in a rest before the log's own inclination is tested, s, so that it can settle."""
_MIN_ROWS: Final = 10
_MIN_UNCLEAR_S: Final = 1.0
"""Smallest duration of a possible rate table for a finding, s."""
_SIGNIFICANCE_SIGMAS: Final = 3.0
"""Inclination error for a finding, in its standard deviations."""


class Course(NamedTuple):
    """Upward direction in the sensor's axes over time, with its standard deviation.

    The shapes are (m,), (m, 3), (m,), (m,) in rad, and (m,). The last is True for a rest that may
    be a rate table.
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
    """Return the attitude from gyro and accelerometer, about every 0.1 s."""
    rates, forces = _align_samples(recording, gyro, accel)
    steps, every = gyro.log.steps, max(1, round(_STEP_S * gyro.log.rate))
    filter_ = Attitude(gyro.log.rate, mag=False)
    chunks: list[Sequence[Floats]] = []
    size = max(1, _CHUNK_ROWS // every) * every
    for first in range(0, gyro.log.n, size):
        part = slice(first, first + size)
        with warnings.catch_warnings():
            # This warning concerns a wrong gravity, which has its own finding.
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
    """Return the samples of both sensors on the clock of the gyro, in their own units."""
    one, other = gyro.log, accel.log
    if one.n == other.n and np.array_equal(one.sampled, other.sampled):
        return one.data, other.data
    samples = Samples.of(recording, gyro.name, accel.name, mag=False)
    return one.data, samples.align(other)


def up_direction(quaternions: Floats) -> Floats:
    """Return the direction of the earth frame's third axis in sensor axes, shape (m, 3)."""
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
    # In the half-second before a rest, gravity must be measured well: otherwise the rest began
    # later.
    at = np.searchsorted(course.times, [BLOCK_S * rest.first for rest in later]) - 1
    forces = np.array([rest_mean(accel, rest)[0] for rest in later])
    off = _angles_between(course.up[at], forces / np.linalg.norm(forces, axis=1, keepdims=True))
    middle, worst = float(np.median(off)), int(np.argmax(off))
    sigma = _median_sigma(off)
    # An error within the filter's standard deviation is not a fault of the sensors.
    surely = float(np.median(off / np.degrees(course.tilt_sigma[at]))) > _SIGNIFICANCE_SIGMAS
    yield Finding(
        SECTION, "inclination", LIMITS["inclination"].severity(middle) if surely else "good",
        f"{imu.name}: as a rest begins, the inclination from gyro and accelerometer is off "
        f"gravity by {_format_median(middle, sigma)} deg (median of "
        f"{count_noun(len(off), 'rest')}, {shorten(off[worst])} at most).",
        middle, "deg", sigma, rest_spans([later[worst]]), accel.figure,
        "Rest before the motion too, which gives the gyro's bias, and calibrate the gyro's scale.",
    )  # fmt: skip


def _median_sigma(values: Floats) -> float | None:
    """Return the standard error of a median, None for a single value."""
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
        f"The inclination from gyro and accelerometer has a standard deviation of "
        f"{shorten(middle)} deg (median){doubt_text}; the heading relative to the "
        f"start is {heading_text} at the end.",
        share, "%", None, _spans_where(course.times, doubt), gyro.figure,
        "Include rests of some seconds, and log at 100 Hz or more.",
    )  # fmt: skip


def _check_unclear_rest(gyro: Sensor, course: Course) -> Iterator[Finding]:
    """Yield a steady rate: a bias above its limit, or a rate table."""
    seconds = _STEP_S * np.count_nonzero(course.unclear)
    if seconds < _MIN_UNCLEAR_S:
        return
    spans = _spans_where(course.times, course.unclear)
    begin, end = max(spans, key=lambda span: span[1] - span[0])
    rate = np.nanmean(gyro.log.data[gyro.rows(begin, end)], axis=0) * (gyro.factor or 1.0)
    size = float(np.linalg.norm(rate))
    yield Finding(
        SECTION, "unclear rest", "look",
        f"{gyro.label} is at rest, or on a rate table, for {seconds:.3g} s: its steady "
        f"{math.degrees(size):.3g} deg/s about the vertical exceeds the largest bias.",
        math.degrees(size), "deg/s", None, spans, gyro.figure,
        make_sentence("For a rate table, do nothing; for a bias, give ",
                      bias_limit_advice(size), "."),
    )  # fmt: skip


def _spans_where(times: Floats, where: Booleans) -> Spans:
    """Return the time spans in which a mask is True, adjacent ones merged."""
    return tuple(
        (round(max(0.0, float(times[a]) - _STEP_S), 3), round(float(times[b - 1]), 3))
        for a, b in runs(where).tolist()
    )


class _LogVertical(NamedTuple):
    """The log's own vertical, up or down, in sensor axes, and times since the beginning."""

    times: Floats
    axis: Floats

    def at(self, times: Floats) -> tuple[Floats, Booleans]:
        """Return the row at or before each time, and True if that row is recent."""
        rows = np.clip(np.searchsorted(self.times, times, "right") - 1, 0, None)
        fresh = np.abs(times - self.times[rows]) < 2.0 * BLOCK_S
        return self.axis[rows], fresh & (times >= self.times[0])


def _read_log_verticals(recording: Recording) -> Iterator[tuple[str, _LogVertical]]:
    """Yield the verticals of the log's orientations: of a reference, or of PX4's estimator."""
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
    """Yield the angle between the log's own vertical, up or down, and gravity."""
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
        f"{name[0].upper()}{name[1:]} is {_format_median(middle, sigma)} deg off gravity "
        f"at rest (median of {count_noun(len(off), 'rest')} of {_MIN_REST_S:g} s or more).",
        middle, "deg", sigma, rest_spans(where), accel.figure,
        "Level the vehicle and calibrate its horizon; a tilted mount of the sensor shows here.",
    )  # fmt: skip


def _angle_between_lines(one: Floats, other: Floats) -> Floats:
    """Return the angle between two lines, deg; opposite directions count as equal."""
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
    limit = LIMITS["attitudes differ"]
    yield Finding(
        SECTION, "attitudes differ", limit.severity(worst),
        f"The verticals of {name} and of {gyro.label} with its accelerometer differ by up to "
        f"{shorten(worst)} deg (95 % of the time the latter is trusted; median "
        f"{shorten(np.median(off[known]))}).",
        worst, "deg", None, _spans_where(course.times, off >= limit.look), gyro.figure,
        "Compare both with a level surface at rest.",
    )  # fmt: skip
