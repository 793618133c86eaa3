"""The tests of a record, together."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.identify.checks.arrangements import ReverseArrangements, reverse_arrangements
from zerorate.identify.checks.kpss import kpss
from zerorate.identify.checks.normality import anderson_darling, jarque_bera
from zerorate.identify.checks.unit_root import adf
from zerorate.identify.checks.verdict import Verdict
from zerorate.identify.preparation.prepare import segments

__all__ = ["Battery", "examined"]

Floats = npt.NDArray[np.float64]

_LEAST_SEGMENT: Final = 10
"""Samples whose mean is worth comparing."""


@dataclass(frozen=True, eq=False)
class Battery:
    """Whether a record is stationary and Gaussian.

    Attributes
    ----------
    means, variances : ReverseArrangements
        Whether the segments show a trend.
    kpss, adf : Verdict
        Whether the record is stationary, and whether it has a unit root.
    jarque_bera, anderson_darling : Verdict
        Whether it is Gaussian.
    segment_means : ndarray, shape (m,)
        In the unit of the record; NaN where all samples are missing.
    segment : float
        Length of one, s.
    slow : float
        Part of the variance that is between the means of the segments.
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
        """Whether no test saw a trend or a wandering mean."""
        return self.means.accepted and self.variances.accepted and self.kpss.accepted

    @property
    def gaussian(self) -> bool:
        """Whether both tests of normality hold."""
        return self.jarque_bera.accepted and self.anderson_darling.accepted


def examined(record: Floats, rate: float, count: int) -> Battery:
    """Return the tests of a record, those of stationarity over so many segments.

    There are fewer where a segment would have less than 10 samples.
    """
    count = min(count, record.size // _LEAST_SEGMENT)
    means = np.array([_mean(part) for part in segments(record, count)])
    return Battery(
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


def _mean(values: Floats) -> float:
    there = values[np.isfinite(values)]
    return float(there.mean()) if there.size else np.nan
