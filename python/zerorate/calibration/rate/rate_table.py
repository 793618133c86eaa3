"""Calibration of a gyro on a rate table: bias, scale and non-linearity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.noise.coefficient import UNKNOWN_COEFFICIENT, Coefficient
from zerorate.record import Log
from zerorate.record.missing import floats
from zerorate.types import Booleans, Floats, Integers
from zerorate.views import Result

if TYPE_CHECKING:
    pass

Term = Literal["quadratic", "cubic", "asymmetry"]

TERMS: Final[tuple[Term, ...]] = ("quadratic", "cubic", "asymmetry")
_MAX_SIZE_DIFFERENCE: Final = 0.01
"""Relative difference below which two rates have the same size."""
_POWERS: Final[dict[Term, int]] = {"quadratic": 2, "cubic": 3, "asymmetry": 1}
_CHANCE_SHARE: Final = 0.1
"""Share of the best model's mean square below which an error counts as chance."""
_ROUNDING_SHARE: Final = 1e-12
"""Share of the largest mean below which an error counts as rounding."""
_MIN_TERM_SIGMAS: Final = 2.0
"""Smallest significant term, in its standard errors."""
_MAX_SLOPE_CHANGE: Final = 0.5
"""Largest change of slope by the terms, over the scale; at twice this value the inverse is
ambiguous.
"""
_ITERATIONS: Final = 60
"""Number of steps of the fixed point iteration; each at least halves the error."""


@dataclass(frozen=True)
class RateTableAxis:
    """Response of one gyro axis to angular rate, with standard errors.

    ``output = bias + scale w + cross w' + quadratic w^2 + cubic w^3 + asymmetry |w|``. A term that
    was not chosen is zero and not identifiable; its upper bound is known.

    Parameters
    ----------
    bias : Coefficient
        Output at rest, unit of the output.
    scale : Coefficient
        Change of the output per rate.
    cross : tuple of Coefficient
        Change of the output per rate about each of the other axes, in their order. Empty if the
        table rotated about a single axis.
    quadratic, cubic, asymmetry : Coefficient
        Non-linear terms. The slope is ``scale + asymmetry`` for positive rates and ``scale -
        asymmetry`` for negative rates.
    terms : tuple of str
        Names of the chosen non-linear terms.
    chi_squared : float
        Chi-squared of the residuals per degree of freedom; NaN if no sigma was given.
    degrees_of_freedom : int
        Number of means minus number of coefficients.
    nonlinearity : float
        Largest distance of a mean from the best straight line, divided by the line's output at the
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
    """Calibration of a gyro by a rate table.

    Parameters
    ----------
    axes : tuple of RateTableAxis
        Axes of the gyro, one or three.
    rates, means, sigma : ndarray, shape (m, k)
        The table: rates, means of the output, and standard errors of the means.
    residuals : ndarray, shape (m, k)
        Means minus the fitted output.

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
        """Return the output at given rates of shape (..., k), or of any shape for one axis.

        Outside the rates of the table, the response continues as its tangent.
        """
        w = self._reshape("rates", rates)
        return (self._line(w) + self._bend(w)).reshape(np.shape(rates))

    def correct(self, z: npt.ArrayLike | Log) -> Floats | Log:
        """Return the true rates at which the sensor has the output `z`.

        The rates are in the unit of the table's rates.

        Parameters
        ----------
        z : array_like or Log
            Output, any shape for one axis, (..., 3) for three axes. NaN stays NaN.

        Returns
        -------
        ndarray of the shape of `z`, or Log
            Rates, correct up to rounding, from a fixed-point iteration. A Log keeps its unit and
            names. Outside the rates of the table, the response continues as its tangent.

        Raises
        ------
        ValueError
            If the last dimension is not the number of axes.
        """
        if isinstance(z, Log):
            return z.with_data(self._invert(self._reshape("z", z.data)))
        return self._invert(self._reshape("z", z)).reshape(np.shape(z))

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

    def _invert(self, z: Floats) -> Floats:
        matrix = self._matrix
        straight = z - np.array([axis.bias for axis in self.axes])
        w: Floats = np.linalg.solve(matrix, straight[..., None])[..., 0]
        for _ in range(_ITERATIONS if any(axis.terms for axis in self.axes) else 0):
            w = np.linalg.solve(matrix, (straight - self._bend(w))[..., None])[..., 0]
        return w

    def _reshape(self, name: str, values: npt.ArrayLike) -> Floats:
        array, k = floats(values, name), len(self.axes)
        if k == 1:
            return array.reshape(-1, 1)
        if array.shape[-1:] != (k,):
            raise ArgumentError(
                name, f"must have {k} axes in its last dimension, got {array.shape}"
            )
        return array


