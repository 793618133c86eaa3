"""Low-pass filters in the spectrum of a record: which one, its corner, and the noise below it.

A sensor's own low-pass takes the fast half of its white noise away. A model without a filter
explains the falling spectrum by flicker, and N comes out at half. Here the density is
|H|^2 (N^2 + B^2/x + K^2/x^2) + ramp + white noise that is not filtered, x = 2 sin(pi f), for seven
shapes of |H|^2; N^2 below the corner is the first and the last white noise together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.noise.coefficient import Coefficient, CoefficientField
from zerorate.noise.least_squares import solve_non_negative
from zerorate.noise.processes import Process
from zerorate.types import Floats

_MAX_SCORE: Final = 3.0
"""Standard deviations of a density that falls towards half the rate, where none is looked for."""
_MIN_CHANCE: Final = 0.01
_POINTS: Final = 12
"""Points of a band at which a model is computed."""
_TOLERANCE: Final = 0.003
"""Error of a shape, over its plateau: no filter is as it is named far down its stopband."""
_FILTER_COST: Final = 6.0
_AVERAGED_BIC: Final = 10.0
_NAMED_BELOW: Final = 0.25
"""Density at half the rate over the plateau, above which no filter is named."""
_MIN_SENSOR_CORNER_HZ: Final = 1.0
"""A corner from here on is a filter, not drift."""
_MARKOV_BIC: Final = 15.0
_MARKOV_CHANCE: Final = 1e-3
_WHOLE_ORDER: Final = 0.05
_SHARE_POINTS: Final = 1 << 14
_MAX_SIMPLE_MEAN: Final = 12.0
_MEAN_CORNER: Final = 0.4429
_CUBE_CORNER: Final = 0.2622
_MAX_STEPS: Final = 40
_SMALL_STEP: Final = 1e-4
_SMALL_GAIN: Final = 1e-2
_MIN_SINGULAR: Final = 1e-6
_ONE_SIDED_95: Final = 1.6448536269514722


@dataclass(frozen=True)
class LowPass:
    """A low-pass filter between the noise of a sensor and its samples.

    Parameters
    ----------
    corner : Coefficient
        Frequency at which the density is half, Hz.
    order : float
        Order of the filter; infinite for a moving average.

    Examples
    --------
    >>> from zerorate.noise import Coefficient, LowPass
    >>> print(LowPass(Coefficient(20.02, sigma=0.1), 2.0))
    low-passed at 20.02 ± 0.10 Hz, second order
    """

    corner: CoefficientField = CoefficientField(positive=True, required=True)
    order: float = 2.0

    def __post_init__(self) -> None:
        """Check the order."""
        if self.order <= 0.0:
            raise ArgumentError("order", f"must be positive, got {self.order}")

    def passed_share(self, rate: float) -> float:
        """Return the share of the variance of white noise that passes, at a rate in Hz.

        Examples
        --------
        >>> from zerorate.noise import LowPass
        >>> round(1.0 / LowPass(5.0, 1.0).passed_share(200.0))  # a sample varies so much less
        14
        """
        f: Floats = (np.arange(_SHARE_POINTS, dtype=np.float64) + 0.5) * (0.5 / _SHARE_POINTS)
        corner: Floats = np.array([math.log(min(float(self.corner) / rate, 0.4999))])
        if math.isinf(self.order):
            return float(_mean(f[:, None], corner).mean())
        order = 2.0 if math.isnan(self.order) else self.order
        return float(_butterworth(order)(f, corner).mean())

    def __str__(self) -> str:
        """Return corner and order in words."""
        sigma = self.corner.sigma
        if not sigma:
            return f"low-passed at {self.corner.value:g} Hz, {_order_in_words(self.order)}"
        digits = max(0, 1 - math.floor(math.log10(sigma)))
        corner = f"{self.corner.value:.{digits}f} ± {sigma:.{digits}f}"
        return f"low-passed at {corner} Hz, {_order_in_words(self.order)}"


def _order_in_words(order: float) -> str:
    if math.isinf(order):
        return "moving average"
    if math.isnan(order):
        return "two poles"
    words = {1.0: "first order", 2.0: "second order", 3.0: "third order", 4.0: "fourth order"}
    return words.get(order, f"order {order:.2g}")


_MIN_RESPONSE_LINES: Final = 1 << 12
_MAX_RESPONSE_LINES: Final = 1 << 18


def process_of(filtered: Filtered) -> Process:
    """Return white noise behind a filter, of unit density well below its corner.

    From the autocovariance r of its rate: s(k+1) - s(k) = -(r(0)/2 + r(1) + ... + r(k)).
    """
    assert filtered.response is not None
    lines = _MIN_RESPONSE_LINES
    if filtered.corner.value > 0.0:
        lines = max(lines, 1 << math.ceil(math.log2(64.0 / filtered.corner.value)))
    lines = min(lines, _MAX_RESPONSE_LINES)
    density = filtered.response((np.arange(lines + 1) * 0.5 / lines)[:, None])[:, 0]
    covariance = np.fft.irfft(density)[:lines]
    covariance[0] *= 0.5
    slope = -np.cumsum(covariance)
    phase = np.concatenate(([0.0], np.cumsum(slope)))
    # The running sum, whose negative second difference is the phase, and which is even.
    rise = np.concatenate(([0.0], -np.cumsum(phase[1:-1])))
    summed = np.concatenate(([0.0], np.cumsum(rise)))
    return Process(
        phase=lambda k: _continued(phase, np.abs(k), 0),
        summed=lambda k: _continued(summed, np.abs(k), 1),
    )


def _continued(table: Floats, k: Floats, sums: int) -> Floats:
    """Return a table at lags, beyond its memory as white noise goes on."""
    last = len(table) - 1
    near = np.interp(np.minimum(k, last), np.arange(len(table)), table)
    over = np.maximum(k - last, 0.0)
    if sums == 0:
        return near - 0.5 * over
    level = -(table[last] - 2.0 * table[last - 1] + table[last - 2])
    step = table[last] - table[last - 1]
    # -phase(last + j) = level' + j/2, summed twice.
    cube = over * (over - 1.0) * (over + 1.0) / 12.0
    return np.asarray(near + over * step - (level - 0.5) * over * (over + 1.0) / 2.0 + cube)


class NarrowBands(NamedTuple):
    """Densities of narrow bands, with the sample as unit of time.

    Parameters
    ----------
    frequency : ndarray, shape (b, p)
        Points of each band, cycles a sample.
    counts : ndarray, shape (b,)
        Independent lines of each band.
    ramp : ndarray, shape (b,)
        Density of a record that grows by one a sample.
    density : ndarray, shape (b,)
        Of the record.
    """

    frequency: Floats
    counts: Floats
    ramp: Floats
    density: Floats


class _Shape(NamedTuple):
    """A family of filters: squared magnitude at points for numbers p, where to begin, and names."""

    name: str
    response: Callable[[Floats, Floats], Floats]
    starts: Callable[[float], Sequence[Sequence[float]]]
    corner: Callable[[Floats], float]
    order: Callable[[Floats], float]


def _tangent_ratio(f: Floats, corner: float) -> Floats:
    ratio: Floats = np.tan(np.pi * np.minimum(f, 0.499999)) / math.tan(math.pi * corner)
    return ratio


def _inside(log_corner: float) -> float:
    return min(math.exp(log_corner), 0.4999)


def _exponential(f: Floats, p: Floats) -> Floats:
    corner = math.sin(math.pi * _inside(p[0]))
    return 1.0 / (1.0 + (np.sin(np.pi * f) / corner) ** 2)


def _butterworth(order: float) -> Callable[[Floats, Floats], Floats]:
    return lambda f, p: 1.0 / (1.0 + _tangent_ratio(f, _inside(p[0])) ** (2.0 * order))


def _any_butterworth(f: Floats, p: Floats) -> Floats:
    order = min(max(math.exp(p[1]), 0.3), 12.0)
    ratio = np.maximum(_tangent_ratio(f, _inside(p[0])), 1e-30)
    log_ratio = 2.0 * order * np.log(ratio)
    return 1.0 / (1.0 + np.exp(np.minimum(log_ratio, 600.0)))


def _aliased(f: Floats, p: Floats) -> Floats:
    corner = math.exp(p[0])
    aliases = range(-3, 4)
    total = sum(1.0 / (1.0 + ((f + k) / corner) ** 4) for k in aliases)
    level = sum(1.0 / (1.0 + (k / corner) ** 4) for k in aliases)
    return np.asarray(total / level)


def _damped(f: Floats, p: Floats) -> Floats:
    t = _tangent_ratio(f, _inside(p[0])) ** 2
    damping = math.exp(p[1])
    return 1.0 / ((1.0 - t) ** 2 + 4.0 * damping**2 * t)


def _damped_corner(p: Floats) -> float:
    half = 1.0 - 2.0 * math.exp(p[1]) ** 2
    ratio = math.sqrt(half + math.sqrt(half**2 + 1.0))
    return math.atan(ratio * math.tan(math.pi * _inside(p[0]))) / math.pi


def _mean(f: Floats, p: Floats) -> Floats:
    width = max(_MEAN_CORNER / math.exp(p[0]), 1.0001)
    if width > _MAX_SIMPLE_MEAN:
        x = width * np.sin(np.pi * f)
        return np.where(x > 1e-9, np.sin(np.pi * width * f) / np.maximum(x, 1e-9), 1.0) ** 2
    lags = np.arange(1, math.ceil(width))
    weights = 1.0 - lags / width
    series = 1.0 + 2.0 * np.tensordot(weights, np.cos(2.0 * np.pi * lags[:, None, None] * f), 1)
    return np.asarray(np.maximum(series / (1.0 + 2.0 * weights.sum()), 0.0))


def _cube(f: Floats, p: Floats) -> Floats:
    width = _CUBE_CORNER / math.exp(p[0])
    aliases = range(-2, 3)
    total = sum(np.sinc(width * (f + k)) ** 6 for k in aliases)
    level = sum(float(np.sinc(width * k)) ** 6 for k in aliases)
    return np.asarray(total / level)


def _corners(lowest: float, count: int = 24) -> Floats:
    corners: Floats = np.geomspace(2.5 * lowest, 0.47, count)
    return corners


def _plain_starts(*others: float) -> Callable[[float], Sequence[Sequence[float]]]:
    return lambda lowest: [(math.log(corner), *others) for corner in _corners(lowest)]


def _mean_starts(lowest: float) -> Sequence[Sequence[float]]:
    widths = np.unique(np.rint(np.geomspace(2.0, min(80.0, _MEAN_CORNER / lowest), 48)))
    return [(math.log(_MEAN_CORNER / width),) for width in widths]


def _cube_starts(lowest: float) -> Sequence[Sequence[float]]:
    return [(math.log(corner),) for corner in _corners(lowest, 48)]


def _own_corner(p: Floats) -> float:
    return math.exp(p[0])


def _own_order(p: Floats) -> float:
    order = math.exp(p[1])
    whole = max(round(order), 1)
    return float(whole) if abs(order - whole) < _WHOLE_ORDER * whole else order


def _damped_order(p: Floats) -> float:
    return 2.0 if 0.5 < math.exp(p[1]) < 1.0 else math.nan


_SHAPES: Final = (
    _Shape("one", _exponential, _plain_starts(), _own_corner, lambda p: 1.0),
    _Shape("oneb", _butterworth(1.0), _plain_starts(), _own_corner, lambda p: 1.0),
    _Shape("two", _butterworth(2.0), _plain_starts(), _own_corner, lambda p: 2.0),
    _Shape(
        "bw", _any_butterworth, _plain_starts(math.log(1.5)), _own_corner, lambda p: math.exp(p[1])
    ),
    _Shape("twoa", _aliased, _plain_starts(), _own_corner, lambda p: 2.0),
    _Shape("damp", _damped, _plain_starts(math.log(0.7)), _damped_corner, _damped_order),
    _Shape("mean", _mean, _mean_starts, _own_corner, lambda p: math.inf),
    _Shape("sinc3", _cube, _cube_starts, _own_corner, lambda p: 3.0),
)


@dataclass(frozen=True)
class _Fit:
    """Parameters of one shape, and the quality of its fit to the density."""

    shape: _Shape | None
    p: Floats
    c: Floats
    deviance: float
    bic: float
    chance: float

    @property
    def white(self) -> float:
        """N^2."""
        return float(self.c[0] + self.c[4]) if self.shape else float(self.c[0])


def _deviance(density: Floats, model: Floats, counts: Floats) -> float:
    ratio = density / model
    return float(2.0 * np.sum(counts * (ratio - 1.0 - np.log(ratio))))


def _chance(deviance: float, freedom: int) -> float:
    """Return the probability of a larger deviance, by Wilson and Hilferty's cube root."""
    z = ((deviance / freedom) ** (1.0 / 3.0) - 1.0 + 2.0 / (9.0 * freedom)) / math.sqrt(
        2.0 / (9.0 * freedom)
    )
    return 0.5 * math.erfc(z / math.sqrt(2.0))


