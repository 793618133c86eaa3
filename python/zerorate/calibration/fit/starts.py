"""Where the fit starts: at the data sheet, or at what gravity and turns tell of unknown units."""

from __future__ import annotations

from itertools import permutations, product
from typing import Final, Literal

import numpy as np

from zerorate.calibration.fit.joint_fit import DATASHEET, WIDE, Prior, forces, sizes
from zerorate.calibration.fit.sensors import STANDARD_GRAVITY
from zerorate.calibration.fit.solution import Record, Sensors, errors_of
from zerorate.geometry.rotations import cross_matrices
from zerorate.record.log import LogError
from zerorate.types import Floats

PriorName = Literal["datasheet", "wide"]

_WINDOW: Final = 0.15
_NEAR_GRAVITY: Final = 0.08
_FEWEST_POSES: Final = 9
_MOST_UNLIKE: Final = 1.5
"""Largest ratio between the scales of an accelerometer's axes."""

_LEAST_SPREAD: Final = 0.02
"""Of poses, parts of what they show; and in the direction in which they differ least, parts of that
in which they differ most."""

_SIZES: Final = (0.8, 1.2)
"""Of the accelerometer at rest, parts of gravity, in its right unit."""

_SIGNS: Final = tuple(product((1.0, -1.0), repeat=3))

_WRONG: Final = 0.15
"""Miss of carried gravity, parts of the angle turned: no sensor of the right axes is so bad."""


def start_of(record: Record, name: PriorName) -> Prior:
    """Return the prior of a record's sensors: a data sheet, or what the record itself shows.

    Raises
    ------
    LogError
        If poses or turns are too few to find units that are not known, or if the gyro follows
        gravity only in another unit than its own.
    """
    accel, bias, gyro = np.eye(3), np.zeros(3), np.eye(3)
    if not record.accel.known:
        accel, bias = _ellipsoid(record.accel_means)
    if not record.gyro.known:
        gyro = _linear_gyro(record, accel, bias)
    elif record.accel.known:
        gyro = _axes(record)
    of_accel, of_gyro = (
        DATASHEET if one.known and name == "datasheet" else WIDE
        for one in (record.accel, record.gyro)
    )
    return Prior(accel, bias, gyro, of_accel, of_gyro)


def nominal_sensors(record: Record, prior: Prior) -> Sensors:
    """Return both sensors before calibration: of one scale each, without errors.

    Of an accelerometer whose unit is not known that is the sphere through the poses.
    """
    accel, _ = prior.sizes
    bias, matrix = np.zeros(3), np.eye(3)
    if not record.accel.known:
        bias, accel = _sphere(record.accel_means)
    if not record.gyro.known:
        matrix = prior.gyro
    return Sensors(accel * np.eye(3), bias, matrix, np.zeros((3, 3)))


