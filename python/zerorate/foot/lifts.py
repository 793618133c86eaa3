"""Rides in a lift: two opposite pulses of the force while the foot stands."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from zerorate.types import Booleans, Floats

_MEAN_S: Final = 0.2
_STEP_S: Final = 0.05
_MAX_RATE_RAD_S: Final = math.radians(10.0)
"""Largest deviation of the mean rate from its median while the foot stands, rad/s."""
_MIN_STILL_S: Final = 1.5
_MIN_PULSE_M_S2: Final = 0.15
_MIN_TOP_M_S2: Final = 0.3
_MIN_PULSE_S: Final = 0.4
_MAX_ACROSS: Final = (0.15, 0.3)
"""Largest horizontal force in a pulse: m/s^2, and relative to the pulse."""
_MIN_SPEED_M_S: Final = 0.25
_MAX_DIFFERENCE: Final = 0.5
"""Largest difference between the speeds of both pulses, relative to the larger speed."""
_MAX_RIDE_S: Final = 180.0
_MAX_SAMPLE: Final = 1e4
"""Largest valid rate, rad/s, or force, m/s^2; larger samples count as missing."""


class Ride(NamedTuple):
    """A ride in a lift.

    Attributes
    ----------
    start, end : int
        First sample and end (exclusive) of the ride.
    height : float
        Height gained, m. Negative if the lift goes down.

    Examples
    --------
    >>> from zerorate.foot import Ride
    >>> Ride(1000, 4000, 12.0).height
    12.0
    """

    start: int
    end: int
    height: float


class _Pulse(NamedTuple):
    start: float
    end: float
    middle: float
    speed: float


def find_rides(time: Floats, gyro: Floats, accel: Floats) -> tuple[Ride, ...]:
    """Return the rides in a lift, from n samples of a sensor on a foot.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times of the samples, s, increasing.
    gyro, accel : ndarray, shape (n, 3)
        Rates, rad/s, and forces, m/s^2. NaN where missing.

    Notes
    -----
    A lift speeds up and slows down. The vertical force has two pulses of opposite sign and equal
    area. The area is the speed v. The height is v times the time between the pulses.
    """
    rides: list[Ride] = []
    pulses = sorted(_find_pulses(time, gyro, accel))
    used = -1
    for k, (first, second) in enumerate(pairwise(pulses)):
        larger = max(abs(first.speed), abs(second.speed))
        opposite = abs(first.speed + second.speed) < _MAX_DIFFERENCE * larger
        if k == used or not opposite or second.start - first.end > _MAX_RIDE_S:
            continue
        used = k + 1
        height = 0.5 * (first.speed - second.speed) * (second.middle - first.middle)
        start, end = np.searchsorted(time, [first.start, second.end])
        rides.append(Ride(int(start), int(end), height))
    return tuple(rides)


def _find_pulses(time: Floats, gyro: Floats, accel: Floats) -> Iterator[_Pulse]:
    instants = np.arange(time[0] + 0.5 * _MEAN_S, time[-1] - 0.5 * _MEAN_S, _STEP_S)
    if len(instants) < _MIN_STILL_S / _STEP_S:
        return
    rates, forces = (_window_means(time, values, instants) for values in (gyro, accel))
    known = np.isfinite(rates).all(axis=1) & np.isfinite(forces).all(axis=1)
    if not known.any():
        return
    off = np.linalg.norm(rates - np.median(rates[known], axis=0), axis=1)
    for first, end in _runs(known & (off < _MAX_RATE_RAD_S), _MIN_STILL_S):
        force = forces[first:end]
        usual = np.median(force, axis=0)
        size = float(np.linalg.norm(usual))
        if size == 0.0:
            continue
        along = force @ (usual / size)
        across = np.sqrt(np.maximum((force**2).sum(axis=1) - along**2, 0.0))
        push = along - size
        is_pulse = (np.abs(push) > _MIN_PULSE_M_S2) & (
            across < _MAX_ACROSS[0] + _MAX_ACROSS[1] * np.abs(push)
        )
        for sign in (1.0, -1.0):
            for a, b in _runs(is_pulse & (sign * push > 0.0), _MIN_PULSE_S):
                part, at = push[a:b], instants[first + a : first + b]
                speed = float(part.sum()) * _STEP_S
                if abs(speed) > _MIN_SPEED_M_S and np.abs(part).max() > _MIN_TOP_M_S2:
                    middle = float((at * part).sum() / part.sum())
                    yield _Pulse(float(at[0]), float(at[-1]), middle, speed)


def _window_means(time: Floats, values: Floats, instants: Floats) -> Floats:
    """Return the means of all samples within 0.1 s of each instant."""
    values = np.where(np.abs(values) <= _MAX_SAMPLE, values, np.nan)
    total = np.vstack([np.zeros(3), np.cumsum(np.nan_to_num(values), axis=0)])
    count = np.concatenate([[0], np.cumsum(np.isfinite(values).all(axis=1))])
    first, end = (np.searchsorted(time, instants + half * _MEAN_S) for half in (-0.5, 0.5))
    with np.errstate(invalid="ignore", divide="ignore"):
        means: Floats = (total[end] - total[first]) / (count[end] - count[first])[:, np.newaxis]
    return means


def _runs(holds: Booleans, seconds: float) -> list[tuple[int, int]]:
    """Return start and end (exclusive) of runs of True that last at least so many seconds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(np.int8)))
    runs: npt.NDArray[np.intp] = edges.reshape(-1, 2)
    return [(int(a), int(b)) for a, b in runs if (b - a) * _STEP_S >= seconds]


def describe_rides(rides: tuple[Ride, ...], time: Floats) -> Iterator[str]:
    """Yield a note for each ride."""
    for ride in rides:
        way = "up" if ride.height > 0.0 else "down"
        end = time[min(ride.end, len(time) - 1)]
        yield (
            f"it seems to ride a lift from {time[ride.start]:.0f} to {end:.0f} s, "
            f"{abs(ride.height):.0f} m {way}, which is not in the track"
        )


def ride_variance(rides: tuple[Ride, ...], n: int) -> Floats:
    """Return the height variance from rides that the track leaves out, m², shape (n,)."""
    variance = np.zeros(n)
    for ride in rides:
        variance[ride.start :] += ride.height**2
    return variance
