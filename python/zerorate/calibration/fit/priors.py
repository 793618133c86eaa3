"""Start of the fit: from the data sheet, or from gravity and rotations if units are unknown."""

from __future__ import annotations

from itertools import permutations, product
from typing import Final, Literal

import numpy as np

from zerorate.calibration.fit.joint_fit import (
    DATASHEET_SPREAD,
    WIDE_SPREAD,
    Prior,
    forces,
    vector_norms,
)
from zerorate.calibration.fit.sensors import STANDARD_GRAVITY
from zerorate.calibration.fit.solution import Record, Sensors, compute_errors
from zerorate.geometry.rotations import cross_matrices
from zerorate.record.log import LogError
from zerorate.types import Floats

PriorName = Literal["datasheet", "wide"]

_WINDOW_S: Final = 0.15
_MAX_GRAVITY_ERROR: Final = 0.08
_MIN_POSES: Final = 9
_MAX_SCALE_RATIO: Final = 1.5
"""Largest ratio between the scales of an accelerometer's axes."""

_MIN_SPREAD: Final = 0.02
"""Smallest spread of the poses as a share of their size, and smallest ratio of their spreads in the
worst and the best direction.
"""

_GRAVITY_RANGE: Final = (0.8, 1.2)
"""Range of the accelerometer's size at rest if its unit is right, in units of gravity."""

_SIGN_CHOICES: Final = tuple(product((1.0, -1.0), repeat=3))

_MAX_MISS_SHARE: Final = 0.15
"""Largest error angle of propagated gravity with the right axes, as a share of the rotation."""


def choose_prior(record: Record, name: PriorName) -> Prior:
    """Return the prior of both sensors: a data sheet's, or an estimate from the record.

    Raises
    ------
    LogError
        If poses or rotations are too few to find unknown units, or the gyro follows gravity only in
        a different unit.
    """
    accel, bias, gyro = np.eye(3), np.zeros(3), np.eye(3)
    if not record.accel.known:
        accel, bias = _fit_ellipsoid(record.accel_means)
    if not record.gyro.known:
        gyro = _fit_gyro_matrix(record, accel, bias)
    elif record.accel.known:
        gyro = _find_axes(record)
    accel_spread, gyro_spread = (
        DATASHEET_SPREAD if sensor.known and name == "datasheet" else WIDE_SPREAD
        for sensor in (record.accel, record.gyro)
    )
    return Prior(accel, bias, gyro, accel_spread, gyro_spread)


def nominal_sensors(record: Record, prior: Prior) -> Sensors:
    """Return both sensors before calibration: one scale each, without errors.

    For an accelerometer of unknown unit, the scale follows from the sphere through the poses.
    """
    accel, _ = prior.sizes
    bias, matrix = np.zeros(3), np.eye(3)
    if not record.accel.known:
        bias, accel = _fit_sphere(record.accel_means)
    if not record.gyro.known:
        matrix = prior.gyro
    return Sensors(accel * np.eye(3), bias, matrix, np.zeros((3, 3)))


