"""Fit of bias against temperature: polynomial, random walk and white noise."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from zerorate.calibration.temperature.blocks import Blocks
from zerorate.types import Floats

KELVINS_PER_UNIT: Final = 10.0
"""Unit of temperature in the polynomial, K."""

MAX_DEGREE: Final = 3
MIN_SPANS_K: Final = (1.0, 8.0, 15.0)
"""Smallest temperature ranges for a straight line, a parabola and a cubic, K."""

_NEIGHBOURS: Final = 6
"""Number of blocks before and after a block that give the sign of the temperature's change."""

_MIN_CHANGE_SHARE: Final = 0.02
"""Smallest change between these blocks, as a share of the temperature range."""

_MIN_FREEDOM: Final = 3
_WALK_VARIANCES: Final = 10.0 ** np.arange(-6.0, 3.1, 0.25)
"""Variances of the walk's step in one block, over the white variance of a block's mean."""

_WALK_PRIOR: Final = np.sqrt(_WALK_VARIANCES) / (1.0 + _WALK_VARIANCES)
"""Half-Cauchy prior of the walk's standard deviation, on a logarithmic grid."""

_MAX_CONDITION: Final = 1e10
_ROUNDING: Final = 64.0 * float(np.finfo(float).eps)
"""Rounding error of a sum of some hundred products, over the sum of their sizes."""

_TINY: Final = float(np.finfo(float).tiny)


class Fit(NamedTuple):
    """Fit of one axis.

    Parameters
    ----------
    degree
        Degree of the polynomial.
    coefficients
        c_0 to c_3, zero above the degree, shape (4,).
    covariance
        Covariance of the coefficients, shape (4, 4).
    slope, slope_sigma
        Slope per kelvin at the reference, from a polynomial of degree 1 at least. Sigma is infinite
        if the record does not determine it.
    hysteresis, hysteresis_sigma
        Bias during warming minus bias during cooling, at equal temperature. Sigma is infinite if
        the record does not have both.
    """

    degree: int
    coefficients: Floats
    covariance: Floats
    slope: float
    slope_sigma: float
    hysteresis: float
    hysteresis_sigma: float


def powers(temperature: Floats, reference: float) -> Floats:
    """Return 1, x, x^2, x^3 along the last axis; x is the temperature difference over 10 K."""
    x = (np.asarray(temperature) - reference) / KELVINS_PER_UNIT
    square = x * x
    return np.stack([np.ones_like(x), x, square, square * x], axis=-1)


def fit_axes(blocks: Blocks, reference: float, max_degree: int) -> list[Fit]:
    """Return the fit of each axis.

    Notes
    -----
    For each strength of the walk, a Kalman filter of one state whitens the biases and the powers of
    the temperature. Their products give the coefficients of every degree, their errors, and the
    likelihoods of strength and degree. Coefficients are averaged over all strengths by their
    restricted likelihood. The walk's standard deviation has a half-Cauchy prior (Gelman 2006,
    Bayesian Analysis 1:515), which is flat near zero. A prior flat in the logarithm would favour a
    zero walk. A drift that correlates with temperature by chance would then count as slope, and
    half of its error would be missing.
    """
    if not blocks.count.size:
        return []
    powers_of = powers(np.nan_to_num(blocks.temperature), reference)[:, 1:]
    columns = np.column_stack([powers_of, _heating_signs(blocks), blocks.bias])
    # Blocks without a clear change of temperature are left out.
    moving = columns[:, MAX_DEGREE] != 0.0
    whitened = _WhitenedColumns.of(columns, blocks)
    both = _WhitenedColumns.of(columns[moving], blocks.select(moving)) if moving.any() else None
    allowed = _max_allowed_degree(blocks, max_degree)
    return [_fit_axis(whitened, both, i, allowed) for i in range(MAX_DEGREE + 1, columns.shape[1])]


def _max_allowed_degree(blocks: Blocks, max_degree: int) -> int:
    """Return the highest degree that the record may determine."""
    temperature = blocks.temperature
    if not np.isfinite(temperature).all():
        return 0
    span = np.ptp(temperature)
    degree = min(max_degree, sum(bool(span >= least) for least in MIN_SPANS_K))
    return max(min(degree, blocks.count.size - 1 - _MIN_FREEDOM), 0)


