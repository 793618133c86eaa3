"""Frames of the earth, and orientations from one to another."""

from __future__ import annotations

import math
from typing import Final, Literal, TypeAlias

import numpy as np

from zerorate.geometry.rotations import inverse, product
from zerorate.types import Floats

Frame: TypeAlias = Literal["enu", "ned", "nwu"]

_SQRT_HALF: Final = math.sqrt(0.5)
FRAMES: Final[dict[Frame, tuple[float, float, float, float]]] = {
    "enu": (1.0, 0.0, 0.0, 0.0),
    "ned": (0.0, _SQRT_HALF, _SQRT_HALF, 0.0),
    "nwu": (_SQRT_HALF, 0.0, 0.0, _SQRT_HALF),
}
"""The quaternion that turns vectors of each frame of the earth into east, north and up."""


def in_enu(quaternions: Floats, frame: Frame) -> Floats:
    """Return orientations from sensor to a frame of the earth as those to east, north and up."""
    return product(np.array(FRAMES[frame]), quaternions)


def from_enu(quaternions: Floats, frame: Frame) -> Floats:
    """Return orientations from sensor to east, north and up as those to a frame of the earth."""
    return product(inverse(np.array(FRAMES[frame])), quaternions)
