"""Parameters of a calibration: names, indices in its arrays, and conversion to coefficients."""

from __future__ import annotations

from itertools import product
from typing import Final, Literal

from zerorate.noise.coefficient import Coefficient

Frame = Literal["x", "z", "symmetric"]
Vector = tuple[Coefficient, Coefficient, Coefficient]
Matrix = tuple[Vector, Vector, Vector]

_AXES: Final = "xyz"
_VECTOR: Final = tuple(_AXES)
_MATRIX: Final = tuple(map("".join, product(_AXES, _AXES)))

PARAMETERS: Final = (
    *(f"accel.matrix.{axes}" for axes in _MATRIX),
    *(f"accel.bias.{axis}" for axis in _VECTOR),
    *(f"gyro.matrix.{axes}" for axes in _MATRIX),
    *(f"gyro.bias.{axis}" for axis in _VECTOR),
    *(f"gyro.g_sensitivity.{axes}" for axes in _MATRIX),
)
"""Names of all parameters, in the order of `Calibration.values`; matrices row by row."""

ACCEL_MATRIX: Final = slice(0, 9)
ACCEL_BIAS: Final = slice(9, 12)
GYRO_MATRIX: Final = slice(12, 21)
GYRO_BIAS: Final = slice(21, 24)
G_SENSITIVITY: Final = slice(24, 33)


def make_coefficient(value: float, sigma: float, identifiable: bool) -> Coefficient:
    """Return an estimate; if not identifiable, with the bound that follows from its error."""
    known = Coefficient(value, sigma)
    return known if identifiable else Coefficient(value, sigma, False, known.upper_bound)
