"""The unit-root test of Dickey and Fuller."""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.identify.checks.verdict import Verdict
from zerorate.identify.estimation.autoregression import HIGHEST_ORDER, fit_ar
from zerorate.identify.records import as_record
from zerorate.noise.records import longest_stretch

__all__ = ["adf"]

_LEAST: Final = 20

_LARGEST: Final = 2.74
_SMALLEST: Final = -18.83
_BETWEEN: Final = -1.61
_BELOW: Final = (2.1659, 1.4412, 0.038269)
_ABOVE: Final = (1.7339, 0.93202, -0.12745, -0.010368)
"""Response surface of the normal quantile, in powers of the statistic."""

_CRITICAL: Final = (-2.86154, -2.8903, -4.234, -40.04)
"""Response surface of the 5 % point, in powers of 1/n."""


def adf(z: npt.ArrayLike, lags: int | None = None) -> Verdict:
    """Test whether a record has a unit root: whether it walks at random rather than about a level.

    Acceptance says that the record may walk. Beware of the opposite: drift that is faint beside
    white noise, a gyro's case, is an ARMA process whose moving-average root is near 1, and there
    the test rejects a unit root that is present far more often than 5 %. `kpss` sees such drift,
    and `reverse_arrangements` does if it does not come back.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples in any unit, at least 20; those not finite are missing, and the regression starts
        anew after them.
    lags : int, optional
        Lagged differences in the regression, 0 to 63. Default: the number of least AIC, all
        compared over the same samples, up to Schwert's 12 (n/100)^(1/4) but at most 63, with n
        the length of the longest stretch without a gap.

    Returns
    -------
    Verdict
        The statistic is that of the coefficient on z_(k-1) in the regression of z_k - z_(k-1) with
        a constant; the hypothesis is accepted above the critical value `lower`.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, has too few or only equal samples, or `lags` is not as described.

    Notes
    -----
    With k lagged differences the regression is an AR(k + 1) in another basis, its coefficient
    phi_1 + ... + phi_(k+1) - 1. Probability: J. G. MacKinnon, Journal of Business and Economic
    Statistics 12, 1994; critical value: the same, Queen's University working paper 1227, 2010.
    W. E. Said, D. A. Dickey, Biometrika 71, 1984; G. W. Schwert, JBES 7, 1989.

    Examples
    --------
    >>> noise = np.random.default_rng(1).standard_normal(1000)
    >>> adf(noise).accepted, adf(np.cumsum(noise)).accepted
    (False, True)
    """
    record = as_record(z, _LEAST, "the Dickey-Fuller test")
    n = longest_stretch(record).size
    k = _least_aic(record, _schwert(n)) if lags is None else _checked(lags, n)
    statistic, used = _statistic(record, k + 1)
    lower = sum(b / used**power for power, b in enumerate(_CRITICAL))
    p_value = _probability(statistic)
    return Verdict(
        name="augmented Dickey-Fuller",
        hypothesis="unit root",
        statistic=statistic,
        p_value=p_value,
        lower=lower,
        upper=math.inf,
        accepted=statistic > lower,
        n=used,
        note=f"{k} lagged difference" + ("s" if k != 1 else ""),
    )


def _statistic(record: npt.NDArray[np.float64], order: int) -> tuple[float, int]:
    """Return the sum of the coefficients less 1 over its standard error, and the residuals used."""
    model = fit_ar(record, order)
    variance = float(model.covariance[:order, :order].sum())
    # The covariance has the residuals' mean square; the test has it per degree of freedom.
    freedom = (model.n - order - 1) / model.n
    return (float(model.phi.sum()) - 1.0) / math.sqrt(variance / freedom), model.n


def _least_aic(record: npt.NDArray[np.float64], highest: int) -> int:
    sigma2, n = _native.autoregression_variances(record, highest + 1, "least-squares", True)
    orders = np.arange(1, highest + 2)
    return int(np.argmin(n * np.log(sigma2[1:]) + 2.0 * orders))


def _schwert(n: int) -> int:
    return max(min(math.ceil(12.0 * math.sqrt(math.sqrt(n / 100.0))), _most(n)), 0)


def _probability(statistic: float) -> float:
    if statistic > _LARGEST:
        return 1.0
    if statistic < _SMALLEST:
        return 0.0
    surface = _BELOW if statistic <= _BETWEEN else _ABOVE
    quantile = sum(b * statistic**power for power, b in enumerate(surface))
    return 0.5 * math.erfc(-quantile / math.sqrt(2.0))


def _most(n: int) -> int:
    """Return the most lags that a stretch of n samples bears."""
    return min(n // 2 - 2, HIGHEST_ORDER - 1)


def _checked(lags: int, n: int) -> int:
    most = max(_most(n), 0)
    if lags not in range(most + 1):
        raise ValueError(f"lags must be a whole number from 0 to {most}, got {lags!r}")
    return int(lags)
