"""The test of stationarity by Kwiatkowski, Phillips, Schmidt and Shin."""

from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.identify.checks.verdict import Verdict
from zerorate.identify.preparation.centring import centred
from zerorate.identify.preparation.trend import detrend
from zerorate.identify.records import as_record

__all__ = ["kpss"]

Floats = npt.NDArray[np.float64]
Level = Literal["constant", "linear"]

_PROBABILITIES: Final = (0.10, 0.05, 0.025, 0.01)
_CRITICAL: Final[dict[str, tuple[float, float, float, float]]] = {
    "constant": (0.347, 0.463, 0.574, 0.739),
    "linear": (0.119, 0.146, 0.176, 0.216),
}
_LEAST: Final = 10
_ROUNDING: Final = 1e-12
"""What a straight line of samples up to 1 is off by, at most."""


def kpss(z: npt.ArrayLike, lags: int | None = None, trend: Level = "constant") -> Verdict:
    """Test whether a record is stationary about a level, or about a straight line.

    Drift as faint as that of a gyro is seen by this test and by `reverse_arrangements`, seldom by
    `adf`.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples in any unit; those not finite are missing: the sums pass over them, and no product
        reaches across.
    lags : int, optional
        Lags of the long-run variance, 0 to n - 1. More are needed the longer the noise is
        correlated, and cost power. Default: chosen from the record by the rule of Hobijn and
        others with Bartlett's window.
    trend : {"constant", "linear"}
        What the record may be stationary about.

    Returns
    -------
    Verdict
        Its `p_value` is interpolated in a table from 0.10 to 0.01; beyond either, `p_bound` says
        on which side it lies.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, has fewer than 10 or only equal samples, or an argument is not as
        described.

    Notes
    -----
    D. Kwiatkowski and others, Journal of Econometrics 54, 1992, equations 13, 10 and table 1;
    lags: B. Hobijn, P. H. Franses, M. Ooms, Statistica Neerlandica 58(4), 2004.

    Examples
    --------
    >>> noise = np.random.default_rng(1).standard_normal(10_000)
    >>> kpss(noise).accepted, kpss(noise + 0.02 * np.cumsum(noise[::-1])).accepted
    (True, False)
    """
    if trend not in _CRITICAL:
        raise ValueError(f"trend must be one of 'constant', 'linear', got {trend!r}")
    residuals = centred(as_record(z, _LEAST, "the KPSS test"))
    if trend == "linear":
        residuals = _without_line(residuals)
    present = residuals[np.isfinite(residuals)]
    n = present.size
    sums = np.cumsum(present)
    used = _rule(residuals, n) if lags is None else _checked(lags, n)
    statistic = float(sums @ sums) / n**2 / _long_run_variance(residuals, used, n)
    return _judged(statistic, trend, n)


def _without_line(record: Floats) -> Floats:
    residuals = detrend(record, "linear")
    if not np.any(np.abs(residuals) > _ROUNDING):
        raise ValueError("the KPSS test needs samples that differ from a straight line")
    return centred(residuals)


def _judged(statistic: float, trend: Level, n: int) -> Verdict:
    table = _CRITICAL[trend]
    return Verdict(
        name="KPSS",
        hypothesis="stationary" + (" about a line" if trend == "linear" else ""),
        statistic=statistic,
        p_value=float(np.interp(statistic, table, _PROBABILITIES)),
        lower=-np.inf,
        upper=table[1],
        accepted=statistic <= table[1],
        n=n,
        p_bound=_beyond(statistic, table),
    )


def _beyond(statistic: float, table: tuple[float, ...]) -> Literal["", "<", ">"]:
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


def _rule(residuals: Floats, n: int) -> int:
    """Return the lags that suit the correlation of the record, after Hobijn and others."""
    lag = np.arange(int(n ** (2 / 9)) + 1)
    covariances = _covariances(residuals, lag[-1], n)
    total = float(2.0 * covariances.sum() - covariances[0])
    slope = float(2.0 * (lag @ covariances))
    return min(int(1.1447 * ((slope / total) ** 2) ** (1 / 3) * n ** (1 / 3)), n - 1)


def _checked(lags: int, n: int) -> int:
    if lags not in range(n):
        raise ValueError(f"lags must be a whole number from 0 to {n - 1}, got {lags!r}")
    return int(lags)
