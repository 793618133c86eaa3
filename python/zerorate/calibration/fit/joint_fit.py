"""One least-squares fit of both sensors to rests and rotations, with one covariance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from zerorate.calibration.fit.turns import TurnRotations
from zerorate.geometry.rotations import cross_matrices
from zerorate.types import Booleans, Floats, Integers

LOWER_TRIANGLE: Final = np.array([(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)])
_BIAS: Final = slice(6, 9)
_GYRO: Final = slice(9, 18)
_SENSOR_PARAMETERS: Final = 18
"""Number of parameters of the sensors: A, b_a, M. Two tilts of each rest follow them."""

_MAX_STEPS: Final = 25
_VARIANCE_STEPS: Final = 12
"""Number of steps after which variances stay fixed: with the weights they could oscillate."""

_PRIOR_RESIDUALS: Final = (10.0, 1.0)
"""Number of residuals assumed to agree with the first guess of each variance."""

_MAX_LOG_CHANGE: Final = 1.0
"""Largest change of the logarithm of a variance in one step."""

_HUBER_SIGMAS: Final = 2.5
"""Error of a rotation, in standard errors, above which its weight is reduced: one good rotation in
twenty.
"""

_MAX_STEP_SIZE: Final = 0.5
"""Largest step: of a tilt in rad, of a matrix or bias as a share of its sensor's scale."""

_CONVERGED_SIGMAS: Final = 0.01
"""Largest step of a parameter, in standard errors, at which the iteration ends."""

_MIN_TURN_ERROR_RAD: Final = 1e-6
"""Smallest standard error of a rotation, rad, for records without noise."""

_MAX_LINEAR_CHANGE: Final = 1e-3
"""Change of M, as a share of its largest element, up to which rotations are linearised. The error
is of second order.
"""

_PINNED_SIGMA_RATIO: Final = 1e-6
"""Standard deviation of a pinned parameter, as a share of its prior standard deviation."""

_ERROR_PER_ANGLE: Final = 5e-4
"""First guess of a rotation's error beyond noise, as a share of its angle."""


MAX_SIGMA_RATIO: Final = 0.3
"""Largest standard error of an identifiable parameter, as a share of the data sheet's."""


class Spread(NamedTuple):
    """Standard deviations of a sensor's parameters about the prior.

    Parameters
    ----------
    scale, cross
        Standard deviations of the matrix's diagonal and of its other elements, as shares of the
        scale.
    bias
        Standard deviation of an accelerometer's bias, as a share of gravity.
    """

    scale: float
    cross: float
    bias: float


DATASHEET_SPREAD: Final = Spread(0.05, 0.03, 0.1)
"""Standard deviations from data sheets of MEMS sensors."""

WIDE_SPREAD: Final = Spread(0.5, 0.5, 0.5)
"""Standard deviations of sensors with an unknown unit."""


