"""ARMA models of a record, by conditional least squares and by the exact likelihood."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.faults import ArgumentError
from zerorate.identification.arma_model import ArmaModel
from zerorate.noise.records import as_record
from zerorate.types import Booleans, Floats, Integers

METHODS: Final = ("css", "exact")
MAX_ORDER: Final = 8


@dataclass(frozen=True, eq=False)
class ArmaGrid:
    """Fits of ARMA models of all orders to the same residuals.

    Attributes
    ----------
    sigma2 : ndarray, shape (max_p + 1, max_q + 1)
        Innovation variance of ARMA(p, q) in row p and column q: the mean square of its residuals. A
        model never has a larger variance than the models of lower order that it contains.
    n : int
        Number of residuals.
    converged : ndarray of bool, shape (max_p + 1, max_q + 1)
        Mask of the models with a converged search.
    evaluations : ndarray of int, shape (max_p + 1, max_q + 1)
        Number of passes over the record in the searches of each model, without the passes that
        choose a start with slow drift.
    coefficients : tuple of ndarray
        [phi, theta, c] of each order (p, q), sorted by p, then by q.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.identification import arma_grid
    >>> a = np.random.default_rng(1).standard_normal(2001)
    >>> grid = arma_grid(a[1:] + 0.5 * a[:-1], 1, 1)
    >>> bool(grid.sigma2[0, 1] < grid.sigma2[0, 0]), bool(grid.converged.all())
    (True, True)
    """

    sigma2: Floats
    n: int
    converged: Booleans
    evaluations: Integers
    coefficients: tuple[Floats, ...] = ()


def fit_arma(
    z: npt.ArrayLike,
    p: int,
    q: int,
    method: Literal["css", "exact"] = "css",
    constant: bool = True,
    start: npt.ArrayLike | None = None,
) -> ArmaModel:
    """Fit an ARMA(p, q) model to a record.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples in any unit; values that are masked or not finite count as missing.
    p, q : int
        Autoregressive and moving-average order, 0 to 8.
    method : {"css", "exact"}
        "css" minimises the sum of the squared conditional residuals, and is fast. Before each
        stretch between missing samples, innovations are assumed zero and samples equal to the
        record's mean. The first p residuals of the stretch depend on this assumption and are left
        out. "exact" maximises the Gaussian likelihood of all samples, across missing samples; the
        process is then stationary. On long records both methods agree closely.
    constant : bool
        True: estimate a constant. False: the process has mean zero.
    start : array_like, shape (p + q + 1,), optional
        Only start of the search: [phi, theta, c], without c if there is no constant. Take the start
        from an `ArmaGrid` or from a similar record. Default: several starts are tried.

    Returns
    -------
    ArmaModel
        Model with an invertible moving average. With "css" the autoregression may be outside the
        stationary region.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If an order or the method is not valid. If `z` is not one axis, is constant or too short.

    Notes
    -----
    The search has several starts: Hannan and Rissanen's estimate, the best models of lower orders,
    and white noise on a slow drift. The last start suits most gyros: short autoregressions do not
    find their slow drift. Standard errors follow from the curvature of the sum of squares or of the
    likelihood. Hannan & Rissanen, Biometrika 69(1), 1982; Ansley, Biometrika 66(1), 1979; Monahan,
    Biometrika 71(2), 1984.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.identification import fit_arma
    >>> a = np.random.default_rng(1).standard_normal(5001)
    >>> model = fit_arma(a[1:] + 0.5 * a[:-1], 0, 1)
    >>> model.theta.round(1).tolist(), round(model.sigma2, 1)
    ([0.5], 1.0)
    """
    check_orders(p, q)
    if method not in METHODS:
        raise ArgumentError("method", f"must be 'css' or 'exact', got {method!r}")
    record = as_record(z, 2 * (p + q + 1) + p, f"ARMA({p}, {q})")
    begin = None if start is None else np.asarray(start, dtype=np.float64).ravel()
    estimate, numbers, search = _native.arma_fit(record, p, q, constant, method == "exact", begin)
    phi, theta, offset, sigma2, covariance = estimate
    n, log_likelihood, condition, mean_sigma, record_mean, record_deviation = numbers
    return ArmaModel(
        phi=phi,
        theta=theta,
        constant=offset,
        sigma2=sigma2,
        covariance=covariance,
        n=n,
        log_likelihood=log_likelihood,
        condition=condition,
        method=method,
        has_constant=constant,
        converged=search[0],
        remarks=_remarks(on_circle=search[2]),
        mean_sigma=mean_sigma,
        record_mean=record_mean,
        record_deviation=record_deviation,
    )


def arma_grid(z: npt.ArrayLike, max_p: int, max_q: int) -> ArmaGrid:
    """Fit ARMA models of all orders up to (max_p, max_q) to a record.

    The fit is by conditional least squares with a constant. All models are compared on the same
    residuals: the first `max_p` residuals of each stretch between missing samples are left out.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples in any unit; values that are masked or not finite count as missing.
    max_p, max_q : int
        Highest orders, 0 to 8.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If an order is not valid. If `z` is not one axis, is constant or too short.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.identification import arma_grid
    >>> grid = arma_grid(np.random.default_rng(1).standard_normal(1000), 1, 2)
    >>> grid.sigma2.shape, grid.n
    ((2, 3), 999)
    """
    check_orders(max_p, max_q)
    record = as_record(z, 2 * (max_p + max_q + 1) + max_p, f"ARMA({max_p}, {max_q})")
    sigma2, converged, evaluations, n, coefficients = _native.arma_grid(record, max_p, max_q)
    return ArmaGrid(sigma2, n, converged, evaluations, tuple(coefficients))


def check_orders(p: int, q: int) -> None:
    """Raise ValueError unless both orders are whole numbers from 0 to 8."""
    for name, order in (("p", p), ("q", q)):
        if not isinstance(order, int | np.integer) or not 0 <= order <= MAX_ORDER:
            raise ArgumentError(
                name, f"must be a whole number from 0 to {MAX_ORDER}, got {order!r}"
            )


def _remarks(on_circle: bool) -> tuple[str, ...]:
    if not on_circle:
        return ()
    return (
        "the search ended with a root of the moving average on the unit circle, where standard "
        "errors do not hold",
    )
