"""Whether a record may be modelled, in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from zerorate.identify.study.phrases import listed, per_cent
from zerorate.numerals import significant

if TYPE_CHECKING:
    from zerorate.identify.checks.arrangements import ReverseArrangements
    from zerorate.identify.checks.rest import Span
    from zerorate.identify.study.battery import Battery
    from zerorate.identify.study.result import Identification

__all__ = ["is_fit", "on_distribution", "on_fitness", "on_smoothing"]

_SHOWN_SPANS: Final = 3

_SLOW: Final = 0.1
"""Part of the variance between segments of a record that is not stationary, from which on it
is more than noise with a little drift."""

_COARSE: Final = 0.5
"""Steps over the deviation from which on quantisation alone fails tests of normality."""

_ODD: Final = 0.1
"""Skewness, or half the excess kurtosis, below which a distribution is Gaussian in practice."""

_REMEDY: Final = "take a linear trend off, or let the filter hold a random walk"


def is_fit(found: Identification) -> bool:
    """Return whether the record is at rest and does not wander off."""
    return not found.moving and not found.tests.adf.accepted and not _wanders(found.tests)


def on_fitness(found: Identification) -> Iterator[str]:
    """Yield whether the record is fit for a model, and why not."""
    tests = found.tests
    if found.moving:
        yield (
            f"Not fit for a drift model: it was not at rest {_where(found.moving)}. The numbers "
            "describe the motion; cut the record to where it rests."
        )
    elif tests.adf.accepted:
        yield f"Not fit as it is: a unit root is not rejected, so it may wander off; {_REMEDY}."
    elif tests.stationary:
        yield "Fit for modelling: at rest, and no test of stationarity sees a trend."
    else:
        trends = listed(list(_trends(tests)))
        slow = (
            f"{per_cent(tests.slow)} of the variance is slower than segments of "
            f"{significant(tests.segment)} s"
        )
        if _wanders(tests):
            yield f"Not fit as it is: {trends}; {slow}; {_REMEDY}."
        else:
            yield f"Fit for modelling: at rest, with a small drift: {trends}; {slow}."


def on_distribution(found: Identification) -> Iterator[str]:
    """Yield why tests of normality reject, and whether that matters."""
    tests, survey = found.tests, found.survey
    steps = survey.step / survey.deviation
    if tests.gaussian or not is_fit(found):
        return
    if steps >= _COARSE and found.smooth == 1:
        yield (
            f"Quantised in steps of {significant(survey.step)} {found.unit}, {significant(steps)} "
            f"deviations: for that alone normality is rejected; it makes {per_cent(steps**2 / 12)} "
            "of the variance."
        )
    elif _oddity(tests) < _ODD:
        yield (
            "Normality is rejected, but skewness and kurtosis are so near to the Gaussian ones "
            "that it does not matter."
        )
    else:
        yield (
            "Not Gaussian: the coefficients stay right, but their errors and the criteria are "
            "approximate; look for outliers and steps."
        )


def on_smoothing(found: Identification) -> Iterator[str]:
    """Yield what a moving average did to the correlation."""
    width = found.smooth
    if width > 1:
        yield (
            f"Smoothed over {width} samples, which alone correlates white noise by "
            f"{(width - 1) / width:.2g} at lag 1: the models describe the smoothing as well."
        )


def _wanders(tests: Battery) -> bool:
    # A stationary process of long memory has differing means, too, but no trend in them.
    return not tests.stationary and tests.slow >= _SLOW


def _trends(tests: Battery) -> Iterator[str]:
    for test, what in ((tests.means, "means"), (tests.variances, "variances")):
        if not test.accepted:
            yield _trend(test, what)
    if not tests.kpss.accepted:
        yield "KPSS sees the mean wander"


def _trend(test: ReverseArrangements, what: str) -> str:
    way = "rise" if test.z_score > 0.0 else "fall"
    bounds = f"{test.lower:.0f} to {test.upper:.0f}"
    return f"the {what} of {test.segments} segments {way} (A = {test.reversals}, not {bounds})"


def _oddity(tests: Battery) -> float:
    """Return the root of skewness squared and half the excess kurtosis squared."""
    return math.sqrt(6.0 * tests.jarque_bera.statistic / tests.jarque_bera.n)


def _where(spans: Sequence[Span]) -> str:
    """Return up to three spans, the longest ones, and how many more there are."""
    longest = sorted(spans, key=lambda span: span.start - span.end)[:_SHOWN_SPANS]
    ordered = sorted(longest, key=lambda span: span.start)
    shown = [f"{span.start:.1f} to {span.end:.1f} s" for span in ordered]
    more = len(spans) - len(shown)
    if more:
        shown.append(f"{more} shorter span{'s' if more > 1 else ''}")
    return f"from {listed(shown)}"