@dataclass(frozen=True, eq=False)
class Prior:
    """Knowledge before the record: A, M and their standard deviations.

    Parameters
    ----------
    accel, gyro
        A, lower triangular, unit of the accelerometer per gravity; and M, rad/s per unit of the
        gyro; shape (3, 3).
    bias
        Bias of the accelerometer, in its unit, shape (3,).
    accel_spread, gyro_spread
        Standard deviations of the parameters of each sensor.
    pinned
        Mask of the parameters that must stay, shape (18,). Default: none.
    """

    accel: Floats
    bias: Floats
    gyro: Floats
    accel_spread: Spread = DATASHEET_SPREAD
    gyro_spread: Spread = DATASHEET_SPREAD
    pinned: Booleans | None = None

    @property
    def values(self) -> Floats:
        """Return the parameters of the sensors, shape (18,)."""
        return _pack(self.accel, self.bias, self.gyro)

    @property
    def sizes(self) -> tuple[float, float]:
        """Return the scale of A and of M, for the units of their relative parts."""
        scales = [abs(np.linalg.det(matrix)) ** (1 / 3) for matrix in (self.accel, self.gyro)]
        return float(scales[0]), float(scales[1])

    @property
    def units(self) -> Floats:
        """Return the scale of the sensor of each parameter, shape (18,)."""
        accel, gyro = self.sizes
        return np.repeat([accel, gyro], [_BIAS.stop, _SENSOR_PARAMETERS - _BIAS.stop])

    @property
    def sigmas(self) -> Floats:
        """Return the standard deviations of the parameters, shape (18,)."""
        sigmas = self._spreads(self.accel_spread, self.gyro_spread)
        return (
            sigmas
            if self.pinned is None
            else np.where(self.pinned, _PINNED_SIGMA_RATIO * sigmas, sigmas)
        )

    @property
    def datasheet(self) -> Floats:
        """Return the standard deviations from data sheets, shape (18,)."""
        return self._spreads(DATASHEET_SPREAD, DATASHEET_SPREAD)

    def _spreads(self, of_accel: Spread, of_gyro: Spread) -> Floats:
        accel, gyro = self.sizes
        lower = np.where(np.eye(3, dtype=bool), of_accel.scale, of_accel.cross)
        # The axes of a gyro may be in another order.
        own = np.where(np.abs(self.gyro) > 0.5 * gyro, of_gyro.scale, of_gyro.cross)
        return _pack(accel * lower, np.full(3, accel * of_accel.bias), gyro * own)


@dataclass(frozen=True, eq=False)
class Observations:
    """Data of the fit.

    Parameters
    ----------
    means, sigmas
        Means of the accelerometer at rests, and their standard errors, shape (n, 3).
    pairs
        Indices of the rests before and after each rotation, shape (m, 2).
    seconds, averaging_time
        Length of each rotation, and averaging time of its bias, s, shape (m,).
    integrate
        Function from a matrix M to the rotations.
    white
        Angle random walk of the corrected rate, rad/s/sqrt(Hz).
    rounding_sigma
        Error that rounding at rests leaves in the bias of a rotation, rad/s.
    """

    means: Floats
    sigmas: Floats
    pairs: Integers
    seconds: Floats
    averaging_time: Floats
    integrate: Callable[[Floats], TurnRotations]
    white: float
    rounding_sigma: float


