"""The way of one axis: survey, preparation, tests, orders, models, and how well they fit."""

from collections.abc import Callable
from typing import Final, Literal, TypedDict, Unpack

import numpy as np
import numpy.typing as npt

from zerorate.identify.checks.rest import moving_spans
from zerorate.identify.checks.whiteness import autocorrelation, whiteness
from zerorate.identify.estimation.arma import fit_arma
from zerorate.identify.estimation.autoregression import fit_ar
from zerorate.identify.estimation.order import Criterion, OrderSelection, select_order
from zerorate.identify.models.model import ArmaModel
from zerorate.identify.preparation.prepare import Prepared, prepare
from zerorate.identify.records import as_record
from zerorate.identify.study.battery import examined
from zerorate.identify.study.online import learned_online
from zerorate.identify.study.result import Identification
from zerorate.identify.study.survey import surveyed
from zerorate.io.log import checked_rate

__all__ = ["LEAST_SAMPLES", "Criterion", "Method", "Preparation", "identify"]

Floats = npt.NDArray[np.float64]
Method = Literal["css", "exact"]

LEAST_SAMPLES: Final = 200
"""Fewer leave the tests without power."""

_LAGS: Final = 40
_RESIDUAL_LAGS: Final = 20


class Preparation(TypedDict, total=False):
    """What `prepare` may be asked to do."""

    smooth: int
    outliers: Literal["hampel", "moving-average"] | None
    window: int
    threshold: float
    trend: Literal["mean", "linear"] | None
    decimate: int


def identify(
    z: npt.ArrayLike,
    rate: float,
    *,
    name: str = "",
    unit: str = "unit",
    order: tuple[int, int] | None = None,
    max_order: int = 10,
    max_p: int = 3,
    max_q: int = 3,
    criterion: Criterion = "aic",
    segments: int = 100,
    method: Method = "css",
    progress: Callable[[str, float], None] | None = None,
    **preparation: Unpack[Preparation],
) -> Identification:
    """Find a drift model of a record at rest, and test whether it may be believed.

    Parameters
    ----------
    z : array_like, shape (n,)
        Record of one axis, NaN where a sample is missing.
    rate : float
        Samples per second, Hz.
    name, unit : str
        Of the axis, for the report.
    order : (int, int), optional
        Orders p, q of the model; by default the clear choice of the criterion.
    max_order : int
        Largest order of the autoregressive models.
    max_p, max_q : int
        Largest orders of the ARMA models.
    criterion : str
        By which orders are chosen: "fpe", "aic", "aicc", "bic" or "hq".
    segments : int
        How many parts of the record the tests of stationarity compare; fewer where a part would
        have less than 10 samples.
    method : str
        Of the ARMA model: "css", the conditional sum of squares, or "exact", the likelihood.
    progress : callable, optional
        Called with the step's name and the fraction of the whole that is done.
    **preparation
        ``smooth``, ``outliers``, ``window``, ``threshold``, ``trend`` and ``decimate`` of
        `prepare`; by default nothing is done to the record, and a constant of the models takes
        up its mean.

    Returns
    -------
    Identification
        Tests, criteria and models, `verdict` in words, and `plot`.

    Raises
    ------
    TypeError, ValueError
        If the record or an argument is not as described, or fewer than 200 samples are there.

    Notes
    -----
    Fu and Han (2019), section 1.1: orders by a criterion, residuals tested for whiteness. Bao and
    Yuan: reverse arrangements of segments.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.identify import identify
    >>> a = np.random.default_rng(1).standard_normal(20_000)
    >>> z = np.zeros_like(a)
    >>> for k in range(1, len(a)):
    ...     z[k] = 0.7 * z[k - 1] + a[k]
    >>> found = identify(z, 100.0)
    >>> found.model.order, found.whiteness.white
    ((1, 0), True)
    """
    tell = progress or (lambda step, fraction: None)
    tell("preparing", 0.0)
    record = as_record(z, LEAST_SAMPLES, "identification")
    survey = surveyed(record, checked_rate(rate))
    moving = moving_spans(record, rate)
    prepared = _prepared(record, rate, preparation)
    data = prepared.data
    tell("tests", 0.1)
    tests = examined(data, prepared.rate or rate, segments)
    tell("orders", 0.3)
    ar_orders = select_order(data, "ar", criterion, max_order=max_order)
    arma_orders = select_order(data, "arma", criterion, max_p=max_p, max_q=max_q)
    tell("models", 0.7)
    model = _fitted(data, order, arma_orders, method)
    return Identification(
        name=name,
        unit=unit,
        survey=survey,
        moving=moving,
        smooth=preparation.get("smooth", 1),
        prepared=prepared,
        tests=tests,
        correlogram=autocorrelation(data, _LAGS),
        ar_orders=ar_orders,
        arma_orders=arma_orders,
        ar=fit_ar(data, ar_orders.clear[0]),
        model=model,
        asked=order is not None,
        whiteness=whiteness(model.residuals(data), _RESIDUAL_LAGS, sum(model.order)),
        online=learned_online(data, model),
    )


def _fitted(
    data: Floats, order: tuple[int, int] | None, found: OrderSelection, method: Method
) -> ArmaModel:
    """Return the model of an order, from where the comparison came to if it went there."""
    p, q = order or found.clear
    start = dict(zip(found.orders, found.coefficients, strict=True)).get((p, q))
    return fit_arma(data, p, q, method=method, start=start)


def _prepared(record: Floats, rate: float, preparation: Preparation) -> Prepared:
    options: Preparation = {"trend": None, **preparation}
    prepared = prepare(record, rate, **options)
    as_record(prepared.data, LEAST_SAMPLES, "identification after decimation")
    return prepared
