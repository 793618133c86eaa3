"""Joint fit of hard iron, soft iron and field, its standard errors, and the scatter it leaves.

All in units of the field's median size. The model of a tick is y = D Bᵀ h + b: B the mean rotation
from the sensor to the gyro's frame, h the field there, which goes on every 20 s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.calibration.magnet.ticks import TICK, Ticks
from zerorate.types import Floats, Integers

_WINDOW: Final = 200
"""Ticks in which the field is one."""
_WALK: Final = 0.1
_IRON: Final = 1.0
_SOFT: Final = 0.2
_ROUNDS: Final = 8
_MEDIAN: Final = 0.79
"""Median of the square of a normal vector of three, over three."""
KNOWN: Final = 0.10
"""Deviation of a direction of the hard iron that is known."""
_SOFT_KNOWN: Final = 0.3
_UNMODELLED: Final = 0.03
_FLOOR: Final = 0.01


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
    groups = int(group.max()) + 1
    system = _System(ticks, group, window, soft)
    middle = np.median(ticks.turned, axis=0)
    fields = np.tile(middle, (int(window[-1]) + 1, 1))
    iron, elements = np.zeros((groups, 3)), np.zeros(8)
    weights, variance = np.ones(ticks.n), 0.0
    for _ in range(_ROUNDS):
        left = system.left(iron, elements, fields)
        weights, variance = _huber(left)
        step = system.step(left, iron, elements, fields, weights / variance)
        fields = fields + step[: fields.size].reshape(-1, 3)
        if soft:
            elements[list(soft)] += step[fields.size : fields.size + len(soft)]
        iron = iron + step[fields.size + len(soft) :].reshape(-1, 3)
        if np.abs(step).max() < 1e-7:
            break
    left = system.left(iron, elements, fields)
    scatter = float(np.sqrt(np.mean((left**2).sum(axis=1) * weights) / 3.0))
    return Fit(iron, elements, fields, window, scatter, weights)


def _huber(left: Floats) -> tuple[Floats, float]:
    squares = (left**2).sum(axis=1)
    variance = max(float(np.median(squares)) / 3.0 / _MEDIAN, 1e-10)
    return np.minimum(1.0, 2.5 * np.sqrt(variance / np.maximum(squares, 1e-30))), variance


class _System:
    """Normal equations of a fit: fields first, then elements of D, then hard irons."""

    def __init__(
        self, ticks: Ticks, group: Integers, window: Integers, soft: tuple[int, ...]
    ) -> None:
        self.ticks, self.group, self.window, self.soft = ticks, group, window, soft
        new = (np.diff(window, prepend=-1) != 0) | (np.diff(group, prepend=-1) != 0)
        starts = np.flatnonzero(new)
        self.parts = list(zip(starts, [*starts[1:], ticks.n], strict=True))
        self.windows, self.groups = int(window[-1]) + 1, int(group.max()) + 1

    def left(self, iron: Floats, elements: Floats, fields: Floats) -> Floats:
        """Residuals, shape (n, 3)."""
        seen = (self.ticks.back @ fields[self.window][:, :, None])[:, :, 0]
        left: Floats = self.ticks.field - seen @ matrix_of(elements).T - iron[self.group]
        return left

    def jacobian(self, elements: Floats, fields: Floats) -> Floats:
        """Return derivatives by field, elements of D and hard iron, shape (n, 3, 6 + soft)."""
        back = self.ticks.back
        found = np.empty((self.ticks.n, 3, 6 + len(self.soft)))
        found[:, :, :3] = matrix_of(elements) @ back
        seen = (back @ fields[self.window][:, :, None])[:, :, 0]
        for k, element in enumerate(self.soft):
            found[:, :, 3 + k] = seen @ BASIS[element].T
        found[:, :, 3 + len(self.soft) :] = np.eye(3)
        return found

    def step(
        self, left: Floats, iron: Floats, elements: Floats, fields: Floats, weights: Floats
    ) -> Floats:
        """Return the step of all unknowns."""
        first, soft = 3 * self.windows, len(self.soft)
        size = first + soft + 3 * self.groups
        normal, right = np.zeros((size, size)), np.zeros(size)
        jacobian = self.jacobian(elements, fields)
        for start, stop in self.parts:
            w, g = int(self.window[start]), int(self.group[start])
            places = [*range(3 * w, 3 * w + 3), *range(first, first + soft)]
            places += range(first + soft + 3 * g, first + soft + 3 * g + 3)
            rows = jacobian[start:stop].reshape(-1, 6 + soft)
            weighted = rows * np.repeat(weights[start:stop], 3)[:, None]
            normal[np.ix_(places, places)] += weighted.T @ rows
            right[places] += weighted.T @ left[start:stop].ravel()
        for w in range(self.windows - 1):
            one, other = slice(3 * w, 3 * w + 3), slice(3 * w + 3, 3 * w + 6)
            amount, apart = np.eye(3) / _WALK**2, (fields[w + 1] - fields[w]) / _WALK**2
            normal[one, one] += amount
            normal[other, other] += amount
            normal[one, other] -= amount
            normal[other, one] -= amount
            right[one] += apart
            right[other] -= apart
        inner, last = slice(first, first + soft), slice(first + soft, size)
        place = np.arange(size)
        normal[place[inner], place[inner]] += 1.0 / _SOFT**2
        right[inner] -= elements[list(self.soft)] / _SOFT**2
        normal[place[last], place[last]] += 1.0 / _IRON**2
        right[last] -= iron.ravel() / _IRON**2
        normal[place, place] += 1e-9
        return np.asarray(np.linalg.solve(normal, right), dtype=np.float64)


def covariance(ticks: Ticks, group: Integers, found: Fit, soft: tuple[int, ...] = ()) -> Floats:
    """Return the covariance of all elements of D and of the hard irons, shape (8 + 3 g, 8 + 3 g).

    Not noise limits it but the places: a field that varies with the place, and a place that goes
    with the pose, look like iron. A group counts for as many independent observations as it has
    tens of seconds, at most four. Elements of D that were not fitted may be a few per cent.
    """
    system = _System(ticks, group, found.window, FULL)
    jacobian = system.jacobian(found.elements, found.fields)
    size = 8 + 3 * system.groups
    information = np.zeros((size, size))
    variance = max(found.scatter**2, 1e-10)
    for g in range(system.groups):
        mine = np.flatnonzero(group == g)
        if not len(mine):
            continue
        part = _eliminated(jacobian[mine], found.weights[mine], found.window[mine], variance)
        count = min(max(min(4.0, len(mine) * TICK / 10.0), 0.5), 4.0)
        places = [*range(8), *range(8 + 3 * g, 11 + 3 * g)]
        limit = max(found.scatter, _FLOOR)
        information[np.ix_(places, places)] += part * (count / len(mine) / limit**2)
    prior = np.full(size, 1.0 / _IRON**2)
    prior[:8] = [1.0 / (_SOFT if k in soft else _UNMODELLED) ** 2 for k in range(8)]
    return np.asarray(np.linalg.inv(information + np.diag(prior)), dtype=np.float64)


def _eliminated(jacobian: Floats, weights: Floats, window: Integers, variance: float) -> Floats:
    """Information on elements of D and one hard iron, the fields unknown, of unit noise."""
    windows = np.unique(window, return_inverse=True)[1]
    number = int(windows[-1]) + 1
    inner, across = np.zeros((3 * number, 3 * number)), np.zeros((3 * number, 11))
    own = np.zeros((11, 11))
    for w in range(number):
        mine = windows == w
        rows = jacobian[mine].reshape(-1, 14)
        all_ = (rows * np.repeat(weights[mine], 3)[:, None]).T @ rows
        place = slice(3 * w, 3 * w + 3)
        inner[place, place] += all_[:3, :3]
        across[place] += all_[:3, 3:]
        own += all_[3:, 3:]
        if w:
            before = slice(3 * w - 3, 3 * w)
            amount = np.eye(3) * variance / _WALK**2
            inner[place, place] += amount
            inner[before, before] += amount
            inner[place, before] -= amount
            inner[before, place] -= amount
    left: Floats = own - across.T @ np.linalg.solve(inner + 1e-9 * np.eye(len(inner)), across)
    return 0.5 * (left + left.T)


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
