"""What the wheels of a simulated drive tell: their speed, with a scale, noise, ticks and slips."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.geometry.rotations import inverse
from zerorate.simulation.drive import SimulatedDrive
from zerorate.simulation.gyro import not_negative, whole
from zerorate.simulation.hand import fixed, turned
from zerorate.types import Floats

__all__ = ["wheel_speeds"]

_SLIPS = (0.5, 2.0)
"""Seconds that a slip lasts."""
_SLIP = (-0.4, 0.3)
"""By how much a wheel that slips is too slow or too fast."""


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
    """Return what wheels tell of a simulated drive, as ``NavigationFilter.process`` takes it.

    Parameters
    ----------
    drive : SimulatedDrive
        Of n samples.
    rate : float
        Hz at which they tell it, at samples; NaN at all others.
    scale : float
        They roll (1 + scale) times as fast as they tell.
    sigma : float
        Deviation of white noise, m/s.
    tick : float
        Way from count to count, m, by which the speed is rounded; 0 for none.
    slips : int
        How often they slip, for 0.5 to 2 s, 40 % too slow or 30 % too fast.
    axle : array_like, shape (3,)
        From the inertial sensors, forward, right, down, m.
    yaw : float
        Of the axis along which they roll, to the right of the sensors' x, rad.
    seed : int
        Of noise and slips.

    Returns
    -------
    ndarray, shape (n,)
        m/s, forward.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=60.0, seed=1)
    >>> told = zr.simulation.wheel_speeds(drive, scale=0.02)
    >>> told.shape, bool(abs(told[::10]).max() > 5.0)
    ((6000,), True)
    """
    if not 0.0 < rate <= drive.rate:
        raise ArgumentError("rate", f"must be above 0 and {drive.rate:g} Hz at most, got {rate}")
    if not abs(scale) <= 0.5:
        raise ArgumentError("scale", f"must be within 0.5, got {scale}")
    noise, way = not_negative("sigma", sigma), not_negative("tick", tick)
    random = np.random.default_rng(whole("seed", seed, 0))
    spin = drive.gyro - drive.gyro_bias
    velocity = turned(inverse(drive.truth_quaternion), drive.truth_velocity)
    velocity = velocity + np.cross(spin, fixed("axle", axle, (3,)))
    forward = math.cos(yaw) * velocity[:, 0] + math.sin(yaw) * velocity[:, 1]
    at = np.unique(np.rint(np.arange(0.0, len(drive.time), drive.rate / rate)).astype(np.int64))
    at = at[at < len(drive.time)]
    speed = forward[at] / (1.0 + scale) + noise * random.standard_normal(at.size)
    for _ in range(whole("slips", slips, 0)):
        first = random.uniform(drive.time[0], drive.time[-1])
        last = first + random.uniform(*_SLIPS)
        speed[(drive.time[at] >= first) & (drive.time[at] < last)] *= 1.0 + random.choice(_SLIP)
    if way > 0.0:
        speed = way * rate * np.floor(speed / (way * rate) + random.uniform(size=at.size))
    found = np.full(len(drive.time), np.nan)
    found[at] = speed
    return found
