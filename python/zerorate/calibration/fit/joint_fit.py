"""One least-squares fit of both sensors to rests and turns, with the covariance of all."""

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
"""Parameters of the sensors: A, b_a, M. Two for each rest follow, the tilt of its direction."""

_MAX_STEPS: Final = 25
_VARIANCE_STEPS: Final = 12
"""Steps after which the variances stay fixed: they and the weights of turns could oscillate."""

_PRIOR_RESIDUALS: Final = (10.0, 1.0)
"""Residuals assumed to agree with the first guess at both variances."""

_MAX_LOG_CHANGE: Final = 1.0
"""Change of the logarithm of a variance in a step."""

_HUBER_SIGMAS: Final = 2.5
"""Standard errors of a turn beyond which it counts less: one good turn of twenty."""

_MAX_STEP_SIZE: Final = 0.5
"""Of a tilt, rad, or of a matrix or bias, parts of the scale of its sensor."""

_CONVERGED_SIGMAS: Final = 0.01
"""Step, in standard errors, after which there is nothing to be gained."""

_MIN_TURN_ERROR_RAD: Final = 1e-6
"""Of a turn, rad, in records that have no noise."""

_MAX_LINEAR_CHANGE: Final = 1e-3
"""Change of M, parts of its largest element, up to which a turn follows its derivative: what that
misses is the square of it."""

_PINNED_SIGMA_RATIO: Final = 1e-6
"""Of its prior's error: that of a parameter that must not move."""

_ERROR_PER_ANGLE: Final = 5e-4
"""First guess at what a turn errs by beyond noise, parts of its angle."""


MAX_SIGMA_RATIO: Final = 0.3
"""A parameter is identifiable if its standard error is below this part of a data sheet's."""


class Spread(NamedTuple):
    """Standard deviations of a sensor from its prior.

    Parameters
    ----------
    scale, cross
        Of the diagonal of its matrix and of the other elements, parts of the scale.
    bias
        Of an accelerometer, parts of gravity.
    """

    scale: float
    cross: float
    bias: float


DATASHEET_SPREAD: Final = Spread(0.05, 0.03, 0.1)
"""Values from data sheets of MEMS sensors."""

WIDE_SPREAD: Final = Spread(0.5, 0.5, 0.5)
"""Sensors of which not even the unit is known."""


@dataclass(frozen=True, eq=False)
class Prior:
    """Knowledge before the record: A, M and their standard deviations.

    Parameters
    ----------
    accel, gyro
        A, lower triangular, in the unit of the accelerometer per gravity; M, rad/s per unit of the
        gyro; shape (3, 3).
    bias
        Of the accelerometer, its unit, shape (3,).
    accel_spread, gyro_spread
        Standard deviations of the diagonal of each matrix and of its other elements, parts of the
        scale, and of the bias of the accelerometer, parts of gravity.
    pinned
        Which of the parameters must not move, shape (18,); default none.
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
        """Return the scale of the sensor that each parameter is of, shape (18,)."""
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
        """Return the standard deviations that a data sheet promises, shape (18,)."""
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
        Of the accelerometer at rests, and their standard errors, shape (n, 3).
    pairs
        Rest before and after each turn, shape (m, 2).
    seconds, averaging_time
        Length of each turn, and of the rests that its bias is the mean of, s, shape (m,).
    integrate
        Returns the turns for a matrix M.
    white
        Angle random walk of the corrected rate, rad/s/sqrt(Hz).
    rounding_sigma
        What rounding at rests leaves in the bias of a turn, rad/s.
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
    """The sensors as fitted, and the residuals.

    Parameters
    ----------
    accel, bias, gyro
        A, b_a and M.
    directions
        Of gravity's reaction in each rest, unit vectors, shape (n, 3).
    covariance
        Of the elements of A (6), b_a (3) and M (9, row by row), shape (18, 18).
    factors
        Found over assumed standard deviation of rests and of turns.
    weights
        Weight of each turn: 1, and less for outliers.
    turn_rotations
        The turns.
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
    """Return the specific force, parts of gravity, at rests, shape (n, 3)."""
    return np.asarray(np.linalg.solve(accel, (means - bias).T).T)


def directions(means: Floats, accel: Floats, bias: Floats) -> Floats:
    """Return unit vectors along the specific force at rests, shape (n, 3)."""
    force = forces(means, accel, bias)
    return np.asarray(force / vector_norms(force)[:, np.newaxis])


def vector_norms(vectors: Floats) -> Floats:
    """Return the lengths of vectors, never zero, shape (n,)."""
    return np.asarray(np.maximum(np.linalg.norm(vectors, axis=1), np.finfo(float).tiny))


def _tangents(u: Floats) -> Floats:
    """Return two unit vectors across each direction, shape (n, 3, 2)."""
    # Across the axis that is farthest from the direction, so that no product is small.
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
    """Return the sensors that fit rests and turns best.

    Parameters
    ----------
    observations
        Rests and turns.
    prior
        Prior; also the start, unless there is a better one.
    start
        An earlier fit to start at, of other rests and turns too.

    Notes
    -----
    Gauss-Newton on ``(mean - b - A u) / sigma`` of each rest and, across u, on ``u_after - P.T
    u_before`` of each turn, of which the variance is that of white noise and of a part of the
    angle. What both groups' errors are of those assumed is found with the rest, by Fisher scoring
    on the restricted likelihood; a few assumed residuals, and no change after twelve steps, keep
    it from wandering. Turns have Huber's weights.
    """
    state = _start_state(observations, prior, start)
    anchor = _Anchor.at(observations, _unpack(state.values)[2])
    turn_rotations = anchor.turn_rotations
    # The angles hardly change from step to step, and must not: they are weights.
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
    """The turns for one matrix M, from which those for others near it follow."""

    matrix: Floats
    turn_rotations: TurnRotations

    @classmethod
    def at(cls, observations: Observations, matrix: Floats) -> _Anchor:
        return cls(matrix, observations.integrate(matrix))

    def update(self, observations: Observations, matrix: Floats) -> tuple[_Anchor, TurnRotations]:
        """Return the turns for another matrix, and the start for the next time."""
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
    """Return the variance of each turn by white noise and by its angle, shape (m, 2)."""
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

    Of the rows of each group, in sigmas: the residuals, the part of the variance that is scaled,
    and the derivatives.
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
    # [u]x psi across e is psi . (e x u).
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
    """Return the inverse of a positive definite matrix whose parameters differ in unit."""
    size = np.sqrt(np.diagonal(normal))
    inverse = np.linalg.inv(normal / np.outer(size, size)) / np.outer(size, size)
    return np.asarray((inverse + inverse.T) / 2.0)


def _rescale_variances(
    system: _System, inverse: Floats, step_taken: Floats, squares: Floats
) -> Floats:
    """Return the scale of both variances after a step of Fisher scoring on their logarithms."""
    score, information = np.zeros(2), np.zeros((2, 2))
    hats = []
    for k, (residuals, share, rows) in enumerate(system.groups):
        shared = rows * share[:, np.newaxis]
        hat = inverse @ (rows.T @ shared)
        hats.append(hat)
        residuals = residuals - rows @ step_taken
        score[k] = (share * residuals) @ residuals - share.sum() + np.trace(hat)
        score[k] += _PRIOR_RESIDUALS[k] * (1.0 / squares[k] - 1.0)
        # The trace of a product of symmetric matrices, without the product.
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