def _fit_ellipsoid(means: Floats) -> tuple[Floats, Floats]:
    """Return A and b_a of the ellipsoid, or else the sphere, through the means at rests."""
    if len(means) < _MIN_POSES:
        raise LogError(
            f"the unit of the accel is not known, and finding it takes {_MIN_POSES} poses, "
            f"got {len(means)}; give the unit, or more poses"
        )
    centre, radius = _fit_sphere(means)
    x, y, z = ((means - centre) / radius).T
    design = np.stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z, x, y, z], axis=1)
    solution, _, rank, _ = np.linalg.lstsq(design, np.ones(len(means)), rcond=1e-6)
    quadric = solution[[0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(3, 3)
    if rank == 9 and np.linalg.eigvalsh(quadric)[0] > 0:
        middle = -0.5 * np.linalg.solve(quadric, solution[6:])
        shape = quadric / (1.0 + middle @ quadric @ middle)
        semi_axes = np.linalg.eigvalsh(shape) ** -0.5
        if semi_axes.max() < _MAX_SCALE_RATIO * semi_axes.min():
            accel = radius * np.linalg.cholesky(np.linalg.inv(shape))
            return accel, centre + radius * middle
    return radius * np.eye(3), centre


def _fit_sphere(means: Floats) -> tuple[Floats, float]:
    """Return the centre and radius of the sphere through the means at rests."""
    level = means.mean(axis=0)
    spread = max(float(np.linalg.norm(means - level, axis=1).max()), np.finfo(float).tiny)
    points = (means - level) / spread
    design = np.column_stack((2.0 * points, np.ones(len(means))))
    solution, _, rank, values = np.linalg.lstsq(design, (points**2).sum(axis=1), rcond=None)
    square = solution[3] + solution[:3] @ solution[:3]
    is_degenerate = spread < _MIN_SPREAD * float(np.linalg.norm(means, axis=1).max())
    if is_degenerate or rank < 4 or values[-1] < _MIN_SPREAD * values[0] or square <= 0:
        raise LogError(
            "the unit of the accel is not known, and the poses are too close to find it; give the "
            "unit, or hold each axis up and down"
        )
    return level + spread * solution[:3], spread * float(np.sqrt(square))


def _fit_gyro_matrix(record: Record, accel: Floats, bias: Floats) -> Floats:
    """Return M with the best fit to the motion of gravity, u(t + h) - u(t) = sum of u x M z dt."""
    gyro = record.gyro
    width = max(2, round(_WINDOW_S * gyro.rate))
    level = np.median(record.gyro_means, axis=0)
    rows, changes = [], []
    for turn, raw in zip(record.turns, record.forces, strict=True):
        first, last = turn.first, turn.last
        force = forces(raw, accel, bias)
        size = vector_norms(force)
        up = force / size[:, np.newaxis]
        # u x M z = [u]x M z, linear in the elements of M.
        z = (gyro.data[first:last] - level)[:, np.newaxis, np.newaxis] / gyro.rate
        products = (cross_matrices(up)[:, :, :, np.newaxis] * z).reshape(-1, 3, 9)
        for start in range(0, last - first - width, width):
            part = slice(start, start + width)
            if (np.abs(size[start : start + width + 1] - 1.0) < _MAX_GRAVITY_ERROR).all():
                ends = 0.5 * (products[start] + products[start + width])
                rows.append(products[part].sum(axis=0) - products[start] + ends)
                changes.append(up[start + width] - up[start])
    if len(rows) * 3 < 27:
        raise LogError(
            "the unit of the gyro is not known, and the rotations are too few or too fast to find "
            "it; give the unit, or rotate more slowly"
        )
    solution, _, rank, values = np.linalg.lstsq(
        np.concatenate(rows), np.concatenate(changes), rcond=None
    )
    singular = np.linalg.svd(solution.reshape(3, 3), compute_uv=False)
    if rank < 9 or values[-1] < 1e-3 * values[0] or not singular[-1] > 1e-3 * singular[0]:
        raise LogError(
            "the unit of the gyro is not known, and the rotations are about too few axes to find "
            "it; give the unit, or rotate about x, y and z"
        )
    return np.asarray(solution.reshape(3, 3))


def _typical_miss(record: Record, matrix: Floats) -> float:
    """Return the median error angle of propagated gravity, as a share of the rotation."""
    # A wrong unit makes many turns of one. The error angle is bounded, so the angle is bounded
    # here.
    nominal = Sensors(np.eye(3), np.zeros(3), matrix, np.zeros((3, 3)))
    _, miss, turns = compute_errors(record, nominal)
    return float(np.median(miss / turns.angles.clip(0.1, 2.0)))


def _find_axes(record: Record) -> Floats:
    """Return the axes of the gyro that follow gravity: its own, or a signed permutation of them."""
    if not record.turns or _typical_miss(record, np.eye(3)) < _MAX_MISS_SHARE:
        return np.eye(3)
    for unit, factor in (("deg/s", np.pi / 180.0), ("rad/s", 180.0 / np.pi)):
        if unit != record.gyro.unit and _typical_miss(record, factor * np.eye(3)) < _MAX_MISS_SHARE:
            raise LogError(
                f"the gyro does not follow gravity in {record.gyro.unit}, its stated unit; it "
                f"does in '{unit}'"
            )
    candidates = [
        np.diag(signs)[list(order)] for order in permutations(range(3)) for signs in _SIGN_CHOICES
    ]
    miss = [_typical_miss(record, matrix) for matrix in candidates]
    best = int(np.argmin(miss))
    return candidates[best] if miss[best] < _MAX_MISS_SHARE else np.eye(3)


_COUNTS_ADVICE: Final = (
    "if these are raw counts, read them without a unit, or with the scale of their device"
)


def check_gravity(record: Record, gravity: float) -> None:
    """Raise LogError if an accelerometer does not show gravity at rest.

    Raises
    ------
    LogError
        If the size at rest is not gravity; the message names the unit that would fit.
    """
    size = float(np.median(np.linalg.norm(record.accel_means, axis=1)))
    if not record.accel.known or _GRAVITY_RANGE[0] <= size <= _GRAVITY_RANGE[1]:
        return
    raw, unit = size / record.accel.factor, record.accel.unit
    fitting = [
        name
        for name, g in _gravity_by_unit(gravity)
        if _GRAVITY_RANGE[0] <= raw / g <= _GRAVITY_RANGE[1]
    ]
    advice = f"it fits '{fitting[0]}'" if fitting else _COUNTS_ADVICE
    raise LogError(
        f"the accel shows {raw:.4g} {unit} at rest, which is not gravity, "
        f"{1.0 / record.accel.factor:.4g} {unit}; {advice}"
    )


def _gravity_by_unit(gravity: float) -> list[tuple[str, float]]:
    """Return the units and the value of gravity in each."""
    standard = gravity / STANDARD_GRAVITY
    return [("g", standard), ("m/s^2", gravity), ("mg", 1e3 * standard)]
