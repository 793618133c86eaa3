"""Identification of one axis: a drift model from a record at rest."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal, TypedDict, Unpack

import numpy as np
import numpy.typing as npt

from zerorate._native import RecursiveLeastSquares
from zerorate.faults import keyword_argument, make_sentence
from zerorate.identification.arma import fit_arma
from zerorate.identification.arma_model import ArmaModel
from zerorate.identification.as_json import as_dict
from zerorate.identification.autoregression import fit_ar
from zerorate.identification.conclusions import conclusions
from zerorate.identification.correlogram import Correlogram, Whiteness, autocorrelation, whiteness
from zerorate.identification.order import Criterion, OrderSelection, select_order
from zerorate.identification.preparation import PreparedRecord, prepare
from zerorate.identification.record_tests import (
    RecordSummary,
    RecordTests,
    run_tests,
    summarise_record,
)
from zerorate.noise.motion_check import Span, moving_spans
from zerorate.noise.records import as_record
from zerorate.progress import choose_reporter
from zerorate.record.named import names_of, rate_of, unit_of
from zerorate.record.names import UNKNOWN_UNIT
from zerorate.types import Floats, Integers
from zerorate.views import Result

if TYPE_CHECKING:
    pass


@dataclass(frozen=True, eq=False)
class Identification(Result):
    """Tests and models of one axis.

    Attributes
    ----------
    name, unit : str
        Name and unit of the axis.
    record : RecordSummary
        Summary of the record before preparation.
    moving : tuple of Span
        Time spans with motion, s from the beginning of the record.
    smooth : int
        Width of the moving average in samples, 1 for none.
    prepared : PreparedRecord
        Prepared record, with the number of samples changed in each step.
    tests : RecordTests
        Tests of stationarity and normality of the prepared record.
    correlogram : Correlogram
        Correlogram of the prepared record.
    ar_orders, arma_orders : OrderSelection
        Values of the criteria for all orders.
    ar : ArmaModel
        Autoregressive model of order `ar_orders.clear`, fitted by least squares.
    model : ArmaModel
        ARMA model of order `arma_orders.clear`, or of the given order.
    order_given : bool
        True if the order was given.
    whiteness : Whiteness
        Whiteness of the residuals of `model`.
    online : OnlineFit or None
        Recursive least squares of the same order on the same record; None if the recursion does not
        support the order.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.identification import identify
    >>> a = np.random.default_rng(1).standard_normal(20_001)
    >>> found = identify(a[1:] + 0.6 * a[:-1], 100.0)
    >>> found.model.order, found.whiteness.white, found.moving
    ((0, 1), True, ())
    """

    name: str
    unit: str
    record: RecordSummary
    moving: tuple[Span, ...]
    smooth: int
    prepared: PreparedRecord
    tests: RecordTests
    correlogram: Correlogram
    ar_orders: OrderSelection
    arma_orders: OrderSelection
    ar: ArmaModel
    model: ArmaModel
    order_given: bool
    whiteness: Whiteness
    online: OnlineFit | None

    @property
    def rate(self) -> float:
        """Sampling rate of the modelled record, Hz."""
        return self.prepared.rate or self.record.rate

    @property
    def residuals(self) -> Floats:
        """Innovations of `model`, shape (n,), NaN for missing samples."""
        return self.model.residuals(self.prepared.data)

    @cached_property
    def slow_ratio(self) -> float:
        """Variance of segment means divided by the model's value; about 1 for a complete model."""
        return compute_slow_ratio(self)

    @property
    def verdict(self) -> tuple[str, ...]:
        """Conclusions from the numbers, one sentence each."""
        return conclusions(self)

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers in types of JSON, without NaN or infinity."""
        return as_dict(self)


_STARTUP_SAMPLES: Final = 100
_CHECKPOINT_COUNT: Final = 200
_MAX_ORDER: Final = 3
"""Largest order of the online recursion."""


@dataclass(frozen=True, eq=False)
class OnlineFit:
    """Recursive extended least squares over a record.

    Attributes
    ----------
    samples : ndarray of int64, shape (m,)
        Number of processed samples at each recorded time, evenly spaced in its logarithm.
    coefficients : ndarray, shape (m, p + q + 1)
        [phi, theta, c] at these times; c in the unit of the record.
    distance : ndarray, shape (p + q,)
        Difference of the last phi and theta from the offline estimates, in standard errors.
    """

    samples: Integers
    coefficients: Floats
    distance: Floats

    @property
    def last(self) -> Floats:
        """[phi, theta, c] at the end of the record."""
        return np.asarray(self.coefficients[-1])


def learn_online(record: Floats, offline: ArmaModel) -> OnlineFit | None:
    """Return an online fit of a record by recursive least squares, in the offline model's order.

    Parameters
    ----------
    record : ndarray, shape (n,)
        Record, NaN where missing.
    offline : ArmaModel
        Offline model of the same record.

    Returns
    -------
    OnlineFit or None
        Online fit. None for orders without an autoregressive part or above 3, and for a record of
        at most 100 samples, the length of the start-up.
    """
    p, q = offline.order
    if not 1 <= p <= _MAX_ORDER or q > _MAX_ORDER or record.size <= _STARTUP_SAMPLES:
        return None
    samples = np.unique(
        np.geomspace(_STARTUP_SAMPLES, record.size, _CHECKPOINT_COUNT).astype(np.int64)
    )
    filter_ = RecursiveLeastSquares((p, q), startup=_STARTUP_SAMPLES)
    history = []
    for start, end in zip((0, *samples[:-1]), samples, strict=True):
        filter_.process(record[start:end])
        history.append(filter_.coefficients if filter_.ready else np.full(p + q + 1, np.nan))
    coefficients = np.stack(history)
    return OnlineFit(samples, coefficients, _sigma_distance(coefficients[-1], offline))


def _sigma_distance(last: Floats, offline: ArmaModel) -> Floats:
    known = np.concatenate((offline.phi, offline.theta))
    errors = offline.standard_errors[: known.size]
    present = errors > 0.0
    distance = np.full(known.size, np.nan)
    distance[present] = (last[: known.size] - known)[present] / errors[present]
    return distance


Method = Literal["css", "exact"]

MIN_SAMPLES: Final = 200
"""Smallest number of samples: with fewer the tests have no power."""

_CORRELOGRAM_LAGS: Final = 40
_RESIDUAL_LAGS: Final = 20


class Preparation(TypedDict, total=False):
    """Options of `prepare`."""

    smooth: int
    outliers: Literal["hampel", "moving-average"] | None
    window: int
    threshold: float
    trend: Literal["mean", "linear"] | None
    decimate: int


def identify(
    z: npt.ArrayLike,
    rate: float | None = None,
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
    """Find a drift model of a record at rest, and test it.

    Parameters
    ----------
    z : array_like, shape (n,)
        Record of one axis, NaN where a sample is missing.
    rate : float
        Sampling rate, Hz. Default: the rate of a `Log`.
    name, unit : str
        Name and unit of the axis, for the report. Default: from a `Log`, or from the name of a
        column.
    order : (int, int), optional
        Orders p, q of the model. Default: the smallest model within a margin of the best criterion
        (see `select_order`).
    max_order : int
        Largest order of the autoregressive models.
    max_p, max_q : int
        Largest orders of the ARMA models.
    criterion : str
        Criterion for the choice of orders: "fpe", "aic", "aicc", "bic" or "hq".
    segments : int
        Number of segments in the tests of stationarity; fewer if a segment would have less than 10
        samples.
    method : str
        Estimation of the ARMA model. "css": conditional sum of squares. "exact": likelihood.
    progress : callable, optional
        Function that is called with the name of the step and the completed fraction. Default: a
        progress bar in notebooks.
    **preparation
        ``smooth``, ``outliers``, ``window``, ``threshold``, ``trend`` and ``decimate`` of
        `prepare`. By default the record is unchanged, and the models have a constant for its mean.

    Returns
    -------
    Identification
        Tests, criteria and models. `verdict` has the conclusions as sentences; `plot` draws the
        figure.

    Raises
    ------
    TypeError, ValueError
        If the record or an argument is not as described. If there are fewer than 200 samples.

    Notes
    -----
    From Fu and Han (2019), section 1.1: orders by a criterion, and a test of the residuals for
    whiteness. From Bao and Yuan: reverse arrangements of segments.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.identification import identify
    >>> a = np.random.default_rng(1).standard_normal(20_000)
    >>> z = np.zeros_like(a)
    >>> for k in range(1, len(a)):
    ...     z[k] = 0.7 * z[k - 1] + a[k]
    >>> found = identify(z, 100.0)
    >>> found.model.order, found.whiteness.white
    ((1, 0), True)
    """
    report = choose_reporter(progress)
    report("preparing", 0.0)
    record = as_record(z, MIN_SAMPLES, "identification")
    rate, (own, *_) = rate_of(rate, z), names_of(z) or ("",)
    summary = summarise_record(record, rate)
    moving = moving_spans(record, rate)
    prepared = _prepare_record(record, rate, preparation)
    data = prepared.data
    report("tests", 0.1)
    tests = run_tests(data, prepared.rate or rate, segments)
    report("orders", 0.3)
    ar_orders = select_order(data, "ar", criterion, max_order=max_order)
    arma_orders = select_order(data, "arma", criterion, max_p=max_p, max_q=max_q)
    report("models", 0.7)
    model = _fit_model(data, order, arma_orders, method)
    return Identification(
        name=name or own,
        unit=unit_of(unit, z) or UNKNOWN_UNIT,
        record=summary,
        moving=moving,
        smooth=preparation.get("smooth", 1),
        prepared=prepared,
        tests=tests,
        correlogram=autocorrelation(data, _CORRELOGRAM_LAGS),
        ar_orders=ar_orders,
        arma_orders=arma_orders,
        ar=fit_ar(data, ar_orders.clear[0]),
        model=model,
        order_given=order is not None,
        whiteness=whiteness(model.residuals(data), _RESIDUAL_LAGS, sum(model.order)),
        online=learn_online(data, model),
    )


def _fit_model(
    data: Floats, order: tuple[int, int] | None, selection: OrderSelection, method: Method
) -> ArmaModel:
    """Return the model of an order; the search starts from the comparison's result if present."""
    p, q = order or selection.clear
    start = dict(zip(selection.orders, selection.coefficients, strict=True)).get((p, q))
    return fit_arma(data, p, q, method=method, start=start)


