"""Low-pass filter that explains the spectrum of a record, and the noise below its corner.

A sensor's own low-pass removes the white noise at high frequencies. A model without a filter
explains the falling spectrum by flicker, and its N is half of the true N. Here the density is |H|^2
(N^2 + B^2/x + K^2/x^2) + ramp + unfiltered white noise, x = 2 sin(pi f). Seven shapes of |H|^2 are
tried. N^2 below the corner is the sum of both white noises.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from zerorate.noise.filter_fit import (
    SMALL_STEP,
    Fit,
    NarrowBands,
    Search,
    chance_of,
    deviance_of,
)
from zerorate.noise.low_pass import NO_CORNER, Estimate, Filtered
from zerorate.noise.responses import SHAPES, Shape, own_corner
from zerorate.types import Floats

_MAX_SCORE: Final = 3.0
"""Standard deviations of a density's fall towards half the rate below which no filter is searched.
"""
_MIN_CHANCE: Final = 0.01
_TOLERANCE: Final = 0.003
"""Error of a shape over its plateau: no filter follows its formula far in the stopband."""
_FILTER_COST: Final = 6.0
_AVERAGED_BIC: Final = 10.0
_NAMED_BELOW: Final = 0.25
"""Density at half the rate over the plateau above which no filter is named."""
_MIN_SENSOR_CORNER_HZ: Final = 1.0
"""Smallest corner of a filter, Hz; a lower corner may be drift."""
_MARKOV_BIC: Final = 15.0
_MARKOV_CHANCE: Final = 1e-3


def suspects_filter(
    basis: Floats, strengths: Floats, density: Floats, counts: Floats, frequency: Floats
) -> bool:
    """Return True if a model without a filter does not fit, above all at high frequencies.

    Parameters
    ----------
    basis, strengths : ndarray, shape (b, k), (k,)
        Model: density of each band for terms of unit strength, and their strengths.
    density, counts, frequency : ndarray, shape (b,)
        Density of each band, its number of independent lines, and its frequency in cycles per
        sample.
    """
    model, active = basis @ strengths, strengths > 0.0
    weight = np.sqrt(counts) / model
    falling, residual = np.cos(2.0 * np.pi * frequency) * weight, (density - model) * weight
    columns, _ = np.linalg.qr(basis[:, active] * weight[:, None])
    falling = falling - columns @ (columns.T @ falling)
    residual = residual - columns @ (columns.T @ residual)
    score = float(falling @ residual) / max(float(np.linalg.norm(falling)), 1e-300)
    chance = chance_of(
        deviance_of(density, model, counts), max(density.size - int(active.sum()), 1)
    )
    return abs(score) >= _MAX_SCORE or chance < _MIN_CHANCE


def find_filter(bands: NarrowBands, rate: float) -> Filtered | None:
    """Return the noise behind the best filter for a density, None if no filter fits better."""
    search = Search(bands)
    plain = search.fit(None, bands.counts)
    fits = [search.fit(shape, bands.counts) for shape in SHAPES]
    best = min(fits, key=lambda fit: fit.bic)
    model = np.maximum(search.columns(best.shape, best.p) @ best.c, 1e-12 * bands.density)
    counts = 1.0 / (1.0 / bands.counts + (_TOLERANCE * best.white / model) ** 2)
    plain = search.fit(None, counts)
    fits = [search.fit(fit.shape, counts, [fit.p]) for fit in fits]
    best = min(fits, key=lambda fit: fit.bic)
    is_better = best.bic < plain.bic - _FILTER_COST
    if is_better and best.chance >= _MARKOV_CHANCE:
        if _is_sensor(search, best, rate):
            return _average(search, fits, counts)
        drift = _markov_drift(search, fits, plain, counts)
        return drift
    if not is_better and plain.chance >= _MIN_CHANCE:
        return None
    part = _part_that_holds(search)
    if part is None and min(fit.chance for fit in (plain, best)) < _MARKOV_CHANCE:
        nothing = Estimate(math.nan, math.nan)
        return Filtered(nothing, nothing, nothing, nothing, math.nan, 1, 0.0, holds=False)
    return part


def _is_sensor(search: Search, fit: Fit, rate: float) -> bool:
    """Return True if a filter belongs to the sensor, and is not drift on a white floor."""
    shape = fit.shape
    assert shape is not None
    corner = shape.corner(fit.p)
    if corner * rate >= _MIN_SENSOR_CORNER_HZ:
        return True
    model = search.columns(shape, fit.p) @ fit.c
    width = search.f[:, -1] - search.f[:, 0]
    above = search.f.mean(axis=1) > corner
    return float(np.sum((model * width)[above])) < 0.5 * float(np.sum(model * width))


def _markov_drift(
    search: Search, fits: Sequence[Fit], plain: Fit, counts: Floats
) -> Filtered | None:
    """Return the white floor below a first-order process, if this clearly explains the density."""
    first = fits[0]
    if first.bic > plain.bic - _MARKOV_BIC or first.chance < _MARKOV_CHANCE or first.c[4] <= 0.0:
        return None
    covariance = search.covariance(first, counts)
    white = Estimate(float(first.c[4]), math.sqrt(covariance[4, 4]))
    flicker, walk, ramp = (_amplitude(search, first, counts, covariance, i) for i in (1, 2, 3))
    return Filtered(
        white,
        flicker,
        walk,
        ramp,
        deviance=first.deviance,
        freedom=_freedom(search, first),
        chance=first.chance,
    )


def _freedom(search: Search, fit: Fit) -> int:
    return max(search.density.size - int(np.count_nonzero(fit.c)) - fit.p.size, 1)


def _amplitude(search: Search, fit: Fit, counts: Floats, covariance: Floats, i: int) -> Estimate:
    value = float(fit.c[i])
    sigma = (
        math.sqrt(max(covariance[i, i], 0.0)) if value else search.sigma_of_absent(fit, counts, i)
    )
    return Estimate(value, sigma)


def _average(search: Search, fits: Sequence[Fit], counts: Floats) -> Filtered:
    """Return the mean over all filters that fit a density nearly like the best filter."""
    least = min(fit.bic for fit in fits)
    near = [fit for fit in fits if fit.bic <= least + _AVERAGED_BIC]
    odds = np.exp([-0.5 * (fit.bic - least) for fit in near])
    odds = odds / odds.sum()
    found = [_estimates(search, fit, counts) for fit in near]
    white, flicker, walk, ramp, corner = (
        _mixture(odds, [estimates[i] for estimates in found]) for i in range(5)
    )
    best = min(near, key=lambda fit: fit.bic)
    shape, p, c = best.shape, best.p, best.c
    assert shape is not None

    def response(f: Floats) -> Floats:
        return np.asarray((c[0] * shape.response(f, p) + c[4]) / (c[0] + c[4]))

    top = float((search.columns(shape, p) @ c)[-1])
    named = top < _NAMED_BELOW * best.white
    return Filtered(
        white, flicker, walk, ramp,
        deviance=best.deviance, freedom=_freedom(search, best), chance=best.chance,
        corner=corner if named else NO_CORNER,
        order=shape.order(p) if named else math.nan,
        response=response,
    )  # fmt: skip


def _estimates(search: Search, fit: Fit, counts: Floats) -> tuple[Estimate, ...]:
    """Return N^2, B^2, K^2, R^2 and the corner of one filter."""
    covariance = search.covariance(fit, counts)
    white = covariance[0, 0] + covariance[4, 4] + 2.0 * covariance[0, 4]
    shape = fit.shape
    assert shape is not None
    slope = np.zeros(len(covariance))
    for k in range(fit.p.size):
        step = np.eye(fit.p.size)[k] * SMALL_STEP
        change = shape.corner(fit.p + step) - shape.corner(fit.p - step)
        slope[5 + k] = change / (2.0 * SMALL_STEP)
    return (
        Estimate(fit.white, math.sqrt(max(float(white), 0.0))),
        *(_amplitude(search, fit, counts, covariance, i) for i in (1, 2, 3)),
        Estimate(shape.corner(fit.p), math.sqrt(max(float(slope @ covariance @ slope), 0.0))),
    )


def _mixture(odds: Floats, estimates: Sequence[Estimate]) -> Estimate:
    values, sigmas = np.array(estimates).T
    mean = float(odds @ values)
    return Estimate(mean, math.sqrt(float(odds @ (sigmas**2 + (values - mean) ** 2))))


_FIRST_PART: Final = 10
_PART_TRIES: Final = 30


def _part_that_holds(search: Search) -> Filtered | None:
    """Return the noise of the largest low-frequency part that a smooth response explains."""
    ends = np.unique(
        np.rint(np.geomspace(_FIRST_PART, search.density.size, _PART_TRIES)).astype(int)
    )
    for end in ends[::-1]:
        smooth = _smooth(search, int(end))
        if smooth is None:
            continue
        part, fit, degree = smooth
        if degree:
            half = int(np.searchsorted(search.f[:, 0], 0.5 * search.f[end - 1, -1]))
            if half >= _FIRST_PART:
                again = _smooth(search, half, degree)
                if again is None:
                    continue
                part, fit, degree = again
        return _of_part(part, fit)
    return None


def _smooth(search: Search, end: int, degree: int | None = None) -> tuple[Search, Fit, int] | None:
    """Return the fit of the first bands by terms times exp(a u + b u^2), None if none fits."""
    part = Search(NarrowBands(*(values[:end] for values in search.bands)))
    part.unfiltered = False
    highest = 2.0 * math.sin(math.pi * float(part.f[-1, -1]))

    def shape(count: int) -> Shape:
        def response(f: Floats, p: Floats) -> Floats:
            u = (2.0 * np.sin(np.pi * f) / highest) ** 2
            return np.asarray(
                np.exp(np.clip(sum(a * u ** (k + 1) for k, a in enumerate(p)), -30, 30))
            )

        return Shape(str(count), response, lambda low: [(0.0,) * count], own_corner, own_corner)

    degrees = (0, 1, 2) if degree is None else (degree,)
    fits = [(part.fit(shape(count), part.counts, [np.zeros(count)]), count) for count in degrees]
    fit, count = min(fits, key=lambda entry: entry[0].bic)
    return (part, fit, count) if fit.chance >= _MIN_CHANCE else None


def _of_part(part: Search, fit: Fit) -> Filtered:
    covariance = part.covariance(fit, part.counts)
    white, flicker, walk = (_amplitude(part, fit, part.counts, covariance, i) for i in (0, 1, 2))
    return Filtered(
        white,
        flicker,
        walk,
        ramp=Estimate(0.0, math.nan),
        deviance=fit.deviance,
        freedom=_freedom(part, fit),
        chance=fit.chance,
        up_to=float(part.f[-1, -1]),
    )
