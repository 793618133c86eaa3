"""Conclusions from the numbers of an identification, in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.numerals import format_significant

if TYPE_CHECKING:
    from zerorate.identification.arrangements import ReverseArrangements
    from zerorate.identification.identification import Identification
    from zerorate.identification.order import OrderSelection
    from zerorate.identification.record_tests import RecordTests
    from zerorate.noise.motion_check import Span

_MIN_PREDICTABLE_SHARE: Final = 0.01
"""Smallest predictable share of the residuals' variance that shows an incomplete model."""

_MAX_SLOW_RATIO: Final = 1.5
"""Largest ratio of the slow variance to the model's slow variance that chance explains. For 100
segments of a known model the ratio has a standard deviation of a seventh.
"""

_MAX_DISTANCE_SIGMAS: Final = 3.0
"""Largest difference of two estimates, in standard errors, that chance explains."""


def conclusions(result: Identification) -> tuple[str, ...]:
    """Return the conclusions on a record and its model, one sentence each.

    Parameters
    ----------
    result : Identification
        Identification to describe.

    Returns
    -------
    tuple of str
        Sentences on the record, order, residuals, drift and coefficients, in this order.
    """
    parts = (
        _describe_fitness,
        _describe_distribution,
        _describe_smoothing,
        _describe_order,
        _describe_residuals,
        _describe_drift,
        _describe_coefficients,
        _describe_online,
    )
    return tuple(sentence for part in parts for sentence in part(result))


def _describe_order(result: Identification) -> Iterator[str]:
    orders, name = result.arma_orders, model_name(result.model.order)
    rule = orders.criterion.upper()
    clear, least = model_name(orders.clear), model_name(orders.minimum)
    if result.order_given:
        yield f"{name} was requested; the clear choice by {rule} is {clear}."
    elif orders.clear == orders.minimum:
        yield f"{rule} chooses {name}, the order with the least value."
    else:
        yield (
            f"{rule} chooses {name}: the fewest coefficients within {orders.margin:g} of the "
            f"least, which {least} has."
        )
    if not result.order_given and not result.moving and _is_at_limit(orders):
        yield "This is the highest order tried; a higher one may be better."
    if sum(result.model.order) and not result.moving:
        explained = max(0.0, 1.0 - result.model.sigma2 / float(np.nanvar(result.prepared.data)))
        yield f"The model explains {format_percent(explained)} of the variance."


def _is_at_limit(orders: OrderSelection) -> bool:
    """Return True if the clear choice has one of the highest orders."""
    highest = [max(order[i] for order in orders.orders) for i in (0, 1)]
    return any(0 < most == own for most, own in zip(highest, orders.clear, strict=True))


def _describe_residuals(result: Identification) -> Iterator[str]:
    white, test = result.whiteness, result.whiteness.ljung_box
    if white.white:
        yield f"The residuals are white (Ljung-Box, p = {format_significant(test.p_value, 2)})."
        return
    rest = format_percent(white.predictable)
    if white.predictable < _MIN_PREDICTABLE_SHARE:
        yield (
            f"The residuals are not quite white (Ljung-Box); {rest} of their variance could still "
            f"be predicted, which is negligible."
        )
    else:
        yield (
            f"The residuals are not white: {rest} of their variance could still be predicted; try "
            f"a higher order (the AR models suggest {model_name(result.ar_orders.clear)})."
        )


def _describe_drift(result: Identification) -> Iterator[str]:
    ratio = result.slow_ratio
    if result.moving or not ratio > _MAX_SLOW_RATIO:
        return
    yield (
        f"The means of segments of {format_significant(result.tests.segment)} s vary with "
        f"{format_significant(ratio, 2)} times the variance that the model predicts, so the model "
        f"lacks a slow drift. Decimate the record to model it."
    )


def _describe_coefficients(result: Identification) -> Iterator[str]:
    for note in result.model.notes:
        yield f"{note[0].upper()}{note[1:]}."


def _describe_online(result: Identification) -> Iterator[str]:
    if result.online is None or result.moving:
        return
    distance = np.abs(result.online.distance)
    far = float(np.nanmax(distance)) if np.isfinite(distance).any() else 0.0
    if far <= _MAX_DISTANCE_SIGMAS:
        yield (
            "Online estimation ends with coefficients within "
            f"{format_significant(max(far, 0.1), 2)} standard errors of these."
        )
    else:
        yield (
            f"Online estimation ends with coefficients up to {format_significant(far, 2)} "
            "standard errors from these: the recursion had not converged."
        )


_MAX_SHOWN_SPANS: Final = 3

_MAX_SLOW_SHARE: Final = 0.1
"""Share of the variance between segments above which the record is more than noise with a small
drift.
"""

_COARSE_STEP_SIGMAS: Final = 0.5
"""Ratio of step to standard deviation above which quantisation alone fails tests of normality."""

