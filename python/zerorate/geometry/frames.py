"""Earth frames, and conversion of orientations between them."""

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
"""Quaternion from each earth frame to east, north, up."""


def in_enu(quaternions: Floats, frame: Frame) -> Floats:
    """Convert orientations from sensor-to-`frame` to sensor-to-ENU (east, north, up)."""
    return product(np.array(FRAMES[frame]), quaternions)


def from_enu(quaternions: Floats, frame: Frame) -> Floats:
    """Convert orientations from sensor-to-ENU (east, north, up) to sensor-to-`frame`."""
    return product(inverse(np.array(FRAMES[frame])), quaternions)
