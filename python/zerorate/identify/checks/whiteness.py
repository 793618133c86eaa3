"""Whether residuals are white."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.identify.checks.correlogram import (
    Correlations,
    Correlogram,
    autocorrelation,
    correlations,
    partial,
)
from zerorate.identify.checks.verdict import Verdict
from zerorate.identify.preparation.smoothing import checked_width
from zerorate.identify.records import as_record

__all__ = ["Correlogram", "Whiteness", "autocorrelation", "ljung_box", "whiteness"]

Floats = npt.NDArray[np.float64]

_PREDICTOR: Final = 20


@dataclass(frozen=True, eq=False)
class Whiteness:
    """What is left in residuals that could still be explained.

    Attributes
    ----------
    ljung_box : Verdict
        The test of all lags together.
    correlogram : Correlogram
        The correlations lag by lag.
    outside : int
        Number of lags whose autocorrelation is beyond the bound; of white noise, 1 in 20.
    predictable : float
        Share of the variance that an AR(20) of the residuals would still explain, 0 to 1. White
        noise of n samples shows some 20/n by chance.
    white : bool
        Whether the Ljung-Box test accepts. Of a long record it rejects correlations too faint to
        matter; `predictable` says how much they do.
    """

    ljung_box: Verdict
    correlogram: Correlogram
    outside: int
    predictable: float
    white: bool


def ljung_box(z: npt.ArrayLike, lags: int = 20, fitted: int = 0) -> Verdict:
    """Test whether the autocorrelations up to a lag are those of white noise, all together.

    Parameters
    ----------
    z : array_like, shape (n,)
        Residuals in any unit; those not finite are missing, and no product reaches across them.
    lags : int, default 20
        The greatest lag: more lags see longer correlations, and any one of them less well.
    fitted : int, default 0
        Coefficients p + q of the model whose residuals these are; less than `lags`.

    Returns
    -------
    Verdict
        Statistic Q with lags - fitted degrees of freedom.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, has too few or only equal samples, or an argument is not as
        described.

    Notes
    -----
    Q = n (n + 2) sum r_l^2 / (n - l): G. M. Ljung, G. E. P. Box, Biometrika 65(2), 1978. With gaps,
    each correlation counts by the pairs that it was made of.

    Examples
    --------
    >>> ljung_box(np.random.default_rng(1).standard_normal(1000)).accepted
    True
    """
    record = as_record(z, 2, "the Ljung-Box test")
    _check_fitted(lags, fitted)
    return _portmanteau(correlations(record, lags), fitted)


def whiteness(residuals: npt.ArrayLike, lags: int = 20, fitted: int = 0) -> Whiteness:
    """Return whether residuals are white, and how much it matters if not.

    Parameters
    ----------
    residuals : array_like, shape (n,)
        Of a model, in any unit; those not finite are missing.
    lags : int, default 20
        The greatest lag that is tested.
    fitted : int, default 0
        Coefficients p + q of the model; less than `lags`.

    Returns
    -------
    Whiteness

    Raises
    ------
    TypeError
        If `residuals` does not hold real numbers.
    ValueError
        If `residuals` is not one axis, has too few or only equal samples, or an argument is not
        as described.

    Examples
    --------
    >>> noise = np.random.default_rng(1).standard_normal(100_001)
    >>> faint = whiteness(noise[1:] + 0.05 * noise[:-1])
    >>> faint.white, faint.predictable < 0.004
    (False, True)
    """
    record = as_record(residuals, 2, "the test of whiteness")
    _check_fitted(lags, fitted)
    found = correlations(record, lags, welcome=_PREDICTOR)
    correlogram = found.up_to(lags).correlogram()
    verdict = _portmanteau(found.up_to(lags), fitted)
    return Whiteness(
        ljung_box=verdict,
        correlogram=correlogram,
        outside=int(np.count_nonzero(np.abs(correlogram.acf) > correlogram.bound)),
        predictable=_predictable(found.up_to(_PREDICTOR).acf),
        white=verdict.accepted,
    )


def _check_fitted(lags: int, fitted: int) -> None:
    checked_width(lags, "lags")
    if not 0 <= fitted < lags:
        raise ValueError(f"fitted must be from 0 to less than lags, {lags}, got {fitted}")


def _portmanteau(found: Correlations, fitted: int) -> Verdict:
    n, lag = found.n, np.arange(1, found.acf.size + 1)
    # Of all n - l pairs this is r^2 / (n - l).
    terms = (found.acf / (n - lag)) ** 2 * found.pairs
    statistic = n * (n + 2) * float(terms.sum())
    freedom = found.acf.size - fitted
    upper = float(_native.chi_squared_quantile(0.95, [freedom])[0])
    return Verdict(
        name="Ljung-Box",
        hypothesis="white noise",
        statistic=statistic,
        p_value=_native.chi_squared_survival(statistic, freedom),
        lower=-np.inf,
        upper=upper,
        accepted=statistic <= upper,
        n=n,
    )


def _predictable(acf: Floats) -> float:
    """Return 1 less the product of 1 - pacf^2, which is what each lag leaves of the variance."""
    pacf = partial(acf)
    return 1.0 - float(np.prod(1.0 - pacf[np.isfinite(pacf)] ** 2))
