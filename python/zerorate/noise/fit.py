"""Noise coefficients from a deviation curve or a spectrum, with their standard errors."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate._native import chi_squared_quantile
from zerorate.noise.coefficient import Coefficient
from zerorate.noise.least_squares import Solution, Weighting, bound_by_single, solve, upper_bound
from zerorate.noise.model import NoiseModel
from zerorate.noise.quantities import Quantity
from zerorate.noise.terms import Markov, Sinusoid
from zerorate.types import Floats

# A coefficient is identifiable if its square exceeds twice the standard error of the square. Its
# relative error is then below a quarter.
_IDENTIFIABLE_SIGMAS: Final = 2.0
_MISFIT_PROBABILITY: Final = 0.99
_ONE_SIDED_95: Final = 1.6448536269514722
_MAX_MISFIT: Final = 4.0
_MISFIT_PRECISION: Final = 5e-3
_MAX_STEPS: Final = 100


@dataclass(frozen=True)
class FittedModel(NoiseModel):
    """A `NoiseModel` with the quality of its fit.

    Attributes
    ----------
    method : str
        Data or method of the fit: name of a deviation, ``"whittle"`` or ``"polynomial"``.
    chi_squared, degrees_of_freedom : float, int
        Weighted sum of squared residuals, and its expected value. The weights do not include
        `misfit`.
    misfit : float
        Relative error of the model's variances that explains the residuals; 0 if chance explains
        them. Standard errors of the coefficients include `misfit`.

    Examples
    --------
    >>> import zerorate as zr
    >>> model = zr.NoiseModel(angle_random_walk=1e-4)
    >>> signal, _ = zr.simulate(model, rate=100.0, duration=600.0, seed=1)
    >>> fit = zr.allan(signal, rate=100.0, unit="rad/s").fit()
    >>> abs(fit.angle_random_walk / 1e-4 - 1.0) < 0.02, fit.method
    (True, 'oadev')
    """

    method: str = ""
    chi_squared: float = 0.0
    degrees_of_freedom: int = 0
    misfit: float = 0.0


@dataclass(frozen=True)
class Component:
    """Column of a fit.

    Parameters
    ----------
    name : str
        Field of `NoiseModel`.
    scale : float
        Variance of the column for a coefficient of 1.
    make : callable, optional
        Function from a coefficient to a Markov or Sinusoid term.
    """

    name: str
    scale: float
    make: Callable[[Coefficient], Markov | Sinusoid] | None = None


@dataclass(frozen=True)
class Problem:
    """Data to fit, and their components.

    Parameters
    ----------
    basis : ndarray, shape (t, p)
        Expected data of each component at unit strength.
    data : ndarray, shape (t,)
        Estimates of variances.
    edf : ndarray, shape (t,)
        Approximate degrees of freedom of each estimate, for the first weights.
    weighting : callable
        Function from strengths to the covariance of the data.
    """

    basis: Floats
    data: Floats
    edf: Floats
    weighting: Weighting

    def solve(self) -> tuple[Solution, Weighting, float, float]:
        """Return the solution, its weighting, its misfit, and chi-squared without the misfit."""
        start = 2.0 * self.data**2 / self.edf
        plain = solve(self.basis, self.data, start, self.weighting)
        freedom = max(plain.degrees_of_freedom, 1)
        if plain.chi_squared <= float(chi_squared_quantile(_MISFIT_PROBABILITY, [freedom])[0]):
            return plain, self.weighting, 0.0, plain.chi_squared
        misfit = self._find_misfit(plain.strengths, freedom)
        weighting = self._weight_with_misfit(misfit)
        solution = solve(self.basis, self.data, weighting(plain.strengths), weighting)
        return solution, weighting, misfit, plain.chi_squared

    def _find_misfit(self, strengths: Floats, freedom: int) -> float:
        """Return the relative model error that reduces chi-squared to its expectation.

        If this error dominates, chi-squared is proportional to the inverse of its square.
        """
        misfit = float(np.sqrt(np.mean((self.data / (self.basis @ strengths) - 1.0) ** 2)))
        for _ in range(_MAX_STEPS):
            weighting = self._weight_with_misfit(misfit)
            solution = solve(self.basis, self.data, weighting(strengths), weighting)
            strengths, ratio = solution.strengths, np.sqrt(solution.chi_squared / freedom)
            misfit = min(misfit * float(ratio), _MAX_MISFIT)
            if abs(ratio - 1.0) < _MISFIT_PRECISION or misfit == _MAX_MISFIT:
                break
        return misfit

    def _weight_with_misfit(self, misfit: float) -> Weighting:
        def weighting(strengths: Floats) -> Floats:
            expected = self.basis @ strengths
            scatter, error = self.weighting(strengths), (misfit * expected) ** 2
            return scatter + (error if scatter.ndim == 1 else np.diag(error))

        return weighting


def fit_components(
    problem: Problem, components: Sequence[Component], method: str, unit: tuple[float, Quantity]
) -> FittedModel:
    """Solve the problem and return its model; `unit` is the data's SI unit and quantity."""
    solution, weighting, misfit, chi_squared = problem.solve()
    coefficients: dict[str, object] = {}
    for i, component in enumerate(components):
        bound = upper_bound(problem.basis, solution, i, weighting)
        if not np.isfinite(bound):
            bound = bound_by_single(problem.basis[:, i], problem.data, problem.edf)
        value = _make_coefficient(solution, i, bound, component.scale).scaled(unit[0])
        if component.make is None:
            coefficients[component.name] = value
        else:
            earlier = coefficients.get(component.name, ())
            coefficients[component.name] = (*earlier, component.make(value))  # type: ignore[misc]
    return FittedModel(
        **coefficients,  # type: ignore[arg-type]
        quantity=unit[1],
        method=method,
        chi_squared=chi_squared,
        degrees_of_freedom=solution.degrees_of_freedom,
        misfit=misfit,
    )


def coefficient_of(model: NoiseModel, field: str) -> Coefficient:
    """Return a coefficient of a model by its field."""
    coefficient: Coefficient = getattr(model, field)
    return coefficient


def coefficient_of_square(square: float, sigma: float) -> Coefficient:
    """Return the root of a square as a coefficient, with standard error and 95 % bound."""
    largest = math.sqrt(max(square, 0.0) + _ONE_SIDED_95 * sigma)
    if not square > 0.0:
        return Coefficient(0.0, largest / _ONE_SIDED_95, False, largest)
    value = math.sqrt(square)
    identifiable = square > _IDENTIFIABLE_SIGMAS * sigma
    return Coefficient(value, sigma / (2.0 * value), identifiable, max(largest, value))


def _make_coefficient(solution: Solution, i: int, bound: float, scale: float) -> Coefficient:
    """Return the root of a strength as a coefficient, with errors to first order."""
    strength, sigma = solution.strengths[i] / scale, solution.sigmas[i] / scale
    largest = float(np.sqrt(bound / scale))
    if not strength > 0.0:
        return Coefficient(0.0, largest / 1.645, False, largest)
    value = float(np.sqrt(strength))
    identifiable = strength > _IDENTIFIABLE_SIGMAS * sigma
    return Coefficient(value, float(sigma / (2.0 * value)), bool(identifiable), max(largest, value))
