"""What is known of a gyro before its first sample, from whatever knows it."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from zerorate.calibrate.calibration import Calibration
from zerorate.io.missing import floats
from zerorate.types import Floats
from zerorate.units import convert

__all__ = ["gyro_prior"]

_CALIBRATED_MATRIX = 1e-3
"""How far scale and misalignment may have moved since a calibration."""

Prior = tuple[Floats, Floats | None, Floats | None, Floats | None]


@runtime_checkable
class _Knows(Protocol):
    """A filter that has learned biases."""

    @property
    def bias(self) -> npt.ArrayLike: ...
    @property
    def bias_sigma(self) -> npt.ArrayLike: ...


def gyro_prior(
    given: Calibration | _Knows | npt.ArrayLike, sigma: npt.ArrayLike | None, gyro_unit: str
) -> Prior:
    """Return bias, its deviation, the matrix of the gyro and the deviation of its elements.

    What is not known is None. The matrix is M in ``rate = M (gyro - bias)``.

    Parameters
    ----------
    given : Calibration, DriftFilter or array_like, shape (3,)
        A `DriftFilter` of three channels, in the unit of the gyro.
    sigma : array_like, shape () or (3,), optional
        Deviation of the bias, in place of what is known of it.
    gyro_unit : str
        Unit of the gyro's samples, of the bias and of its deviation.

    Raises
    ------
    ValueError
        If a shape is wrong, or the calibration is for samples of another kind of unit.
    """
    if isinstance(given, Calibration):
        return _calibrated(given, sigma, gyro_unit)
    bias_sigma = _known(given, sigma)
    return _axes("bias", _bias(given)), bias_sigma, None, None


def _calibrated(given: Calibration, sigma: npt.ArrayLike | None, gyro_unit: str) -> Prior:
    gyro = given.gyro
    try:
        scale = convert(1.0, gyro.raw_unit, gyro_unit)
        output = convert(1.0, gyro.unit, gyro_unit)
    except ValueError as error:
        raise ValueError(
            f"the calibration is for a gyro in {gyro.raw_unit}, this one is in {gyro_unit}: apply "
            "the calibration to the samples, and leave bias out"
        ) from error
    deviations = np.array([[element.sigma for element in row] for row in gyro.matrix])
    matrix = gyro.correction * output / scale
    return (
        np.array(gyro.bias) * scale,
        None if sigma is None else _axes("bias_sigma", sigma),
        matrix,
        np.hypot(np.minimum(deviations * scale / output, 0.1), _CALIBRATED_MATRIX),
    )


def _bias(given: _Knows | npt.ArrayLike) -> npt.ArrayLike:
    return given.bias if isinstance(given, _Knows) else given


def _known(given: object, sigma: npt.ArrayLike | None) -> Floats | None:
    if sigma is not None:
        return _axes("bias_sigma", sigma)
    known = getattr(given, "bias_sigma", None)
    if known is None:
        return None
    deviation = _axes("bias_sigma", known)
    # A filter that has seen nothing knows nothing.
    return deviation if np.all(deviation > 0.0) else None


def _axes(name: str, given: npt.ArrayLike) -> Floats:
    values = floats(given, name)
    if values.shape == () and name == "bias_sigma":
        values = np.full(3, float(values))
    if values.shape != (3,):
        raise ValueError(f"{name} must have shape (3,), got {values.shape}")
    return values
