"""Fits of noise behind a filter to the densities of narrow bands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final, NamedTuple

import numpy as np

from zerorate.noise.least_squares import solve_non_negative
from zerorate.noise.responses import Shape
from zerorate.types import Floats

_MAX_STEPS: Final = 40
SMALL_STEP: Final = 1e-4
"""Change of a shape's parameter for numerical slopes."""
_SMALL_GAIN: Final = 1e-2
_MIN_SINGULAR: Final = 1e-6


class NarrowBands(NamedTuple):
    """Densities of narrow bands, with the sample as unit of time.

    Parameters
    ----------
    frequency : ndarray, shape (b, p)
        Frequencies in each band, cycles per sample.
    counts : ndarray, shape (b,)
        Number of independent lines of each band.
    ramp : ndarray, shape (b,)
        Density of a record that grows by one per sample.
    density : ndarray, shape (b,)
        Density of the record.
    """

    frequency: Floats
    counts: Floats
    ramp: Floats
    density: Floats


@dataclass(frozen=True)
class Fit:
    """Parameters of one shape, and the quality of its fit to the density."""

    shape: Shape | None
    p: Floats
    c: Floats
    deviance: float
    bic: float
    chance: float

    @property
    def white(self) -> float:
        """N^2."""
        return float(self.c[0] + self.c[4]) if self.shape else float(self.c[0])


def deviance_of(density: Floats, model: Floats, counts: Floats) -> float:
    """Return twice the loss of log likelihood against a perfect model, for gamma densities."""
    ratio = density / model
    return float(2.0 * np.sum(counts * (ratio - 1.0 - np.log(ratio))))


def chance_of(deviance: float, freedom: int) -> float:
    """Return the probability of a larger deviance, by Wilson and Hilferty's cube root."""
    z = ((deviance / freedom) ** (1.0 / 3.0) - 1.0 + 2.0 / (9.0 * freedom)) / math.sqrt(
        2.0 / (9.0 * freedom)
    )
    return 0.5 * math.erfc(z / math.sqrt(2.0))


_SUBSETS: Final = np.array(list(product((0.0, 1.0), repeat=5)))[1:]
_RIDGE: Final = 1e-12


def _linear(columns: Floats, density: Floats, counts: Floats, rounds: int = 6) -> Floats:
    """Return the non-negative amplitudes that explain a density, by scoring.

    `columns` has shape (..., b, 5): many problems are solved at once. Each solution is the best
    subset with only positive amplitudes.
    """
    weight = np.broadcast_to(np.sqrt(counts) / density, columns.shape[:-1])
    for _ in range(rounds):
        scaled = columns * weight[..., None]
        lengths = np.maximum(np.linalg.norm(scaled, axis=-2), 1e-300)
        scaled = scaled / lengths[..., None, :]
        gram = np.swapaxes(scaled, -1, -2) @ scaled
        goal = np.einsum("...bk,...b->...k", scaled, density * weight)
        c = _best_subset(gram, goal) / lengths
        model = np.einsum("...bk,...k->...b", columns, c)
        weight = np.sqrt(counts) / np.maximum(model, 1e-12 * density)
    return np.asarray(c)


def _best_subset(gram: Floats, goal: Floats) -> Floats:
    """Return the least squares of at most five columns without a negative amplitude."""
    inside = _SUBSETS[:, :, None] * _SUBSETS[:, None, :]
    outside = np.eye(5) * (1.0 - _SUBSETS)[:, None, :] + _RIDGE * np.eye(5)
    right = goal[..., None, :] * _SUBSETS
    x = np.linalg.solve(gram[..., None, :, :] * inside + outside, right[..., None])[..., 0]
    gain = np.where(np.all(x >= 0.0, axis=-1), np.sum(x * right, axis=-1), -np.inf)
    best = np.argmax(gain, axis=-1)
    solution: Floats = np.take_along_axis(x, best[..., None, None], axis=-2)[..., 0, :]
    return solution


