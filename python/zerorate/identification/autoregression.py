"""Autoregressive models of one order."""

from __future__ import annotations

import math
import operator
from dataclasses import replace
from typing import Literal, SupportsIndex

import numpy as np
import numpy.typing as npt

from zerorate._native import fit_autoregression
from zerorate.faults import ArgumentError
from zerorate.identification.arma_model import ArmaModel
from zerorate.noise.records import as_record

ArMethod = Literal["least-squares", "burg", "yule-walker"]

MAX_AR_ORDER = 64
"""Largest order of an autoregression: a gyro's drift never determines more coefficients."""


def fit_ar(
    z: npt.ArrayLike, p: int, method: ArMethod = "least-squares", constant: bool = True
) -> ArmaModel:
    """Fit an autoregressive model of order p, z_k = sum_i phi_i z_(k-i) + a_k + c.

    Parameters
    ----------
    z : array_like, shape (n,)
        Record of one axis, any unit; values that are masked or not finite count as missing.
    p : int
        Order, 0 to 64.
    method : str, default "least-squares"
        - "least-squares": fits each sample that has p samples without a gap before it. It assumes
          nothing about earlier samples. The model may be unstable, so it can show a unit root.
        - "burg": least squares forward and backward together; always stationary, and precise on
          short records.
        - "yule-walker": matches the record's first autocovariances; always stationary, and biased
          towards 0 if roots are near 1.
    constant : bool, default True
        True: fit c ("burg" and "yule-walker" subtract the mean). False: use the record unchanged.

    Returns
    -------
    ArmaModel
        With "least-squares", `n` is the number of residuals and `sigma2` is their mean square.
        `covariance` is sigma2 (X'X)^-1, as in R's ``ar.ols`` and statsmodels' ``AutoReg``. With
        "burg" and "yule-walker", `n` is the number of samples. `sigma2` is their mean square times
        the factors (1 - reflection coefficient squared) of all orders. `covariance` is the limit
        for long records: sigma2/n times the inverse of the model's covariance of p samples.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, is too short, constant, or free of noise.

    Notes
    -----
    The normal equations are summed in one pass. If their condition number exceeds about 1e10, the
    rows are triangularised instead. J. P. Burg, "Maximum entropy spectral analysis", Stanford,
    1975.

    Examples
    --------
    >>> import numpy as np
    >>> z = np.zeros(3000)
    >>> for k, a in enumerate(np.random.default_rng(1).standard_normal(2999)):
    ...     z[k + 1] = 0.9 * z[k] + a
    >>> model = fit_ar(z, 1)
    >>> model.order, model.n, bool(abs(model.phi[0] - 0.9) < 3 * model.standard_errors[0])
    ((1, 0), 2999, True)
    """
    order = check_order("p", p)
    phi, c, sigma2, covariance, n, condition = fit_autoregression(z, order, method, bool(constant))
    model = ArmaModel(
        phi=phi,
        theta=phi[:0],
        constant=c,
        sigma2=sigma2,
        covariance=covariance,
        n=n,
        log_likelihood=-0.5 * n * (math.log(2.0 * math.pi * sigma2) + 1.0),
        condition=condition,
        method=method,
        has_constant=bool(constant),
    )
    return add_moments(model, z)


def check_order(name: str, value: SupportsIndex) -> int:
    """Return the order of an autoregression as an int; ValueError if it is out of range."""
    try:
        order = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be a whole number, got {value!r}") from None
    if not 0 <= order <= MAX_AR_ORDER:
        raise ArgumentError(name, f"must be 0 to {MAX_AR_ORDER}, got {order}")
    return order


def add_moments(model: ArmaModel, z: npt.ArrayLike) -> ArmaModel:
    """Return the model, with mean and standard deviation of its record added if missing."""
    if model.stationary:
        return model
    record = as_record(z)
    return replace(
        model, record_mean=float(np.nanmean(record)), record_deviation=float(np.nanstd(record))
    )