def _prepare_record(record: Floats, rate: float, preparation: Preparation) -> PreparedRecord:
    options: Preparation = {"trend": None, **preparation}
    prepared = prepare(record, rate, **options)
    _check_sizes(as_record(prepared.data, MIN_SAMPLES, "identification after decimation"))
    return prepared


_MAX_SIZE_RATIO: Final = 1e8
"""Largest distance from the median, in median distances: squares of larger ones would reduce all
others to rounding.
"""


def _check_sizes(data: Floats) -> None:
    middle = np.nanmedian(data)
    away = np.abs(data - middle)
    typical, farthest = np.nanmedian(away), int(np.nanargmax(away))
    if 0.0 < _MAX_SIZE_RATIO * typical < away[farthest]:
        raise ValueError(
            make_sentence(
                f"identification needs samples of similar size: sample {farthest} is "
                f"{data[farthest]:g}, and half of all lie within {typical:.3g} of {middle:.3g}; ",
                keyword_argument("outliers"),
                " can replace it",
            )
        )


_MIN_MEANS: Final = 30
"""Smallest number of residuals, which determines their variance to 25 %."""


def compute_slow_ratio(result: Identification) -> float:
    """Return the variance of the segments' means over the variance from the model.

    Orders are chosen by the prediction of the next sample. A slow drift contributes little to it,
    so a model with white residuals can lack the drift. This ratio is then large.

    Parameters
    ----------
    result : Identification
        Record and model.

    Returns
    -------
    float
        Ratio, about 1 if the model is complete. NaN if fewer than 30 segments have samples or the
        model is not stationary.
    """
    means = result.tests.segment_means[np.isfinite(result.tests.segment_means)]
    if means.size < _MIN_MEANS or not result.model.stationary:
        return math.nan
    n = max(round(result.tests.segment * result.rate), 1)
    return float(np.var(means, ddof=1)) / variance_of_mean(result.model, n)


def variance_of_mean(model: ArmaModel, n: int) -> float:
    """Return the variance of the mean of n samples of a stationary process."""
    gamma = model.autocovariance(n - 1)
    weights = 1.0 - np.arange(n) / n
    return float(2.0 * (weights @ gamma) - gamma[0]) / n
