"""Magnetic field at a simulated sensor: fields of the earth, a room and a magnet."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.simulation.gyro import check_not_negative
from zerorate.simulation.hand import check_shape
from zerorate.types import Floats

_WANDER_TIME_S: Final = 15.0
"""Correlation time of the field on a path through a room, s."""
_MAGNET_RATIO: Final = (0.5, 0.3)
"""Horizontal and upward field of a near magnet, relative to the earth's field."""
_EDGE_S: Final = 0.2
"""Time in which a magnet approaches or leaves, s."""


def earth_field(norm: float, dip: float) -> Floats:
    """Return the field east, north, up, from its strength in any unit and its dip, rad."""
    if not abs(dip) <= 0.5 * math.pi:
        raise ArgumentError("dip", f"must be from -pi/2 to pi/2, got {dip}")
    return check_not_negative("field", norm) * np.array([0.0, math.cos(dip), -math.sin(dip)])


def draw_room_field(
    angle: float, earth: Floats, rate: float, n: int, random: np.random.Generator
) -> Floats:
    """Draw the disturbance of the field on a path through a room, shape (n, 3).

    Each axis is a Gauss-Markov process. Its standard deviation rotates the horizontal field by
    `angle`.
    """
    size = math.tan(check_not_negative("field_wander", angle)) * math.hypot(*earth[:2])
    keep = math.exp(-1.0 / (_WANDER_TIME_S * rate))
    driven = math.sqrt(1.0 - keep**2) * random.standard_normal((n, 3))
    driven[0] = random.standard_normal(3)
    return size * _markov(driven, keep)


def draw_magnet_field(earth: Floats, random: np.random.Generator) -> Floats:
    """Return the field of a magnet in earth axes: a random horizontal part and an upward part."""
    level, up = _MAGNET_RATIO
    azimuth = random.uniform(0.0, 2.0 * math.pi)
    direction = np.array([level * math.cos(azimuth), level * math.sin(azimuth), up])
    return float(np.linalg.norm(earth)) * direction


def magnet_nearness(seconds: Floats, magnet: Floats) -> Floats:
    """Return the nearness of a magnet at each time, from 0 to 1."""
    near = np.zeros(seconds.size)
    for begin, end in magnet:
        edge = np.minimum(seconds - begin, end - seconds) / _EDGE_S
        near = np.maximum(near, np.clip(edge, 0.0, 1.0))
    return near


def check_spans(magnet: npt.ArrayLike) -> Floats:
    """Return the spans with a near magnet, shape (m, 2). Raises ValueError for invalid spans."""
    intervals = (
        np.zeros((0, 2)) if np.size(magnet) == 0 else check_shape("magnet", magnet, (None, 2))
    )
    if not (intervals[:, 0] < intervals[:, 1]).all():
        raise ArgumentError("magnet", "must be pairs of seconds, each from less to more")
    return intervals


def _markov(driven: Floats, keep: float) -> Floats:
    """Return y = keep y' + driven (y' is the previous sample), in blocks without underflow."""
    block = max(1, int(-20.0 / math.log(keep)) if keep > 0.0 else 1)
    y, last = np.empty_like(driven), np.zeros(driven.shape[1])
    for first in range(0, len(driven), block):
        part = driven[first : first + block]
        powers = keep ** np.arange(1.0, len(part) + 1.0)[:, None]
        y[first : first + block] = powers * (last + np.cumsum(part / powers, axis=0))
        last = y[first + len(part) - 1]
    return y
