"""Calibration of a gyro on a rate table: bias, scale, and how far its output is from a line."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.noise.coefficient import NOTHING_KNOWN, Coefficient
from zerorate.record import Log
from zerorate.record.missing import floats
from zerorate.types import Booleans, Floats, Integers
from zerorate.views import Result

if TYPE_CHECKING:
    pass

Term = Literal["quadratic", "cubic", "asymmetry"]

TERMS: Final[tuple[Term, ...]] = ("quadratic", "cubic", "asymmetry")
_SAME: Final = 0.01
"""Part of a rate by which the sizes of two may differ and count as one."""
_POWERS: Final[dict[Term, int]] = {"quadratic": 2, "cubic": 3, "asymmetry": 1}
_FLOOR: Final = 0.1
"""Part of the best model's mean square below which an error is chance."""
_ROUNDING: Final = 1e-12
"""Part of the largest mean below which an error is rounding."""
_SEEN: Final = 2.0
"""Standard errors above which a term may be more than chance."""
_STEEPEST: Final = 0.5
"""Most that the terms may add to the slope, over the scale: twice as much has two inverses."""
_ROUNDS: Final = 60
"""Steps of the fixed point, each at least halving the error: all digits of a double."""


@dataclass(frozen=True)
class RateTableAxis:
    """What one axis of a gyro makes of angular rate, and how well that is known.

    ``output = bias + scale w + cross w' + quadratic w^2 + cubic w^3 + asymmetry |w|``. A term that
    was not chosen is zero, not identifiable, and has a bound.

    Parameters
    ----------
    bias : Coefficient
        Output at rest, in the unit of the output.
    scale : Coefficient
        Output per rate.
    cross : tuple of Coefficient
        Output per rate about each of the other axes, in their order; empty if the table turned
        one axis alone.
    quadratic, cubic, asymmetry : Coefficient
        Bends of the line. The scale is ``scale + asymmetry`` of positive rates,
        ``scale - asymmetry`` of negative ones.
    terms : tuple of str
        Which of the last three were chosen.
    chi_squared : float
        Of the residuals, per degree of freedom; NaN where no sigma was given.
    degrees_of_freedom : int
        Means less coefficients.
    nonlinearity : float
        Largest distance of a mean from the best straight line, over what the line makes of the
        largest rate.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> rates = np.linspace(-300.0, 300.0, 7)
    >>> means = 1.5 + 0.97 * rates + 1e-7 * rates**3
    >>> (axis,) = zr.calibrate_rate_table(rates, means, sigma=0.01).axes
    >>> axis.terms, round(float(axis.scale), 3), axis.degrees_of_freedom
    (('cubic',), 0.97, 4)
    """

    bias: Coefficient
    scale: Coefficient
    cross: tuple[Coefficient, ...]
    quadratic: Coefficient
    cubic: Coefficient
    asymmetry: Coefficient
    terms: tuple[Term, ...]
    chi_squared: float
    degrees_of_freedom: int
    nonlinearity: float