_SUBSETS: Final = np.array(list(product((0.0, 1.0), repeat=5)))[1:]
_RIDGE: Final = 1e-12


def _linear(columns: Floats, density: Floats, counts: Floats, rounds: int = 6) -> Floats:
    """Return the amplitudes from zero on that explain a density, by scoring.

    `columns` has shape (..., b, 5): many problems are solved at once, each by the best of the
    subsets of its amplitudes that are all above zero.
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
    """Return the least squares of at most five columns with no negative amplitude."""
    inside = _SUBSETS[:, :, None] * _SUBSETS[:, None, :]
    outside = np.eye(5) * (1.0 - _SUBSETS)[:, None, :] + _RIDGE * np.eye(5)
    right = goal[..., None, :] * _SUBSETS
    x = np.linalg.solve(gram[..., None, :, :] * inside + outside, right[..., None])[..., 0]
    gain = np.where(np.all(x >= 0.0, axis=-1), np.sum(x * right, axis=-1), -np.inf)
    best = np.argmax(gain, axis=-1)
    found: Floats = np.take_along_axis(x, best[..., None, None], axis=-2)[..., 0, :]
    return found


class _Search:
    """Fits of shapes to the densities of one record."""

    def __init__(self, bands: NarrowBands) -> None:
        self.bands = bands
        self.f, self.density, self.counts = bands.frequency, bands.density, bands.counts
        x = 2.0 * np.sin(np.pi * self.f)
        self.drift = np.stack([np.ones_like(x), 1.0 / x, 1.0 / x**2])
        self.quantised = np.mean(x**2, axis=1)
        self.lowest = float(self.f[0].mean())
        self.unfiltered = True

    def columns(self, shape: _Shape | None, p: Floats) -> Floats:
        """Return white, flicker, walk, ramp, and white noise that is not filtered."""
        if shape is None:
            parts = [*self.drift.mean(axis=2), self.bands.ramp, self.quantised]
        else:
            parts = [*(self.drift * shape.response(self.f, p)).mean(axis=2)]
            others = (self.bands.ramp, np.ones_like(self.density))
            parts += [part * self.unfiltered for part in others]
        return np.stack(parts, axis=1)

    def fit(self, shape: _Shape | None, counts: Floats, starts: Sequence[Floats] = ()) -> _Fit:
        """Return the best fit of a shape, from these starts or from all of its own."""
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

    def _refine(self, shape: _Shape, p: Floats, counts: Floats) -> _Fit:
        columns = self.columns(shape, p)
        c = _linear(columns, self.density, counts)
        model = np.maximum(columns @ c, 1e-12 * self.density)
        least = _deviance(self.density, model, counts)
        for _ in range(_MAX_STEPS):
            weight = (np.sqrt(counts) / model)[:, None]
            slopes = self.slopes(shape, p, c)
            both = np.hstack((columns, slopes, -slopes)) * weight
            found = solve_non_negative(both, self.density * weight[:, 0])
            k, n = c.size, p.size
            step, goal = found[k : k + n] - found[k + n :], found[:k]
            before, share = least, 1.0
            while share > 1e-3:
                p_new, c_new = p + np.clip(share * step, -0.5, 0.5), c + share * (goal - c)
                columns_new = self.columns(shape, p_new)
                model_new = np.maximum(columns_new @ c_new, 1e-12 * self.density)
                deviance = _deviance(self.density, model_new, counts)
                if deviance < least:
                    p, c, columns, model, least = p_new, c_new, columns_new, model_new, deviance
                    break
                share *= 0.5
            if before - least < _SMALL_GAIN:
                break
        return self._judged(shape, p, c, counts)

    def slopes(self, shape: _Shape, p: Floats, c: Floats) -> Floats:
        """Return the derivatives of the model by each number of the shape, shape (b, n)."""
        steps = np.eye(p.size) * _SMALL_STEP
        if not p.size:
            return np.empty((self.density.size, 0))
        ups = [
            self.columns(shape, p + step) @ c - self.columns(shape, p - step) @ c for step in steps
        ]
        return np.stack(ups, axis=1) / (2.0 * _SMALL_STEP)

    def _judged(self, shape: _Shape | None, p: Floats, c: Floats, counts: Floats) -> _Fit:
        model = np.maximum(self.columns(shape, p) @ c, 1e-12 * self.density)
        deviance = _deviance(self.density, model, counts)
        free = int(np.count_nonzero(c)) + p.size
        bic = deviance + free * math.log(float(counts.sum()))
        chance = _chance(deviance, max(self.density.size - free, 1))
        return _Fit(shape, p, c, deviance, bic, chance)

    def covariance(self, fit: _Fit, counts: Floats) -> Floats:
        """Return the covariance of all c and p, where c is not zero or is one of the terms."""
        columns = self.columns(fit.shape, fit.p)
        model = np.maximum(columns @ fit.c, 1e-12 * self.density)
        slopes = self.slopes(fit.shape, fit.p, fit.c) if fit.shape else np.empty((model.size, 0))
        free = fit.c > 0.0
        used = np.hstack((columns[:, free], slopes)) * (np.sqrt(counts) / model)[:, None]
        index = np.concatenate((np.flatnonzero(free), 5 + np.arange(fit.p.size)))
        full = np.zeros((5 + fit.p.size,) * 2)
        full[np.ix_(index, index)] = _inverse_gram(used)
        return full

    def sigma_of_absent(self, fit: _Fit, counts: Floats, i: int) -> float:
        """Return the standard error that amplitude i, found to be zero, would have."""
        c = fit.c.copy()
        c[i] = max(c[i], 1e-12 * c.max())
        full = self.covariance(_Fit(fit.shape, fit.p, c, 0.0, 0.0, 0.0), counts)
        return math.sqrt(max(full[i, i], 0.0))


def _inverse_gram(matrix: Floats) -> Floats:
    lengths = np.linalg.norm(matrix, axis=0)
    lengths[lengths == 0.0] = 1.0
    _, values, vectors = np.linalg.svd(matrix / lengths, full_matrices=False)
    values = np.maximum(values, _MIN_SINGULAR * values.max(initial=1.0))
    inverse = vectors.T / values
    product: Floats = inverse @ inverse.T / np.outer(lengths, lengths)
    return product


class Estimate(NamedTuple):
    """A squared amplitude with its standard error, in densities with the sample as unit of time."""

    value: float
    sigma: float


_NO_CORNER: Final = Estimate(math.nan, math.nan)


@dataclass(frozen=True)
class Filtered:
    """Noise behind a filter, estimated from the spectrum, the sample as unit of time.

    Attributes
    ----------
    white, flicker, walk, ramp : Estimate
        N^2, B^2, K^2 and R^2.
    deviance, freedom, chance : float, int, float
        Of the best model, and the probability of a larger one.
    corner : Estimate
        Of the filter, cycles a sample; NaN where none is named.
    order : float
        Of the filter.
    up_to : float
        Frequency below which the model holds, cycles a sample; NaN for all.
    response : callable
        Density of the white noise over N^2, at frequencies in cycles a sample.
    holds : bool
        False where neither a filter nor any part of the spectrum is explained.
    """

    white: Estimate
    flicker: Estimate
    walk: Estimate
    ramp: Estimate
    deviance: float
    freedom: int
    chance: float
    corner: Estimate = _NO_CORNER
    order: float = math.nan
    up_to: float = math.nan
    response: Callable[[Floats], Floats] | None = field(default=None, repr=False)
    holds: bool = True

    @property
    def named(self) -> bool:
        """True if a filter is certain enough to be named."""
        return math.isfinite(self.corner.value)


def band_fields(filtered: Filtered, rate: float) -> dict[str, Any]:
    """Return the fields of a model on the filter: `low_pass` and `up_to`, Hz."""
    fields: dict[str, Any] = {}
    if filtered.named:
        corner = Coefficient(filtered.corner.value * rate, filtered.corner.sigma * rate)
        fields["low_pass"] = LowPass(corner, filtered.order)
    if math.isfinite(filtered.up_to):
        fields["up_to"] = filtered.up_to * rate
    return fields


def suspects_filter(
    basis: Floats, strengths: Floats, density: Floats, counts: Floats, frequency: Floats
) -> bool:
    """Return True if a model without a filter misses a density, above all by its fast end.

    Parameters
    ----------
    basis, strengths : ndarray, shape (b, k), (k,)
        The model: density of each band for terms of unit strength, and their strengths.
    density, counts, frequency : ndarray, shape (b,)
        Of each band, its independent lines, and where it lies, cycles a sample.
    """
    model, active = basis @ strengths, strengths > 0.0
    weight = np.sqrt(counts) / model
    falling, residual = np.cos(2.0 * np.pi * frequency) * weight, (density - model) * weight
    columns, _ = np.linalg.qr(basis[:, active] * weight[:, None])
    falling = falling - columns @ (columns.T @ falling)
    residual = residual - columns @ (columns.T @ residual)
    score = float(falling @ residual) / max(float(np.linalg.norm(falling)), 1e-300)
    chance = _chance(_deviance(density, model, counts), max(density.size - int(active.sum()), 1))
    return abs(score) >= _MAX_SCORE or chance < _MIN_CHANCE


def find_filter(bands: NarrowBands, rate: float) -> Filtered | None:
    """Return the noise behind the filter that explains a density, None if none does better."""
    search = _Search(bands)
    plain = search.fit(None, bands.counts)
    fits = [search.fit(shape, bands.counts) for shape in _SHAPES]
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


def _is_sensor(search: _Search, fit: _Fit, rate: float) -> bool:
    """Return True if a filter is one of the sensor, and not drift on a white floor."""
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
    search: _Search, fits: Sequence[_Fit], plain: _Fit, counts: Floats
) -> Filtered | None:
    """Return the white floor below a first-order process, where that clearly explains it."""
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


def _freedom(search: _Search, fit: _Fit) -> int:
    return max(search.density.size - int(np.count_nonzero(fit.c)) - fit.p.size, 1)


def _amplitude(search: _Search, fit: _Fit, counts: Floats, covariance: Floats, i: int) -> Estimate:
    value = float(fit.c[i])
    sigma = (
        math.sqrt(max(covariance[i, i], 0.0)) if value else search.sigma_of_absent(fit, counts, i)
    )
    return Estimate(value, sigma)


def _average(search: _Search, fits: Sequence[_Fit], counts: Floats) -> Filtered:
    """Return the mean over all filters that explain a density nearly like the best one."""
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
        corner=corner if named else _NO_CORNER,
        order=shape.order(p) if named else math.nan,
        response=response,
    )  # fmt: skip


def _estimates(search: _Search, fit: _Fit, counts: Floats) -> tuple[Estimate, ...]:
    """Return N^2, B^2, K^2, R^2 and the corner of one filter."""
    covariance = search.covariance(fit, counts)
    white = covariance[0, 0] + covariance[4, 4] + 2.0 * covariance[0, 4]
    shape = fit.shape
    assert shape is not None
    slope = np.zeros(len(covariance))
    for k in range(fit.p.size):
        step = np.eye(fit.p.size)[k] * _SMALL_STEP
        change = shape.corner(fit.p + step) - shape.corner(fit.p - step)
        slope[5 + k] = change / (2.0 * _SMALL_STEP)
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


def _part_that_holds(search: _Search) -> Filtered | None:
    """Return the noise of the largest lowest part of a spectrum that a smooth response explains."""
    ends = np.unique(
        np.rint(np.geomspace(_FIRST_PART, search.density.size, _PART_TRIES)).astype(int)
    )
    for end in ends[::-1]:
        found = _smooth(search, int(end))
        if found is None:
            continue
        part, fit, degree = found
        if degree:
            half = int(np.searchsorted(search.f[:, 0], 0.5 * search.f[end - 1, -1]))
            if half >= _FIRST_PART:
                again = _smooth(search, half, degree)
                if again is None:
                    continue
                part, fit, degree = again
        return _of_part(part, fit)
    return None


def _smooth(
    search: _Search, end: int, degree: int | None = None
) -> tuple[_Search, _Fit, int] | None:
    """Return the fit of the first bands by terms times exp(a u + b u^2), None if none holds."""
    part = _Search(NarrowBands(*(values[:end] for values in search.bands)))
    part.unfiltered = False
    highest = 2.0 * math.sin(math.pi * float(part.f[-1, -1]))

    def shape(count: int) -> _Shape:
        def response(f: Floats, p: Floats) -> Floats:
            u = (2.0 * np.sin(np.pi * f) / highest) ** 2
            return np.asarray(
                np.exp(np.clip(sum(a * u ** (k + 1) for k, a in enumerate(p)), -30, 30))
            )

        return _Shape(str(count), response, lambda low: [(0.0,) * count], _own_corner, _own_corner)

    degrees = (0, 1, 2) if degree is None else (degree,)
    fits = [(part.fit(shape(count), part.counts, [np.zeros(count)]), count) for count in degrees]
    fit, count = min(fits, key=lambda entry: entry[0].bic)
    return (part, fit, count) if fit.chance >= _MIN_CHANCE else None


def _of_part(part: _Search, fit: _Fit) -> Filtered:
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