@dataclass(frozen=True, eq=False)
class Fit:
    """Fitted sensors and their residuals.

    Parameters
    ----------
    accel, bias, gyro
        A, b_a and M.
    directions
        Directions of the reaction to gravity at each rest, unit vectors, shape (n, 3).
    covariance
        Covariance of the elements of A (6), b_a (3) and M (9, row by row), shape (18, 18).
    factors
        Estimated over assumed standard deviation, for rests and for rotations.
    weights
        Weight of each rotation: 1, or less for outliers.
    turn_rotations
        Integrated rotations.
    """

    accel: Floats
    bias: Floats
    gyro: Floats
    directions: Floats
    covariance: Floats
    factors: tuple[float, float]
    weights: Floats
    turn_rotations: TurnRotations

    @property
    def sigmas(self) -> Floats:
        """Return the standard errors of the 18 parameters."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance).clip(0.0)))


def _pack(accel: Floats, bias: Floats, gyro: Floats) -> Floats:
    return np.concatenate((accel[LOWER_TRIANGLE[:, 0], LOWER_TRIANGLE[:, 1]], bias, gyro.ravel()))


def _unpack(values: Floats) -> tuple[Floats, Floats, Floats]:
    accel = np.zeros((3, 3))
    accel[LOWER_TRIANGLE[:, 0], LOWER_TRIANGLE[:, 1]] = values[:6]
    return accel, values[_BIAS], values[_GYRO].reshape(3, 3)


def forces(means: Floats, accel: Floats, bias: Floats) -> Floats:
    """Return the specific force at rests, in units of gravity, shape (n, 3)."""
    return np.asarray(np.linalg.solve(accel, (means - bias).T).T)


def directions(means: Floats, accel: Floats, bias: Floats) -> Floats:
    """Return unit vectors along the specific force at rests, shape (n, 3)."""
    force = forces(means, accel, bias)
    return np.asarray(force / vector_norms(force)[:, np.newaxis])


def vector_norms(vectors: Floats) -> Floats:
    """Return the lengths of vectors, with a positive minimum, shape (n,)."""
    return np.asarray(np.maximum(np.linalg.norm(vectors, axis=1), np.finfo(float).tiny))


def _tangents(u: Floats) -> Floats:
    """Return two unit vectors perpendicular to each direction, shape (n, 3, 2)."""
    # The cross product with the axis farthest from the direction is never small.
    axis = np.eye(3)[np.abs(u).argmin(axis=1)]
    first = np.cross(u, axis)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack((first, np.cross(u, first)), axis=2)


@dataclass(eq=False)
class _State:
    """State of the iteration."""

    values: Floats
    directions: Floats
    squares: Floats
    weights: Floats


def joint_fit(observations: Observations, prior: Prior, start: Fit | None = None) -> Fit:
    """Return the sensors with the best fit to rests and rotations.

    Parameters
    ----------
    observations
        Rests and rotations.
    prior
        Prior, and start values if `start` is None.
    start
        Earlier fit to start from; it may be a fit of other rests and rotations.

    Notes
    -----
    Gauss-Newton minimises two groups of residuals: ``(mean - b - A u) / sigma`` of each rest, and
    ``u_after - P.T u_before`` of each rotation, perpendicular to u. The variance of a rotation is
    the sum of white noise and a share of the angle. One variance factor per group is estimated
    together with the parameters, by Fisher scoring on the restricted likelihood. A few assumed
    residuals, and fixed factors after twelve steps, keep it stable. Rotations have Huber's weights.
    """
    state = _start_state(observations, prior, start)
    anchor = _Anchor.at(observations, _unpack(state.values)[2])
    turn_rotations = anchor.turn_rotations
    # The angles serve as weights, so they stay fixed during the iteration.
    noise = _turn_variances(observations, turn_rotations)
    units = np.append(prior.units, np.ones(2 * len(observations.means)))
    inverse: Floats = np.zeros((_SENSOR_PARAMETERS, _SENSOR_PARAMETERS))
    for step in range(_MAX_STEPS):
        system = _build_system(observations, prior, state, turn_rotations, noise)
        inverse = _invert_scaled(system.normal)
        full_step = inverse @ system.right
        if step < _VARIANCE_STEPS:
            state.squares = _rescale_variances(system, inverse, full_step, state.squares)
        sigmas = np.sqrt(np.diagonal(inverse).clip(0.0))
        largest = float(np.abs(full_step / units).max())
        _apply_step(state, full_step * min(1.0, _MAX_STEP_SIZE / max(largest, 1e-300)))
        anchor, turn_rotations = anchor.update(observations, _unpack(state.values)[2])
        if step >= 2 and (np.abs(full_step) <= _CONVERGED_SIGMAS * sigmas).all():
            break
    accel, bias, gyro = _unpack(state.values)
    return Fit(
        accel=accel,
        bias=bias,
        gyro=gyro,
        directions=state.directions,
        covariance=inverse[:_SENSOR_PARAMETERS, :_SENSOR_PARAMETERS],
        factors=(float(np.sqrt(state.squares[0])), float(np.sqrt(state.squares[1]))),
        weights=state.weights,
        turn_rotations=turn_rotations,
    )


@dataclass(frozen=True, eq=False)
class _Anchor:
    """Rotations for one matrix M, linearised for nearby matrices."""

    matrix: Floats
    turn_rotations: TurnRotations

    @classmethod
    def at(cls, observations: Observations, matrix: Floats) -> _Anchor:
        return cls(matrix, observations.integrate(matrix))

    def update(self, observations: Observations, matrix: Floats) -> tuple[_Anchor, TurnRotations]:
        """Return the rotations for another matrix, and the anchor for the next call."""
        change = matrix - self.matrix
        if np.abs(change).max() > _MAX_LINEAR_CHANGE * np.abs(matrix).max():
            fresh = _Anchor.at(observations, matrix)
            return fresh, fresh.turn_rotations
        psi = np.einsum("mabc,bc->ma", self.turn_rotations.by_matrix, change)
        cross = cross_matrices(psi)
        rotations = self.turn_rotations.rotations @ (np.eye(3) + cross + 0.5 * cross @ cross)
        return self, replace(self.turn_rotations, rotations=rotations)


def _start_state(observations: Observations, prior: Prior, start: Fit | None) -> _State:
    weights = np.ones(len(observations.pairs))
    if start is None:
        start_directions = directions(observations.means, prior.accel, prior.bias)
        return _State(prior.values, start_directions, np.ones(2), weights)
    values = _pack(start.accel, start.bias, start.gyro)
    start_directions = directions(observations.means, start.accel, start.bias)
    return _State(values, start_directions, np.square(start.factors), weights)


def _turn_variances(observations: Observations, turn_rotations: TurnRotations) -> Floats:
    """Return the variances of each rotation from white noise and from its angle, shape (m, 2)."""
    white = (
        observations.white**2
        * observations.seconds
        * (1.0 + observations.seconds / observations.averaging_time)
        + _MIN_TURN_ERROR_RAD**2
    )
    white += (observations.rounding_sigma * observations.seconds) ** 2
    return np.stack([white, (_ERROR_PER_ANGLE * turn_rotations.angles) ** 2], axis=1)


@dataclass(frozen=True, eq=False)
class _System:
    """Normal equations, and the sums for the variances of both groups.

    For each group the rows hold the residuals, the scaled part of the variance, and the
    derivatives, all divided by the standard errors.
    """

    normal: Floats
    right: Floats
    groups: tuple[tuple[Floats, Floats, Floats], tuple[Floats, Floats, Floats]]


def _build_system(
    observations: Observations,
    prior: Prior,
    state: _State,
    turn_rotations: TurnRotations,
    noise: Floats,
) -> _System:
    tangents = _tangents(state.directions)
    rests, rest_residuals = _rest_rows(observations, state, tangents)
    variance = noise @ np.array([1.0, state.squares[1]])
    turns, turn_residuals = _turn_rows(
        observations, state, tangents, turn_rotations, np.sqrt(variance)
    )
    state.weights = _huber_weights(turn_residuals)
    root = np.repeat(np.sqrt(state.weights), 2)
    turns, turn_residuals = turns * root[:, np.newaxis], turn_residuals * root
    normal = rests.T @ rests + turns.T @ turns
    right = rests.T @ rest_residuals + turns.T @ turn_residuals
    known, diagonal = prior.sigmas**-2.0, np.arange(_SENSOR_PARAMETERS)
    normal[diagonal, diagonal] += known
    right[:_SENSOR_PARAMETERS] += known * (prior.values - state.values)
    share = np.repeat(state.squares[1] * noise[:, 1] / variance, 2)
    return _System(
        normal,
        right,
        ((rest_residuals, np.ones(rest_residuals.size), rests), (turn_residuals, share, turns)),
    )


def _huber_weights(residuals: Floats) -> Floats:
    size = np.linalg.norm(residuals.reshape(-1, 2), axis=1)
    return np.asarray(np.minimum(1.0, _HUBER_SIGMAS / np.maximum(size, 1e-300)))


def _rest_rows(
    observations: Observations, state: _State, tangents: Floats
) -> tuple[Floats, Floats]:
    """Return the derivatives of the accelerometer's output at rests, and its residuals."""
    n, u = len(observations.means), state.directions
    accel, bias, _ = _unpack(state.values)
    rows = np.zeros((n, 3, _SENSOR_PARAMETERS + 2 * n))
    for index, (row, column) in enumerate(LOWER_TRIANGLE):
        rows[:, row, index] = u[:, column]
    rows[:, range(3), range(_BIAS.start, _BIAS.stop)] = 1.0
    rest = np.arange(n)
    tilts = accel @ tangents
    for k in range(2):
        rows[rest, :, _SENSOR_PARAMETERS + 2 * rest + k] = tilts[:, :, k]
    sigmas = observations.sigmas * np.sqrt(state.squares[0])
    rows /= sigmas[:, :, np.newaxis]
    residuals = (observations.means - bias - u @ accel.T) / sigmas
    return rows.reshape(3 * n, -1), residuals.ravel()