@dataclass(frozen=True, eq=False)
class RateTable(Result):
    """A gyro that a rate table has calibrated.

    Parameters
    ----------
    axes : tuple of RateTableAxis
        One, or three.
    rates, means, sigma : ndarray, shape (m, k)
        The table: rates that were set, means of the output, and their standard errors as the fit
        took them.
    residuals : ndarray, shape (m, k)
        Means less what the axes make of the rates.

    Examples
    --------
    >>> rates = np.array([-200.0, -100.0, -50.0, 0.0, 50.0, 100.0, 200.0])
    >>> means = 0.3 + 0.98 * rates + np.array([2, -1, 1, 0, -2, 1, -1]) * 1e-3
    >>> table = calibrate_rate_table(rates, means)
    >>> print(table)
    bias          0.3000 ± 0.0005
    scale         0.979995 ± 0.000004
    quadratic     not chosen, below 7.6e-08
    cubic         not chosen, below 7.7e-10
    asymmetry     not chosen, below 1.7e-05
    non-linearity 0.00089 % of full scale
    >>> round(float(table.correct(0.3 + 0.98 * 75.0)), 2)
    75.0
    """

    axes: tuple[RateTableAxis, ...]
    rates: Floats
    means: Floats
    sigma: Floats
    residuals: Floats

    def predict(self, rates: npt.ArrayLike) -> Floats:
        """Return the output at these rates, shape (..., k) or any of one axis.

        Beyond the rates of the table, terms go on by their tangent.
        """
        w = self._shaped("rates", rates)
        return (self._line(w) + self._bend(w)).reshape(np.shape(rates))

    def correct(self, z: npt.ArrayLike | Log) -> Floats | Log:
        """Return the rates of which this is the output, in the unit of the table's rates.

        Parameters
        ----------
        z : array_like or Log
            Output: of any shape of one axis, (..., 3) of three; NaN stays NaN.

        Returns
        -------
        ndarray of the same shape, or Log of the same unit
            By a fixed point, to rounding; beyond the rates of the table by the tangent.

        Raises
        ------
        ValueError
            If the last dimension is not that of the axes.
        """
        if isinstance(z, Log):
            return z.with_data(self._inverted(self._shaped("z", z.data)))
        return self._inverted(self._shaped("z", z)).reshape(np.shape(z))

    @property
    def _matrix(self) -> Floats:
        k = len(self.axes)
        matrix = np.zeros((k, k))
        for i, axis in enumerate(self.axes):
            matrix[i, i] = axis.scale
            if axis.cross:
                matrix[i, [j for j in range(k) if j != i]] = axis.cross
        return matrix

    def _line(self, w: Floats) -> Floats:
        line: Floats = np.array([axis.bias for axis in self.axes]) + w @ self._matrix.T
        return line

    def _bend(self, w: Floats) -> Floats:
        largest = np.abs(self.rates).max(axis=0)
        return np.stack(
            [_bend(axis, w[..., i], float(largest[i])) for i, axis in enumerate(self.axes)], axis=-1
        )

    def _inverted(self, z: Floats) -> Floats:
        matrix = self._matrix
        straight = z - np.array([axis.bias for axis in self.axes])
        w: Floats = np.linalg.solve(matrix, straight[..., None])[..., 0]
        for _ in range(_ROUNDS if any(axis.terms for axis in self.axes) else 0):
            w = np.linalg.solve(matrix, (straight - self._bend(w))[..., None])[..., 0]
        return w

    def _shaped(self, name: str, values: npt.ArrayLike) -> Floats:
        given, k = floats(values, name), len(self.axes)
        if k == 1:
            return given.reshape(-1, 1)
        if given.shape[-1:] != (k,):
            raise ArgumentError(
                name, f"must have {k} axes in its last dimension, got {given.shape}"
            )
        return given


