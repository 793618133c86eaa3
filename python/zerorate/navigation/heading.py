"""The heading of a body in motion, by the likelihood of a bank of filters."""

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
from zerorate.navigation.events import SIGMA_POSITION, SIGMA_VELOCITY, Events
from zerorate.navigation.windows import Epochs, sigma_of_position
from zerorate.record.fixes import Fixes
from zerorate.record.samples import Samples
from zerorate.types import Floats, Integers

_MEMBERS: Final = 8
_OF_MEMBER: Final = math.radians(27.0)
"""Deviation of the heading of a member, of which eight are 45 deg apart."""
_SHORTEST: Final = 2.0
LONGEST: Final = 60.0
"""Seconds after which a bank has decided, at least and at most."""
_LEAD: Final = 15.0
"""Logarithm of the likelihood by which the best leads all that look elsewhere."""
_ELSEWHERE: Final = math.radians(15.0)
_SQUARE: Final = 25.0
"""Normalised innovation squared of a scalar that counts at most."""
_OPEN: Final = 1e12
_CLOCK: Final = 0.2
"""Seconds by which the clock of a receiver may be off."""
_CHORD: Final = 1.0
_CHORDS: Final = 10.0
_COURSE_WAY: Final = 0.5
"""Metres that a course needs, and how much of them may be noise, rad."""
_COURSE_NOISE: Final = math.tan(math.radians(10.0))
_COURSE_SIGMA: Final = math.radians(5.0)


@dataclass(frozen=True)
class Heading:
    """A heading that was decided.

    Parameters
    ----------
    begun : float
        Of the body at the first fix, rad, as the member that won began.
    begun_sigma : float
        Its deviation there.
    time : float
        When it was decided, s.
    decided, decided_sigma : float
        Of the body at that time, rad.
    """

    begun: float
    begun_sigma: float
    time: float
    decided: float
    decided_sigma: float


def find_heading(
    samples: Samples, fixes: Fixes, start: Alignment, options: Mapping[str, Any]
) -> Heading | None:
    """Return the heading of a body from its start on, None if 60 s do not tell it.

    Filters that differ in their heading alone run over the same fixes; that under which these are
    the most likely has the right one. Beside eight round the compass runs one along the course, as
    a body does that moves forward.

    Parameters
    ----------
    samples : Samples
        Of the sensors, in the axes of the body.
    fixes : Fixes
        On their clock.
    start : Alignment
        At the time of a fix, with any heading.
    options : mapping
        Of `NavigationFilter`.
    """
    first, last = np.searchsorted(samples.time, [start.time, start.time + LONGEST])
    piece = slice(max(int(first) - 1, 0), int(last))
    used = _as_late(fixes.between(start.time, start.time + LONGEST))
    if len(used) < 2 or piece.stop - piece.start < 2:
        return None
    turned = _turned(samples, start, piece)
    yaws = 2.0 * math.pi / _MEMBERS * np.arange(_MEMBERS)
    members = [(float(yaw), _OF_MEMBER, used.time[0]) for yaw in yaws]
    course = _course(samples.time[piece], turned, used)
    if course is not None:
        members.append(course)
    runs = [_run(samples, piece, used, start, member, options) for member in members]
    known = np.array([since for *_, since in members])
    for k in range(1, len(used)):
        if used.time[k] - used.time[0] < _SHORTEST:
            continue
        counted = np.flatnonzero(known <= used.time[k])
        likely = np.array([runs[i].likelihood[k] for i in counted])
        headings = np.array([runs[i].heading[k] for i in counted])
        best = int(np.argmax(likely))
        others = np.abs(_wrapped(headings - headings[best])) > _ELSEWHERE
        if (likely[best] - likely[others] >= _LEAD).all():
            won = runs[counted[best]]
            yaw, sigma, _ = members[counted[best]]
            time = float(used.time[k])
            return Heading(yaw, sigma, time, float(headings[best]), float(won.sigma[k]))
    return None


def _as_late(fixes: Fixes) -> Fixes:
    """Return fixes with the deviations that they have where their clock is off.

    A position that is a tenth of a second late is off by what the body moves in it: a fine receiver
    would have the bank decide by its clock.
    """
    epochs = Epochs.of(fixes)
    if len(epochs.time) < 3:
        return fixes
    moved = epochs.velocity[:, :2]
    step = max(1, round(_CHORD / max(epochs.interval, 1e-3)))
    changed = moved[step:] - moved[:-step] if len(moved) > step else moved[1:] - moved[:-1]
    speed, change = (_CLOCK * math.sqrt(np.nanmean(x**2)) for x in (moved, changed))
    return replace(
        fixes,
        position_sigma=np.hypot(_known(fixes.position_sigma, SIGMA_POSITION, fixes), speed),
        velocity_sigma=np.hypot(_known(fixes.velocity_sigma, SIGMA_VELOCITY, fixes), change),
    )


