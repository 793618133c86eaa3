"""Heading of a body in motion, from the likelihoods of a bank of filters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from zerorate._native import NavigationFilter
from zerorate.geometry.earth import local_ned
from zerorate.geometry.rotations import about_z, cumulative_product, from_rotation_vectors, product
from zerorate.navigation.alignment import Alignment
from zerorate.navigation.events import DEFAULT_POSITION_SIGMA_M, DEFAULT_VELOCITY_SIGMA_M_S, Events
from zerorate.navigation.windows import Epochs, sigma_of_position
from zerorate.record.fixes import Fixes
from zerorate.record.samples import Samples
from zerorate.types import Floats, Integers

_MEMBER_COUNT: Final = 8
_MEMBER_SIGMA_RAD: Final = math.radians(27.0)
"""Number of filters, and the standard deviation of each filter's heading, rad."""
_MIN_DECISION_S: Final = 2.0
MAX_DECISION_S: Final = 60.0
"""Shortest and longest time in which a bank decides, s."""
_MIN_LIKELIHOOD_LEAD: Final = 15.0
"""Smallest difference of log likelihood between the best filter and other headings."""
_DISTINCT_HEADING_RAD: Final = math.radians(15.0)
_MAX_NIS: Final = 25.0
"""Limit of the normalised innovation squared of a scalar, against outliers."""
_OPEN_GATE: Final = 1e12
_CLOCK_ERROR_S: Final = 0.2
"""Possible clock error of a receiver, s."""
_CHORD_S: Final = 1.0
_CHORD_WINDOW_S: Final = 10.0
_MIN_COURSE_M: Final = 0.5
"""Displacements for the course: time (s), window (s) and smallest displacement (m)."""
_MAX_COURSE_NOISE: Final = math.tan(math.radians(10.0))
_COURSE_SIGMA_RAD: Final = math.radians(5.0)


@dataclass(frozen=True)
class Heading:
    """A heading and the time of its decision.

    Parameters
    ----------
    start_heading : float
        Heading of the body at the first fix, rad, from the most likely filter.
    start_sigma : float
        Standard deviation of `start_heading`, rad.
    time : float
        Time of the decision, s.
    heading : float
        Heading of the body at `time`, rad.
    sigma : float
        Standard deviation of `heading`, rad.
    """

    start_heading: float
    start_sigma: float
    time: float
    heading: float
    sigma: float


def find_heading(
    samples: Samples, fixes: Fixes, start: Alignment, options: Mapping[str, Any]
) -> Heading | None:
    """Return the heading of a body after its start. None if 60 s do not determine it.

    A bank of filters processes the same fixes. The filters differ only in their heading, and the
    most likely filter has the right heading. Eight filters have headings round the compass. Another
    filter uses the course as heading, for bodies that move forward.

    Parameters
    ----------
    samples : Samples
        Samples of the sensors, in the axes of the body.
    fixes : Fixes
        Fixes on the clock of the sensors.
    start : Alignment
        Alignment at the time of a fix, with any heading.
    options : mapping
        Options of `NavigationFilter`.
    """
    first, last = np.searchsorted(samples.time, [start.time, start.time + MAX_DECISION_S])
    piece = slice(max(int(first) - 1, 0), int(last))
    used = _inflate_for_clock(fixes.between(start.time, start.time + MAX_DECISION_S))
    if len(used) < 2 or piece.stop - piece.start < 2:
        return None
    yaw_change = _integrate_yaw(samples, start, piece)
    yaws = 2.0 * math.pi / _MEMBER_COUNT * np.arange(_MEMBER_COUNT)
    members = [(float(yaw), _MEMBER_SIGMA_RAD, used.time[0]) for yaw in yaws]
    course = _fit_course(samples.time[piece], yaw_change, used)
    if course is not None:
        members.append(course)
    runs = [_run_member(samples, piece, used, start, member, options) for member in members]
    since_times = np.array([since for *_, since in members])
    for k in range(1, len(used)):
        if used.time[k] - used.time[0] < _MIN_DECISION_S:
            continue
        active = np.flatnonzero(since_times <= used.time[k])
        likely = np.array([runs[i].likelihood[k] for i in active])
        headings = np.array([runs[i].heading[k] for i in active])
        best = int(np.argmax(likely))
        elsewhere = np.abs(_wrap(headings - headings[best])) > _DISTINCT_HEADING_RAD
        if (likely[best] - likely[elsewhere] >= _MIN_LIKELIHOOD_LEAD).all():
            winner = runs[active[best]]
            yaw, sigma, _ = members[active[best]]
            time = float(used.time[k])
            return Heading(yaw, sigma, time, float(headings[best]), float(winner.sigma[k]))
    return None


def _inflate_for_clock(fixes: Fixes) -> Fixes:
    """Return the fixes with larger standard deviations, to include a clock error.

    With a clock error of 0.1 s, a position is wrong by the motion during 0.1 s. A precise receiver
    states a much smaller error, so the clock error would decide the bank.
    """
    epochs = Epochs.of(fixes)
    if len(epochs.time) < 3:
        return fixes
    velocity = epochs.velocity[:, :2]
    step = max(1, round(_CHORD_S / max(epochs.interval, 1e-3)))
    velocity_change = (
        velocity[step:] - velocity[:-step] if len(velocity) > step else velocity[1:] - velocity[:-1]
    )
    speed, change = (
        _CLOCK_ERROR_S * math.sqrt(np.nanmean(x**2)) for x in (velocity, velocity_change)
    )
    return replace(
        fixes,
        position_sigma=np.hypot(
            _fill_sigma(fixes.position_sigma, DEFAULT_POSITION_SIGMA_M, fixes), speed
        ),
        velocity_sigma=np.hypot(
            _fill_sigma(fixes.velocity_sigma, DEFAULT_VELOCITY_SIGMA_M_S, fixes), change
        ),
    )


