"""One least-squares fit of both sensors to rests and turns, with the covariance of all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from zerorate.calibration.fit.turns import Carried
from zerorate.geometry.rotations import cross_matrices
from zerorate.types import Booleans, Floats, Integers

LOWER: Final = np.array([(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)])
_BIAS: Final = slice(6, 9)
_GYRO: Final = slice(9, 18)
_OWN: Final = 18
"""Parameters of the sensors: A, b_a, M. Two for each rest follow, the tilt of its direction."""

_STEPS: Final = 25
_FROZEN: Final = 12
"""Steps after which the variances stay, lest they and the weights of turns chase each other."""

_DAMPING: Final = (10.0, 1.0)
"""Residuals assumed to agree with the first guess at both variances."""

_LARGEST_FACTOR: Final = 1.0
"""Change of the logarithm of a variance in a step."""

_HUBER: Final = 2.5
"""Standard errors of a turn beyond which it counts less: one good turn of twenty."""

_LARGEST_STEP: Final = 0.5
"""Of a tilt, rad, or of a matrix or bias, parts of the scale of its sensor."""

_CONVERGED: Final = 0.01
"""Step, in standard errors, after which there is nothing to be gained."""

_LEAST_ERROR: Final = 1e-6
"""Of a turn, rad, in records that have no noise."""

_LINEAR: Final = 1e-3
"""Change of M, parts of its largest element, up to which a turn follows its derivative: what that
misses is the square of it."""

_PINNED: Final = 1e-6
"""Of its prior's error: that of a parameter that must not move."""

_PER_ANGLE: Final = 5e-4
"""First guess at what a turn errs by beyond noise, parts of its angle."""


DETERMINED: Final = 0.3
"""A parameter is identifiable if its standard error is below this part of a data sheet's."""


class Spread(NamedTuple):
    """How far a sensor may be from its prior, standard deviations.

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


DATASHEET: Final = Spread(0.05, 0.03, 0.1)
"""What data sheets of MEMS sensors promise."""

WIDE: Final = Spread(0.5, 0.5, 0.5)
"""Sensors of which not even the unit is known."""


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known before the record: A, M and how far they may be from that.

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
    accel_spread: Spread = DATASHEET
    gyro_spread: Spread = DATASHEET
    pinned: Booleans | None = None

    @property
    def values(self) -> Floats:
        """Return the parameters of the sensors, shape (18,)."""
        return _packed(self.accel, self.bias, self.gyro)

    @property
    def sizes(self) -> tuple[float, float]:
        """Return the scale of A and of M: what a part of one means in their units."""
        found = [abs(np.linalg.det(matrix)) ** (1 / 3) for matrix in (self.accel, self.gyro)]
        return float(found[0]), float(found[1])

    @property
    def units(self) -> Floats:
        """Return the scale of the sensor that each parameter is of, shape (18,)."""
        accel, gyro = self.sizes
        return np.repeat([accel, gyro], [_BIAS.stop, _OWN - _BIAS.stop])

    @property
    def sigmas(self) -> Floats:
        """Return the standard deviations of the parameters, shape (18,)."""
        found = self._spreads(self.accel_spread, self.gyro_spread)
        return found if self.pinned is None else np.where(self.pinned, _PINNED * found, found)

    @property
    def datasheet(self) -> Floats:
        """Return the standard deviations that a data sheet promises, shape (18,)."""
        return self._spreads(DATASHEET, DATASHEET)

    def _spreads(self, of_accel: Spread, of_gyro: Spread) -> Floats:
        accel, gyro = self.sizes
        lower = np.where(np.eye(3, dtype=bool), of_accel.scale, of_accel.cross)
        # The axes of a gyro may be in another order.
        own = np.where(np.abs(self.gyro) > 0.5 * gyro, of_gyro.scale, of_gyro.cross)
        return _packed(accel * lower, np.full(3, accel * of_accel.bias), gyro * own)


@dataclass(frozen=True, eq=False)
class Observations:
    """What is fitted.

    Parameters
    ----------
    means, sigmas
        Of the accelerometer at rests, and their standard errors, shape (n, 3).
    pairs
        Rest before and after each turn, shape (m, 2).
    seconds, averaged
        Length of each turn, and of the rests that its bias is the mean of, s, shape (m,).
    carry
        Returns the turns for a matrix M.
    white
        Angle random walk of the corrected rate, rad/s/sqrt(Hz).
    steady
        What rounding at rests leaves in the bias of a turn, rad/s.
    """

    means: Floats
    sigmas: Floats
    pairs: Integers
    seconds: Floats
    averaged: Floats
    carry: Callable[[Floats], Carried]
    white: float
    steady: float


@dataclass(frozen=True, eq=False)
class Fit:
    """The sensors as fitted, and what is left.

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
        Of each turn, 1 but for outliers.
    carried
        The turns.
    """

    accel: Floats
    bias: Floats
    gyro: Floats
    directions: Floats
    covariance: Floats
    factors: tuple[float, float]
    weights: Floats
    carried: Carried

    @property
    def sigmas(self) -> Floats:
        """Return the standard errors of the 18 parameters."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance).clip(0.0)))


