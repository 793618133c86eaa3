"""Conversion of a calibration to the axes of another frame, and the rotation between the sensors.

In axes f' = R f a matrix A becomes A R^T. The frame defines R: A R^T is lower triangular ("x"),
upper triangular ("z") or symmetric. A small change of A rotates R by Exp(d). Three linear equations
give d, and all errors are propagated through it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.calibration.parameters import (
    ACCEL_MATRIX,
    G_SENSITIVITY,
    GYRO_MATRIX,
    Frame,
    Vector,
    make_coefficient,
)
from zerorate.faults import ArgumentError
from zerorate.geometry.rotations import cross_matrices, from_matrices, to_rotation_vectors
from zerorate.noise.coefficient import UNKNOWN_COEFFICIENT
from zerorate.types import Booleans, Floats

if TYPE_CHECKING:
    from zerorate.calibration.calibration import Calibration

_MATRICES: Final = (ACCEL_MATRIX, GYRO_MATRIX, G_SENSITIVITY)
_ZERO_ELEMENTS: Final = {"x": ((0, 1), (0, 2), (1, 2)), "z": ((1, 0), (2, 0), (2, 1))}
"""Elements of the accelerometer's matrix that are zero in each frame."""

_OFF_DIAGONAL: Final = ((0, 1), (0, 2), (1, 2))
_MIN_DEPENDENCE: Final = 0.1
"""Derivative, relative to the scales, above which a parameter depends on another one."""


def rotation_into_frame(matrix: Floats, frame: Frame) -> Floats:
    """Return the rotation of an accelerometer's matrix into the axes of a frame, shape (3, 3).

    Raises
    ------
    ValueError
        If the determinant of the matrix is not positive: the sensor's axes are left-handed.
    """
    if not np.linalg.det(matrix) > 0.0:
        raise ValueError(
            "the axes of a sensor are left-handed: one sign is wrong, so there is no rotation "
            "into another frame"
        )
    if frame == "symmetric":
        left, _, right = np.linalg.svd(matrix)
        return np.asarray(left @ right)
    order = slice(None, None, 1 if frame == "x" else -1)
    reordered = matrix[order, order]
    lower = np.linalg.cholesky(reordered @ reordered.T)
    return np.asarray(np.linalg.solve(lower, reordered)[order, order])


def convert_frame(calibration: Calibration, frame: Frame) -> Calibration:
    """Return a calibration in the axes of a frame; the same object if it already has them."""
    if frame not in ("x", "z", "symmetric"):
        raise ArgumentError("frame", f"must be 'x', 'z' or 'symmetric', got {frame!r}")
    if frame == calibration.frame:
        return calibration
    values = calibration.values
    rotation = rotation_into_frame(values[ACCEL_MATRIX].reshape(3, 3), frame)
    rotated = _rotate_values(values, rotation, frame)
    jacobian = _jacobian(rotated, rotation, frame)
    covariance = jacobian @ calibration.covariance @ jacobian.T
    identifiable = _find_identifiable(jacobian, calibration)
    for i, j in _ZERO_ELEMENTS.get(frame, ()):
        covariance[3 * i + j] = covariance[:, 3 * i + j] = 0.0
        identifiable[3 * i + j] = True
    return replace(
        calibration,
        values=rotated,
        covariance=0.5 * (covariance + covariance.T),
        identifiable=identifiable,
        frame=frame,
        rests=tuple(replace(r, direction=rotation @ r.direction) for r in calibration.rests),
        turns=tuple(replace(t, axis=rotation @ t.axis) for t in calibration.turns),
    )


def _rotate_values(values: Floats, rotation: Floats, frame: Frame) -> Floats:
    rotated = values.copy()
    for block in _MATRICES:
        rotated[block] = (values[block].reshape(3, 3) @ rotation.T).ravel()
    if frame == "symmetric":
        accel = rotated[ACCEL_MATRIX].reshape(3, 3)
        rotated[ACCEL_MATRIX] = (0.5 * (accel + accel.T)).ravel()
    for i, j in _ZERO_ELEMENTS.get(frame, ()):
        rotated[3 * i + j] = 0.0
    return rotated


def _jacobian(rotated: Floats, rotation: Floats, frame: Frame) -> Floats:
    """Return the derivative of the converted parameters by the old ones, shape (33, 33)."""
    jacobian = np.eye(33)
    angles = _angle_jacobian(rotated[ACCEL_MATRIX].reshape(3, 3), rotation, frame)
    for block in _MATRICES:
        jacobian[block, block] = np.kron(np.eye(3), rotation)
        jacobian[block, ACCEL_MATRIX] -= _jacobian_by_angles(rotated[block].reshape(3, 3)) @ angles
    return jacobian


