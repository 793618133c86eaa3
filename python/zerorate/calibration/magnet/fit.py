"""Joint fit of hard iron, soft iron and field, its standard errors, and the remaining scatter.

All values are in units of the field's median size. The model of a tick is y = D Bᵀ h + b. B is the
mean rotation from the sensor to the gyro's frame. h is the field in this frame, with a new value
every 20 s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate._native import magnet_covariance, magnet_fit
from zerorate.calibration.magnet.ticks import Ticks
from zerorate.types import Floats, Integers

_WINDOW_TICKS: Final = 200
"""Number of ticks with one field."""
_SOFT_PRIOR_SIGMA: Final = 0.2
KNOWN_SIGMA: Final = 0.10
"""Largest standard deviation of a hard iron along a known direction."""
_MAX_SOFT_SIGMA_RATIO: Final = 0.3
_UNMODELLED_SIGMA: Final = 0.03


def _make_basis() -> Floats:
    root2, root6 = np.sqrt(2.0), np.sqrt(6.0)
    elements = [np.diag([1.0, -1.0, 0.0]) / root2, np.diag([1.0, 1.0, -2.0]) / root6]
    pairs = ((0, 1), (0, 2), (1, 2))
    for sign in (1.0, -1.0):
        for i, j in pairs:
            element = np.zeros((3, 3))
            element[i, j], element[j, i] = 1.0 / root2, sign / root2
            elements.append(element)
    return np.array(elements)


BASIS: Final = _make_basis()
"""Orthonormal matrices without trace: two of scale, three symmetric, three antisymmetric."""
SCALE: Final = (0, 1)
SYMMETRIC: Final = (0, 1, 2, 3, 4)
ROTATION: Final = (5, 6, 7)
FULL: Final = tuple(range(8))


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of a fit.

    Parameters
    ----------
    iron : ndarray, shape (g, 3)
        Hard iron of each group.
    elements : ndarray, shape (8,)
        Elements of D - 1 in `BASIS`, zero if not fitted.
    fields : ndarray, shape (w, 3)
        Field in each window of 20 s with ticks.
    window : ndarray of int, shape (n,)
        Window of each tick.
    scatter : float
        RMS residual of an axis.
    weights : ndarray, shape (n,)
        Weight of each tick, at most 1.
    """

    iron: Floats
    elements: Floats
    fields: Floats
    window: Integers
    scatter: float
    weights: Floats

    @property
    def matrix(self) -> Floats:
        """D, shape (3, 3)."""
        return soft_iron_matrix(self.elements)


def soft_iron_matrix(elements: Floats) -> Floats:
    """Return D from its elements."""
    matrix: Floats = np.eye(3) + np.tensordot(elements, BASIS, axes=1)
    return matrix