def _turn_rows(
    observations: Observations,
    state: _State,
    tangents: Floats,
    turn_rotations: TurnRotations,
    sigmas: Floats,
) -> tuple[Floats, Floats]:
    """Return the derivatives of gravity propagated through turns, and its residuals."""
    m, before, after = len(observations.pairs), observations.pairs[:, 0], observations.pairs[:, 1]
    back = turn_rotations.rotations.transpose(0, 2, 1)
    propagated = np.einsum("mab,mb->ma", back, state.directions[before])
    across = tangents[after].transpose(0, 2, 1)
    rows = np.zeros((m, 2, _SENSOR_PARAMETERS + 2 * len(observations.means)))
    # The component of [u]x psi along e is psi . (e x u).
    levers = np.cross(across, propagated[:, np.newaxis])
    rows[:, :, _GYRO] = levers @ turn_rotations.by_matrix.reshape(m, 3, 9)
    turn = np.arange(m)
    from_before = across @ back @ tangents[before]
    from_after = across @ tangents[after]
    for k in range(2):
        rows[turn, :, _SENSOR_PARAMETERS + 2 * before + k] = from_before[:, :, k]
        rows[turn, :, _SENSOR_PARAMETERS + 2 * after + k] -= from_after[:, :, k]
    residuals = np.einsum("mka,ma->mk", across, state.directions[after] - propagated)
    rows /= sigmas[:, np.newaxis, np.newaxis]
    return rows.reshape(2 * m, rows.shape[2]), (residuals / sigmas[:, np.newaxis]).ravel()