def calibrate_rate_table(
    rates: npt.ArrayLike,
    means: npt.ArrayLike,
    sigma: npt.ArrayLike | None = None,
    count: npt.ArrayLike | None = None,
) -> RateTable:
    """Fit what a gyro makes of the rates of a table: bias, scale, and bends if there are any.

    Parameters
    ----------
    rates : array_like, shape (m,) or (m, 3)
        Rates that the table was set to, in any unit, each with its sign. Of three axes, the rate
        about each axis of the body: with turns about all of them cross-axis terms are fitted, too.
    means : array_like, the same shape
        Mean output at each, in any unit.
    sigma : float or array_like, optional
        Standard error of each mean; with `count`, the standard deviation of a sample.
    count : int or array_like, optional
        Samples of each mean. Alone, it says how the means weigh next to each other.

    Returns
    -------
    RateTable
        With coefficients, the non-linearity, and `correct` for samples.

    Raises
    ------
    ValueError
        If the shapes disagree, numbers are not finite, a sigma or count is not positive, there are
        not more means than coefficients of a line, or all rates are alike; or if the terms bend the
        line so far that it cannot be inverted.

    Notes
    -----
    ``output = b + S w + c2 w^2 + c3 w^3 + a |w|`` by weighted least squares. Standard errors are
    multiplied by the root of the residuals' chi-squared per degree of freedom, where that is above
    1 or no sigma was given: it counts what the model misses.

    Terms are chosen by prediction. Each size of rate, both signs of it at once, is left out and
    predicted from the others; the smallest model counts whose error is within a standard error of
    the best one's. Each of its terms is larger than two of its own standard errors.

    Rates of one sign cannot tell the asymmetry from the scale. The Earth's rate is in the bias.

    Examples
    --------
    >>> rates = np.array([-300.0, -200.0, -100.0, 0.0, 100.0, 200.0, 300.0])
    >>> table = calibrate_rate_table(rates, 1.5 + 0.97 * rates + 2e-7 * rates**3, sigma=0.01)
    >>> table.axes[0].terms, round(float(table.correct(1.5 + 0.97 * 250.0 + 3.125)), 6)
    (('cubic',), 250.0)
    """
    w, z = _columns("rates", rates), _columns("means", means)
    if w.shape != z.shape or w.shape[1] not in (1, 3):
        raise ValueError(
            f"rates and means must have one shape, (m,) or (m, 3), "
            f"got {np.shape(rates)} and {np.shape(means)}"
        )
    errors, told = _standard_errors(z.shape, np.shape(means), sigma, count)
    turned = np.any(w != 0.0, axis=0)
    axes = []
    for i in range(w.shape[1]):
        others = np.arange(w.shape[1]) != i
        table = _Table(w[:, i], w[:, others & turned], z[:, i], errors[:, i])
        axes.append(_axis(table, turned[others], told))
    found = RateTable(tuple(axes), w, z, errors, np.zeros(z.shape))
    residuals = z - found.predict(w)
    freedom = np.array([axis.degrees_of_freedom for axis in axes])
    chi_squared = np.sum((residuals / errors) ** 2, axis=0) / freedom
    sigmas = errors * np.sqrt(np.maximum(chi_squared, 1.0) if told else chi_squared)
    return replace(found, sigma=sigmas, residuals=residuals)


def _columns(name: str, values: npt.ArrayLike) -> Floats:
    given = floats(values, name)
    columns = given[:, None] if given.ndim == 1 else given
    if columns.ndim != 2 or not np.isfinite(columns).all():
        raise ArgumentError(name, f"must be finite, of shape (m,) or (m, 3), got {given.shape}")
    return columns


def _standard_errors(
    shape: tuple[int, ...],
    given_shape: tuple[int, ...],
    sigma: npt.ArrayLike | None,
    count: npt.ArrayLike | None,
) -> tuple[Floats, bool]:
    """Return standard errors of the means, shape (m, k), and whether their size is known."""
    deviation = _positive("sigma", 1.0 if sigma is None else sigma, shape, given_shape)
    samples = _positive("count", 1.0 if count is None else count, shape, given_shape)
    return deviation / np.sqrt(samples), sigma is not None


def _positive(
    name: str, values: npt.ArrayLike, shape: tuple[int, ...], given_shape: tuple[int, ...]
) -> Floats:
    given = floats(values, name)
    if given.ndim == 1 and given.shape == shape[:1]:
        given = given[:, None]
    if given.shape not in ((), given_shape, shape, (shape[0], 1)):
        raise ArgumentError(name, f"must be one number, or one a mean, got shape {given.shape}")
    if not (np.isfinite(given) & (given > 0.0)).all():
        raise ArgumentError(name, "must be positive and finite")
    return np.broadcast_to(given, shape)


class _Table(NamedTuple):
    """Rates about an axis and about the others that were turned, and the means of its output."""

    own: Floats
    cross: Floats
    means: Floats
    sigma: Floats

    def part(self, rows: Booleans) -> _Table:
        """Return some of the rows."""
        return _Table(self.own[rows], self.cross[rows], self.means[rows], self.sigma[rows])

    def design(self, terms: Sequence[Term], largest: float) -> Floats:
        """Return columns of rates over the largest one: 1, own, cross and terms."""
        w = self.own / largest
        bends = {"quadratic": w**2, "cubic": w**3, "asymmetry": np.abs(w)}
        columns = [np.ones_like(w), w, *(self.cross.T / largest), *(bends[t] for t in terms)]
        return np.column_stack(columns)


