"""Wheels of a simulated drive: speeds with scale error, noise, ticks and slips."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.geometry.rotations import inverse, rotate
from zerorate.simulation.drive import SimulatedDrive
from zerorate.simulation.gyro import check_not_negative, check_whole
from zerorate.simulation.hand import check_shape
from zerorate.types import Floats

_SLIP_DURATION_S = (0.5, 2.0)
"""Shortest and longest slip, s."""
_SLIP_FACTORS = (-0.4, 0.3)
"""Relative speed errors of a slipping wheel."""


def wheel_speeds(
    drive: SimulatedDrive,
    rate: float = 10.0,
    *,
    scale: float = 0.0,
    sigma: float = 0.1,
    tick: float = 0.0,
    slips: int = 0,
    axle: npt.ArrayLike = (0.0, 0.0, 0.0),
    yaw: float = 0.0,
    seed: int = 0,
) -> Floats:
    """Return the wheel speeds of a simulated drive, for ``NavigationFilter.process``.

    Parameters
    ----------
    drive : SimulatedDrive
        Simulated drive of n samples.
    rate : float
        Rate of the readings, Hz. Samples without a reading are NaN.
    scale : float
        Scale error: the true speed is (1 + scale) times the measured speed.
    sigma : float
        Standard deviation of the white noise, m/s.
    tick : float
        Distance per tick, m. The speed is rounded to ticks. 0 means no rounding.
    slips : int
        Number of slips. Each slip lasts 0.5 to 2 s, and the wheel is 40 % too slow or 30 % too
        fast.
    axle : array_like, shape (3,)
        Vector from the inertial sensors to the axle, m forward, right, down.
    yaw : float
        Angle from the sensors' x axis to the rolling direction, positive to the right, rad.
    seed : int
        Seed of the noise and the slips.

    Returns
    -------
    ndarray, shape (n,)
        Forward speeds, m/s.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=60.0, seed=1)
    >>> speeds = zr.simulation.wheel_speeds(drive, scale=0.02)
    >>> speeds.shape, bool(abs(speeds[::10]).max() > 5.0)
    ((6000,), True)
    """
    if not 0.0 < rate <= drive.rate:
        raise ArgumentError("rate", f"must be above 0 and {drive.rate:g} Hz at most, got {rate}")
    noise, tick_length = check_not_negative("sigma", sigma), check_not_negative("tick", tick)
    random = np.random.default_rng(check_whole("seed", seed, 0))
    forward = _rolling_speed(drive, scale, axle, yaw)
    at = np.unique(np.rint(np.arange(0.0, len(drive.time), drive.rate / rate)).astype(np.int64))
    at = at[at < len(drive.time)]
    speed = forward[at] + noise * random.standard_normal(at.size)
    _slip(drive.time[at], speed, check_whole("slips", slips, 0), random)
    if tick_length > 0.0:
        speed = (
            tick_length
            * rate
            * np.floor(speed / (tick_length * rate) + random.uniform(size=at.size))
        )
    speeds = np.full(len(drive.time), np.nan)
    speeds[at] = speed
    return speeds


def wheel_ticks(
    drive: SimulatedDrive,
    tick: float = 0.03,
    *,
    scale: float = 0.0,
    slips: int = 0,
    axle: npt.ArrayLike = (0.0, 0.0, 0.0),
    yaw: float = 0.0,
    seed: int = 0,
) -> Floats:
    """Return the number of ticks counted at each sample, for ``Wheels.of_ticks``.

    Parameters
    ----------
    drive : SimulatedDrive
        Simulated drive of n samples.
    tick : float
        Stated distance per tick, m.
    scale, slips, axle, yaw, seed
        As in `wheel_speeds`.

    Returns
    -------
    ndarray, shape (n,)
        Tick counts from the start, as whole numbers.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=60.0, seed=1)
    >>> count = zr.simulation.wheel_ticks(drive, scale=0.02)
    >>> wheels = zr.navigation.Wheels.of_ticks(drive.time, count, tick=0.03)
    >>> bool(abs(wheels.speed).max() > 5.0)
    True
    """
    if not tick > 0.0:
        raise ArgumentError("tick", f"must be above 0, got {tick}")
    random = np.random.default_rng(check_whole("seed", seed, 0))
    speed = _rolling_speed(drive, scale, axle, yaw)
    _slip(drive.time, speed, check_whole("slips", slips, 0), random)
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(drive.time)
    distance = np.concatenate([[0.0], np.cumsum(steps)])
    ticks: Floats = np.floor(distance / tick + random.uniform())
    return ticks


def _rolling_speed(drive: SimulatedDrive, scale: float, axle: npt.ArrayLike, yaw: float) -> Floats:
    """Return the noise-free speed of the wheels at each sample, m/s."""
    if not abs(scale) <= 0.5:
        raise ArgumentError("scale", f"must be within 0.5, got {scale}")
    velocity = rotate(inverse(drive.truth_quaternion), drive.truth_velocity)
    velocity = velocity + np.cross(drive.rates(), check_shape("axle", axle, (3,)))
    forward: Floats = math.cos(yaw) * velocity[:, 0] + math.sin(yaw) * velocity[:, 1]
    return forward / (1.0 + scale)


def _slip(time: Floats, speed: Floats, count: int, random: np.random.Generator) -> None:
    """Add `count` random slips of a wheel to its speed, in place."""
    for _ in range(count):
        first = random.uniform(time[0], time[-1])
        last = first + random.uniform(*_SLIP_DURATION_S)
        speed[(time >= first) & (time < last)] *= 1.0 + random.choice(_SLIP_FACTORS)
