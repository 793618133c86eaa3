"""Noise coefficients from a deviation curve, and the expected curve of a model."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from zerorate.noise.coefficient import Coefficient
from zerorate.noise.covariance import CurveStatistics, variances
from zerorate.noise.fit import Component, FittedModel, Problem, fit_components
from zerorate.noise.kinds import KINDS, Kind
from zerorate.noise.least_squares import residual_chi_squared
from zerorate.noise.model import NoiseModel
from zerorate.noise.processes import (
    COLOURED,
    Process,
    markov,
    ramp_variance,
    sinusoid_variance,
    strength,
)
from zerorate.noise.processes import markov as markov_process
from zerorate.noise.quantities import TERMS, Quantity
from zerorate.noise.terms import Markov, Sinusoid
from zerorate.types import Floats, Integers

if TYPE_CHECKING:
    from zerorate.noise.result import AllanResult

_TIMES_PER_DECADE: Final = 8
# Limits the weight of a ramp or a sine, which have no scatter.
_MIN_RELATIVE_VARIANCE: Final = 1e-12

_POWERS: Final = {
    "quantization": -2,
    "angle_random_walk": -1,
    "bias_instability": 0,
    "rate_random_walk": 1,
    "rate_ramp": 2,
}
_MIN_TAUS: Final = len(_POWERS) + 1


@dataclass(frozen=True)
class Curve:
    """One axis of a deviation curve: squared deviations of the rate, without estimation bias.

    Parameters
    ----------
    estimator : Kind
        Kind of the estimated deviation.
    kind : Kind
        The same kind without reflection; estimates are corrected for the effect of reflection.
    rate : float
        Samples per second, Hz.
    m, terms : ndarray of int, shape (t,)
        Averaging times in samples, and number of terms of each estimate without reflection.
    variance, edf : ndarray, shape (t,)
        Estimates and their degrees of freedom.
    """

    estimator: Kind
    kind: Kind
    rate: float
    m: Integers
    terms: Integers
    variance: Floats
    edf: Floats


def curve_fit(
    curve: Curve,
    terms: Sequence[str],
    times: Sequence[float] | int,
    frequencies: Sequence[float],
    unit: tuple[float, Quantity],
    white: Process = COLOURED["angle_random_walk"],
) -> FittedModel:
    """Fit the coefficients `terms`, Markov terms and sines to a curve.

    Parameters
    ----------
    curve : Curve
        Estimates at averaging times at least a quarter of an octave apart.
    terms : sequence of str
        Coefficients to estimate.
    times : sequence of float, or int
        Correlation times of Markov terms, s; or the number of terms with unknown times.
    frequencies : sequence of float
        Frequencies of sines, Hz.
    unit : tuple
        SI unit of the deviation, and its quantity.
    white : Process
        White noise of unit density behind the low-pass filter.

    Raises
    ------
    ValueError
        If the model has no random term: a ramp and sines alone give no weights.
    """
    if not times and not set(terms) & set(COLOURED):
        raise ValueError(f"a fit needs a noise: name a Markov term or one of {', '.join(COLOURED)}")
    if isinstance(times, int):
        times = _find_times(curve, terms, times, frequencies, white)
    design = _Design(curve, terms, times, frequencies, white)
    return fit_components(design.problem(), design.components, curve.estimator.name, unit)


class _Design:
    """Columns of the fit of one curve, and the covariance of its points."""

    def __init__(
        self,
        curve: Curve,
        terms: Sequence[str],
        times: Sequence[float],
        frequencies: Sequence[float],
        white: Process,
    ) -> None:
        kind, rate, m = curve.kind, curve.rate, curve.m
        samples = m.astype(np.float64)
        noises = [term for term in terms if term in COLOURED]
        periods = tuple(time * rate for time in times)
        counts = (tuple(m.tolist()), tuple(curve.terms.tolist()))
        self.curve, self.n_noises = curve, len(noises) + len(periods)
        self.statistics = _curve_statistics(kind, *counts, tuple(noises), periods, white)
        columns = [self.statistics.variances]
        components = [Component(term, strength(term, rate)) for term in noises]
        components += [_markov_component(time) for time in times]
        self.has_ramp = "rate_ramp" in terms and kind.order == 2
        if self.has_ramp:
            columns.append(ramp_variance(kind, samples)[:, None])
            components.append(Component("rate_ramp", strength("rate_ramp", rate)))
        for frequency in frequencies:
            columns.append(sinusoid_variance(kind, samples, frequency / rate)[:, None])
            components.append(_sinusoid_component(frequency))
        self.basis = np.hstack(columns)
        self.components = components

    def problem(self) -> Problem:
        """Return the least-squares problem to solve."""
        return Problem(self.basis, self.curve.variance, self.curve.edf, self.covariance)

    def covariance(self, strengths: Floats) -> Floats:
        """Return the covariance of the squared deviations for these strengths."""
        slope = float(np.sqrt(strengths[self.n_noises])) if self.has_ramp else 0.0
        matrix = self.statistics.covariance(strengths[: self.n_noises], slope)
        expected = self.basis @ strengths
        if self.curve.estimator.total:
            gain = expected * np.sqrt(2.0 / self.curve.edf / np.diag(matrix))
            matrix = matrix * np.outer(gain, gain)
        return matrix + np.diag(_MIN_RELATIVE_VARIANCE * expected**2)


@lru_cache(maxsize=8)
def _curve_statistics(
    kind: Kind,
    m: tuple[int, ...],
    terms: tuple[int, ...],
    noises: tuple[str, ...],
    periods: tuple[float, ...],
    white: Process,
) -> CurveStatistics:
    """Return the statistics that the axes of a record share."""
    coloured = {**COLOURED, "angle_random_walk": white}
    processes = [coloured[noise] for noise in noises]
    processes += [markov_process(period) for period in periods]
    return CurveStatistics(kind, np.array(m), np.array(terms), processes)


def _markov_component(time: float) -> Component:
    return Component("markov", time / 2.0, lambda amplitude: Markov(amplitude, time))


def _sinusoid_component(frequency: float) -> Component:
    return Component("sinusoid", 1.0, lambda amplitude: Sinusoid(amplitude, frequency))


def _find_times(
    curve: Curve,
    terms: Sequence[str],
    count: int,
    frequencies: Sequence[float],
    white: Process,
) -> list[float]:
    """Return correlation times, each found by the smallest chi-squared after the others.

    The scatter comes from the fit without the new term, so that each trial needs only one linear
    fit.
    """
    times: list[float] = []
    first, last = 2.0 / curve.rate, float(curve.m[-1]) / curve.rate
    steps = max(int(_TIMES_PER_DECADE * np.log10(last / first)), 1)
    for _ in range(count):
        problem = _Design(curve, terms, times, frequencies, white).problem()
        solution, weighting, *_ = problem.solve()
        scatter = weighting(solution.strengths)
        trials = [float(t) for t in np.geomspace(first, last, steps + 1) if t not in times]
        columns = (variances(curve.kind, curve.m, markov_process(t * curve.rate)) for t in trials)
        misfits = [
            residual_chi_squared(np.column_stack((problem.basis, column)), problem.data, scatter)
            for column in columns
        ]
        times.append(trials[int(np.argmin(misfits))])
    return times


class ExpectedTerm(NamedTuple):
    """Term of a model: its field, and its rate deviation in SI, shape (t,)."""

    field: str
    deviation: Floats


def expected_terms(model: NoiseModel, curve: "AllanResult") -> tuple[ExpectedTerm, ...]:
    """Return the nonzero terms of a model at the averaging times of a curve.

    Parameters
    ----------
    model : NoiseModel
        Noise model in SI units.
    curve : AllanResult
        Curve of any kind; only its averaging times, rate and kind are used.

    Returns
    -------
    tuple of ExpectedTerm
        Terms of a sampled record, which `AllanResult.fit` also uses. They differ slightly from
        terms in continuous time.
    """
    return tuple(term for term in _yield_terms(model, curve) if np.any(term.deviation > 0.0))


def expected_deviation(model: NoiseModel, curve: "AllanResult") -> Floats:
    """Return the expected deviation of the rate for a model, in SI, shape (t,)."""
    terms = (term.deviation for term in expected_terms(model, curve))
    return reduce(np.hypot, terms, np.zeros(curve.taus.size))


def _yield_terms(model: NoiseModel, curve: "AllanResult") -> Iterator[ExpectedTerm]:
    kind, m, rate = KINDS[curve.kind], curve.factors, curve.rate
    for field in (term.field for term in TERMS[model.quantity]):
        if field in COLOURED:
            variance = variances(kind, m, COLOURED[field])
        else:
            variance = ramp_variance(kind, m.astype(np.float64))
        size = abs(getattr(model, field).value)
        yield ExpectedTerm(field, size * np.sqrt(strength(field, rate) * variance))
    for correlated in model.markov:
        scale = correlated.amplitude * np.sqrt(correlated.time / 2.0)
        variance = variances(kind, m, markov(correlated.time * rate))
        yield ExpectedTerm("markov", scale * np.sqrt(variance))
    for sine in model.sinusoid:
        variance = sinusoid_variance(kind, m.astype(np.float64), sine.frequency / rate)
        yield ExpectedTerm("sinusoid", sine.amplitude * np.sqrt(variance))


def polynomial_fit(taus: Floats, deviation: Floats, unit: tuple[float, Quantity]) -> FittedModel:
    """Fit sigma^2 = sum of A_n tau^n, n = -2 to 2, by least squares of relative errors.

    Every averaging time has the same weight and is assumed independent of the others. Therefore the
    stated errors are too small, and a term without evidence may be large. The method is not the
    default for these reasons. A negative coefficient is not identifiable.

    Parameters
    ----------
    taus, deviation : ndarray, shape (t,)
        Averaging times, s, and a curve of the Allan family.
    unit : tuple
        SI unit of the deviation, and its quantity.
    """
    if taus.size < _MIN_TAUS:
        raise ValueError(f"the polynomial fit needs {_MIN_TAUS} averaging times, has {taus.size}")
    variance = deviation**2
    basis = taus[:, None] ** np.array(list(_POWERS.values())) / variance[:, None]
    lengths = np.linalg.norm(basis, axis=0)
    scaled, residuals, _, _ = np.linalg.lstsq(basis / lengths, np.ones(taus.size), rcond=None)
    residual = float(residuals[0]) if residuals.size else 0.0
    freedom = taus.size - len(_POWERS)
    spread = np.sqrt(np.diag(np.linalg.pinv((basis / lengths).T @ (basis / lengths))))
    sigmas = spread * np.sqrt(residual / freedom) / lengths
    coefficients = {
        name: _make_coefficient(name, a, sigma).scaled(unit[0])
        for name, a, sigma in zip(_POWERS, scaled / lengths, sigmas, strict=True)
    }
    return FittedModel(
        **coefficients,  # type: ignore[arg-type]
        quantity=unit[1],
        method="polynomial",
        chi_squared=residual,
        degrees_of_freedom=freedom,
        misfit=float(np.sqrt(residual / freedom)),
    )


def _make_coefficient(name: str, a: float, sigma: float) -> Coefficient:
    model = NoiseModel(**{name: 1.0})  # type: ignore[arg-type]
    unit = float(model.allan_deviation(1.0)) ** 2
    bound = float(np.sqrt(max(a, 0.0) + 1.645 * sigma) / np.sqrt(unit))
    if not a > 0.0:
        return Coefficient(0.0, bound / 1.645, False, bound)
    value = float(np.sqrt(a / unit))
    return Coefficient(value, float(value * sigma / (2.0 * a)), bool(a > 2.0 * sigma), bound)