_MAX_ODDITY: Final = 0.1
"""Largest skewness, or half of the excess kurtosis, of a practically Gaussian distribution."""

_REMEDY: Final = "subtract a linear trend, or use a filter with a random walk"


def is_fit(result: Identification) -> bool:
    """Return True if the record is at rest and its drift is bounded."""
    return not result.moving and not result.tests.adf.accepted and not _is_wandering(result.tests)


def _describe_fitness(result: Identification) -> Iterator[str]:
    """Yield sentences on the suitability of the record for a model, with reasons."""
    tests = result.tests
    if result.moving:
        yield (
            "Not fit for a drift model: the sensor was not at rest "
            f"{_describe_spans(result.moving)}. The numbers describe the motion; cut the record "
            f"to a static interval."
        )
    elif tests.adf.accepted:
        yield f"Not fit as it is: a unit root, as of a random walk, is not rejected; {_REMEDY}."
    elif tests.stationary:
        yield "Fit for modelling: at rest, and no test of stationarity rejects."
    else:
        trends = join_words(list(_describe_trends(tests)))
        slow = (
            f"{format_percent(tests.slow)} of the variance is slower than segments of "
            f"{format_significant(tests.segment)} s"
        )
        if _is_wandering(tests):
            yield f"Not fit as it is: {trends}; {slow}; {_REMEDY}."
        else:
            yield f"Fit for modelling: at rest, with a small drift: {trends}; {slow}."


def _describe_distribution(result: Identification) -> Iterator[str]:
    """Yield the reason why tests of normality reject, and its importance."""
    tests, record = result.tests, result.record
    steps = record.step / record.deviation
    if tests.gaussian or not is_fit(result):
        return
    if steps >= _COARSE_STEP_SIGMAS and result.smooth == 1:
        yield (
            f"Quantised in steps of {format_significant(record.step)} {result.unit}, "
            f"{format_significant(steps)} "
            "deviations: this alone rejects normality; it contributes "
            f"{format_percent(steps**2 / 12)} "
            "of the variance."
        )
    elif _oddity(tests) < _MAX_ODDITY:
        yield (
            "Normality is rejected, but skewness and kurtosis are close enough to Gaussian values."
        )
    else:
        yield (
            "Not Gaussian: the coefficients remain valid, but their errors and the criteria are "
            "approximate; look for outliers and steps."
        )


def _describe_smoothing(result: Identification) -> Iterator[str]:
    """Yield the effect of a moving average on the correlation."""
    width = result.smooth
    if width > 1:
        yield (
            f"Smoothed over {width} samples, which correlates even white noise by "
            f"{(width - 1) / width:.2g} at lag 1: the models describe the smoothing, too."
        )


def _is_wandering(tests: RecordTests) -> bool:
    # Segment means of a stationary process with long correlation also differ, but without a trend.
    return not tests.stationary and tests.slow >= _MAX_SLOW_SHARE


def _describe_trends(tests: RecordTests) -> Iterator[str]:
    for test, what in ((tests.means, "means"), (tests.variances, "variances")):
        if not test.accepted:
            yield _describe_trend(test, what)
    if not tests.kpss.accepted:
        yield "KPSS rejects a constant mean"


def _describe_trend(test: ReverseArrangements, what: str) -> str:
    way = "rise" if test.z_score > 0.0 else "fall"
    bounds = f"{test.lower:.0f} to {test.upper:.0f}"
    of_segments = f"{what} of {test.segment_count} segments"
    return f"the {of_segments} {way} (A = {test.reversal_count}, not {bounds})"


def _oddity(tests: RecordTests) -> float:
    """Return the root of skewness squared and half the excess kurtosis squared."""
    return math.sqrt(6.0 * tests.jarque_bera.statistic / tests.jarque_bera.n)


def _describe_spans(spans: Sequence[Span]) -> str:
    """Return the three longest spans, and the number of the other spans."""
    longest = sorted(spans, key=lambda span: span.start - span.end)[:_MAX_SHOWN_SPANS]
    ordered = sorted(longest, key=lambda span: span.start)
    shown = [f"{span.start:.1f} to {span.end:.1f} s" for span in ordered]
    more = len(spans) - len(shown)
    if more:
        shown.append(f"{more} shorter span{'s' if more > 1 else ''}")
    return f"from {join_words(shown)}"


def join_words(parts: Sequence[str]) -> str:
    """Return "a, b and c"."""
    return " and ".join(filter(None, (", ".join(parts[:-1]), *parts[-1:])))


def format_percent(part: float) -> str:
    """Return a share in per cent, with two digits."""
    return f"{format_significant(100.0 * part, 2)} %" if part >= 1e-4 else "less than 0.01 %"


def model_name(order: tuple[int, int]) -> str:
    """Return AR(p), MA(q), ARMA(p, q), or "white noise"."""
    p, q = order
    if p and q:
        return f"ARMA({p}, {q})"
    return f"AR({p})" if p else f"MA({q})" if q else "white noise"
