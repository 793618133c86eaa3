"""Start of a filter from the data: at rest if there is a rest, otherwise in motion."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Final, Literal

import numpy as np

from zerorate._native import longest_quiet
from zerorate.faults import keyword_argument, make_sentence
from zerorate.geometry.earth import local_ned
from zerorate.navigation.alignment import Alignment, align, level_attitude
from zerorate.navigation.heading import (
    MAX_DECISION_S,
    find_heading,
    format_heading,
    turn_to_heading,
)
from zerorate.navigation.refined_start import refine_attitude
from zerorate.navigation.windows import Epochs, sigma_of_position
from zerorate.record import LogError, Recording
from zerorate.record.fixes import Fixes
from zerorate.record.offset import TimeOffset
from zerorate.record.samples import Samples
from zerorate.types import Booleans, Floats

_TICK_S: Final = 0.5
_STEADY_LIMITS: Final = (math.radians(0.85), 0.26, 0.26)
"""Limits at rest: scatter of half-second means of rate, rad/s, and force, m/s^2, and the change of
gravity, m/s^2. A running engine stays below them.
"""
_MAX_GYRO_BIAS_RAD_S: Final = math.radians(10.0)
"""Largest bias expected of a gyro."""
_MIN_REST_S: Final = 3.0
_MAX_REST_SEARCH_S: Final = 300.0
"""Shortest rest (s), and time before the motion in which a rest is searched (s)."""
_MIN_DRIFT_M_S: Final = 0.3
"""Slowest drift of positions, m/s, that a rest must exclude if there are no velocities."""
_GYRO_BIAS_SIGMAS_RAD_S: Final = (math.radians(0.1), math.radians(0.5))
"""Standard deviations of the gyro bias, rad/s: after a rest, and without a rest."""
_LEVEL_SIGMA_RAD: Final = math.radians(5.0)
_LEVEL_S: Final = 5.0
_FORCE_TOLERANCE: Final = 0.5
"""Largest relative difference between the mean force in motion and gravity."""
_ACCEL_BIAS_SIGMA_M_S2: Final = 0.05
_DISPLACEMENT_SPANS_S: Final = (3.0, 10.0, 30.0)
"""Spans over which a displacement shows motion, s; slow motion needs the longer spans."""
_MAX_TRIES: Final = 20


def find_start(
    imu: Recording,
    gnss: Fixes,
    *,
    heading: float | Literal["course"] | None = None,
    time_offset: float | TimeOffset = 0.0,
    **options: Any,  # noqa: ANN401
) -> Alignment:
    """Find the start of a filter from a recording, at rest or in motion.

    Parameters
    ----------
    imu : Recording
        Recording with a gyro and an accelerometer. Its axes are forward, right, down.
    gnss : Fixes
        Fixes of the receiver.
    heading : float or "course", optional
        Heading at the start, rad from north over east. "course" takes the direction of the
        vehicle's first motion. Default: a bank of filters finds the heading. The vehicle may then
        move in any direction, but must speed up, brake or turn.
    time_offset : float or TimeOffset
        Offset to add to the times of the fixes, s.
    **options
        Options of `NavigationFilter` for the filters of the bank.

    Returns
    -------
    Alignment
        Start for `NavigationFilter`. Its ``notes`` say how the start was found.

    Raises
    ------
    LogError
        If no start is found. The message names what is missing: a rest, the course, or a plausible
        force.

    Notes
    -----
    A rest is the longest span of at least 3 s with steady half-second means, before the receiver
    moves. Their standard deviation, as root sum square of the three axes, is at most 0.85 deg/s for
    the rate and 0.26 m/s^2 for the force. The mean rate is the gyro bias, with a standard deviation
    of 0.1 deg/s. Without a rest the bias is assumed zero, with a standard deviation of 0.5 deg/s.
    Roll and pitch come from the mean force of the 5 s before the start, with a standard deviation
    of 5 deg.

    The bank has eight filters with headings round the compass, and one filter that uses the course
    as heading. The most likely filter gives the heading. Its log likelihood must exceed the log
    likelihood of every other heading by 15. In these filters the standard deviation of a fix
    includes a clock error of 0.2 s.

    Without a rest, an iterated smoother over the first minute then corrects roll, pitch and
    heading.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=60.0, seed=1)
    >>> start = zr.navigation.find_start(drive.recording(), drive.fixes)
    >>> start.heading_known, len(start.notes)
    (True, 2)
    """
    samples = Samples.of(imu, mag=False, what="navigation")
    fixes = _select_fixes(imu, samples, TimeOffset.of(time_offset).applied(gnss), gnss.source)
    motion = _ReceiverMotion.of(fixes)
    rest = _find_rest(samples, motion)
    if heading is not None and rest is not None:
        return align(imu, latitude=_latitude(fixes), heading=heading, span=rest)
    begins = motion.motion_starts if heading is None else [_first_fix_time(samples, fixes)]
    if not begins:
        raise LogError(_describe_no_motion(imu, motion))
    for begin in begins[:_MAX_TRIES]:
        level = _align_in_motion(imu.source, samples, fixes, begin, rest)
        if heading == "course":
            return replace(level, course=True)
        if heading is not None:
            turned = turn_to_heading(level.quaternion, float(heading))
            return replace(
                level, quaternion=turned, heading_known=True, heading_sigma=_LEVEL_SIGMA_RAD
            )
        solution = find_heading(samples, fixes, level, options)
        if solution is None:
            continue
        note = (
            f"heading from the motion: {format_heading(solution.heading, 0)} deg "
            f"(sigma {math.degrees(solution.sigma):.0f}) at {solution.time:.1f} s, "
            f"{solution.time - begin:.1f} s after the start"
        )
        found = replace(
            level,
            quaternion=turn_to_heading(level.quaternion, solution.start_heading),
            heading_known=True,
            heading_sigma=solution.start_sigma,
            notes=(*level.notes, note),
        )
        return found if rest is not None else refine_attitude(samples, fixes, found, options)
    raise LogError(_describe_no_heading(imu, begins))


def _select_fixes(imu: Recording, samples: Samples, fixes: Fixes, source: str) -> Fixes:
    """Return the fixes that have a position and lie within the time of the samples."""
    present = np.isfinite(fixes.position[:, :2].sum(axis=1))
    time = samples.time
    inside = fixes.chosen(present).between(float(time[0]), float(time[-1]))
    if len(inside):
        return inside
    if not len(fixes):
        raise LogError(f"{source}: there are no fixes")
    raise LogError(
        make_sentence(
            f"{imu.source}: the filter cannot start: its samples are from {time[0]:.6g} to "
            f"{time[-1]:.6g} s and the fixes from {fixes.time[0]:.6g} to {fixes.time[-1]:.6g} s, "
            f"which suggests different clocks: ",
            keyword_argument("time_offset"),
            " moves these",
        )
    )


def _latitude(fixes: Fixes) -> float:
    return float(np.clip(fixes.position[0, 0], -89.5, 89.5))


@dataclass(frozen=True, eq=False)
class _ReceiverMotion:
    """Times at which a receiver stands, and times at which it certainly moves."""

    fixes: Fixes
    departure: float
    """Time until which the receiver stands, s; before the first fix if it always moves."""
    motion_starts: list[float]
    """Times of fixes in motion, at least a minute apart, s."""
    max_displacement: float
    """Largest displacement in three seconds, m."""

    @classmethod
    def of(cls, fixes: Fixes) -> _ReceiverMotion:
        sigma = sigma_of_position(fixes)
        epochs = Epochs.of(fixes)
        time = fixes.time
        position = np.nan_to_num(fixes.position)
        way = local_ned(position, position[0])[:, :2]
        departed, moving = np.zeros(len(time), bool), np.zeros(len(time), bool)
        farthest = 0.0
        for i, seconds in enumerate(_DISPLACEMENT_SPANS_S):
            before = np.clip(np.searchsorted(time, time - seconds - 1e-6), 0, None)
            displacement = np.hypot(*(way - way[before]).T)
            moving |= displacement > np.maximum(0.5, 4.0 * math.sqrt(2.0) * sigma)
            if i == 0:
                departed = displacement > np.maximum(0.3, 5.7 * sigma)
                farthest = float(displacement.max())
        if epochs.is_reported:
            fast = epochs.speed > np.maximum(0.2, 4.0 * epochs.sigma)
            at = np.searchsorted(time, epochs.time[fast])
            departed[at] = True
            fast = epochs.speed > np.maximum(0.5, 4.0 * epochs.sigma)
            moving[np.searchsorted(time, epochs.time[fast])] = True
        leaving = np.flatnonzero(departed | moving)
        departure = float(time[leaving[0]] if leaving.size else time[-1]) - 1.0
        return cls(fixes, departure, list(_motion_starts(time, moving)), farthest)


def _motion_starts(time: Floats, moving: Booleans) -> Iterator[float]:
    """Yield times of fixes in motion, each at least a minute after the previous time."""
    after = -math.inf
    for t in time[moving].tolist():
        if t >= after:
            yield t
            after = t + MAX_DECISION_S


def begins_in_motion(start: Alignment) -> bool:
    """Return True if there was no rest to find the gyro bias from."""
    return start.gyro_bias_sigma >= _GYRO_BIAS_SIGMAS_RAD_S[1]


def _find_rest(samples: Samples, motion: _ReceiverMotion) -> tuple[float, float] | None:
    """Return start and end of the longest rest before the receiver moves, s; None without rest."""
    stop = motion.departure
    fixes = motion.fixes
    start = max(float(fixes.time[0]), float(samples.time[0]), stop - _MAX_REST_SEARCH_S)
    count = math.floor((stop - start) / _TICK_S)
    if count * _TICK_S < _MIN_REST_S:
        return None
    start = stop - count * _TICK_S
    edges = np.searchsorted(samples.time, start + _TICK_S * np.arange(count + 1))
    means = np.array([_mean_sample(samples, a, b) for a, b in pairwise(edges)])
    shortest = _MIN_REST_S
    if fixes.velocity is None:
        shortest = max(
            _MIN_REST_S, 1.4 * float(np.median(sigma_of_position(fixes))) / _MIN_DRIFT_M_S
        )
    first, last = longest_quiet(means, *_STEADY_LIMITS, _MAX_GYRO_BIAS_RAD_S)
    if (last - first) * _TICK_S < shortest:
        return None
    return start + first * _TICK_S, start + last * _TICK_S


def _mean_sample(samples: Samples, first: int, last: int) -> Floats:
    values = np.concatenate((samples.gyro[first:last], samples.accel[first:last]), axis=1)
    present = np.isfinite(values).all(axis=1)
    return values[present].mean(axis=0) if present.any() else np.full(6, np.nan)


def _first_fix_time(samples: Samples, fixes: Fixes) -> float:
    """Return the time of the first fix with a second of samples before it."""
    late = fixes.time >= samples.time[0] + 1.0
    return float(fixes.time[late][0] if late.any() else fixes.time[0])


def _align_in_motion(
    source: str, samples: Samples, fixes: Fixes, begin: float, rest: tuple[float, float] | None
) -> Alignment:
    """Return the alignment at a fix, without the heading."""
    a, b = np.searchsorted(samples.time, [begin - _LEVEL_S, begin])
    # In the first second of a recording, use the samples after the fix.
    b = max(b, int(np.searchsorted(samples.time, samples.time[0] + 1.0)))
    mean = _mean_sample(samples, int(a), int(b))
    force = float(np.linalg.norm(mean[3:]))
    if not abs(force / 9.81 - 1.0) <= _FORCE_TOLERANCE:
        raise LogError(
            f"{source}: the filter cannot start: the mean force from {samples.time[a]:.1f} to "
            f"{begin:.1f} s is {force:.3g} m/s^2, expected about 9.8: the accelerometer has "
            "another unit, or lacks samples"
        )
    bias, sigma = np.zeros(3), _GYRO_BIAS_SIGMAS_RAD_S[1]
    note = "there is no rest of 3 s before the receiver moves: the bias of the gyro is assumed 0"
    if rest is not None:
        x, y = np.searchsorted(samples.time, rest)
        bias, sigma = _mean_sample(samples, int(x), int(y))[:3], _GYRO_BIAS_SIGMAS_RAD_S[0]
        note = f"the bias of the gyro was measured in a rest from {rest[0]:.1f} to {rest[1]:.1f} s"
    return Alignment(
        time=begin,
        quaternion=level_attitude(mean[3:], 0.0),
        latitude=_latitude(fixes),
        heading_known=False,
        course=False,
        gyro_bias=bias,
        accel_bias=np.zeros(3),
        level_sigma=_LEVEL_SIGMA_RAD,
        heading_sigma=math.pi / 2.0,
        gyro_bias_sigma=sigma,
        accel_bias_sigma=_ACCEL_BIAS_SIGMA_M_S2,
        notes=(f"{note}, to {math.degrees(sigma):.1f} deg/s",),
    )


def _describe_no_motion(imu: Recording, motion: _ReceiverMotion) -> str:
    time = motion.fixes.time
    return make_sentence(
        f"{imu.source}: the filter cannot start: from {time[0]:.1f} to {time[-1]:.1f} s the fixes "
        f"show no motion beyond their noise, {motion.max_displacement:.2g} m in 3 s at "
        "most, so neither course nor acceleration determines the heading: ",
        keyword_argument("heading"),
        " says it",
    )


def _describe_no_heading(imu: Recording, begins: list[float]) -> str:
    times = ", ".join(f"{t:.1f}" for t in begins[:3])
    return make_sentence(
        f"{imu.source}: the filter cannot start: it moves from {times} s on, but for a minute no "
        f"heading fits the fixes clearly best: either the vehicle does not accelerate, brake or "
        f"turn, or units, axes or clock are wrong; ",
        keyword_argument("heading"),
        " says the heading",
    )
