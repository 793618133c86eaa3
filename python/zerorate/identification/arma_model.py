"""ARMA model of a record, with standard errors of its coefficients."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from zerorate._native import arma_residuals
from zerorate.faults import ArgumentError
from zerorate.identification.arma_text import diagnosis, from_json, to_json
from zerorate.identification.filter_start import make_filter
from zerorate.identification.polynomials import (
    Mode,
    at_one,
    autocovariance,
    inverse_roots,
    is_stationary,
    modes,
    psi_weights,
    spectrum,
)
from zerorate.identification.state_space import make_state_space
from zerorate.noise.records import as_record
from zerorate.record.exporting import document_restore
from zerorate.types import Floats
from zerorate.views import Result

Complexes = npt.NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class ArmaModel(Result):
    """Model z_k = sum_i phi_i z_(k-i) + a_k + sum_j theta_j a_(k-j) + c, of orders (p, q).

    `fit_ar` and `fit_arma` estimate a model; `of` makes a model from known numbers. Two models are
    equal if all their numbers are equal. `print` shows a table.

    Attributes
    ----------
    phi : ndarray, shape (p,)
        Autoregressive coefficients.
    theta : ndarray, shape (q,)
        Moving-average coefficients.
    constant : float
        c, in the unit of the record.
    sigma2 : float
        Variance of the innovations a: their mean square.
    covariance : ndarray, shape (p + q + 1, p + q + 1)
        Covariance of the estimates of [phi, theta, c]; zero for a constant that was not estimated.
    n : int
        Number of innovations in the mean square.
    log_likelihood : float
        Gaussian log-likelihood of the innovations.
    condition : float
        Condition number of the normal equations, scaled to a unit diagonal. It is large if the
        record hardly distinguishes the coefficients.
    method : str
        Method by which the model was estimated.
    has_constant : bool
        True if the constant was estimated; otherwise it is 0.
    converged : bool
        True if the search for the estimate converged.
    remarks : tuple of str
        Sentences on the estimation.
    record_mean : float
        Mean of the record; NaN if it is not known.
    record_deviation : float
        Standard deviation of the record; NaN if it is not known.
    mean_sigma : float
        Standard error of `mean`; NaN if it is not known.

    Raises
    ------
    ValueError
        If the covariance does not have the shape (p + q + 1, p + q + 1). If a coefficient or the
        innovation variance is not a finite number.

    Examples
    --------
    >>> model = ArmaModel.of([0.9], [-0.5], constant=0.1, sigma2=4.0)
    >>> round(model.mean, 12), model.autocovariance(2).round(3).tolist()
    (1.0, [7.368, 4.632, 4.168])
    >>> print(model)
    ARMA(1, 1) as given
    phi_1     0.9
    theta_1   -0.5
    constant  0.1
    sigma^2   4
    """

    phi: Floats
    theta: Floats
    constant: float
    sigma2: float
    covariance: Floats
    n: int
    log_likelihood: float
    condition: float
    method: str
    has_constant: bool = True
    converged: bool = True
    remarks: tuple[str, ...] = ()
    record_mean: float = math.nan
    record_deviation: float = math.nan
    mean_sigma: float = math.nan

    to_json = to_json
    to_state_space = make_state_space
    to_filter = make_filter

    def __post_init__(self) -> None:
        """Freeze the arrays and check them."""
        for name in ("phi", "theta", "covariance"):
            array = np.array(getattr(self, name), dtype=np.float64)
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        _check_model(self)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Warnings, one sentence each: first the remarks, then warnings from the numbers.

        Warnings from the numbers concern:

        - a search that did not converge;
        - a condition number above 1e8, which loses half of the digits;
        - a model that is not stationary or not invertible;
        - a root within 1.96 standard errors (95 %) of the unit circle;
        - an AR and an MA root closer than 1.96 standard errors: the record does not determine this
          common factor.
        """
        return tuple(dict.fromkeys((*self.remarks, *diagnosis(self))))

    @classmethod
    def of(
        cls,
        phi: npt.ArrayLike,
        theta: npt.ArrayLike,
        constant: float = 0.0,
        sigma2: float = 1.0,
    ) -> ArmaModel:
        """Return the model with given coefficients, without standard errors or a record.

        Parameters
        ----------
        phi, theta : array_like, shape (p,) and (q,)
            Coefficients; an empty array for order zero.
        constant : float
            c, in the unit of the record.
        sigma2 : float
            Variance of the innovations.

        Raises
        ------
        ValueError
            If a number is not finite, or `sigma2` negative.
        """
        phi, theta = (np.atleast_1d(np.asarray(x, dtype=np.float64)) for x in (phi, theta))
        size = phi.size + theta.size + 1
        return cls(
            phi=phi,
            theta=theta,
            constant=float(constant),
            sigma2=float(sigma2),
            covariance=np.zeros((size, size)),
            n=0,
            log_likelihood=math.nan,
            condition=math.nan,
            method="given",
        )

    @classmethod
    @document_restore
    def from_json(cls, source: str | os.PathLike[str]) -> ArmaModel:
        """Return the model that `to_json` wrote, without loss of digits.

        Examples
        --------
        >>> model = ArmaModel.of([1.2, -0.3], [0.5], sigma2=2e-9)
        >>> ArmaModel.from_json(model.to_json()) == model
        True
        """
        return from_json(source, cls)

    @property
    def order(self) -> tuple[int, int]:
        """Orders (p, q)."""
        return len(self.phi), len(self.theta)

    @property
    def mean(self) -> float:
        """Mean c / (1 - phi_1 - ... - phi_p) of the process; NaN for a random walk with drift."""
        if not self.constant:
            return 0.0
        rest = at_one(-self.phi)
        return float(self.constant / rest) if rest else math.nan

    @property
    def ar_roots(self) -> Complexes:
        """Roots of 1 - phi_1 x - ... - phi_p x^p, smallest size first."""
        return _roots(-self.phi)

    @property
    def ma_roots(self) -> Complexes:
        """Roots of 1 + theta_1 x + ... + theta_q x^q, smallest size first."""
        return _roots(self.theta)

    @property
    def stationary(self) -> bool:
        """True if every AR root lies outside the unit circle."""
        return is_stationary(self.phi)

    @property
    def invertible(self) -> bool:
        """True if every MA root lies outside the unit circle."""
        return bool(np.all(np.abs(inverse_roots(self.theta)) < 1.0))

    def modes(self, rate: float) -> tuple[Mode, ...]:
        """Return time constant, frequency and damping of each AR root, slowest decay first.

        Parameters
        ----------
        rate : float
            Samples per second.

        Examples
        --------
        >>> [round(mode.time_constant, 3) for mode in ArmaModel.of([0.99], []).modes(100.0)]
        [0.995]
        """
        return modes(inverse_roots(-self.phi), rate)

    def psi_weights(self, n: int) -> Floats:
        """Return psi_0 ... psi_(n-1), the impulse response from innovations to samples.

        Raises
        ------
        ValueError
            If `n` is not positive.
        """
        if n < 1:
            raise ArgumentError("n", f"must be at least 1, got {n}")
        return psi_weights(self.phi, self.theta, n)

    def autocovariance(self, lags: int) -> Floats:
        """Return gamma_0 ... gamma_lags of the process, shape (lags + 1,), correct up to rounding.

        Raises
        ------
        ValueError
            If the model is not stationary, or `lags` negative.
        """
        if lags < 0:
            raise ArgumentError("lags", f"must not be negative, got {lags}")
        if not self.stationary:
            least = float(np.min(np.abs(self.ar_roots)))
            raise ValueError(
                "only a stationary model has an autocovariance: "
                f"the smallest AR root is {least:.6g}, expected above 1"
            )
        return autocovariance(self.phi, self.theta, self.sigma2, lags)

    def autocorrelation(self, lags: int) -> Floats:
        """Return rho_0 = 1 ... rho_lags, shape (lags + 1,).

        Raises
        ------
        ValueError
            As `autocovariance`.
        """
        gamma = self.autocovariance(lags)
        return np.asarray(gamma / gamma[0])

    def spectrum(self, frequencies: npt.ArrayLike, rate: float) -> Floats:
        """Return the one-sided density ``2 sigma2 |theta|^2 / (rate |phi|^2)``.

        Parameters
        ----------
        frequencies : array_like
            Frequencies in Hz, from 0 to rate / 2, any shape.
        rate : float
            Samples per second.

        Returns
        -------
        ndarray of float64, the shape of `frequencies`
            Density in the squared unit of the record per Hz. Its integral from 0 to rate / 2 is the
            variance of a stationary model. It is infinite at a root on the unit circle.

        Raises
        ------
        ValueError
            If a frequency is outside its range, or the rate is not positive.
        """
        return spectrum(self.phi, self.theta, self.sigma2, frequencies, rate)

    def residuals(self, z: npt.ArrayLike) -> Floats:
        """Return the innovations of a record under this model, shape (n,).

        a_k = z_k - sum_i phi_i z_(k-i) - sum_j theta_j a_(k-j) - c. Before each stretch between
        missing samples, the samples are taken as their mean (`record_mean` if known), and the
        innovations as zero. The first p innovations of a stretch depend on this assumption and are
        NaN. So are those of missing samples.

        Raises
        ------
        TypeError, ValueError
            If `z` is not a record of one axis.

        Examples
        --------
        >>> ArmaModel.of([0.5], []).residuals([4.0, 3.0, 1.0])
        array([ nan,  1. , -0.5])
        """
        record = as_record(z)
        centre = self._start_level(record)
        constant = math.fsum((self.constant, -centre * at_one(-self.phi)))
        phi, theta = self.phi.tolist(), self.theta.tolist()
        return arma_residuals(record, phi, theta, centre, constant)

    def _start_level(self, record: Floats) -> float:
        """Return the assumed level of samples before a record begins."""
        if math.isfinite(self.record_mean):
            return self.record_mean
        return self.mean if self.stationary else float(np.nanmean(record))

    @property
    def standard_errors(self) -> Floats:
        """Standard errors of [phi, theta, c], shape (p + q + 1,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def parameter_count(self) -> int:
        """Number of estimated parameters: coefficients, constant and innovation variance."""
        return len(self.phi) + len(self.theta) + int(self.has_constant) + 1

    @property
    def aic(self) -> float:
        """Akaike's criterion, -2 log L + 2 k with k = `parameter_count`."""
        return -2.0 * self.log_likelihood + 2.0 * self.parameter_count

    def __eq__(self, other: object) -> bool:
        """Return True if every number is equal, bit for bit."""
        if not isinstance(other, ArmaModel):
            return NotImplemented
        return self.to_json() == other.to_json()

    def __hash__(self) -> int:
        """Return a hash consistent with ``==``."""
        return hash(self.to_json())

    def __reduce__(self) -> tuple[Callable[[str], ArmaModel], tuple[str]]:
        """Pickle through JSON, which is lossless and freezes the arrays again."""
        return ArmaModel.from_json, (self.to_json(),)


def _roots(coefficients: Floats) -> Complexes:
    reciprocal = inverse_roots(coefficients)
    return np.asarray(1.0 / reciprocal[reciprocal != 0.0])


def _check_model(model: ArmaModel) -> None:
    size = len(model.phi) + len(model.theta) + 1
    if model.covariance.shape != (size, size):
        raise ArgumentError(
            "covariance", f"must have shape {(size, size)}, got {model.covariance.shape}"
        )
    numbers: dict[str, Any] = {
        "phi": model.phi,
        "theta": model.theta,
        "constant": model.constant,
        "sigma2": model.sigma2,
    }
    for name, value in numbers.items():
        if not np.all(np.isfinite(value)):
            raise ArgumentError(name, f"must be finite, got {value}")
    if model.sigma2 < 0.0:
        raise ValueError(f"sigma2 must not be negative, got {model.sigma2}")