def _heating_signs(blocks: Blocks) -> Floats:
    """Return 0.5 if the temperature rises, -0.5 if it falls, otherwise 0.

    It is zero throughout if warming and cooling do not share half of the temperature range.
    """
    temperature, n = blocks.temperature, blocks.count.size
    indices = np.arange(n)
    before, after = np.maximum(indices - _NEIGHBOURS, 0), np.minimum(indices + _NEIGHBOURS, n - 1)
    change = temperature[after] - temperature[before]
    span = np.ptp(temperature)
    sign = np.where(np.abs(change) > _MIN_CHANGE_SHARE * span, np.sign(change), 0.0)
    up, down = temperature[sign > 0.0], temperature[sign < 0.0]
    if not (up.size and down.size) or span < MIN_SPANS_K[0]:
        return np.zeros(n)
    both = min(up.max(), down.max()) - max(up.min(), down.min())
    return np.asarray(0.5 * sign) if both > 0.5 * span else np.zeros(n)


@dataclass(frozen=True, eq=False)
class _WhitenedColumns:
    """Columns of numbers whitened by each strength of the walk.

    Parameters
    ----------
    products
        Sums of products of any two columns, shape (walks, columns, columns).
    log_scale
        Sum of the logarithms of all innovation variances, shape (walks,).
    last
        Filtered value of each column at the end, shape (walks, columns).
    last_variance
        Variance of `last`, over a block's variance, shape (walks,).
    freedom
        Number of innovations of a column.
    """

    products: Floats
    log_scale: Floats
    last: Floats
    last_variance: Floats
    freedom: int

    @classmethod
    def of(cls, columns: Floats, blocks: Blocks) -> _WhitenedColumns:
        """Return the columns after a Kalman filter of the walk that starts at the first row."""
        noise = np.median(blocks.count) / blocks.count
        steps = np.diff(blocks.time) / blocks.length
        last = np.tile(columns[0], (_WALK_VARIANCES.size, 1))
        P = np.full(_WALK_VARIANCES.size, noise[0])
        products = np.zeros((_WALK_VARIANCES.size, columns.shape[1], columns.shape[1]))
        innovations = np.empty((len(steps), *last.shape))
        variances = np.empty((len(steps), _WALK_VARIANCES.size))
        for i, (row, R, step) in enumerate(zip(columns[1:], noise[1:], steps, strict=True)):
            P = P + _WALK_VARIANCES * step
            S = P + R
            innovations[i], variances[i] = row - last, S
            last = last + (P / S)[:, np.newaxis] * innovations[i]
            P = P * R / S
        if len(steps):
            white = innovations / np.sqrt(variances)[..., np.newaxis]
            products = np.matmul(white.transpose(1, 2, 0), white.transpose(1, 0, 2))
        return cls(products, np.log(variances).sum(axis=0), last, P, len(steps))

    def regression(self, column: int, on: list[int]) -> _Regression:
        """Return the regression of a column on other columns."""
        A = self.products[:, on][:, :, on]
        inverse: Floats = np.linalg.inv(A).astype(np.float64)
        slopes = np.einsum("wij,wj->wi", inverse, self.products[:, on, column])
        left = self._left(column, on, slopes)
        return _Regression(self, column, on, inverse, slopes, left, np.linalg.slogdet(A)[1])

    def _left(self, column: int, on: list[int], slopes: Floats) -> Floats:
        """Return the residual sum of squares of a column, at least its rounding error.

        In this quadratic form, rounding errors of the slopes enter only as squares.
        """
        every = [*on, column]
        terms = self.products[:, every][:, :, every]
        by = np.column_stack([-slopes, np.ones(len(slopes))])
        left: Floats = np.einsum("wi,wij,wj->w", by, terms, by)
        largest = np.einsum("wi,wij,wj->w", np.abs(by), np.abs(terms), np.abs(by))
        return np.asarray(np.maximum(left, np.maximum(_ROUNDING * largest, _TINY)))

    def is_regular(self, on: list[int]) -> bool:
        """Return True if columns are linearly independent."""
        A = self.products[:, on][:, :, on]
        scale = np.sqrt(np.diagonal(A, axis1=1, axis2=2))
        if not (scale > 0.0).all():
            return False
        A = A / scale[:, :, np.newaxis] / scale[:, np.newaxis, :]
        return bool((np.linalg.cond(A) < _MAX_CONDITION).all())


