"""Detection of a steady gyro rate while the accelerometer shows no motion."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from zerorate.faults import Argument, keyword_argument, make_sentence
from zerorate.record.log import Log
from zerorate.types import Floats
from zerorate.units import UNITS, convert

_MIN_RATE_RAD_S: Final = math.radians(10.0)
"""Largest rate that filters accept as a bias, rad/s."""
_MAX_RATE_CHANGE_RAD_S: Final = math.radians(1.0)
_MAX_FORCE_CHANGE_M_S2: Final = 0.15
"""Largest change of the second means of force, m/s^2, for a tilt below a degree."""
_MIN_SECONDS: Final = 5


class SteadyRate(NamedTuple):
    """Rate that only the gyro shows: its size, rad/s, and a sentence."""

    size: float
    text: str


def detect_steady_rate(gyro: Log, accel: Log) -> SteadyRate | None:
    """Return a rate above 10 deg/s that only the gyro shows; None without one.

    It is a bias, or a rotation about the vertical, which no accelerometer shows. `check` tests
    units, from motion.

    Parameters
    ----------
    gyro, accel : Log
        Sensors of three axes in known units; otherwise the result is None.
    """
    rates, forces = (
        _second_means(gyro, "rate", "rad/s"),
        _second_means(accel, "acceleration", "m/s^2"),
    )
    if min(len(rates), len(forces)) < _MIN_SECONDS:
        return None
    rate = np.median(rates, axis=0)
    size = float(np.linalg.norm(rate))
    if size < _MIN_RATE_RAD_S or _largest_change(rates) > _MAX_RATE_CHANGE_RAD_S:
        return None
    if _largest_change(forces) > _MAX_FORCE_CHANGE_M_S2:
        return None
    text = make_sentence(
        f"{', '.join(gyro.names)}: {math.degrees(size):.1f} deg/s throughout, while the "
        f"accelerometer shows no motion: {_cause(rate, forces)}",
        "; for a bias, give ",
        bias_limit_advice(size),
    )
    return SteadyRate(size, text)


def _cause(rate: Floats, forces: Floats) -> str:
    up = np.median(forces, axis=0)
    up = up / max(float(np.linalg.norm(up)), 1e-9)
    level = float(np.linalg.norm(rate - up * (rate @ up)))
    return "a bias" if level > _MAX_RATE_CHANGE_RAD_S else "a bias, or a rate table"


def bias_limit_advice(size: float) -> Argument:
    """Return the argument that declares a rate of this size, rad/s, as a bias."""
    limit = math.ceil(math.degrees(size) * 1.2 / 5.0) * 5
    return keyword_argument("bias_limit", str(limit), f"bias_limit=math.radians({limit})")


def _second_means(log: Log, kind: str, unit: str) -> Floats:
    """Return the means of whole seconds, shape (k, 3), in SI; empty for an unknown unit."""
    if log.channels != 3 or log.unit not in UNITS or UNITS[log.unit].kind != kind:
        return np.empty((0, 3))
    length = max(round(log.rate), 1)
    count = log.n // length
    data = convert(log.data[: count * length], log.unit, unit).reshape(count, length, 3)
    means: Floats = data[np.isfinite(data).all(axis=(1, 2))].mean(axis=1)
    return means


def _largest_change(means: Floats) -> float:
    return float(np.linalg.norm(means - np.median(means, axis=0), axis=1).max())
