"""Size and shape of a record, and tests for stationarity and a Gaussian distribution."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.identification.arrangements import ReverseArrangements, reverse_arrangements
from zerorate.identification.normality import anderson_darling, jarque_bera
from zerorate.identification.preparation import segments
from zerorate.identification.stationarity import adf, kpss
from zerorate.identification.verdict import Verdict
from zerorate.types import Floats

_GLANCE_SAMPLES: Final = 10_000
_MIN_REPEATS: Final = 4
"""Smallest number of samples per distinct value of a quantised record."""


@dataclass(frozen=True)
class RecordSummary:
    """Size and shape of the record of one axis.

    Attributes
    ----------
    sample_count : int
        Number of samples, with missing samples.
    missing_count : int
        Number of missing samples.
    stretch_count : int
        Number of stretches between gaps.
    rate : float
        Samples per second, Hz.
    mean, deviation : float
        Mean and standard deviation of the present samples, in the unit of the record.
    step : float
        Step of quantisation, in the unit of the record; 0 if the values look continuous.
    """

    sample_count: int
    missing_count: int
    stretch_count: int
    rate: float
    mean: float
    deviation: float
    step: float

    @property
    def duration(self) -> float:
        """Length, s: the number of samples times the sampling period."""
        return self.sample_count / self.rate


def summarise_record(record: Floats, rate: float) -> RecordSummary:
    """Summarise a record of shape (n,) with at least one sample."""
    present = np.isfinite(record)
    there = record if present.all() else record[present]
    starts = int(present[0]) + np.count_nonzero(present[1:] & ~present[:-1])
    # The first sample is subtracted, because an offset may be many times the noise.
    first = there[0]
    rest = there - first
    return RecordSummary(
        sample_count=record.size,
        missing_count=record.size - there.size,
        stretch_count=int(starts),
        rate=rate,
        mean=float(first + rest.mean()),
        deviation=float(rest.std()),
        step=_quantisation_step(there[:_GLANCE_SAMPLES]),
    )


def _quantisation_step(values: Floats) -> float:
    """Return the median distance of neighbouring values, 0 for many distinct values."""
    distinct = np.unique(values)
    if distinct.size < 2 or distinct.size * _MIN_REPEATS > values.size:
        return 0.0
    return float(np.median(np.diff(distinct)))


_MIN_SEGMENT_SAMPLES: Final = 10
"""Smallest number of samples in a segment."""


@dataclass(frozen=True, eq=False)
class RecordTests:
    """Tests of a record for stationarity and a Gaussian distribution.

    Attributes
    ----------
    means, variances : ReverseArrangements
        Test for a trend in the means or the variances of segments.
    kpss, adf : Verdict
        Tests for stationarity, and for a unit root.
    jarque_bera, anderson_darling : Verdict
        Tests for a Gaussian distribution.
    segment_means : ndarray, shape (m,)
        Means of the segments, in the unit of the record; NaN if all samples are missing.
    segment : float
        Length of a segment, s.
    slow : float
        Share of the variance that is between the means of the segments.
    """

    means: ReverseArrangements
    variances: ReverseArrangements
    kpss: Verdict
    adf: Verdict
    jarque_bera: Verdict
    anderson_darling: Verdict
    segment_means: Floats
    segment: float
    slow: float

    @property
    def all(self) -> tuple[Verdict, ...]:
        """The tests in the order of a report."""
        return (
            self.means,
            self.variances,
            self.kpss,
            self.adf,
            self.jarque_bera,
            self.anderson_darling,
        )

    @property
    def stationary(self) -> bool:
        """True if no test found a trend or a wandering mean."""
        return self.means.accepted and self.variances.accepted and self.kpss.accepted

    @property
    def gaussian(self) -> bool:
        """True if both tests accept normality."""
        return self.jarque_bera.accepted and self.anderson_darling.accepted


def run_tests(record: Floats, rate: float, count: int) -> RecordTests:
    """Return the tests of a record, with stationarity over a number of segments.

    Fewer segments are used if a segment would have less than 10 samples.
    """
    count = min(count, record.size // _MIN_SEGMENT_SAMPLES)
    means = np.array([_finite_mean(part) for part in segments(record, count)])
    return RecordTests(
        means=reverse_arrangements(record, count, "mean"),
        variances=reverse_arrangements(record, count, "variance"),
        kpss=kpss(record),
        adf=adf(record),
        jarque_bera=jarque_bera(record),
        anderson_darling=anderson_darling(record),
        segment_means=means,
        segment=record.size / count / rate,
        slow=float(np.nanvar(means) / np.nanvar(record)),
    )


def _finite_mean(values: Floats) -> float:
    there = values[np.isfinite(values)]
    return float(there.mean()) if there.size else np.nan