def _angle_jacobian(rotated: Floats, rotation: Floats, frame: Frame) -> Floats:
    """Return the derivative of the rotation into a frame by the old matrix, d by dA, (3, 9).

    It follows from dA' = dA R^T - A' [d]x: three elements of dA' are zero in the frame.
    """
    plain = np.kron(np.eye(3), rotation)
    by_angles = _jacobian_by_angles(rotated)
    if frame == "symmetric":
        parts = np.zeros((3, 9))
        for row, (i, j) in enumerate(_OFF_DIAGONAL):
            parts[row, 3 * i + j], parts[row, 3 * j + i] = 1.0, -1.0
    else:
        parts = np.eye(9)[[3 * i + j for i, j in _ZERO_ELEMENTS[frame]]]
    return np.asarray(np.linalg.solve(parts @ by_angles, parts @ plain))


def _jacobian_by_angles(matrix: Floats) -> Floats:
    """Return the derivative of M [d]x by d, row by row, shape (9, 3)."""
    return np.stack([(matrix @ cross).ravel() for cross in cross_matrices(np.eye(3))], axis=1)


def _find_identifiable(jacobian: Floats, calibration: Calibration) -> Booleans:
    """Return the mask of parameters that depend only on parameters that the record determines."""
    scales = _parameter_scales(calibration.values)
    depends_on = np.abs(jacobian) * scales[np.newaxis, :] > _MIN_DEPENDENCE * scales[:, np.newaxis]
    return np.asarray(~(depends_on & ~calibration.identifiable[np.newaxis, :]).any(axis=1))


def _parameter_scales(values: Floats) -> Floats:
    """Return the scale of each parameter's sensor; 1 for biases, which do not rotate."""
    scales = np.ones(33)
    for block in (ACCEL_MATRIX, GYRO_MATRIX):
        scales[block] = np.abs(np.linalg.det(values[block].reshape(3, 3))) ** (1.0 / 3.0)
    scales[G_SENSITIVITY] = scales[GYRO_MATRIX]
    return scales


def gyro_to_accel(calibration: Calibration) -> Vector:
    """Return the rotation vector of C in v_accel = C v_gyro, with its errors, rad.

    The axes of a sensor are the axes in which its matrix is lower triangular: A = L Q_a, W = L'
    Q_g, C = Q_a Q_g^T.
    """
    first = convert_frame(calibration, "x")
    matrix = first.values[GYRO_MATRIX].reshape(3, 3)
    if not np.linalg.det(matrix) > 0.0:
        return UNKNOWN_COEFFICIENT, UNKNOWN_COEFFICIENT, UNKNOWN_COEFFICIENT
    rotation = rotation_into_frame(matrix, "x")
    vector = -to_rotation_vectors(from_matrices(rotation[np.newaxis]))[0]
    # C = Q^T, and the transpose of Exp(d) Q is Q^T Exp(-d): this takes the right Jacobian of the
    # logarithm.
    angles = _angle_jacobian(matrix @ rotation.T, rotation, "x")
    by_matrix = -_inverse_right_jacobian(vector) @ angles
    covariance = by_matrix @ first.covariance[GYRO_MATRIX, GYRO_MATRIX] @ by_matrix.T
    depends_on = np.abs(by_matrix) * _parameter_scales(first.values)[GYRO_MATRIX] > _MIN_DEPENDENCE
    known = np.asarray(~(depends_on & ~first.identifiable[GYRO_MATRIX]).any(axis=1))
    sigmas = np.sqrt(np.diagonal(covariance))
    x, y, z = (
        make_coefficient(float(vector[i]), float(sigmas[i]), bool(known[i])) for i in range(3)
    )
    return x, y, z


def _inverse_right_jacobian(vector: Floats) -> Floats:
    """Return d log(C Exp(e)) by de at e = 0, shape (3, 3)."""
    angle = float(np.linalg.norm(vector))
    cross = cross_matrices(vector)
    half = 0.5 * angle
    # The limit at zero is 1/12; above 1e-4 rad the difference keeps eight digits.
    factor = (1.0 - half / np.tan(half)) / angle**2 if angle > 1e-4 else 1.0 / 12.0
    return np.asarray(np.eye(3) + 0.5 * cross + factor * cross @ cross)
