"""Autocorrelations of a record, and tests of whiteness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.faults import ArgumentError
from zerorate.identification.verdict import TWO_SIDED_95, Verdict
from zerorate.noise.records import as_record, centre_record, check_width
from zerorate.types import Floats, Integers


@dataclass(frozen=True, eq=False)
class Correlogram:
    """Autocorrelations and partial autocorrelations of a record.

    Attributes
    ----------
    lags : ndarray of int64, shape (m,)
        Lags from 1 upwards, in samples.
    acf, pacf : ndarray of float64, shape (m,)
        Autocorrelation and partial autocorrelation.
    bound : float
        1.96 / sqrt(n), the 95 % bound of correlations of white noise (Bartlett). Gaps reduce the
        number of products; `bound` is then the bound of the lag with the fewest products.
    n : int
        Number of present samples.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.identification import autocorrelation
    >>> found = autocorrelation(np.random.default_rng(1).standard_normal(10_000), 20)
    >>> found.lags.size, round(found.bound, 4), bool((abs(found.acf) < found.bound).mean() >= 0.9)
    (20, 0.0196, True)
    """

    lags: Integers
    acf: Floats
    pacf: Floats
    bound: float
    n: int


class Correlations(NamedTuple):
    """Autocorrelations at lags 1 to m, number of pairs of each, and number of samples."""

    acf: Floats
    pairs: Integers
    n: int

    def truncate(self, lags: int) -> Correlations:
        """Return the autocorrelations of the first lags."""
        return Correlations(self.acf[:lags], self.pairs[:lags], self.n)

    def correlogram(self) -> Correlogram:
        """Return the correlogram with partial autocorrelations and the bound."""
        lags = np.arange(1, self.acf.size + 1)
        min_length = int(np.min(self.pairs + lags))
        bound = TWO_SIDED_95 / float(np.sqrt(min_length))
        return Correlogram(lags, self.acf, partial_autocorrelations(self.acf), bound, self.n)


def autocorrelation(z: npt.ArrayLike, lags: int) -> Correlogram:
    """Return autocorrelations and partial autocorrelations at lags 1 to `lags`.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples in any unit; values that are not finite count as missing. Products of two samples
        with a gap between them are left out.
    lags : int
        Greatest lag, from 1 to n - 1, and shorter than the longest stretch without a gap.

    Returns
    -------
    Correlogram
        Autocorrelations, partial autocorrelations and their bound.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, or has too few or only equal samples. If `lags` is not as described.

    Notes
    -----
    r_l = sum (z_k - m)(z_(k+l) - m) / sum (z_k - m)^2. With gaps the sum is scaled to the n - l
    products of a complete record. Partial autocorrelations follow from the recursion of Durbin and
    Levinson. G. E. P. Box, G. M. Jenkins, Time Series Analysis, sections 2.1 and 3.2.

    Examples
    --------
    >>> noise = np.random.default_rng(1).standard_normal(10_002)
    >>> smoothed = noise[:-2] + noise[1:-1] + noise[2:]
    >>> autocorrelation(smoothed, 2).acf.round(1).tolist()
    [0.7, 0.3]
    """
    return compute_correlations(as_record(z, 2, "autocorrelation"), lags).correlogram()


def compute_correlations(record: Floats, lags: int, wanted_lags: int = 0) -> Correlations:
    """Return autocorrelations of a record that is not constant.

    Lags end at `lags`, or earlier than `wanted_lags` if no products exist at longer lags.
    """
    check_width(lags, "lags")
    if lags >= record.size:
        raise ArgumentError(
            "lags", f"must be less than the number of samples, {record.size}, got {lags}"
        )
    sums, pairs = _native.lagged_products(centre_record(record), max(lags, wanted_lags))
    longest = int(np.count_nonzero(pairs))
    if lags >= longest:
        raise ArgumentError("lags", f"must be less than the longest stretch, {longest}, got {lags}")
    n, lag = int(pairs[0]), np.arange(1, longest)
    pairs = pairs[1:longest]
    return Correlations(sums[1:longest] / sums[0] * ((n - lag) / pairs), pairs, n)


def partial_autocorrelations(acf: Floats) -> Floats:
    """Return the partial autocorrelations by the recursion of Durbin and Levinson.

    If gaps or rounding leave no variance at a lag, the result is NaN from this lag on.
    """
    pacf = np.full(acf.size, np.nan)
    phi, variance = np.empty(0), 1.0
    for k, r in enumerate(acf):
        if not variance > 0.0:
            break
        pacf[k] = (r - phi @ acf[:k][::-1]) / variance
        phi = np.append(phi - pacf[k] * phi[::-1], pacf[k])
        variance *= 1.0 - pacf[k] ** 2
    return pacf


_PREDICTOR_ORDER: Final = 20


@dataclass(frozen=True, eq=False)
class Whiteness:
    """Test of residuals for whiteness, and their predictable share.

    Attributes
    ----------
    ljung_box : Verdict
        Test of all lags together.
    correlogram : Correlogram
        Correlations at each lag.
    outside_count : int
        Number of lags with an autocorrelation beyond the bound. For white noise it is about a
        twentieth of all lags.
    predictable : float
        Share of the variance that an AR(20) model of the residuals would explain, 0 to 1. For white
        noise of n samples it is about 20/n by chance.
    white : bool
        True if the Ljung-Box test accepts white noise. For a long record the test rejects even
        negligible correlations; `predictable` measures their importance.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.identification import whiteness
    >>> found = whiteness(np.random.default_rng(1).standard_normal(10_000))
    >>> found.white, bool(found.predictable < 0.01)
    (True, True)
    """

    ljung_box: Verdict
    correlogram: Correlogram
    outside_count: int
    predictable: float
    white: bool


def ljung_box(z: npt.ArrayLike, lags: int = 20, fitted: int = 0) -> Verdict:
    """Test all autocorrelations up to a lag together for white noise.

    Parameters
    ----------
    z : array_like, shape (n,)
        Residuals in any unit; values that are not finite count as missing. Products of two samples
        with a gap between them are left out.
    lags : int, default 20
        Greatest lag. More lags detect longer correlations, but make the test less sensitive at each
        lag.
    fitted : int, default 0
        Number of coefficients p + q of the fitted model; less than `lags`.

    Returns
    -------
    Verdict
        Statistic Q with lags - fitted degrees of freedom.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, or has too few or only equal samples. If an argument is not as
        described.

    Notes
    -----
    Q = n (n + 2) sum r_l^2 / (n - l): G. M. Ljung, G. E. P. Box, Biometrika 65(2), 1978. With gaps,
    each correlation is weighted by its number of pairs.

    Examples
    --------
    >>> ljung_box(np.random.default_rng(1).standard_normal(1000)).accepted
    True
    """
    record = as_record(z, 2, "the Ljung-Box test")
    _check_fitted(lags, fitted)
    return _portmanteau(compute_correlations(record, lags), fitted)


def whiteness(residuals: npt.ArrayLike, lags: int = 20, fitted: int = 0) -> Whiteness:
    """Test residuals for whiteness, and measure their predictable share.

    Parameters
    ----------
    residuals : array_like, shape (n,)
        Residuals of a model, in any unit; values that are not finite count as missing.
    lags : int, default 20
        Greatest lag to test.
    fitted : int, default 0
        Number of coefficients p + q of the model; less than `lags`.

    Returns
    -------
    Whiteness
        Test of all lags, correlations at each lag, and predictable share.

    Raises
    ------
    TypeError
        If `residuals` does not hold real numbers.
    ValueError
        If `residuals` is not one axis, or has too few or only equal samples. If an argument is not
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
    estimates = compute_correlations(record, lags, wanted_lags=_PREDICTOR_ORDER)
    correlogram = estimates.truncate(lags).correlogram()
    verdict = _portmanteau(estimates.truncate(lags), fitted)
    return Whiteness(
        ljung_box=verdict,
        correlogram=correlogram,
        outside_count=int(np.count_nonzero(np.abs(correlogram.acf) > correlogram.bound)),
        predictable=_predictable_share(estimates.truncate(_PREDICTOR_ORDER).acf),
        white=verdict.accepted,
    )


def _check_fitted(lags: int, fitted: int) -> None:
    check_width(lags, "lags")
    if not 0 <= fitted < lags:
        raise ArgumentError("fitted", f"must be from 0 to less than lags, {lags}, got {fitted}")


def _portmanteau(estimates: Correlations, fitted: int) -> Verdict:
    n, lag = estimates.n, np.arange(1, estimates.acf.size + 1)
    # With all n - l pairs this is r^2 / (n - l).
    terms = (estimates.acf / (n - lag)) ** 2 * estimates.pairs
    statistic = n * (n + 2) * float(terms.sum())
    freedom = estimates.acf.size - fitted
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


def _predictable_share(acf: Floats) -> float:
    """Return 1 minus the product of 1 - pacf^2, the share of variance that each lag leaves."""
    pacf = partial_autocorrelations(acf)
    return 1.0 - float(np.prod(1.0 - pacf[np.isfinite(pacf)] ** 2))
