"""What calibrations of an array's gyros say of their scale and misalignment."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from zerorate.calibrate.calibration import Calibration
from zerorate.types import Floats
from zerorate.units import convert

__all__ = ["gyro_corrections"]


def gyro_corrections(given: Sequence[Calibration | npt.ArrayLike]) -> Floats:
    """Return C in ``rate = C (sample - bias)`` of each sensor, shape (sensors, 3, 3).

    Parameters
    ----------
    given : sequence of Calibration or of array_like, shape (3, 3)
        One a sensor; a matrix is C itself.

    Raises
    ------
    ValueError
        If a calibration is not of samples in a unit of rates, or a matrix has another shape.
    """
    if isinstance(given, Calibration):
        raise ValueError(
            "calibrations must be a sequence of one a sensor, got a single Calibration"
        )
    return np.array([_correction(one, number) for number, one in enumerate(given, 1)])


def _correction(one: Calibration | npt.ArrayLike, number: int) -> Floats:
    if not isinstance(one, Calibration):
        matrix = np.asarray(one, dtype=float)
        if matrix.shape != (3, 3):
            raise ValueError(f"calibration {number} must have shape (3, 3), got {matrix.shape}")
        return matrix
    try:
        scale = convert(1.0, one.gyro.raw_unit, one.gyro.unit)
    except ValueError as error:
        raise ValueError(
            f"calibration {number} is for samples in {one.gyro.raw_unit}, of which the array does "
            "not know how large they are: apply each calibration to its samples, and leave "
            "calibrations out"
        ) from error
    correction: Floats = one.gyro.correction / scale
    return correction
