"""Tests of stationarity (KPSS) and of a unit root (Dickey-Fuller)."""

from __future__ import annotations

import math
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.faults import ArgumentError
from zerorate.identification.autoregression import MAX_AR_ORDER, fit_ar
from zerorate.identification.preparation import detrend
from zerorate.identification.verdict import Verdict
from zerorate.noise.records import as_record, centre_record, longest_stretch
from zerorate.types import Floats

Level = Literal["constant", "linear"]

_KPSS_PROBABILITIES: Final = (0.10, 0.05, 0.025, 0.01)
_KPSS_CRITICAL: Final[dict[str, tuple[float, float, float, float]]] = {
    "constant": (0.347, 0.463, 0.574, 0.739),
    "linear": (0.119, 0.146, 0.176, 0.216),
}
_KPSS_MIN_SAMPLES: Final = 10
_KPSS_ROUNDING: Final = 1e-12
"""Largest rounding error of a straight line with samples up to 1."""


def kpss(z: npt.ArrayLike, lags: int | None = None, trend: Level = "constant") -> Verdict:
    """Test a record for stationarity about a level, or about a straight line.

    This test and `reverse_arrangements` detect the weak drift of a gyro; `adf` seldom detects it.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples in any unit; values that are not finite count as missing. Sums skip missing samples.
        Products of two samples with a gap between them are left out.
    lags : int, optional
        Number of lags of the long-run variance, 0 to n - 1. Noise with a long correlation needs
        many lags, but many lags reduce the power of the test. Default: from the record, by the rule
        of Hobijn and others with Bartlett's window.
    trend : {"constant", "linear"}
        Hypothesis: stationary about a level, or about a straight line.

    Returns
    -------
    Verdict
        Result. Its `p_value` is interpolated in a table from 0.10 to 0.01. Outside the table,
        `p_bound` states that the probability is above 0.10 or below 0.01.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, or has fewer than 10 or only equal samples. If an argument is not as
        described.

    Notes
    -----
    D. Kwiatkowski and others, Journal of Econometrics 54, 1992, equations 10 and 13, table 1. Lags:
    B. Hobijn, P. H. Franses, M. Ooms, Statistica Neerlandica 58(4), 2004.

    Examples
    --------
    >>> noise = np.random.default_rng(1).standard_normal(10_000)
    >>> kpss(noise).accepted, kpss(noise + 0.02 * np.cumsum(noise[::-1])).accepted
    (True, False)
    """
    if trend not in _KPSS_CRITICAL:
        raise ArgumentError("trend", f"must be one of 'constant', 'linear', got {trend!r}")
    residuals = centre_record(as_record(z, _KPSS_MIN_SAMPLES, "the KPSS test"))
    if trend == "linear":
        residuals = _remove_line(residuals)
    present = residuals[np.isfinite(residuals)]
    n = present.size
    sums = np.cumsum(present)
    used = _lags_by_rule(residuals, n) if lags is None else _check_kpss_lags(lags, n)
    statistic = float(sums @ sums) / n**2 / _long_run_variance(residuals, used, n)
    return _kpss_verdict(statistic, trend, n)


def _remove_line(record: Floats) -> Floats:
    residuals = detrend(record, "linear")
    if not np.any(np.abs(residuals) > _KPSS_ROUNDING):
        raise ValueError("the KPSS test needs samples that differ from a straight line")
    return centre_record(residuals)


def _kpss_verdict(statistic: float, trend: Level, n: int) -> Verdict:
    table = _KPSS_CRITICAL[trend]
    return Verdict(
        name="KPSS",
        hypothesis="stationary" + (" about a line" if trend == "linear" else ""),
        statistic=statistic,
        p_value=float(np.interp(statistic, table, _KPSS_PROBABILITIES)),
        lower=-np.inf,
        upper=table[1],
        accepted=statistic <= table[1],
        n=n,
        p_bound=_p_bound(statistic, table),
    )


def _p_bound(statistic: float, table: tuple[float, ...]) -> Literal["", "<", ">"]:
    if statistic > table[-1]:
        return "<"
    return ">" if statistic < table[0] else ""


def _covariances(residuals: Floats, lags: int, n: int) -> Floats:
    """Return the autocovariances at lags 0 to `lags`, shape (lags + 1,)."""
    sums, _ = _native.lagged_products(residuals, max(lags, 1))
    return sums[: lags + 1] / n


def _long_run_variance(residuals: Floats, lags: int, n: int) -> float:
    covariances = _covariances(residuals, lags, n)
    weights = 1.0 - np.arange(lags + 1) / (lags + 1)
    return float(2.0 * (weights @ covariances) - covariances[0])


def _lags_by_rule(residuals: Floats, n: int) -> int:
    """Return the number of lags for the correlation of the record, after Hobijn and others."""
    lag = np.arange(int(n ** (2 / 9)) + 1)
    covariances = _covariances(residuals, lag[-1], n)
    total = float(2.0 * covariances.sum() - covariances[0])
    slope = float(2.0 * (lag @ covariances))
    return min(int(1.1447 * ((slope / total) ** 2) ** (1 / 3) * n ** (1 / 3)), n - 1)


