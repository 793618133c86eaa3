"""True angular rates of moving objects, in deg/s."""

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.record.log import check_rate
from zerorate.types import Floats


def table(rate: float, duration: float, seed: int = 0) -> Floats:
    """Return the rate of a rate table: a sine of 2 deg/s at 0.2 Hz with a random phase.

    Parameters
    ----------
    rate : float
        Sampling rate, Hz.
    duration : float
        Length, s.
    seed : int
        Seed of the phase.

    Returns
    -------
    ndarray, shape (n,)
        True angular rate, deg/s.
    """
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi)
    sine: Floats = 2.0 * np.sin(2.0 * math.pi * 0.2 * _sample_times(rate, duration) + phase)
    return sine


def vehicle(rate: float, duration: float, seed: int = 0) -> Floats:
    """Return the yaw rate of a car in a town: corners and lane changes between straights.

    Every 8 to 20 s the car turns by 30 to 90 deg in 2.5 to 5 s, or changes the lane. A lane change
    is 4 deg and back in 3 s. Each rate is a raised cosine. The driver's corrections add 0.3 deg/s
    (RMS, 1 s). Parameters and result are the same as in `table`.
    """
    rng = np.random.default_rng(seed)
    t = _sample_times(rate, duration)
    yaw = 0.3 * _smooth_noise(rng, t.size, rate, 0.5)
    begin = rng.uniform(2.0, 8.0)
    while begin < duration:
        sign = rng.choice((-1.0, 1.0))
        if rng.random() < 0.5:
            length = rng.uniform(2.5, 5.0)
            yaw += sign * rng.uniform(30.0, 90.0) / length * _bump(t, begin, length)
        else:
            length = 3.0
            swerve = _bump(t, begin, length / 2) - _bump(t, begin + length / 2, length / 2)
            yaw += sign * 4.0 / (length / 2) * swerve
        begin += length + rng.uniform(8.0, 20.0)
    return yaw


def hand(rate: float, duration: float, seed: int = 0) -> Floats:
    """Return the rate of a hand that rotates the sensor: 90 deg/s RMS, mostly below 4 Hz.

    Parameters and result are the same as in `table`.
    """
    rng = np.random.default_rng(seed)
    return 90.0 * _smooth_noise(rng, _sample_times(rate, duration).size, rate, 0.075)


MOTIONS: Final[dict[str, Callable[[float, float, int], Floats]]] = {
    "table": table,
    "vehicle": vehicle,
    "hand": hand,
}


def _sample_times(rate: float, duration: float) -> Floats:
    hertz = check_rate(rate)
    if not 0.0 < duration < math.inf:
        raise ArgumentError("duration", f"must be positive and finite, got {duration}")
    return np.arange(max(round(duration * hertz), 1)) / hertz


def _bump(t: Floats, begin: float, length: float) -> Floats:
    """Return a raised cosine with the area `length`."""
    part = np.clip((t - begin) / length, 0.0, 1.0)
    wave: Floats = 1.0 - np.cos(2.0 * math.pi * part)
    return wave


def _smooth_noise(rng: np.random.Generator, n: int, rate: float, width: float) -> Floats:
    """Return noise of variance 1, smoothed by a Gaussian of standard deviation `width`, s."""
    reach = math.ceil(5.0 * width * rate)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / (width * rate)) ** 2)
    kernel /= math.sqrt(float(np.sum(kernel**2)))
    return np.convolve(rng.standard_normal(n + 2 * reach), kernel, "valid")