class Search:
    """Fits of shapes to the densities of one record."""

    def __init__(self, bands: NarrowBands) -> None:
        self.bands = bands
        self.f, self.density, self.counts = bands.frequency, bands.density, bands.counts
        x = 2.0 * np.sin(np.pi * self.f)
        self.drift = np.stack([np.ones_like(x), 1.0 / x, 1.0 / x**2])
        self.quantised = np.mean(x**2, axis=1)
        self.lowest = float(self.f[0].mean())
        self.unfiltered = True

    def columns(self, shape: Shape | None, p: Floats) -> Floats:
        """Return the columns white, flicker, walk, ramp, and unfiltered white noise."""
        if shape is None:
            parts = [*self.drift.mean(axis=2), self.bands.ramp, self.quantised]
        else:
            parts = [*(self.drift * shape.response(self.f, p)).mean(axis=2)]
            others = (self.bands.ramp, np.ones_like(self.density))
            parts += [part * self.unfiltered for part in others]
        return np.stack(parts, axis=1)

    def fit(self, shape: Shape | None, counts: Floats, starts: Sequence[Floats] = ()) -> Fit:
        """Return the best fit of a shape, from given start values or from the shape's own."""
        if shape is None:
            columns = self.columns(None, np.empty(0))
            c = _linear(columns, self.density, counts, 12)
            return self._judged(None, np.empty(0), c, counts)
        if not len(starts):
            trials = [np.array(p) for p in shape.starts(self.lowest)]
            columns = np.stack([self.columns(shape, p) for p in trials])
            models = np.einsum("tbk,tk->tb", columns, _linear(columns, self.density, counts, 3))
            ratio = self.density / np.maximum(models, 1e-12 * self.density)
            deviances = np.sum(counts * (ratio - 1.0 - np.log(ratio)), axis=1)
            starts = [trials[i] for i in np.argsort(deviances)[:2]]
        fits = [self._refine(shape, p, counts) for p in starts]
        return min(fits, key=lambda fit: fit.deviance)

    def _refine(self, shape: Shape, p: Floats, counts: Floats) -> Fit:
        columns = self.columns(shape, p)
        c = _linear(columns, self.density, counts)
        model = np.maximum(columns @ c, 1e-12 * self.density)
        least = deviance_of(self.density, model, counts)
        for _ in range(_MAX_STEPS):
            weight = (np.sqrt(counts) / model)[:, None]
            slopes = self.slopes(shape, p, c)
            both = np.hstack((columns, slopes, -slopes)) * weight
            squares = solve_non_negative(both, self.density * weight[:, 0])
            k, n = c.size, p.size
            step, goal = squares[k : k + n] - squares[k + n :], squares[:k]
            before, share = least, 1.0
            while share > 1e-3:
                p_new, c_new = p + np.clip(share * step, -0.5, 0.5), c + share * (goal - c)
                columns_new = self.columns(shape, p_new)
                model_new = np.maximum(columns_new @ c_new, 1e-12 * self.density)
                deviance = deviance_of(self.density, model_new, counts)
                if deviance < least:
                    p, c, columns, model, least = p_new, c_new, columns_new, model_new, deviance
                    break
                share *= 0.5
            if before - least < _SMALL_GAIN:
                break
        return self._judged(shape, p, c, counts)

    def slopes(self, shape: Shape, p: Floats, c: Floats) -> Floats:
        """Return the derivatives of the model by each parameter of the shape, shape (b, n)."""
        steps = np.eye(p.size) * SMALL_STEP
        if not p.size:
            return np.empty((self.density.size, 0))
        ups = [
            self.columns(shape, p + step) @ c - self.columns(shape, p - step) @ c for step in steps
        ]
        return np.stack(ups, axis=1) / (2.0 * SMALL_STEP)

    def _judged(self, shape: Shape | None, p: Floats, c: Floats, counts: Floats) -> Fit:
        model = np.maximum(self.columns(shape, p) @ c, 1e-12 * self.density)
        deviance = deviance_of(self.density, model, counts)
        free = int(np.count_nonzero(c)) + p.size
        bic = deviance + free * math.log(float(counts.sum()))
        chance = chance_of(deviance, max(self.density.size - free, 1))
        return Fit(shape, p, c, deviance, bic, chance)

    def covariance(self, fit: Fit, counts: Floats) -> Floats:
        """Return the covariance of all c and p, for c that are nonzero or in the terms."""
        columns = self.columns(fit.shape, fit.p)
        model = np.maximum(columns @ fit.c, 1e-12 * self.density)
        slopes = self.slopes(fit.shape, fit.p, fit.c) if fit.shape else np.empty((model.size, 0))
        free = fit.c > 0.0
        used = np.hstack((columns[:, free], slopes)) * (np.sqrt(counts) / model)[:, None]
        index = np.concatenate((np.flatnonzero(free), 5 + np.arange(fit.p.size)))
        full = np.zeros((5 + fit.p.size,) * 2)
        full[np.ix_(index, index)] = _inverse_gram(used)
        return full

    def sigma_of_absent(self, fit: Fit, counts: Floats, i: int) -> float:
        """Return the standard error of amplitude i if its estimate is zero."""
        c = fit.c.copy()
        c[i] = max(c[i], 1e-12 * c.max())
        full = self.covariance(Fit(fit.shape, fit.p, c, 0.0, 0.0, 0.0), counts)
        return math.sqrt(max(full[i, i], 0.0))


def _inverse_gram(matrix: Floats) -> Floats:
    lengths = np.linalg.norm(matrix, axis=0)
    lengths[lengths == 0.0] = 1.0
    _, values, vectors = np.linalg.svd(matrix / lengths, full_matrices=False)
    values = np.maximum(values, _MIN_SINGULAR * values.max(initial=1.0))
    inverse = vectors.T / values
    product: Floats = inverse @ inverse.T / np.outer(lengths, lengths)
    return product
