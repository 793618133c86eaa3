"""Tests of normality: Jarque-Bera and Anderson-Darling."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.identification.verdict import Verdict
from zerorate.noise.records import as_record, centre_record
from zerorate.types import Floats

_CHI_SQUARED_95: Final = 5.991464547107979
"""The 0.95 quantile with 2 degrees of freedom, -2 ln 0.05."""

_ANDERSON_DARLING_95: Final = 0.752
_MAX_STATISTIC: Final = 13.0
"""Largest statistic for which the published probabilities are valid."""

_PROBABILITY_PIECES: Final[tuple[tuple[float, bool, tuple[float, float, float]], ...]] = (
    (0.2, True, (-13.436, 101.14, -223.73)),
    (0.34, True, (-8.318, 42.796, -59.938)),
    (0.6, False, (0.9177, -4.279, -1.38)),
    (math.inf, False, (1.2937, -5.709, 0.0186)),
)
"""For each range of the statistic: upper end, flag for 1 minus the exponential, and polynomial in
its exponent.
"""

_MIN_DISTINCT_SHARE: Final = 0.1
"""Share of distinct values below which a record counts as coarse."""


def jarque_bera(z: npt.ArrayLike) -> Verdict:
    """Test skewness and kurtosis for a Gaussian distribution.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples in any unit, at least 8; values that are not finite count as missing.

    Returns
    -------
    Verdict
        Result. Its probability is valid for some thousands of independent samples or more. With
        fewer samples the test rejects less often than stated. With correlated samples it rejects
        more often than stated.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, or has too few or only equal samples.

    Notes
    -----
    JB = n (S^2 + (K - 3)^2 / 4) / 6 is chi-squared with 2 degrees of freedom, so p = exp(-JB/2). C.
    M. Jarque, A. K. Bera, International Statistical Review 55(2), 1987.

    Examples
    --------
    >>> jarque_bera(np.random.default_rng(1).standard_normal(10_000)).accepted
    True
    """
    x = _present_samples(z, "the Jarque-Bera test")
    squares = x * x
    second = float(squares.mean())
    skewness = float((squares @ x) / x.size) / second**1.5
    kurtosis = float((squares @ squares) / x.size) / second**2
    statistic = x.size / 6.0 * (skewness**2 + (kurtosis - 3.0) ** 2 / 4.0)
    return Verdict(
        name="Jarque-Bera",
        hypothesis="Gaussian",
        statistic=statistic,
        p_value=math.exp(-statistic / 2.0),
        lower=-math.inf,
        upper=_CHI_SQUARED_95,
        accepted=statistic <= _CHI_SQUARED_95,
        n=x.size,
    )


def anderson_darling(z: npt.ArrayLike) -> Verdict:
    """Test a record for a Gaussian distribution, with emphasis on the tails.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples in any unit, at least 8; values that are not finite count as missing.

    Returns
    -------
    Verdict
        Result, with a `note` if the record is coarse. The test also detects the steps of
        quantisation, and rejects a long record because of them alone.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, or has too few or only equal samples.

    Notes
    -----
    Mean and variance are estimated. The statistic is A^2 (1 + 0.75/n + 2.25/n^2), and its
    probability follows the published fit: M. A. Stephens in R. B. D'Agostino, M. A. Stephens,
    Goodness-of-Fit Techniques, tables 4.7 and 4.9.

    Examples
    --------
    >>> anderson_darling(np.random.default_rng(1).standard_normal(10_000)).accepted
    True
    """
    x = np.sort(_present_samples(z, "the Anderson-Darling test"))
    statistic = _squared_distance(x) * (1.0 + 0.75 / x.size + 2.25 / x.size**2)
    p_value, bound = _probability(statistic)
    return Verdict(
        name="Anderson-Darling",
        hypothesis="Gaussian",
        statistic=statistic,
        p_value=p_value,
        lower=-math.inf,
        upper=_ANDERSON_DARLING_95,
        accepted=statistic <= _ANDERSON_DARLING_95,
        n=x.size,
        p_bound="<" if bound else "",
        note=_describe_values(x),
    )


def _present_samples(z: npt.ArrayLike, purpose: str) -> Floats:
    x = centre_record(as_record(z, 8, purpose))
    missing = np.isnan(x)
    return x[~missing] if missing.any() else x


def _squared_distance(x: Floats) -> float:
    """Return A^2 = -n - sum (2i - 1)(ln F(x_i) + ln(1 - F(x_(n+1-i)))) / n of sorted samples."""
    n = x.size
    scaled = x / x.std(ddof=1)
    logs = _native.log_normal_cdf(scaled) + _native.log_normal_cdf(-scaled[::-1])
    weights = (2.0 * np.arange(1, n + 1) - 1.0) / n
    return -float(weights @ logs) - n


def _probability(statistic: float) -> tuple[float, bool]:
    beyond = statistic > _MAX_STATISTIC
    a = min(statistic, _MAX_STATISTIC)
    from_one, (c, b, d) = next((f, p) for end, f, p in _PROBABILITY_PIECES if a < end)
    value = math.exp(c + b * a + d * a * a)
    return (1.0 - value if from_one else value), beyond


def _describe_values(x: Floats) -> str:
    values = 1 + int(np.count_nonzero(np.diff(x)))
    if values > _MIN_DISTINCT_SHARE * x.size:
        return ""
    return (
        f"only {values} different values among {x.size} samples: their steps alone may make the "
        "test reject"
    )
