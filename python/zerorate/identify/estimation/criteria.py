"""Information criteria: what a model leaves over, and what its coefficients cost.

Each takes `sigma2`, the residuals' variance (their sum of squares over n), `n`, their number, the
same for all models that are compared, and `k` = p + q, one more if a constant was fitted. Numbers
or arrays; the least is the best. The Gaussian likelihood's constant, n (1 + ln 2π), is left out.
"""

import math

import numpy as np
import numpy.typing as npt

__all__ = ["aic", "aicc", "bic", "fpe", "hq"]

Floats = npt.NDArray[np.float64]


def fpe(sigma2: npt.ArrayLike, n: int, k: npt.ArrayLike) -> Floats:
    """Return the final prediction error, sigma2 (n + k) / (n - k).

    The variance with which the fitted model forecasts another record of its process, in the square
    of the record's unit.

    Notes
    -----
    With a constant, k = p + 1, this is the form (n + p + 1) / (n - p - 1) of Akaike, "Fitting
    autoregressive models for prediction", Ann. Inst. Stat. Math. 21, 1969; without one, k = p.

    Examples
    --------
    >>> float(fpe(2.0, 12, 4))
    4.0
    """
    k = np.asarray(k)
    return np.asarray(sigma2 * ((n + k) / (n - k)))


def aic(sigma2: npt.ArrayLike, n: int, k: npt.ArrayLike) -> Floats:
    """Return Akaike's criterion, n ln sigma2 + 2 k."""
    return _misfit(sigma2, n) + 2.0 * np.asarray(k)


def aicc(sigma2: npt.ArrayLike, n: int, k: npt.ArrayLike) -> Floats:
    """Return Akaike's criterion for short records, n ln sigma2 + 2 k n / (n - k - 1).

    Infinite for n <= k + 1.
    """
    k = np.asarray(k)
    freedom = n - k - 1.0
    # A short record is no reason to divide by zero.
    cost = np.where(freedom > 0.0, 2.0 * n * k / np.where(freedom > 0.0, freedom, 1.0), np.inf)
    return _misfit(sigma2, n) + cost


def bic(sigma2: npt.ArrayLike, n: int, k: npt.ArrayLike) -> Floats:
    """Return the Bayesian criterion of Schwarz, n ln sigma2 + k ln n."""
    return _misfit(sigma2, n) + math.log(n) * np.asarray(k)


def hq(sigma2: npt.ArrayLike, n: int, k: npt.ArrayLike) -> Floats:
    """Return the criterion of Hannan and Quinn, n ln sigma2 + 2 k ln ln n."""
    return _misfit(sigma2, n) + 2.0 * math.log(math.log(n)) * np.asarray(k)


def _misfit(sigma2: npt.ArrayLike, n: int) -> Floats:
    """Return -2 ln of the Gaussian likelihood, without its constant."""
    return np.asarray(n * np.log(sigma2))
