"""An ARMA model of a record, and how well the record determines it."""

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

__all__ = ["ArmaModel"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ArmaModel:
    """A model z_k = sum_i phi_i z_(k-i) + a_k + sum_j theta_j a_(k-j) + c, of orders (p, q).

    Attributes
    ----------
    phi : ndarray, shape (p,)
        Autoregressive coefficients.
    theta : ndarray, shape (q,)
        Moving-average coefficients.
    constant : float
        c, in the unit of the record.
    sigma2 : float
        Variance of the innovations a: the sum of their squares over their number.
    covariance : ndarray, shape (p + q + 1, p + q + 1)
        Of the estimates of [phi, theta, c]; zero for a constant that was not estimated.
    n : int
        Number of innovations that were summed.
    log_likelihood : float
        Of the innovations, Gaussian.
    condition : float
        Condition number of the normal equations, scaled to a unit diagonal: large where the
        record cannot tell the coefficients apart.
    method : str
        Of the estimate.
    has_constant : bool
        Whether the constant was estimated; otherwise it is 0.
    converged : bool
        Whether the search for the estimate came to its end.
    notes : tuple of str
        What to beware of, a sentence each.
    mean_sigma : float
        Standard error of `mean`, NaN where it is not known.
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
    notes: tuple[str, ...] = field(default=())
    mean_sigma: float = math.nan

    @property
    def order(self) -> tuple[int, int]:
        """Orders (p, q)."""
        return len(self.phi), len(self.theta)

    @property
    def mean(self) -> float:
        """Mean of the process, c / (1 - phi_1 - ... - phi_p)."""
        return float(self.constant / (1.0 - self.phi.sum())) if self.constant else 0.0

    @property
    def standard_errors(self) -> Floats:
        """Standard errors of [phi, theta, c], shape (p + q + 1,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def n_parameters(self) -> int:
        """How many numbers were estimated: coefficients, constant and innovation variance."""
        return len(self.phi) + len(self.theta) + int(self.has_constant) + 1

    @property
    def aic(self) -> float:
        """Akaike's criterion, -2 log L + 2 k with k = `n_parameters`."""
        return -2.0 * self.log_likelihood + 2.0 * self.n_parameters