def _invert_scaled(normal: Floats) -> Floats:
    """Return the inverse of a positive definite matrix of parameters with different units."""
    size = np.sqrt(np.diagonal(normal))
    inverse = np.linalg.inv(normal / np.outer(size, size)) / np.outer(size, size)
    return np.asarray((inverse + inverse.T) / 2.0)


def _rescale_variances(
    system: _System, inverse: Floats, step_taken: Floats, squares: Floats
) -> Floats:
    """Return the scales of both variances after one Fisher scoring step of their logarithms."""
    score, information = np.zeros(2), np.zeros((2, 2))
    hats = []
    for k, (residuals, share, rows) in enumerate(system.groups):
        shared = rows * share[:, np.newaxis]
        hat = inverse @ (rows.T @ shared)
        hats.append(hat)
        residuals = residuals - rows @ step_taken
        score[k] = (share * residuals) @ residuals - share.sum() + np.trace(hat)
        score[k] += _PRIOR_RESIDUALS[k] * (1.0 / squares[k] - 1.0)
        # This is the trace of a product of symmetric matrices, without computing the product.
        twice = float((inverse * (shared.T @ shared)).sum())
        information[k, k] = (
            share @ share - 2.0 * twice + _PRIOR_RESIDUALS[k] * max(1.0, 1.0 / squares[k])
        )
    for k in range(2):
        for other in range(2):
            information[k, other] += (hats[k] * hats[other].T).sum()
    step = np.linalg.solve(information, score)
    return np.asarray(squares * np.exp(step.clip(-_MAX_LOG_CHANGE, _MAX_LOG_CHANGE)))


def _apply_step(state: _State, step: Floats) -> None:
    state.values = state.values + step[:_SENSOR_PARAMETERS]
    tilt = step[_SENSOR_PARAMETERS:].reshape(-1, 2, 1)
    directions = state.directions + (_tangents(state.directions) @ tilt)[:, :, 0]
    state.directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