def calibrate_rate_table(
    rates: npt.ArrayLike,
    means: npt.ArrayLike,
    sigma: npt.ArrayLike | None = None,
    count: npt.ArrayLike | None = None,
) -> RateTable:
    """Fit the response of a gyro to rates of a table: bias, scale and non-linearity.

    Parameters
    ----------
    rates : array_like, shape (m,) or (m, 3)
        Rates of the table with their signs, in any unit. For three axes: the rate about each axis
        of the body. If the table rotated about all of them, cross-axis terms are fitted.
    means : array_like, the same shape
        Mean output at each rate, in any unit.
    sigma : float or array_like, optional
        Standard error of each mean. With `count`: standard deviation of a single sample.
    count : int or array_like, optional
        Number of samples in each mean. Without `sigma`, it gives the relative weights of the means.

    Returns
    -------
    RateTable
        Coefficients and non-linearity of each axis; its `correct` corrects samples.

    Raises
    ------
    ValueError
        If shapes disagree. If a number is not finite, or a sigma or count is not positive. If all
        rates are equal. If the means are too few for a straight line. If the fitted response cannot
        be inverted.

    Notes
    -----
    ``output = b + S w + c2 w^2 + c3 w^3 + a |w|`` is fitted by weighted least squares. If
    chi-squared per degree of freedom exceeds 1, or no sigma was given, standard errors are
    multiplied by its root. They then include the errors of the model.

    Terms are chosen by prediction. Each absolute rate, with both signs, is left out and predicted
    from the other rates. Among the models within one standard error of the best prediction, the
    smallest model is chosen. Each chosen term exceeds two of its standard errors.

    Rates of one sign cannot separate the asymmetry from the scale. The bias contains the Earth's
    rate.

    Examples
    --------
    >>> rates = np.array([-300.0, -200.0, -100.0, 0.0, 100.0, 200.0, 300.0])
    >>> table = calibrate_rate_table(rates, 1.5 + 0.97 * rates + 2e-7 * rates**3, sigma=0.01)
    >>> table.axes[0].terms, round(float(table.correct(1.5 + 0.97 * 250.0 + 3.125)), 6)
    (('cubic',), 250.0)
    """
    w, z = _parse_columns("rates", rates), _parse_columns("means", means)
    if w.shape != z.shape or w.shape[1] not in (1, 3):
        raise ValueError(
            f"rates and means must have one shape, (m,) or (m, 3), "
            f"got {np.shape(rates)} and {np.shape(means)}"
        )
    errors, sigma_known = _standard_errors(z.shape, np.shape(means), sigma, count)
    is_turned = np.any(w != 0.0, axis=0)
    axes = []
    for i in range(w.shape[1]):
        others = np.arange(w.shape[1]) != i
        table = _Table(w[:, i], w[:, others & is_turned], z[:, i], errors[:, i])
        axes.append(_fit_axis(table, is_turned[others], sigma_known))
    result = RateTable(tuple(axes), w, z, errors, np.zeros(z.shape))
    residuals = z - result.predict(w)
    freedom = np.array([axis.degrees_of_freedom for axis in axes])
    chi_squared = np.sum((residuals / errors) ** 2, axis=0) / freedom
    sigmas = errors * np.sqrt(np.maximum(chi_squared, 1.0) if sigma_known else chi_squared)
    return replace(result, sigma=sigmas, residuals=residuals)


def _parse_columns(name: str, values: npt.ArrayLike) -> Floats:
    array = floats(values, name)
    columns = array[:, None] if array.ndim == 1 else array
    if columns.ndim != 2 or not np.isfinite(columns).all():
        raise ArgumentError(name, f"must be finite, of shape (m,) or (m, 3), got {array.shape}")
    return columns


def _standard_errors(
    shape: tuple[int, ...],
    given_shape: tuple[int, ...],
    sigma: npt.ArrayLike | None,
    count: npt.ArrayLike | None,
) -> tuple[Floats, bool]:
    """Return the standard errors of the means, shape (m, k), and True if a sigma was given."""
    deviation = _parse_positive("sigma", 1.0 if sigma is None else sigma, shape, given_shape)
    samples = _parse_positive("count", 1.0 if count is None else count, shape, given_shape)
    return deviation / np.sqrt(samples), sigma is not None


