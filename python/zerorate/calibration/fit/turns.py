"""Rotations from one rest to the next: usable ones, and gravity propagated through them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from zerorate._native import propagate_turns
from zerorate.calibration.fit.sensors import Sensor
from zerorate.calibration.record import Rest, Turn
from zerorate.types import Booleans, Floats, Integers

LONG: Final = "long"
GAP: Final = "gap"
SATURATED: Final = "saturated"

MAX_TURN_S: Final = 30.0
_MIN_HITS: Final = 10
_MAX_WEIGHED_S: Final = 10.0
"""Length of a rest, s, above which its weight for the bias of a rotation is constant."""

_MOTION_WEIGHT: Final = 1e-3


def find_saturated(gyro: Sensor, limit: float | None) -> Booleans:
    """Return the mask of samples at the end of the gyro's range, shape (n,).

    Parameters
    ----------
    gyro
        Gyro samples.
    limit
        End of the range in the raw unit. None: the largest or smallest value of an axis, if it
        occurs ten times.
    """
    if limit is not None:
        return np.asarray((np.abs(gyro.data) >= limit * abs(gyro.factor) * (1 - 1e-9)).any(axis=1))
    at_limit = np.zeros(gyro.n, dtype=bool)
    if gyro.missing is not None and gyro.missing.all():
        return at_limit
    for axis in gyro.data.T:
        for end in (np.nanmax(axis), np.nanmin(axis)):
            hits = axis == end
            if np.count_nonzero(hits) >= _MIN_HITS:
                at_limit |= hits
    return at_limit


def find_turns(rests: Sequence[Rest], gyro: Sensor, saturated: Booleans) -> list[Turn]:
    """Return the rotations from each used rest to the next, with reasons if unusable."""
    used = [index for index, rest in enumerate(rests) if rest.used]
    return [_make_turn(rests, before, after, gyro, saturated) for before, after in pairwise(used)]


def _make_turn(
    rests: Sequence[Rest], before: int, after: int, gyro: Sensor, saturated: Booleans
) -> Turn:
    first, last = rests[before].last - 1, rests[after].first + 1
    reason = _exclusion_reason(gyro, saturated, first, last)
    return Turn(
        start=gyro.start + first / gyro.rate,
        stop=gyro.start + (last - 1) / gyro.rate,
        first=first,
        last=last,
        rests=(before, after),
        angle=float("nan"),
        axis=np.full(3, np.nan),
        residual=float("nan"),
        used=not reason,
        reason=reason,
    )


def _exclusion_reason(gyro: Sensor, saturated: Booleans, first: int, last: int) -> str:
    seconds, count = (last - first) / gyro.rate, last - first
    if seconds > MAX_TURN_S:
        return f"{LONG}: {seconds:.0f} s, more than {MAX_TURN_S:.0f} s"
    if gyro.missing is not None and (missing_count := int(gyro.missing[first:last].sum())):
        return f"{GAP}: {missing_count} of {count} samples of the gyro are missing"
    if hits := int(saturated[first:last].sum()):
        return f"{SATURATED}: {hits} of {count} samples are at the end of the gyro's range"
    return ""


def turn_biases(turns: Sequence[Turn], rests: Sequence[Rest], at_rest: Floats) -> Floats:
    """Return the gyro's bias in each rotation from the biases at all rests, shape (m, 3).

    It is the mean of the rests before and after, weighted by their length up to ten seconds. A rest
    with motion is used only if the other rest also has motion.
    """
    length = np.array([min(rest.stop - rest.start, _MAX_WEIGHED_S) for rest in rests])
    length *= np.where([bool(rest.reason) for rest in rests], _MOTION_WEIGHT, 1.0)
    pair = np.array([turn.rests for turn in turns], dtype=np.int64).reshape(-1, 2)
    weight = length[pair] / length[pair].sum(axis=1, keepdims=True)
    return np.asarray(np.einsum("ij,ijk->ik", weight, at_rest[pair]))


@dataclass(frozen=True, eq=False)
class TurnRotations:
    """Rotation matrices from the integrated gyro, one for each rotation.

    Parameters
    ----------
    rotations
        P, shape (m, 3, 3): a body vector v before the rotation is ``P.T @ v`` after it.
    by_matrix
        T, shape (m, 3, 3, 3): a change dM moves this vector u by ``[u]x psi``, psi_a = T_abc dM_bc.
    angles
        Sum of the angles of all steps, rad, shape (m,).
    """

    rotations: Floats
    by_matrix: Floats
    angles: Floats


def integrate_turns(
    rates: Floats, period: float, spans: Integers, biases: Floats, matrix: Floats
) -> TurnRotations:
    """Return the rotations from raw rates, corrected as ``matrix @ (rate - bias)``.

    Parameters
    ----------
    rates
        Raw rates without the part that depends on gravity, shape (n, 3).
    period
        Sampling period, s.
    spans
        First and last (exclusive) sample of each rotation, shape (m, 2).
    biases
        Bias of each rotation, shape (m, 3).
    matrix
        The correction, shape (3, 3).
    """
    steps = np.full(max(len(rates) - 1, 0), period)
    rotations, by_matrix, _, angles = propagate_turns(rates, steps, spans, biases, matrix)
    return TurnRotations(rotations, by_matrix, angles)


def miss_angles(rotations: Floats, before: Floats, after: Floats) -> Floats:
    """Return the angles between propagated gravity and gravity measured after rotations, rad."""
    propagated = np.einsum("mba,mb->ma", rotations, before)
    sines = np.linalg.norm(np.cross(propagated, after), axis=1)
    return np.asarray(np.arctan2(sines, (propagated * after).sum(axis=1)))