class _Regression(NamedTuple):
    """Regression of one column on others, for each strength of the walk."""

    whitened: _WhitenedColumns
    column: int
    on: list[int]
    inverse: Floats
    slopes: Floats
    left: Floats
    log_information: Floats

    @property
    def criterion(self) -> float:
        """BIC of the most likely walk."""
        n = self.whitened.freedom
        log_likelihood = -0.5 * (self.whitened.log_scale + n * np.log(self.left))
        return float(-2.0 * log_likelihood.max() + len(self.on) * np.log(max(n, 1)))

    def average(self) -> tuple[Floats, Floats]:
        """Return level and slopes, and their covariance, averaged over the walk's strengths."""
        whitened, freedom = self.whitened, self.whitened.freedom - len(self.on)
        evidence = -0.5 * (
            whitened.log_scale + self.log_information + freedom * np.log(self.left)
        ) + np.log(_WALK_PRIOR)
        weight = np.exp(evidence - evidence.max())
        weight /= weight.sum()
        here = whitened.last[:, self.on]
        level = whitened.last[:, self.column] - np.einsum("wi,wi->w", self.slopes, here)
        estimates = np.column_stack([level, self.slopes])
        mean = weight @ estimates
        off = estimates - mean
        variance = self.left / max(freedom - 2, 1)
        inside = np.einsum("w,wij->ij", weight * variance, self._spread(here))
        return mean, inside + np.einsum("w,wi,wj->ij", weight, off, off)

    def _spread(self, here: Floats) -> Floats:
        """Return the covariance of level and slopes, over the variance of a block's mean."""
        across = -np.einsum("wij,wj->wi", self.inverse, here)
        spread = np.empty((here.shape[0], len(self.on) + 1, len(self.on) + 1))
        spread[:, 1:, 1:] = self.inverse
        spread[:, 0, 1:] = spread[:, 1:, 0] = across
        spread[:, 0, 0] = self.whitened.last_variance - np.einsum("wi,wi->w", across, here)
        return spread


def _fit_axis(
    whitened: _WhitenedColumns, both: _WhitenedColumns | None, column: int, max_degree: int
) -> Fit:
    regressions = list(_regressions(whitened, column, max_degree))
    degree = int(np.argmin([regression.criterion for regression in regressions]))
    mean, covariance = regressions[degree].average()
    coefficients, spread = np.zeros(MAX_DEGREE + 1), np.zeros((MAX_DEGREE + 1, MAX_DEGREE + 1))
    coefficients[: degree + 1], spread[: degree + 1, : degree + 1] = mean, covariance
    slope, slope_sigma = _fit_slope(regressions, max(degree, 1))
    return Fit(
        degree,
        coefficients,
        spread,
        slope / KELVINS_PER_UNIT,
        slope_sigma / KELVINS_PER_UNIT,
        *_fit_hysteresis(both, column, degree),
    )


def _fit_hysteresis(both: _WhitenedColumns | None, column: int, degree: int) -> tuple[float, float]:
    """Return bias of warming minus cooling, and its error, infinite if not determined."""
    on = [*range(degree), MAX_DEGREE]
    if both is None or both.freedom - len(on) < _MIN_FREEDOM or not both.is_regular(on):
        return 0.0, np.inf
    mean, covariance = both.regression(column, on).average()
    return float(mean[-1]), float(np.sqrt(covariance[-1, -1]))


def _fit_slope(regressions: list[_Regression], degree: int) -> tuple[float, float]:
    """Return the slope for a degree and its error, infinite if not determined."""
    if degree >= len(regressions):
        return 0.0, np.inf
    mean, covariance = regressions[degree].average()
    return float(mean[1]), float(np.sqrt(covariance[1, 1]))


def _regressions(whitened: _WhitenedColumns, column: int, max_degree: int) -> Iterator[_Regression]:
    """Yield the regressions from degree zero up, if the record determines them."""
    for degree in range(max_degree + 1):
        on = list(range(degree))
        if degree and not whitened.is_regular(on):
            return
        yield whitened.regression(column, on)
