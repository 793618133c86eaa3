"""Joint fit of hard iron, soft iron and field, its standard errors, and the scatter it leaves.

All in units of the field's median size. The model of a tick is y = D Bᵀ h + b: B the mean rotation
from the sensor to the gyro's frame, h the field there, which goes on every 20 s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate._native import magnet_covariance, magnet_fit
from zerorate.calibration.magnet.ticks import Ticks
from zerorate.types import Floats, Integers

_WINDOW: Final = 200
"""Ticks in which the field is one."""
_SOFT: Final = 0.2
KNOWN: Final = 0.10
"""Deviation of a direction of the hard iron that is known."""
_SOFT_KNOWN: Final = 0.3
_UNMODELLED: Final = 0.03


def _basis() -> Floats:
    root2, root6 = np.sqrt(2.0), np.sqrt(6.0)
    found = [np.diag([1.0, -1.0, 0.0]) / root2, np.diag([1.0, 1.0, -2.0]) / root6]
    pairs = ((0, 1), (0, 2), (1, 2))
    for sign in (1.0, -1.0):
        for i, j in pairs:
            element = np.zeros((3, 3))
            element[i, j], element[j, i] = 1.0 / root2, sign / root2
            found.append(element)
    return np.array(found)


BASIS: Final = _basis()
"""Orthonormal matrices of no trace: two of scale, three symmetric, three antisymmetric."""
SCALE: Final = (0, 1)
SYMMETRIC: Final = (0, 1, 2, 3, 4)
ROTATION: Final = (5, 6, 7)
FULL: Final = tuple(range(8))


@dataclass(frozen=True, eq=False)
class Fit:
    """What a fit found.

    Parameters
    ----------
    iron : ndarray, shape (g, 3)
        Hard iron of each group.
    elements : ndarray, shape (8,)
        Of D - 1 in `BASIS`, zero where not fitted.
    fields : ndarray, shape (w, 3)
        Of each window of 20 s that has ticks.
    window : ndarray of int, shape (n,)
        Of each tick.
    scatter : float
        RMS of an axis.
    weights : ndarray, shape (n,)
        Of each tick, at most 1.
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
        return matrix_of(self.elements)


def matrix_of(elements: Floats) -> Floats:
    """Return D of its elements."""
    matrix: Floats = np.eye(3) + np.tensordot(elements, BASIS, axes=1)
    return matrix


def fit(ticks: Ticks, group: Integers, soft: tuple[int, ...] = ()) -> Fit:
    """Return hard iron of each group and the given elements of D, by Gauss-Newton rounds.

    Parameters
    ----------
    ticks : Ticks
        In order.
    group : ndarray of int, shape (n,)
        From 0 on.
    soft : tuple of int
        Which elements of `BASIS` are fitted.
    """
    window = np.unique(ticks.number // _WINDOW, return_inverse=True)[1]
    offered = BASIS[list(soft)]
    iron, values, fields, scatter, weights = magnet_fit(
        ticks.rotation, ticks.field, ticks.turned, group, window, offered
    )
    elements = np.zeros(len(BASIS))
    elements[list(soft)] = values
    return Fit(iron, elements, fields, window, scatter, weights)


def covariance(ticks: Ticks, group: Integers, found: Fit, soft: tuple[int, ...] = ()) -> Floats:
    """Return the covariance of all elements of D and of the hard irons, shape (8 + 3 g, 8 + 3 g).

    Not noise limits it but the places: a field that varies with the place, and a place that goes
    with the pose, look like iron. A group counts for as many independent observations as it has
    tens of seconds, at most four. Elements of D that were not fitted may be a few per cent.
    """
    doubt = [_SOFT if k in soft else _UNMODELLED for k in range(len(BASIS))]
    parts = (found.iron, found.elements, found.fields, found.scatter, found.weights)
    return magnet_covariance(ticks.rotation, ticks.field, group, found.window, BASIS, parts, doubt)


def known_directions(block: Floats) -> int:
    """Return how many directions of a hard iron with this covariance are known."""
    return int((np.linalg.eigvalsh(block) < KNOWN**2).sum())


def conditioned(values: Floats, matrix: Floats, groups: int) -> Floats:
    """Return hard irons of which what is not known is zero, shape (g, 3)."""
    values = values.copy()
    for g in range(groups):
        place = slice(8 + 3 * g, 11 + 3 * g)
        block = matrix[place, place]
        size, axes = np.linalg.eigh(block)
        away = axes[:, size >= KNOWN**2]
        if away.shape[1]:
            gain = block @ away @ np.linalg.inv(away.T @ block @ away)
            values[g] = values[g] - gain @ (away.T @ values[g])
    return values


def soft_known(matrix: Floats, soft: tuple[int, ...]) -> Floats:
    """Return deviations of elements over their prior's."""
    found: Floats = np.sqrt(np.diagonal(matrix)[list(soft)]) / _SOFT
    return found


SOFT_KNOWN: Final = _SOFT_KNOWN


def block_length(n: int) -> int:
    """Return the ticks of a block of unseen scatter, for n ticks."""
    return int(np.clip(n // 16, 100, 300)) if n > 2400 else int(np.clip(n // 8, 20, 100))


def unseen(ticks: Ticks, group: Integers, soft: tuple[int, ...] | None) -> Floats:
    """Return the squared residual of each tick in blocks that the fit had not seen, shape (n,).

    Four folds of interleaved blocks. In a block the field is its own. None for ``soft`` is of raw
    samples.
    """
    fold = np.empty(ticks.n, dtype=np.int64)
    block = np.empty(ticks.n, dtype=np.int64)
    first = 0
    for g in range(int(group.max()) + 1):
        mine = np.flatnonzero(group == g)
        place = np.arange(len(mine)) // block_length(len(mine))
        if len(mine) and len(mine) % block_length(len(mine)) < 10 and place[-1]:
            place[place == place[-1]] = place[-1] - 1
        fold[mine], block[mine] = place % 4, first + place
        first += int(place[-1]) + 1 if len(mine) else 0
    squares = np.empty(ticks.n)
    for k in range(4):
        test = fold == k
        if not test.any():
            continue
        iron, matrix = np.zeros((int(group.max()) + 1, 3)), np.eye(3)
        if soft is not None and not test.all():
            train = ~test
            found = fit(ticks.only(train), group[train], soft)
            seen = np.zeros((len(iron), 3))
            seen[: len(found.iron)] = found.iron
            iron, matrix = seen, found.matrix
        squares[test] = _in_blocks(ticks.only(test), iron[group[test]], matrix, block[test])
    return squares


def _in_blocks(ticks: Ticks, iron: Floats, matrix: Floats, block: Integers) -> Floats:
    values, turn = ticks.field - iron, matrix @ ticks.back
    squares = np.empty(ticks.n)
    for b in np.unique(block):
        mine = block == b
        rows, seen = turn[mine].reshape(-1, 3), values[mine].ravel()
        field = np.linalg.lstsq(rows, seen, rcond=None)[0]
        squares[mine] = ((seen - rows @ field).reshape(-1, 3) ** 2).sum(axis=1) / 3.0
    return squares


def root_mean(squares: Floats) -> float:
    """Return the scatter of an axis, single squares limited to fifty medians."""
    return float(np.sqrt(np.minimum(squares, 50.0 * np.median(squares)).mean()))