def _fill_sigma(sigma: Floats | None, default: float, fixes: Fixes) -> Floats:
    stated = np.full((len(fixes), 3), np.nan) if sigma is None else sigma
    return np.where(np.isnan(stated), default, stated)


@dataclass(frozen=True, eq=False)
class _MemberRun:
    """Log likelihood of one filter at each fix, its heading, and the heading's sigma."""

    likelihood: Floats
    heading: Floats
    sigma: Floats


def _run_member(
    samples: Samples,
    piece: slice,
    fixes: Fixes,
    start: Alignment,
    member: tuple[float, float, float],
    options: Mapping[str, Any],
) -> _MemberRun:
    yaw, sigma, _ = member
    member_start = replace(
        start,
        quaternion=turn_to_heading(start.quaternion, yaw),
        heading_known=True,
        course=False,
        heading_sigma=sigma,
    )
    nav = NavigationFilter(member_start, **{**options, "adapt": "fixed", "gate": _OPEN_GATE})
    time = samples.time[piece]
    events = Events.of(fixes)
    output, _ = nav.process_arrays(time, samples.gyro[piece], samples.accel[piece], events.rows)
    output = events.merge(output)
    size = output["innovation_sigma"]
    with np.errstate(invalid="ignore", divide="ignore"):
        square = np.minimum((output["innovation"] / size) ** 2, _MAX_NIS)
        terms = np.nan_to_num(square + 2.0 * np.log(size))
    at = np.clip(np.searchsorted(time, fixes.time), 0, len(time) - 1)
    heading = heading_of(output["quaternion"][at])
    return _MemberRun(-0.5 * np.cumsum(terms.sum(axis=1)), heading, output["sigma"][at, 8])


def turn_to_heading(quaternion: Floats, yaw: float) -> Floats:
    """Rotate an orientation of heading zero to a heading."""
    return product(about_z(yaw), quaternion)


def heading_of(q: Floats) -> Floats:
    """Return the heading of each orientation, rad."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    heading: Floats = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return heading


def format_heading(heading: float, digits: int) -> str:
    """Return a heading, rad, as text in deg, from 0 to below 360."""
    return f"{round(math.degrees(heading), digits) % 360.0:.{digits}f}"


def _integrate_yaw(samples: Samples, start: Alignment, piece: slice) -> Floats:
    """Return the body's rotation since the start, rad, from its gyro."""
    time = samples.time[piece]
    rate = np.nan_to_num(samples.gyro[piece]) - start.gyro_bias
    steps = 0.5 * (rate[1:] + rate[:-1]) * np.diff(time)[:, np.newaxis]
    turns = np.concatenate((start.quaternion[np.newaxis], from_rotation_vectors(steps)))
    yaw = np.unwrap(heading_of(cumulative_product(turns)))
    return np.asarray(yaw - yaw[0])


def _fit_course(
    time: Floats, yaw_change: Floats, fixes: Fixes
) -> tuple[float, float, float] | None:
    """Return the heading at the first fix, its standard deviation and the time of the decision.

    The body must move along its course. Displacements over a second are rotated back by the gyro's
    angle and summed. If the body does not move forward or its axes are wrong, their directions
    differ.
    """
    present = np.isfinite(fixes.position[:, :2].sum(axis=1))
    used = fixes.chosen(present)
    if len(used) < 2:
        return None
    step = max(1, round(_CHORD_S / max(float(np.median(np.diff(used.time))), 1e-3)))
    from_, to = np.arange(0, len(used) - step), np.arange(step, len(used))
    position = np.nan_to_num(used.position)
    displacement = local_ned(position[to], position[from_])
    middle = 0.5 * (used.time[from_] + used.time[to])
    chords = (displacement[:, 0] + 1j * displacement[:, 1]) * np.exp(
        -1j * np.interp(middle, time, yaw_change)
    )
    sigma = np.sqrt(2.0) * sigma_of_position(used)
    for k in range(len(chords)):
        selected = _select_chords(k, step, used.time[to])
        total = chords[selected].sum()
        if abs(total) <= max(_MIN_COURSE_M, sigma[to[k]] / _MAX_COURSE_NOISE):
            continue
        angles = np.angle(chords[selected] / total)
        spread = float((angles**2).sum()) / max(len(angles) - 1, 1) if len(angles) > 1 else 0.0
        noise = (sigma[to[k]] / abs(total)) ** 2 + _COURSE_SIGMA_RAD**2
        deviation = math.sqrt(noise + spread)
        return float(np.angle(total)), deviation, float(used.time[to[k]])
    return None


def _select_chords(k: int, step: int, ends: Floats) -> Integers:
    """Return displacements without overlap, from the k-th back to ten seconds before it."""
    indices = np.arange(k, -1, -step)
    recent: Integers = indices[ends[k] - ends[indices] <= _CHORD_WINDOW_S]
    return recent


def _wrap(angle: Floats) -> Floats:
    return np.asarray(np.remainder(angle + math.pi, 2.0 * math.pi) - math.pi)
