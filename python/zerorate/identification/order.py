"""Choice of a model's order by information criteria."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, Literal, get_args

import numpy as np
import numpy.typing as npt

from zerorate._native import autoregression_variances
from zerorate.faults import ArgumentError
from zerorate.identification.arma import arma_grid
from zerorate.identification.autoregression import ArMethod, check_order
from zerorate.types import Floats

Order = tuple[int, int]
Criterion = Literal["fpe", "aic", "aicc", "bic", "hq"]

_KINDS: Final = ("ar", "arma")
CRITERIA: Final[tuple[Criterion, ...]] = get_args(Criterion)


@dataclass(frozen=True, eq=False)
class OrderSelection:
    """Models of several orders, fitted to the same residuals, and the chosen order.

    Attributes
    ----------
    kind : str
        "ar" or "arma".
    criterion : str
        Name of the criterion for `minimum` and `clear`.
    margin : float
        Largest excess of the criterion for a smaller model (see `select_order`).
    n : int
        Number of residuals; it is the same for all orders.
    orders : tuple of (p, q), length m
        Compared orders.
    sigma2 : ndarray, shape (m,)
        Mean square of the residuals, in the squared unit of the record.
    n_coefficients : ndarray of float, shape (m,)
        Number of coefficients: k = p + q, plus one for a constant.
    coefficients : tuple of ndarray, length m or 0
        Estimates [phi, theta, c] for "arma"; `fit_arma` can start from them.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.identification import select_order
    >>> a = np.random.default_rng(1).standard_normal(3001)
    >>> found = select_order(a[1:] + 0.5 * a[:-1], criterion="bic")
    >>> found.minimum, found.clear, found.order
    ((4, 0), (3, 0), (3, 0))
    """

    kind: Literal["ar", "arma"]
    criterion: Criterion
    margin: float
    n: int
    orders: tuple[Order, ...]
    sigma2: Floats
    n_coefficients: Floats
    coefficients: tuple[Floats, ...] = ()

    @cached_property
    def fpe(self) -> Floats:
        """Final prediction errors, shape (m,), in the squared unit of the record."""
        return fpe(self.sigma2, self.n, self.n_coefficients)

    @cached_property
    def aic(self) -> Floats:
        """Akaike's criterion, shape (m,)."""
        return aic(self.sigma2, self.n, self.n_coefficients)

    @cached_property
    def aicc(self) -> Floats:
        """Akaike's criterion for short records, shape (m,)."""
        return aicc(self.sigma2, self.n, self.n_coefficients)

    @cached_property
    def bic(self) -> Floats:
        """The Bayesian criterion, shape (m,)."""
        return bic(self.sigma2, self.n, self.n_coefficients)

    @cached_property
    def hq(self) -> Floats:
        """Hannan's and Quinn's criterion, shape (m,)."""
        return hq(self.sigma2, self.n, self.n_coefficients)

    @property
    def scores(self) -> Floats:
        """The criterion of each model, shape (m,): n ln sigma2 plus a penalty, or n ln FPE."""
        values: Floats = getattr(self, self.criterion)
        return self.n * np.log(values) if self.criterion == "fpe" else values

    @property
    def minimum(self) -> Order:
        """Orders (p, q) with the smallest criterion."""
        return self.orders[self.scores.argmin()]

    @property
    def clear(self) -> Order:
        """Orders (p, q) with the fewest coefficients within `margin` of the minimum."""
        scores = self.scores
        beyond = scores > scores.min() + self.margin
        return self.orders[np.lexsort((scores, self.n_coefficients, beyond))[0]]

    @property
    def order(self) -> Order:
        """Recommended orders (p, q): `clear`."""
        return self.clear


