"""Sessions of poses and turns, spoilt or seen in other axes, and what calibration makes of them."""

from functools import cache

import numpy as np

import zerorate as zr


@cache
def session(poses=20, seed=5):
    """A simulated session of an ordinary consumer device, made once."""
    return zr.simulation.simulate_session(poses, seed=seed)


@cache
def calibration(poses=20, seed=5):
    """What it gives, computed once."""
    return zr.calibrate(session(poses, seed).recording)


def with_data(recording, gyro=None, accel=None, gyro_unit=None, accel_unit=None, start=0.0):
    """The recording with other samples, units or start."""
    changed = (("gyro", gyro, gyro_unit), ("accel", accel, accel_unit))
    logs = {name: log(recording[name], data, unit, start) for name, data, unit in changed}
    return zr.Recording(logs)


def log(old, data=None, unit=None, start=0.0):
    return zr.Log(
        old.time + start,
        old.rate,
        old.data if data is None else data,
        old.names,
        unit or old.unit,
        old.meta,
    )


def sigmas(found):
    return np.sqrt(np.diagonal(found.covariance))


def deviations(found, truth):
    """Errors of all parameters that are not fixed, in standard errors."""
    sigma = sigmas(found)
    free = sigma > 0.0
    return (found.values - truth.values)[free] / sigma[free]
