"""Prior and correction of a gyro from a calibration, for compiled classes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from zerorate.types import Floats
from zerorate.units import convert

if TYPE_CHECKING:
    from zerorate.calibration.calibration import Calibration

_MATRIX_DRIFT_SIGMA = 1e-3
"""Standard deviation of the change of scale and misalignment since a calibration, relative."""


def gyro_prior(calibration: Calibration, unit: str) -> tuple[Floats, Floats, Floats]:
    """Return bias, matrix and the standard deviations of its elements for samples in a unit.

    The matrix is M in ``rate = M (gyro - bias)``.

    Raises
    ------
    ValueError
        If this unit does not match the calibration's.
    """
    gyro = calibration.gyro
    try:
        scale = convert(1.0, gyro.raw_unit, unit)
        output = convert(1.0, gyro.unit, unit)
    except ValueError as error:
        raise ValueError(
            f"the calibration is for a gyro in {gyro.raw_unit}, this one is in {unit}: apply "
            "the calibration to the samples, and leave bias out"
        ) from error
    sigmas = np.array([[element.sigma for element in row] for row in gyro.matrix])
    return (
        np.array(gyro.bias) * scale,
        gyro.correction * output / scale,
        np.hypot(np.minimum(sigmas * scale / output, 0.1), _MATRIX_DRIFT_SIGMA),
    )


def gyro_correction(calibration: Calibration, name: str) -> Floats:
    """Return C in ``rate = C (sample - bias)``, shape (3, 3).

    Samples and rates have the same unit. `name` is the name of their source, for the message.

    Raises
    ------
    ValueError
        If the unit of the samples is not an angular rate.
    """
    gyro = calibration.gyro
    try:
        scale = convert(1.0, gyro.raw_unit, gyro.unit)
    except ValueError as error:
        raise ValueError(
            f"{name} is for samples in {gyro.raw_unit}, whose size the array does not know: apply "
            f"each calibration to its samples, and omit calibrations"
        ) from error
    correction: Floats = gyro.correction / scale
    return correction
