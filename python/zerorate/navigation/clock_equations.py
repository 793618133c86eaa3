"""Normal equations for a receiver's clock and antenna, from slopes of a filter's innovations."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from zerorate.types import Floats, Integers

RATE: Final = 2
ARM: Final = slice(3, 6)
SIZE: Final = 6
OFFSETS: Final = np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
"""Unknowns: offset of positions, offset of velocities, clock rate, antenna position (3)."""
_HUBER_LIMIT: Final = 3.0
_CHI_SQUARED_MEDIAN: Final = 0.455
"""Median of chi-squared with one degree of freedom."""
_BLOCK_S: Final = 10.0
_MIN_BLOCKS: Final = 3


@dataclass(frozen=True, eq=False)
class Slopes:
    """Forward and backward derivatives of m innovations by k parameters, shape (m, 6, k).

    The noises of both derivatives are independent, so their product has no bias.
    """

    forward: Floats
    backward: Floats


@dataclass(frozen=True, eq=False)
class Weights:
    """Huber weights of normalised innovations, shape (m, 6); 0 for a missing innovation."""

    scalars: Floats
    weights: Floats
    limit: float
    block: Integers

    @classmethod
    def of(cls, scalars: Floats, time: Floats) -> Weights:
        """Return the weights of innovations, for fixes at the given times, s."""
        size = np.abs(scalars)
        median = float(np.nanmedian(size**2)) if np.isfinite(size).any() else 0.0
        limit = _HUBER_LIMIT * max(1.0, math.sqrt(median / _CHI_SQUARED_MEDIAN))
        weights = np.minimum(1.0, limit / np.maximum(np.nan_to_num(size), 1e-12))
        weights[~np.isfinite(scalars)] = 0.0
        return cls(np.nan_to_num(scalars), weights, limit, np.floor((time - time[0]) / _BLOCK_S))

    def cost(self, scalars: Floats) -> float:
        """Return the Huber cost of innovations."""
        size = np.abs(scalars)
        limit = self.limit
        return float(np.where(size <= limit, size**2, limit * (2.0 * size - limit)).sum())


@dataclass(frozen=True, eq=False)
class ClockEquations:
    """Sums over blocks of ten seconds, in units of each parameter's prior standard deviation."""

    weights: Weights
    free: Integers
    unit: Floats
    away: Floats
    normal: Floats
    """Normal matrix from the mean slopes, shape (k, k)."""
    curvature: Floats
    """Normal matrix from forward slopes times backward slopes, shape (k, k)."""
    right: Floats
    """Right side of each block, shape (b, k)."""

    @classmethod
    def of(
        cls, weights: Weights, slopes: Slopes, free: Integers, sigma: Floats, away: Floats
    ) -> ClockEquations:
        """Return the equations for the `free` parameters, with their prior `sigma`."""
        unit = sigma[free]
        forward, backward = slopes.forward * unit, slopes.backward * unit
        known = np.isfinite((forward + backward).sum(axis=2))
        w = np.where(known, weights.weights, 0.0)
        forward, backward = (np.where(known[..., np.newaxis], x, 0.0) for x in (forward, backward))
        mean = 0.5 * (forward + backward)
        normal = np.einsum("ma,mai,maj->ij", w, mean, mean)
        product = np.einsum("ma,mai,maj->ij", w, forward, backward)
        each = np.einsum("ma,mai,ma->mi", w, mean, weights.scalars)
        begins = np.flatnonzero(np.diff(weights.block, prepend=-1.0))
        right = np.add.reduceat(each, begins, axis=0) if len(each) else each
        right = right[np.abs(right).sum(axis=1) > 0.0]
        return cls(weights, free, unit, away, normal, 0.5 * (product + product.T), right)

    def without_rate(self, rate: float) -> ClockEquations:
        """Return the equations without the clock's rate."""
        here = self.free == RATE
        others = np.flatnonzero(~here)
        back = self.normal[:, here][others, 0] * (rate / self.unit[here][0]) if here.any() else 0.0
        right = self.right[:, others] - back / max(1, len(self.right))
        pick = np.ix_(others, others)
        return replace(
            self, free=self.free[others], unit=self.unit[others], away=self.away[others],
            normal=self.normal[pick], curvature=self.curvature[pick], right=right,
        )  # fmt: skip

    def solve(self) -> Floats | None:
        """Return the step from the sum of all blocks, shape (6,). None if undetermined."""
        if len(self.right) < _MIN_BLOCKS:
            return None
        return self._in_units(np.asarray(np.linalg.solve(self._prior + self.normal, self._total)))

    def remaining(self) -> Floats | None:
        """Return the step from the curvature, which the noise of the slopes does not shorten."""
        if len(self.right) < _MIN_BLOCKS:
            return None
        return self._in_units(np.asarray(np.linalg.solve(self._information, self._total)))

    def sigmas(self) -> Floats | None:
        """Return standard deviations: the larger of unit-innovation and leave-block-out values."""
        n = len(self.right)
        if n < _MIN_BLOCKS:
            return None
        inverse = np.linalg.inv(self._information)
        stated = np.diag(inverse @ (self.normal + self._prior) @ inverse)
        spread = (self.right - self.right.mean(axis=0)) @ inverse
        left_out = n / (n - 1.0) * (spread**2).sum(axis=0)
        return self._in_units(np.sqrt(np.maximum(stated, left_out)))

    @property
    def _prior(self) -> Floats:
        return np.eye(len(self.free))

    @property
    def _total(self) -> Floats:
        total: Floats = self.right.sum(axis=0) + self.away
        return total

    @property
    def _information(self) -> Floats:
        """Curvature plus prior, made positive semidefinite."""
        values, vectors = np.linalg.eigh(self.curvature)
        information: Floats = (vectors * np.maximum(values, 0.0)) @ vectors.T + self._prior
        return information

    def _in_units(self, values: npt.NDArray[np.floating[Any]]) -> Floats:
        all_values = np.zeros(SIZE)
        all_values[self.free] = values * self.unit
        return all_values