def _packed(accel: Floats, bias: Floats, gyro: Floats) -> Floats:
    return np.concatenate((accel[LOWER[:, 0], LOWER[:, 1]], bias, gyro.ravel()))


def _unpacked(values: Floats) -> tuple[Floats, Floats, Floats]:
    accel = np.zeros((3, 3))
    accel[LOWER[:, 0], LOWER[:, 1]] = values[:6]
    return accel, values[_BIAS], values[_GYRO].reshape(3, 3)


def forces(means: Floats, accel: Floats, bias: Floats) -> Floats:
    """Return the specific force, parts of gravity, at rests, shape (n, 3)."""
    return np.asarray(np.linalg.solve(accel, (means - bias).T).T)


def directions(means: Floats, accel: Floats, bias: Floats) -> Floats:
    """Return unit vectors along the specific force at rests, shape (n, 3)."""
    force = forces(means, accel, bias)
    return np.asarray(force / sizes(force)[:, np.newaxis])


def sizes(vectors: Floats) -> Floats:
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
    """Where the iteration stands."""

    values: Floats
    directions: Floats
    squares: Floats
    weights: Floats


def joint_fit(seen: Observations, prior: Prior, start: Fit | None = None) -> Fit:
    """Return the sensors that fit rests and turns best.

    Parameters
    ----------
    seen
        Rests and turns.
    prior
        What is known before; the start, unless there is a better one.
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
    state = _started(seen, prior, start)
    anchor = _Anchor.at(seen, _unpacked(state.values)[2])
    carried = anchor.carried
    # The angles hardly change from step to step, and must not: they are weights.
    noise = _turn_variances(seen, carried)
    units = np.append(prior.units, np.ones(2 * len(seen.means)))
    inverse: Floats = np.zeros((_OWN, _OWN))
    for step in range(_STEPS):
        system = _system(seen, prior, state, carried, noise)
        inverse = _inverse(system.normal)
        moved = inverse @ system.right
        if step < _FROZEN:
            state.squares = _rescaled(system, inverse, moved, state.squares)
        sigmas = np.sqrt(np.diagonal(inverse).clip(0.0))
        largest = float(np.abs(moved / units).max())
        _move(state, moved * min(1.0, _LARGEST_STEP / max(largest, 1e-300)))
        anchor, carried = anchor.moved(seen, _unpacked(state.values)[2])
        if step >= 2 and (np.abs(moved) <= _CONVERGED * sigmas).all():
            break
    accel, bias, gyro = _unpacked(state.values)
    return Fit(
        accel=accel,
        bias=bias,
        gyro=gyro,
        directions=state.directions,
        covariance=inverse[:_OWN, :_OWN],
        factors=(float(np.sqrt(state.squares[0])), float(np.sqrt(state.squares[1]))),
        weights=state.weights,
        carried=carried,
    )


@dataclass(frozen=True, eq=False)
class _Anchor:
    """The turns for one matrix M, from which those for others near it follow."""

    matrix: Floats
    carried: Carried

    @classmethod
    def at(cls, seen: Observations, matrix: Floats) -> _Anchor:
        return cls(matrix, seen.carry(matrix))

    def moved(self, seen: Observations, matrix: Floats) -> tuple[_Anchor, Carried]:
        """Return the turns for another matrix, and what to start from next time."""
        change = matrix - self.matrix
        if np.abs(change).max() > _LINEAR * np.abs(matrix).max():
            fresh = _Anchor.at(seen, matrix)
            return fresh, fresh.carried
        psi = np.einsum("mabc,bc->ma", self.carried.by_matrix, change)
        cross = cross_matrices(psi)
        rotations = self.carried.rotations @ (np.eye(3) + cross + 0.5 * cross @ cross)
        return self, replace(self.carried, rotations=rotations)


def _started(seen: Observations, prior: Prior, start: Fit | None) -> _State:
    weights = np.ones(len(seen.pairs))
    if start is None:
        at = directions(seen.means, prior.accel, prior.bias)
        return _State(prior.values, at, np.ones(2), weights)
    values = _packed(start.accel, start.bias, start.gyro)
    at = directions(seen.means, start.accel, start.bias)
    return _State(values, at, np.square(start.factors), weights)


def _turn_variances(seen: Observations, carried: Carried) -> Floats:
    """Return the variance of each turn by white noise and by its angle, shape (m, 2)."""
    white = seen.white**2 * seen.seconds * (1.0 + seen.seconds / seen.averaged) + _LEAST_ERROR**2
    white += (seen.steady * seen.seconds) ** 2
    return np.stack([white, (_PER_ANGLE * carried.angles) ** 2], axis=1)


@dataclass(frozen=True, eq=False)
class _System:
    """Normal equations, and what the variances of both groups are found from.

    Of the rows of each group, in sigmas: the residuals, the part of the variance that is scaled,
    and the derivatives.
    """

    normal: Floats
    right: Floats
    groups: tuple[tuple[Floats, Floats, Floats], tuple[Floats, Floats, Floats]]


def _system(
    seen: Observations, prior: Prior, state: _State, carried: Carried, noise: Floats
) -> _System:
    tangents = _tangents(state.directions)
    rests, rest_left = _rest_rows(seen, state, tangents)
    variance = noise @ np.array([1.0, state.squares[1]])
    turns, turn_left = _turn_rows(seen, state, tangents, carried, np.sqrt(variance))
    state.weights = _huber(turn_left)
    root = np.repeat(np.sqrt(state.weights), 2)
    turns, turn_left = turns * root[:, np.newaxis], turn_left * root
    normal = rests.T @ rests + turns.T @ turns
    right = rests.T @ rest_left + turns.T @ turn_left
    known, own = prior.sigmas**-2.0, np.arange(_OWN)
    normal[own, own] += known
    right[:_OWN] += known * (prior.values - state.values)
    share = np.repeat(state.squares[1] * noise[:, 1] / variance, 2)
    return _System(
        normal,
        right,
        ((rest_left, np.ones(rest_left.size), rests), (turn_left, share, turns)),
    )


def _huber(left: Floats) -> Floats:
    size = np.linalg.norm(left.reshape(-1, 2), axis=1)
    return np.asarray(np.minimum(1.0, _HUBER / np.maximum(size, 1e-300)))


def _rest_rows(seen: Observations, state: _State, tangents: Floats) -> tuple[Floats, Floats]:
    """Return the derivatives of what the accelerometer shows at rests, and what is left of it."""
    n, u = len(seen.means), state.directions
    accel, bias, _ = _unpacked(state.values)
    rows = np.zeros((n, 3, _OWN + 2 * n))
    for place, (row, column) in enumerate(LOWER):
        rows[:, row, place] = u[:, column]
    rows[:, range(3), range(_BIAS.start, _BIAS.stop)] = 1.0
    rest = np.arange(n)
    tilts = accel @ tangents
    for k in range(2):
        rows[rest, :, _OWN + 2 * rest + k] = tilts[:, :, k]
    sigmas = seen.sigmas * np.sqrt(state.squares[0])
    rows /= sigmas[:, :, np.newaxis]
    left = (seen.means - bias - u @ accel.T) / sigmas
    return rows.reshape(3 * n, -1), left.ravel()


def _turn_rows(
    seen: Observations, state: _State, tangents: Floats, carried: Carried, sigmas: Floats
) -> tuple[Floats, Floats]:
    """Return the derivatives of gravity carried through turns, and what is left of it."""
    m, before, after = len(seen.pairs), seen.pairs[:, 0], seen.pairs[:, 1]
    back = carried.rotations.transpose(0, 2, 1)
    ends = np.einsum("mab,mb->ma", back, state.directions[before])
    across = tangents[after].transpose(0, 2, 1)
    rows = np.zeros((m, 2, _OWN + 2 * len(seen.means)))
    # [u]x psi across e is psi . (e x u).
    levers = np.cross(across, ends[:, np.newaxis])
    rows[:, :, _GYRO] = levers @ carried.by_matrix.reshape(m, 3, 9)
    turn = np.arange(m)
    from_before = across @ back @ tangents[before]
    from_after = across @ tangents[after]
    for k in range(2):
        rows[turn, :, _OWN + 2 * before + k] = from_before[:, :, k]
        rows[turn, :, _OWN + 2 * after + k] -= from_after[:, :, k]
    left = np.einsum("mka,ma->mk", across, state.directions[after] - ends)
    rows /= sigmas[:, np.newaxis, np.newaxis]
    return rows.reshape(2 * m, rows.shape[2]), (left / sigmas[:, np.newaxis]).ravel()


def _inverse(normal: Floats) -> Floats:
    """Return the inverse of a positive definite matrix whose parameters differ in unit."""
    size = np.sqrt(np.diagonal(normal))
    inverse = np.linalg.inv(normal / np.outer(size, size)) / np.outer(size, size)
    return np.asarray((inverse + inverse.T) / 2.0)


def _rescaled(system: _System, inverse: Floats, moved: Floats, squares: Floats) -> Floats:
    """Return the scale of both variances after a step of Fisher scoring on their logarithms."""
    score, information = np.zeros(2), np.zeros((2, 2))
    hats = []
    for k, (left, share, rows) in enumerate(system.groups):
        shared = rows * share[:, np.newaxis]
        hat = inverse @ (rows.T @ shared)
        hats.append(hat)
        left = left - rows @ moved
        score[k] = (share * left) @ left - share.sum() + np.trace(hat)
        score[k] += _DAMPING[k] * (1.0 / squares[k] - 1.0)
        # The trace of a product of symmetric matrices, without the product.
        twice = float((inverse * (shared.T @ shared)).sum())
        information[k, k] = share @ share - 2.0 * twice + _DAMPING[k] * max(1.0, 1.0 / squares[k])
    for k in range(2):
        for other in range(2):
            information[k, other] += (hats[k] * hats[other].T).sum()
    step = np.linalg.solve(information, score)
    return np.asarray(squares * np.exp(step.clip(-_LARGEST_FACTOR, _LARGEST_FACTOR)))


def _move(state: _State, step: Floats) -> None:
    state.values = state.values + step[:_OWN]
    tilt = step[_OWN:].reshape(-1, 2, 1)
    moved = state.directions + (_tangents(state.directions) @ tilt)[:, :, 0]
    state.directions = moved / np.linalg.norm(moved, axis=1, keepdims=True)