def _parse_positive(
    name: str, values: npt.ArrayLike, shape: tuple[int, ...], given_shape: tuple[int, ...]
) -> Floats:
    array = floats(values, name)
    if array.ndim == 1 and array.shape == shape[:1]:
        array = array[:, None]
    if array.shape not in ((), given_shape, shape, (shape[0], 1)):
        raise ArgumentError(name, f"must be one number, or one a mean, got shape {array.shape}")
    if not (np.isfinite(array) & (array > 0.0)).all():
        raise ArgumentError(name, "must be positive and finite")
    return np.broadcast_to(array, shape)


class _Table(NamedTuple):
    """Rates about one axis and about the other rotated axes, and its mean outputs."""

    own: Floats
    cross: Floats
    means: Floats
    sigma: Floats

    def part(self, rows: Booleans) -> _Table:
        """Return a part of the rows."""
        return _Table(self.own[rows], self.cross[rows], self.means[rows], self.sigma[rows])

    def design(self, terms: Sequence[Term], largest: float) -> Floats:
        """Return the columns 1, own rate, cross rates and terms, relative to the largest rate."""
        w = self.own / largest
        bends = {"quadratic": w**2, "cubic": w**3, "asymmetry": np.abs(w)}
        columns = [np.ones_like(w), w, *(self.cross.T / largest), *(bends[t] for t in terms)]
        return np.column_stack(columns)


class _Fit(NamedTuple):
    """Coefficients of a design, their covariance from the given sigmas, and the residuals."""

    values: Floats
    covariance: Floats
    chi_squared: float
    freedom: int


def _fit_axis(table: _Table, others: Booleans, sigma_known: bool) -> RateTableAxis:
    """Return the fit of one axis; `others` is the mask of the other axes that were rotated."""
    largest = float(np.abs(table.own).max())
    if not np.ptp(table.own) > 0.0:
        raise ArgumentError(
            "rates", "must differ about each axis: one rate cannot separate scale and bias"
        )
    if _fit_terms(table, (), largest) is None:
        raise ValueError(
            f"{len(table.means)} means cannot give the {2 + table.cross.shape[1]} coefficients of "
            "a line and their errors"
        )
    terms = _choose_terms(table, largest)
    fit = _fit_terms(table, terms, largest)
    assert fit is not None
    known = _scale_coefficients(fit, terms, largest, sigma_known)
    cross_terms = iter(known[2 : 2 + table.cross.shape[1]])
    bends = dict(zip(terms, known[2 + table.cross.shape[1] :], strict=True))
    bends |= {
        t: _bound_term(table, terms, t, largest, sigma_known) for t in TERMS if t not in bends
    }
    axis = RateTableAxis(
        bias=known[0],
        scale=known[1],
        cross=tuple(
            next(cross_terms) if is_turned else UNKNOWN_COEFFICIENT for is_turned in others
        ),
        **bends,
        terms=terms,
        chi_squared=fit.chi_squared if sigma_known else math.nan,
        degrees_of_freedom=fit.freedom,
        nonlinearity=_nonlinearity(table, largest),
    )
    _check_invertible(axis, largest)
    return axis


def _fit_terms(table: _Table, terms: Sequence[Term], largest: float) -> _Fit | None:
    """Return a weighted least squares fit; None if the rows do not determine it."""
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


def _scale_coefficients(
    fit: _Fit, terms: Sequence[Term], largest: float, sigma_known: bool
) -> list[Coefficient]:
    """Return the coefficients per unit of rate, with errors from the residuals."""
    lines = len(fit.values) - len(terms)
    powers = [0.0, *[1.0] * (lines - 1), *(_POWERS[term] for term in terms)]
    sigmas = np.sqrt(np.diagonal(fit.covariance)) * _inflation(fit, sigma_known)
    triples = zip(fit.values, sigmas, powers, strict=True)
    return [Coefficient(v / largest**p, s / largest**p) for v, s, p in triples]


def _inflation(fit: _Fit, sigma_known: bool) -> float:
    """Return the factor of the standard errors."""
    return math.sqrt(max(fit.chi_squared, 1.0) if sigma_known else fit.chi_squared)


def _bound_term(
    table: _Table, terms: Sequence[Term], term: Term, largest: float, sigma_known: bool
) -> Coefficient:
    """Return a term that was not chosen: zero, with its upper bound."""
    fit = _fit_terms(table, (*terms, term), largest)
    if fit is None:
        return UNKNOWN_COEFFICIENT
    coefficient = _scale_coefficients(fit, (*terms, term), largest, sigma_known)[-1]
    bound = Coefficient(abs(coefficient), coefficient.sigma).upper_bound
    return Coefficient(0.0, coefficient.sigma, identifiable=False, upper_bound=bound)