def _ellipsoid(means: Floats) -> tuple[Floats, Floats]:
    """Return A and b_a of the ellipsoid through the means at rests, or of the sphere."""
    if len(means) < _FEWEST_POSES:
        raise LogError(
            f"the unit of the accel is not known, and finding it takes {_FEWEST_POSES} poses, "
            f"got {len(means)}; give the unit, or more poses"
        )
    centre, radius = _sphere(means)
    x, y, z = ((means - centre) / radius).T
    design = np.stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z, x, y, z], axis=1)
    found, _, rank, _ = np.linalg.lstsq(design, np.ones(len(means)), rcond=1e-6)
    quadric = found[[0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(3, 3)
    if rank == 9 and np.linalg.eigvalsh(quadric)[0] > 0:
        middle = -0.5 * np.linalg.solve(quadric, found[6:])
        shape = quadric / (1.0 + middle @ quadric @ middle)
        sizes = np.linalg.eigvalsh(shape) ** -0.5
        if sizes.max() < _MOST_UNLIKE * sizes.min():
            accel = radius * np.linalg.cholesky(np.linalg.inv(shape))
            return accel, centre + radius * middle
    return radius * np.eye(3), centre


def _sphere(means: Floats) -> tuple[Floats, float]:
    """Return centre and radius of the sphere through the means at rests."""
    level = means.mean(axis=0)
    spread = max(float(np.linalg.norm(means - level, axis=1).max()), np.finfo(float).tiny)
    places = (means - level) / spread
    design = np.column_stack((2.0 * places, np.ones(len(means))))
    found, _, rank, values = np.linalg.lstsq(design, (places**2).sum(axis=1), rcond=None)
    square = found[3] + found[:3] @ found[:3]
    alike = spread < _LEAST_SPREAD * float(np.linalg.norm(means, axis=1).max())
    if alike or rank < 4 or values[-1] < _LEAST_SPREAD * values[0] or square <= 0:
        raise LogError(
            "the unit of the accel is not known, and the poses are too alike to find it; give the "
            "unit, or hold each axis up and down"
        )
    return level + spread * found[:3], spread * float(np.sqrt(square))


def _linear_gyro(record: Record, accel: Floats, bias: Floats) -> Floats:
    """Return M that turns gravity as it moves: u(t + h) - u(t) is the sum of u x M z dt."""
    gyro = record.gyro
    width = max(2, round(_WINDOW * gyro.rate))
    level = np.median(record.gyro_means, axis=0)
    rows, moved = [], []
    for turn, raw in zip(record.turns, record.forces, strict=True):
        first, last = turn.first, turn.last
        force = forces(raw, accel, bias)
        size = sizes(force)
        up = force / size[:, np.newaxis]
        # u x M z = [u]x M z, linear in the elements of M.
        z = (gyro.data[first:last] - level)[:, np.newaxis, np.newaxis] / gyro.rate
        each = (cross_matrices(up)[:, :, :, np.newaxis] * z).reshape(-1, 3, 9)
        for start in range(0, last - first - width, width):
            part = slice(start, start + width)
            if (np.abs(size[start : start + width + 1] - 1.0) < _NEAR_GRAVITY).all():
                ends = 0.5 * (each[start] + each[start + width])
                rows.append(each[part].sum(axis=0) - each[start] + ends)
                moved.append(up[start + width] - up[start])
    if len(rows) * 3 < 27:
        raise LogError(
            "the unit of the gyro is not known, and the turns are too few, or too fast, to find "
            "it; give the unit, or turn more slowly"
        )
    found, _, rank, values = np.linalg.lstsq(
        np.concatenate(rows), np.concatenate(moved), rcond=None
    )
    singular = np.linalg.svd(found.reshape(3, 3), compute_uv=False)
    if rank < 9 or values[-1] < 1e-3 * values[0] or not singular[-1] > 1e-3 * singular[0]:
        raise LogError(
            "the unit of the gyro is not known, and the turns are about too few axes to find it; "
            "give the unit, or turn about x, y and z"
        )
    return np.asarray(found.reshape(3, 3))


def _typical_miss(record: Record, matrix: Floats) -> float:
    """Return the usual miss of carried gravity, parts of the angle, before calibration."""
    # A wrong unit makes of a turn many: what they miss is bounded, and their angle must be.
    nominal = Sensors(np.eye(3), np.zeros(3), matrix, np.zeros((3, 3)))
    _, miss, turns = errors_of(record, nominal)
    return float(np.median(miss / turns.angles.clip(0.1, 2.0)))


def _axes(record: Record) -> Floats:
    """Return the axes of the gyro that follow gravity: its own, or else a signed permutation."""
    if not record.turns or _typical_miss(record, np.eye(3)) < _WRONG:
        return np.eye(3)
    for unit, factor in (("deg/s", np.pi / 180.0), ("rad/s", 180.0 / np.pi)):
        if unit != record.gyro.unit and _typical_miss(record, factor * np.eye(3)) < _WRONG:
            raise LogError(
                f"the gyro does not follow gravity in {record.gyro.unit}, the unit that it has; "
                f"it does in '{unit}'"
            )
    found = [np.diag(signs)[list(order)] for order in permutations(range(3)) for signs in _SIGNS]
    miss = [_typical_miss(record, matrix) for matrix in found]
    best = int(np.argmin(miss))
    return found[best] if miss[best] < _WRONG else np.eye(3)


_OF_COUNTS: Final = (
    "if these are raw counts, read them without a unit, or with the scale of their device"
)


def check_gravity(record: Record, gravity: float) -> None:
    """Refuse an accelerometer that does not show gravity at rest.

    Raises
    ------
    LogError
        It names the unit that would fit.
    """
    size = float(np.median(np.linalg.norm(record.accel_means, axis=1)))
    if not record.accel.known or _SIZES[0] <= size <= _SIZES[1]:
        return
    raw, unit = size / record.accel.factor, record.accel.unit
    fitting = [name for name, g in _units_of(gravity) if _SIZES[0] <= raw / g <= _SIZES[1]]
    advice = f"it fits '{fitting[0]}'" if fitting else _OF_COUNTS
    raise LogError(
        f"the accel shows {raw:.4g} {unit} at rest, which is not gravity, "
        f"{1.0 / record.accel.factor:.4g} {unit}; {advice}"
    )


def _units_of(gravity: float) -> list[tuple[str, float]]:
    """Return units and what gravity is in them."""
    standard = gravity / STANDARD_GRAVITY
    return [("g", standard), ("m/s^2", gravity), ("mg", 1e3 * standard)]