class _Fit(NamedTuple):
    """Coefficients of a design, their covariance by the given sigmas, and what is left over."""

    values: Floats
    covariance: Floats
    chi_squared: float
    freedom: int


def _axis(table: _Table, others: Booleans, told: bool) -> RateTableAxis:
    """Return the fit of one axis; `others` says which other axes were turned about."""
    largest = float(np.abs(table.own).max())
    if not np.ptp(table.own) > 0.0:
        raise ArgumentError(
            "rates", "must differ about each axis: one alone tells no scale from bias"
        )
    if _fitted(table, (), largest) is None:
        raise ValueError(
            f"{len(table.means)} means cannot tell the {2 + table.cross.shape[1]} coefficients of "
            "a line and their errors"
        )
    terms = _chosen(table, largest)
    fit = _fitted(table, terms, largest)
    assert fit is not None
    known = _coefficients(fit, terms, largest, told)
    turned = iter(known[2 : 2 + table.cross.shape[1]])
    bends = dict(zip(terms, known[2 + table.cross.shape[1] :], strict=True))
    bends |= {t: _bound(table, terms, t, largest, told) for t in TERMS if t not in bends}
    axis = RateTableAxis(
        bias=known[0],
        scale=known[1],
        cross=tuple(next(turned) if there else NOTHING_KNOWN for there in others),
        **bends,
        terms=terms,
        chi_squared=fit.chi_squared if told else math.nan,
        degrees_of_freedom=fit.freedom,
        nonlinearity=_nonlinearity(table, largest),
    )
    _check_invertible(axis, largest)
    return axis


def _fitted(table: _Table, terms: Sequence[Term], largest: float) -> _Fit | None:
    """Return a weighted least squares fit; None where the rows do not determine it."""
    X = table.design(terms, largest) / table.sigma[:, None]
    y = table.means / table.sigma
    freedom = len(y) - X.shape[1]
    if freedom < 1 or np.linalg.matrix_rank(X, tol=1e-9 * float(np.linalg.norm(X))) < X.shape[1]:
        return None
    Q, R = np.linalg.qr(X)
    inverse = np.linalg.inv(R)
    values = inverse @ (Q.T @ y)
    chi_squared = float(np.sum((y - X @ values) ** 2)) / freedom
    return _Fit(values, inverse @ inverse.T, chi_squared, freedom)


def _coefficients(
    fit: _Fit, terms: Sequence[Term], largest: float, told: bool
) -> list[Coefficient]:
    """Return coefficients per unit of rate, their errors by the residuals."""
    lines = len(fit.values) - len(terms)
    powers = [0.0, *[1.0] * (lines - 1), *(_POWERS[term] for term in terms)]
    sigmas = np.sqrt(np.diagonal(fit.covariance)) * _inflation(fit, told)
    triples = zip(fit.values, sigmas, powers, strict=True)
    return [Coefficient(v / largest**p, s / largest**p) for v, s, p in triples]


def _inflation(fit: _Fit, told: bool) -> float:
    """Return what standard errors are multiplied by."""
    return math.sqrt(max(fit.chi_squared, 1.0) if told else fit.chi_squared)


def _bound(
    table: _Table, terms: Sequence[Term], term: Term, largest: float, told: bool
) -> Coefficient:
    """Return a term that was not chosen: zero, with what it may be at most."""
    fit = _fitted(table, (*terms, term), largest)
    if fit is None:
        return NOTHING_KNOWN
    found = _coefficients(fit, (*terms, term), largest, told)[-1]
    bound = Coefficient(abs(found), found.sigma).upper_bound
    return Coefficient(0.0, found.sigma, identifiable=False, upper_bound=bound)