def fit(ticks: Ticks, group: Integers, soft: tuple[int, ...] = ()) -> Fit:
    """Return the hard iron of each group and the given elements of D, by Gauss-Newton.

    Parameters
    ----------
    ticks : Ticks
        Ticks in the order of time.
    group : ndarray of int, shape (n,)
        Group of each tick, from 0.
    soft : tuple of int
        Indices of the fitted elements of `BASIS`.
    """
    window = np.unique(ticks.number // _WINDOW_TICKS, return_inverse=True)[1]
    basis = BASIS[list(soft)]
    iron, values, fields, scatter, weights = magnet_fit(
        ticks.rotation, ticks.field, ticks.rotated_field, group, window, basis
    )
    elements = np.zeros(len(BASIS))
    elements[list(soft)] = values
    return Fit(iron, elements, fields, window, scatter, weights)


def covariance(ticks: Ticks, group: Integers, iron_fit: Fit, soft: tuple[int, ...] = ()) -> Floats:
    """Return the covariance of all elements of D and of the hard irons, shape (8 + 3 g, 8 + 3 g).

    Places limit the accuracy, not noise: a field that varies with the place looks like iron if the
    place changes with the pose. A group counts as one independent observation per ten seconds, at
    most four. Elements of D that were not fitted get a standard deviation of 3 %.
    """
    sigmas = [_SOFT_PRIOR_SIGMA if k in soft else _UNMODELLED_SIGMA for k in range(len(BASIS))]
    parts = (iron_fit.iron, iron_fit.elements, iron_fit.fields, iron_fit.scatter, iron_fit.weights)
    return magnet_covariance(
        ticks.rotation, ticks.field, group, iron_fit.window, BASIS, parts, sigmas
    )


def count_known_directions(block: Floats) -> int:
    """Return the number of known directions of a hard iron with this covariance."""
    return int((np.linalg.eigvalsh(block) < KNOWN_SIGMA**2).sum())


def zero_unknown_directions(values: Floats, matrix: Floats, groups: int) -> Floats:
    """Return hard irons with zeros along unknown directions, shape (g, 3)."""
    values = values.copy()
    for g in range(groups):
        slots = slice(8 + 3 * g, 11 + 3 * g)
        block = matrix[slots, slots]
        size, axes = np.linalg.eigh(block)
        unknown_axes = axes[:, size >= KNOWN_SIGMA**2]
        if unknown_axes.shape[1]:
            gain = block @ unknown_axes @ np.linalg.inv(unknown_axes.T @ block @ unknown_axes)
            values[g] = values[g] - gain @ (unknown_axes.T @ values[g])
    return values


def soft_sigma_ratios(matrix: Floats, soft: tuple[int, ...]) -> Floats:
    """Return the standard deviations of elements, over the prior's standard deviations."""
    ratios: Floats = np.sqrt(np.diagonal(matrix)[list(soft)]) / _SOFT_PRIOR_SIGMA
    return ratios


MAX_SOFT_SIGMA_RATIO: Final = _MAX_SOFT_SIGMA_RATIO


def block_length(n: int) -> int:
    """Return the number of ticks in a held-out block, for n ticks."""
    return int(np.clip(n // 16, 100, 300)) if n > 2400 else int(np.clip(n // 8, 20, 100))


def held_out_squares(ticks: Ticks, group: Integers, soft: tuple[int, ...] | None) -> Floats:
    """Return the squared residual of each tick in held-out blocks, shape (n,).

    Four folds of interleaved blocks are left out in turn. Each block has its own field. If ``soft``
    is None, raw samples are used.
    """
    fold = np.empty(ticks.n, dtype=np.int64)
    block = np.empty(ticks.n, dtype=np.int64)
    first = 0
    for g in range(int(group.max()) + 1):
        members = np.flatnonzero(group == g)
        block_index = np.arange(len(members)) // block_length(len(members))
        if len(members) and len(members) % block_length(len(members)) < 10 and block_index[-1]:
            block_index[block_index == block_index[-1]] = block_index[-1] - 1
        fold[members], block[members] = block_index % 4, first + block_index
        first += int(block_index[-1]) + 1 if len(members) else 0
    squares = np.empty(ticks.n)
    for k in range(4):
        test = fold == k
        if not test.any():
            continue
        iron, matrix = np.zeros((int(group.max()) + 1, 3)), np.eye(3)
        if soft is not None and not test.all():
            train = ~test
            training_fit = fit(ticks.select(train), group[train], soft)
            padded_iron = np.zeros((len(iron), 3))
            padded_iron[: len(training_fit.iron)] = training_fit.iron
            iron, matrix = padded_iron, training_fit.matrix
        squares[test] = _block_squares(ticks.select(test), iron[group[test]], matrix, block[test])
    return squares


def _block_squares(ticks: Ticks, iron: Floats, matrix: Floats, block: Integers) -> Floats:
    values, turn = ticks.field - iron, matrix @ ticks.inverse_rotation
    squares = np.empty(ticks.n)
    for b in np.unique(block):
        in_block = block == b
        rows, sensed = turn[in_block].reshape(-1, 3), values[in_block].ravel()
        field = np.linalg.lstsq(rows, sensed, rcond=None)[0]
        squares[in_block] = ((sensed - rows @ field).reshape(-1, 3) ** 2).sum(axis=1) / 3.0
    return squares


def robust_rms(squares: Floats) -> float:
    """Return the scatter of an axis, with each square limited to fifty medians."""
    return float(np.sqrt(np.minimum(squares, 50.0 * np.median(squares)).mean()))