def _check_kpss_lags(lags: int, n: int) -> int:
    if lags not in range(n):
        raise ArgumentError("lags", f"must be a whole number from 0 to {n - 1}, got {lags!r}")
    return int(lags)


_ADF_MIN_SAMPLES: Final = 20

_ADF_MAX_STATISTIC: Final = 2.74
_ADF_MIN_STATISTIC: Final = -18.83
_ADF_SURFACE_SPLIT: Final = -1.61
_ADF_LOWER_SURFACE: Final = (2.1659, 1.4412, 0.038269)
_ADF_UPPER_SURFACE: Final = (1.7339, 0.93202, -0.12745, -0.010368)
"""Response surface of the normal quantile, in powers of the statistic."""

_ADF_CRITICAL: Final = (-2.86154, -2.8903, -4.234, -40.04)
"""Response surface of the 5 % critical value, in powers of 1/n."""


def adf(z: npt.ArrayLike, lags: int | None = None) -> Verdict:
    """Test a record for a unit root: a random walk instead of variation about a level.

    Acceptance means that the record may be a random walk. Rejection is less certain if the random
    walk is weak compared with white noise, as in a gyro. A record with a weak random walk is an
    ARMA process with a moving-average root near 1. The test rejects its unit root in far more than
    5 % of the cases. `kpss` detects the random walk. `reverse_arrangements` detects it if the walk
    does not return.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples in any unit, at least 20; values that are not finite count as missing. The
        regression starts again after a missing sample.
    lags : int, optional
        Number of lagged differences in the regression, 0 to 63. Default: the number with the lowest
        AIC, computed on the same samples for all numbers. The largest number compared is Schwert's
        12 (n/100)^(1/4), at most 63. n is the length of the longest stretch without a gap.

    Returns
    -------
    Verdict
        Result. The statistic belongs to the coefficient on z_(k-1) in the regression of z_k -
        z_(k-1) with a constant. The hypothesis is accepted if the statistic is above the critical
        value `lower`.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, or has too few or only equal samples. If `lags` is not as described.

    Notes
    -----
    With k lagged differences the regression is an AR(k + 1) model in another basis. The tested
    coefficient is phi_1 + ... + phi_(k+1) - 1. Probability: J. G. MacKinnon, Journal of Business
    and Economic Statistics 12, 1994. Critical value: J. G. MacKinnon, Queen's University working
    paper 1227, 2010. Method: W. E. Said, D. A. Dickey, Biometrika 71, 1984; G. W. Schwert, JBES 7,
    1989.

    Examples
    --------
    >>> noise = np.random.default_rng(1).standard_normal(1000)
    >>> adf(noise).accepted, adf(np.cumsum(noise)).accepted
    (False, True)
    """
    record = as_record(z, _ADF_MIN_SAMPLES, "the Dickey-Fuller test")
    n = longest_stretch(record).size
    k = _choose_aic_lags(record, _schwert_lags(n)) if lags is None else _check_adf_lags(lags, n)
    statistic, used = _adf_statistic(record, k + 1)
    lower = sum(b / used**power for power, b in enumerate(_ADF_CRITICAL))
    p_value = _adf_probability(statistic)
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


def _adf_statistic(record: Floats, order: int) -> tuple[float, int]:
    """Return the sum of the coefficients minus 1, over its error, and the residuals used."""
    model = fit_ar(record, order)
    variance = float(model.covariance[:order, :order].sum())
    # The covariance contains the residuals' mean square; the test divides by the degrees of
    # freedom.
    freedom = (model.n - order - 1) / model.n
    return (float(model.phi.sum()) - 1.0) / math.sqrt(variance / freedom), model.n


def _choose_aic_lags(record: Floats, highest: int) -> int:
    sigma2, n = _native.autoregression_variances(record, highest + 1, "least-squares", True)
    orders = np.arange(1, highest + 2)
    return int(np.argmin(n * np.log(sigma2[1:]) + 2.0 * orders))


def _schwert_lags(n: int) -> int:
    return max(min(math.ceil(12.0 * math.sqrt(math.sqrt(n / 100.0))), _max_lags(n)), 0)


def _adf_probability(statistic: float) -> float:
    if statistic > _ADF_MAX_STATISTIC:
        return 1.0
    if statistic < _ADF_MIN_STATISTIC:
        return 0.0
    surface = _ADF_LOWER_SURFACE if statistic <= _ADF_SURFACE_SPLIT else _ADF_UPPER_SURFACE
    quantile = sum(b * statistic**power for power, b in enumerate(surface))
    return 0.5 * math.erfc(-quantile / math.sqrt(2.0))


def _max_lags(n: int) -> int:
    """Return the largest number of lags for a stretch of n samples."""
    return min(n // 2 - 2, MAX_AR_ORDER - 1)


def _check_adf_lags(lags: int, n: int) -> int:
    max_lags = max(_max_lags(n), 0)
    if lags not in range(max_lags + 1):
        raise ArgumentError("lags", f"must be a whole number from 0 to {max_lags}, got {lags!r}")
    return int(lags)