def _chosen(table: _Table, largest: float) -> tuple[Term, ...]:
    """Return the terms of the smallest model that predicts sizes of rate that it has not seen.

    Models compare by the logarithm of their errors' squares, size by size: one size that all
    predict badly must not decide.
    """
    models = [m for count in range(len(TERMS) + 1) for m in combinations(TERMS, count)]
    seen = [m for m in models if _all_seen(table, m, largest)]
    errors = {m: e for m in seen if (e := _left_out(table, m, largest)) is not None}
    if () not in errors:
        return ()
    means = {model: float(np.mean(e)) for model, e in errors.items()}
    best = min(means, key=lambda model: means[model])
    rounding = _ROUNDING * float(np.abs(table.means / table.sigma).max())
    floor = max(_FLOOR * means[best], rounding**2, np.finfo(np.float64).tiny)
    for model in sorted(errors, key=lambda m: (len(m), means[m])):
        worse = np.log((errors[model] + floor) / (errors[best] + floor))
        if np.mean(worse) <= np.std(worse, ddof=1) / math.sqrt(worse.size):
            return model
    return best


def _all_seen(table: _Table, terms: Sequence[Term], largest: float) -> bool:
    """Whether each term is larger than two standard errors."""
    fit = _fitted(table, terms, largest)
    if fit is None:
        return False
    bends = slice(len(fit.values) - len(terms), None)
    sigmas = np.sqrt(np.diagonal(fit.covariance)[bends] * fit.chi_squared)
    return bool((np.abs(fit.values[bends]) > _SEEN * sigmas).all())


def _left_out(table: _Table, terms: Sequence[Term], largest: float) -> Floats | None:
    """Return the mean square of the errors, in sigmas, of each size of rate left out.

    Without those at which this axis rests: no term tells there.
    """
    found = []
    sizes = _sizes(table)
    for size in np.unique(sizes[table.own != 0.0]):
        out = sizes == size
        rest, left = table.part(~out), table.part(out)
        fit = _fitted(rest, terms, largest)
        if fit is None:
            return None
        error = (left.means - left.design(terms, largest) @ fit.values) / left.sigma
        found.append(float(np.mean(error**2)))
    return np.array(found) if len(found) > 1 else None


def _sizes(table: _Table) -> Integers:
    """Return a number for each row, the same where the rates have one size, shape (m,)."""
    sizes = np.abs(np.column_stack((table.own, table.cross)))
    numbers = np.zeros(len(sizes), dtype=np.int64)
    for column in sizes.T:
        order = np.argsort(column)
        steps = np.diff(column[order]) > _SAME * column[order][1:]
        place = np.empty(len(column), dtype=np.int64)
        place[order] = np.concatenate(([0], np.cumsum(steps)))
        numbers = numbers * (place.max() + 1) + place
    same: Integers = np.unique(numbers, return_inverse=True)[1]
    return same


def _nonlinearity(table: _Table, largest: float) -> float:
    line = _fitted(table, (), largest)
    assert line is not None
    off = table.means - table.design((), largest) @ line.values
    return float(np.abs(off).max() / abs(line.values[1]))


def _bend(axis: RateTableAxis, w: Floats, largest: float) -> Floats:
    """Return what the terms add to the line, beyond the largest rate by their tangent."""
    inside = np.clip(w, -largest, largest)
    c2, c3, a = float(axis.quadratic), float(axis.cubic), float(axis.asymmetry)
    slope = 2.0 * c2 * inside + 3.0 * c3 * inside**2 + a * np.sign(inside)
    bend: Floats = c2 * inside**2 + c3 * inside**3 + a * np.abs(inside) + slope * (w - inside)
    return bend


def _check_invertible(axis: RateTableAxis, largest: float) -> None:
    w = np.linspace(-largest, largest, 201)
    slopes = 2.0 * axis.quadratic * w + 3.0 * axis.cubic * w**2
    steepest = float(np.abs(slopes).max()) + abs(axis.asymmetry)
    if steepest > _STEEPEST * abs(axis.scale):
        raise ValueError(
            f"the terms change the slope by up to {steepest / abs(axis.scale):.0%} of the scale, "
            f"more than {_STEEPEST:.0%}: the curve cannot be inverted safely"
        )