def _choose_terms(table: _Table, largest: float) -> tuple[Term, ...]:
    """Return the terms of the smallest model that predicts the rates left out.

    Models are compared by the logarithm of their squared errors, size by size: one size with bad
    predictions by all models must not decide.
    """
    models = [m for count in range(len(TERMS) + 1) for m in combinations(TERMS, count)]
    significant = [m for m in models if _has_significant_terms(table, m, largest)]
    errors = {m: e for m in significant if (e := _held_out_errors(table, m, largest)) is not None}
    if () not in errors:
        return ()
    means = {model: float(np.mean(e)) for model, e in errors.items()}
    best = min(means, key=lambda model: means[model])
    rounding = _ROUNDING_SHARE * float(np.abs(table.means / table.sigma).max())
    floor = max(_CHANCE_SHARE * means[best], rounding**2, np.finfo(np.float64).tiny)
    for model in sorted(errors, key=lambda m: (len(m), means[m])):
        worse = np.log((errors[model] + floor) / (errors[best] + floor))
        if np.mean(worse) <= np.std(worse, ddof=1) / math.sqrt(worse.size):
            return model
    return best


def _has_significant_terms(table: _Table, terms: Sequence[Term], largest: float) -> bool:
    """Return True if each term exceeds two standard errors."""
    fit = _fit_terms(table, terms, largest)
    if fit is None:
        return False
    bends = slice(len(fit.values) - len(terms), None)
    sigmas = np.sqrt(np.diagonal(fit.covariance)[bends] * fit.chi_squared)
    return bool((np.abs(fit.values[bends]) > _MIN_TERM_SIGMAS * sigmas).all())


def _held_out_errors(table: _Table, terms: Sequence[Term], largest: float) -> Floats | None:
    """Return the mean square error, in sigmas, of each size of rate left out.

    Rows with zero rate about this axis are not left out, because they contain no term.
    """
    squares = []
    sizes = _group_by_size(table)
    for size in np.unique(sizes[table.own != 0.0]):
        is_omitted = sizes == size
        training, omitted = table.part(~is_omitted), table.part(is_omitted)
        fit = _fit_terms(training, terms, largest)
        if fit is None:
            return None
        error = (omitted.means - omitted.design(terms, largest) @ fit.values) / omitted.sigma
        squares.append(float(np.mean(error**2)))
    return np.array(squares) if len(squares) > 1 else None


def _group_by_size(table: _Table) -> Integers:
    """Return the group of each row, shape (m,): rates in a group have the same size."""
    sizes = np.abs(np.column_stack((table.own, table.cross)))
    numbers = np.zeros(len(sizes), dtype=np.int64)
    for column in sizes.T:
        order = np.argsort(column)
        steps = np.diff(column[order]) > _MAX_SIZE_DIFFERENCE * column[order][1:]
        group = np.empty(len(column), dtype=np.int64)
        group[order] = np.concatenate(([0], np.cumsum(steps)))
        numbers = numbers * (group.max() + 1) + group
    same: Integers = np.unique(numbers, return_inverse=True)[1]
    return same


def _nonlinearity(table: _Table, largest: float) -> float:
    line = _fit_terms(table, (), largest)
    assert line is not None
    off = table.means - table.design((), largest) @ line.values
    return float(np.abs(off).max() / abs(line.values[1]))


def _bend(axis: RateTableAxis, w: Floats, largest: float) -> Floats:
    """Return the sum of the non-linear terms; above the largest rate, their tangent."""
    inside = np.clip(w, -largest, largest)
    c2, c3, a = float(axis.quadratic), float(axis.cubic), float(axis.asymmetry)
    slope = 2.0 * c2 * inside + 3.0 * c3 * inside**2 + a * np.sign(inside)
    bend: Floats = c2 * inside**2 + c3 * inside**3 + a * np.abs(inside) + slope * (w - inside)
    return bend


def _check_invertible(axis: RateTableAxis, largest: float) -> None:
    w = np.linspace(-largest, largest, 201)
    slopes = 2.0 * axis.quadratic * w + 3.0 * axis.cubic * w**2
    steepest = float(np.abs(slopes).max()) + abs(axis.asymmetry)
    if steepest > _MAX_SLOPE_CHANGE * abs(axis.scale):
        raise ValueError(
            f"the terms change the slope by up to {steepest / abs(axis.scale):.0%} of the scale, "
            f"more than {_MAX_SLOPE_CHANGE:.0%}: the curve cannot be inverted safely"
        )