def _known(sigma: Floats | None, usual: float, fixes: Fixes) -> Floats:
    told = np.full((len(fixes), 3), np.nan) if sigma is None else sigma
    return np.where(np.isnan(told), usual, told)


@dataclass(frozen=True, eq=False)
class _Run:
    """What a member has shown up to each fix: log-likelihood, heading and its deviation."""

    likelihood: Floats
    heading: Floats
    sigma: Floats


def _run(
    samples: Samples,
    piece: slice,
    fixes: Fixes,
    start: Alignment,
    member: tuple[float, float, float],
    options: Mapping[str, Any],
) -> _Run:
    yaw, sigma, _ = member
    own = replace(
        start,
        quaternion=looking(start.quaternion, yaw),
        heading_known=True,
        course=False,
        heading_sigma=sigma,
    )
    nav = NavigationFilter(own, **{**options, "adapt": "fixed", "gate": _OPEN})
    time = samples.time[piece]
    events = Events.of(fixes)
    found, _ = nav.process_arrays(time, samples.gyro[piece], samples.accel[piece], events.rows)
    found = events.merged(found)
    size = found["innovation_sigma"]
    with np.errstate(invalid="ignore", divide="ignore"):
        square = np.minimum((found["innovation"] / size) ** 2, _SQUARE)
        terms = np.nan_to_num(square + 2.0 * np.log(size))
    at = np.clip(np.searchsorted(time, fixes.time), 0, len(time) - 1)
    heading = heading_of(found["quaternion"][at])
    return _Run(-0.5 * np.cumsum(terms.sum(axis=1)), heading, found["sigma"][at, 8])


def looking(quaternion: Floats, yaw: float) -> Floats:
    """Return an orientation of heading zero turned to a heading."""
    return product(about_z(yaw), quaternion)


def heading_of(q: Floats) -> Floats:
    """Return the headings of orientations, rad."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    found: Floats = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return found


def compass(heading: float, digits: int) -> str:
    """Return a heading, rad, in deg from 0 to below 360, as it is printed everywhere."""
    return f"{round(math.degrees(heading), digits) % 360.0:.{digits}f}"


def _turned(samples: Samples, start: Alignment, piece: slice) -> Floats:
    """Return by how much the body has turned since the start, by its gyro, rad."""
    time = samples.time[piece]
    rate = np.nan_to_num(samples.gyro[piece]) - start.gyro_bias
    steps = 0.5 * (rate[1:] + rate[:-1]) * np.diff(time)[:, np.newaxis]
    turns = np.concatenate((start.quaternion[np.newaxis], from_rotation_vectors(steps)))
    yaw = np.unwrap(heading_of(cumulative_product(turns)))
    return np.asarray(yaw - yaw[0])


def _course(time: Floats, turned: Floats, fixes: Fixes) -> tuple[float, float, float] | None:
    """Return heading and deviation at the first fix of a body that moves along its course.

    The third number is when that is known. Chords of a second are turned back by the gyro and
    summed: what does not move forward, or has its axes elsewhere, has chords that go apart.
    """
    there = np.isfinite(fixes.position[:, :2].sum(axis=1))
    used = fixes.chosen(there)
    if len(used) < 2:
        return None
    step = max(1, round(_CHORD / max(float(np.median(np.diff(used.time))), 1e-3)))
    from_, to = np.arange(0, len(used) - step), np.arange(step, len(used))
    place = np.nan_to_num(used.position)
    way = local_ned(place[to], place[from_])
    middle = 0.5 * (used.time[from_] + used.time[to])
    chords = (way[:, 0] + 1j * way[:, 1]) * np.exp(-1j * np.interp(middle, time, turned))
    sigma = np.sqrt(2.0) * sigma_of_position(used)
    for k in range(len(chords)):
        chosen = _apart(k, step, used.time[to])
        total = chords[chosen].sum()
        if abs(total) <= max(_COURSE_WAY, sigma[to[k]] / _COURSE_NOISE):
            continue
        angles = np.angle(chords[chosen] / total)
        spread = float((angles**2).sum()) / max(len(angles) - 1, 1) if len(angles) > 1 else 0.0
        noise = (sigma[to[k]] / abs(total)) ** 2 + _COURSE_SIGMA**2
        deviation = math.sqrt(noise + spread)
        return float(np.angle(total)), deviation, float(used.time[to[k]])
    return None


def _apart(k: int, step: int, ends: Floats) -> Integers:
    """Return the chords that do not overlap, from the k-th back to ten seconds before."""
    chosen = np.arange(k, -1, -step)
    recent: Integers = chosen[ends[k] - ends[chosen] <= _CHORDS]
    return recent


def _wrapped(angle: Floats) -> Floats:
    return np.asarray(np.remainder(angle + math.pi, 2.0 * math.pi) - math.pi)