def select_order(
    z: npt.ArrayLike,
    kind: Literal["ar", "arma"] = "ar",
    criterion: Criterion = "fpe",
    max_order: int = 10,
    max_p: int = 3,
    max_q: int = 3,
    margin: float = 10.0,
    method: ArMethod = "least-squares",
) -> OrderSelection:
    """Compare models of several orders, with a constant, on the same residuals.

    Parameters
    ----------
    z : array_like, shape (n,)
        Record of one axis, any unit; values that are masked or not finite count as missing.
    kind : str, default "ar"
        "ar": autoregressions of orders 0 to `max_order`. "arma": orders (0, 0) to (`max_p`,
        `max_q`).
    criterion : str, default "fpe"
        "fpe", "aic", "aicc", "bic" or "hq", as the attributes of `OrderSelection`.
    max_order, max_p, max_q : int
        Highest orders to compare.
    margin : float, default 10.0
        A higher order is chosen only if it reduces the criterion by more than the margin. With
        `margin` 0 the choice is the minimum. A long record shows every ripple of its spectrum, so
        the last coefficients at the minimum have no meaning. A reduction of 1 or 2 is
        insignificant. A model more than 10 above the minimum has no support (Burnham and Anderson,
        *Model Selection and Multimodel Inference*, 2nd ed., 2002, section 2.6).
    method : str, default "least-squares"
        Estimator of the residual variances of autoregressions. "burg" and "yule-walker" take the
        variances of the recursion, and n is the number of samples, as in R's ``ar``.

    Returns
    -------
    OrderSelection
        Comparison. `n` counts the samples with at least `max_order` samples before them without a
        gap.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers, or an order is not a whole number.
    ValueError
        If an argument is not valid. If `z` is not one axis, too short for the highest order,
        constant, or free of noise.

    Notes
    -----
    Fu and Han, section 1.1, choose the order after which the criterion hardly decreases. `clear` is
    a definite rule for this choice.

    Examples
    --------
    >>> import numpy as np
    >>> a = np.random.default_rng(1).standard_normal(3001)
    >>> selection = select_order(a[1:] + 0.5 * a[:-1], criterion="bic")
    >>> selection.n, len(selection.orders), selection.order
    (2990, 11, (3, 0))
    """
    _check_choice("criterion", criterion, CRITERIA)
    if not margin >= 0.0:
        raise ArgumentError("margin", f"must not be negative, got {margin!r}")
    _check_choice("kind", kind, _KINDS)
    if kind == "ar":
        comparison = _compare_autoregressions(z, check_order("max_order", max_order), method)
    else:
        comparison = _compare_mixed(z, max_p, max_q)
    orders, sigma2, n, coefficients = comparison
    sizes = np.array([p + q + 1.0 for p, q in orders])
    return OrderSelection(kind, criterion, float(margin), n, orders, sigma2, sizes, coefficients)


_Comparison = tuple[tuple[Order, ...], Floats, int, tuple[Floats, ...]]


def _compare_autoregressions(z: npt.ArrayLike, highest: int, method: ArMethod) -> _Comparison:
    sigma2, n = autoregression_variances(z, highest, method, True)
    return tuple((p, 0) for p in range(highest + 1)), sigma2, n, ()


def _compare_mixed(z: npt.ArrayLike, max_p: int, max_q: int) -> _Comparison:
    grid = arma_grid(z, max_p, max_q)
    orders = tuple((p, q) for p in range(max_p + 1) for q in range(max_q + 1))
    return orders, grid.sigma2.ravel(), grid.n, grid.coefficients


def _check_choice(name: str, value: str, known: Sequence[str]) -> None:
    if value not in known:
        names = ", ".join(f"'{choice}'" for choice in known)
        raise ArgumentError(name, f"must be one of {names}, got {value!r}")


def scores_above_minimum(orders: OrderSelection, name: Criterion) -> Floats:
    """Return the excess of a criterion over its minimum for every order.

    Parameters
    ----------
    orders : OrderSelection
        Compared orders.
    name : str
        Name of the criterion from `CRITERIA`.
    """
    scores = replace(orders, criterion=name).scores
    return np.asarray(scores - scores.min())


def fpe(sigma2: npt.ArrayLike, n: int, k: npt.ArrayLike) -> Floats:
    """Return the final prediction error, sigma2 (n + k) / (n - k).

    It is the variance of the fitted model's prediction error on another record of the process. The
    unit is the squared unit of the record.

    Notes
    -----
    With a constant k = p + 1, which gives (n + p + 1) / (n - p - 1) of Akaike, "Fitting
    autoregressive models for prediction", Ann. Inst. Stat. Math. 21, 1969. Without a constant k =
    p.

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

    It is infinite for n <= k + 1.
    """
    k = np.asarray(k)
    freedom = n - k - 1.0
    # Avoid a division by zero for short records.
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
