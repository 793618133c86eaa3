"""Faults of real logs, added to a record: outliers, bursts of outliers, a stuck sensor."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.simulation.gyro import check_not_negative, check_whole
from zerorate.types import Booleans, Floats

_BURST_PERIOD_S: Final = 60.0
"""Interval in which one burst occurs, s."""

_SIGMA_OF_MEDIAN: Final = 1.482602218505602
"""Standard deviation of a Gaussian variable divided by its median absolute value."""

# Append new faults: their position selects the random stream, and old seeds must not change.
_STREAMS: Final = ("share", "burst")


@dataclass(frozen=True)
class Contamination:
    """Faults to add to a record.

    Parameters
    ----------
    share : float
        Share of samples (0 to 1) that are outliers, at random times.
    size : float
        Size of the outliers, in standard deviations of the record (see Notes).
    one_sided : bool
        True makes all outliers positive. By default each outlier has a random sign.
    burst : int
        Length of a burst of outliers, samples. Each minute of the record has a burst at a random
        time. In an incomplete last minute it may be missing.
    stuck : float
        Duration for which the sensor repeats its last value, s. It starts in the middle of the
        record.
    at_zero : bool
        True makes the stuck sensor report zero instead of its last value.

    Raises
    ------
    ValueError
        If a number is out of range, or there is no fault. If there are outliers but no `size`, or a
        `size` but no outliers. If `at_zero` is True and `stuck` is zero.

    Notes
    -----
    The standard deviation of a record is 1.4826/sqrt(2) times the median step size between samples.
    For white noise this equals the standard deviation of the noise. Level and drift of the record
    do not change it. If half of the steps are zero, as in a coarse output, the RMS of the steps
    replaces the median. In a constant record the outliers have the size zero.

    Examples
    --------
    >>> faults = Contamination.parse("share=0.05,size=100,one-sided")
    >>> faults
    Contamination(share=0.05, size=100.0, one_sided=True, burst=0, stuck=0.0, at_zero=False)
    >>> z = np.random.default_rng(1).standard_normal(10_000)
    >>> int(np.count_nonzero(faults.apply(z, rate=100.0, seed=1) - z > 90.0))
    497
    """

    share: float = 0.0
    size: float = 0.0
    one_sided: bool = False
    burst: int = 0
    stuck: float = 0.0
    at_zero: bool = False

    def __post_init__(self) -> None:
        """Check the numbers and their combination."""
        if not 0.0 <= self.share <= 1.0:
            raise ArgumentError("share", f"must be 0 to 1, got {self.share}")
        check_not_negative("size", self.size)
        check_whole("burst", self.burst, 0)
        check_not_negative("stuck", self.stuck)
        outliers = self.share > 0.0 or self.burst > 0
        if not (outliers or self.stuck > 0.0):
            raise ValueError("a contamination needs share, burst or stuck above 0")
        if outliers != (self.size > 0.0):
            raise ValueError("share and burst need a size above 0, and a size needs one of them")
        if self.one_sided and not outliers:
            raise ValueError("one_sided is for share and burst only")
        if self.at_zero and not self.stuck > 0.0:
            raise ValueError("at_zero needs stuck above 0")

    @classmethod
    def parse(cls, text: str) -> Contamination:
        """Return the contamination from a text, such as ``burst=20,size=30`` or ``stuck=10``.

        Raises
        ------
        ValueError
            If a name is unknown or repeated, or a value is not a number.
        """
        options: dict[str, Any] = {}
        for word in text.split(","):
            name, sign, value = (part.strip() for part in word.partition("="))
            if name not in _WORD_TYPES or (_WORD_TYPES[name] is bool) == bool(sign):
                raise ValueError(f"a contamination is made of {_WORDS}, got '{word.strip()}'")
            if name in options:
                raise ValueError(f"{name} stands twice in '{text}'")
            options[name] = True if _WORD_TYPES[name] is bool else _parse_number(name, value)
        return cls(**{name.replace("-", "_"): value for name, value in options.items()})

    def __str__(self) -> str:
        """Return the text that `parse` reads."""
        return ",".join(self._words())

    def apply(self, z: npt.ArrayLike, rate: float, seed: int) -> Floats:
        """Return a contaminated copy of a record.

        Parameters
        ----------
        z : array_like, shape (n,) or (n, k)
            Samples in any unit. Values that are not finite count as missing and do not change.
        rate : float
            Sampling rate, Hz.
        seed : int
            Seed, at least 0. The same arguments give the same copy. Each channel and each kind of
            fault has its own random stream. Channel i therefore does not depend on the number of
            channels.

        Returns
        -------
        ndarray of float64, the shape of `z`
            The record, first with outliers, then with the stuck span.

        Raises
        ------
        ValueError
            If `z` does not have one or two dimensions, or the rate is not positive and finite. If
            the seed is not a whole number of at least 0.
        """
        samples = np.array(z, dtype=np.float64)
        if samples.ndim not in (1, 2):
            raise ArgumentError("z", f"must have the shape (n,) or (n, k), got {samples.shape}")
        if not 0.0 < rate < math.inf:
            raise ArgumentError("rate", f"must be positive and finite, got {rate}")
        columns = np.atleast_2d(samples.T)
        seeds = np.random.SeedSequence(check_whole("seed", seed, 0)).spawn(len(columns))
        for column, column_seed in zip(columns, seeds, strict=True):
            present = np.isfinite(column)
            column[present] = self._contaminate(column, present, rate, column_seed)[present]
        return samples

    def stuck_span(self, n: int, rate: float) -> slice:
        """Return the slice of stuck samples in a record of n samples."""
        return slice(n // 2, min(n, n // 2 + round(self.stuck * rate)))

    def _contaminate(
        self, z: Floats, there: Booleans, rate: float, seed: np.random.SeedSequence
    ) -> Floats:
        seeds = dict(zip(_STREAMS, seed.spawn(len(_STREAMS)), strict=True))
        contaminated = z.copy()
        if self.size > 0.0:
            step = self.size * _white_sigma(z, there)
            contaminated += step * self._outliers(z.size, np.random.default_rng(seeds["share"]))
            contaminated += step * self._bursts(z.size, rate, np.random.default_rng(seeds["burst"]))
        span = self.stuck_span(z.size, rate)
        before = contaminated[: span.start][there[: span.start]]
        contaminated[span] = 0.0 if self.at_zero or not before.size else before[-1]
        return contaminated

    def _outliers(self, n: int, random: np.random.Generator) -> Floats:
        is_outlier = random.random(n) < self.share
        return is_outlier * self._signs(n, random)

    def _bursts(self, n: int, rate: float, random: np.random.Generator) -> Floats:
        bursts = np.zeros(n)
        minute = max(1, round(_BURST_PERIOD_S * rate))
        for begin in range(0, n if self.burst else 0, minute):
            first = begin + int(random.integers(max(1, minute - self.burst + 1)))
            end = min(first + self.burst, n)
            bursts[first:end] = self._signs(self.burst, random)[: max(0, end - first)]
        return bursts

    def _signs(self, n: int, random: np.random.Generator) -> Floats:
        signs = random.choice((-1.0, 1.0), n)
        return np.ones(n) if self.one_sided else signs

    def _words(self) -> Iterator[str]:
        for field in fields(self):
            value, name = getattr(self, field.name), field.name.replace("_", "-")
            if value != field.default:
                yield name if value is True else f"{name}={value:.15g}"


_WORD_TYPES: Final = {
    field.name.replace("_", "-"): type(field.default) for field in fields(Contamination)
}
"""Type of the value of each name in a text."""

_WORDS: Final = ", ".join(
    name if kind is bool else f"{name}=" for name, kind in _WORD_TYPES.items()
)


def _parse_number(name: str, text: str) -> float | int:
    try:
        return int(text) if _WORD_TYPES[name] is int else float(text)
    except ValueError:
        kind = "a whole number" if _WORD_TYPES[name] is int else "a number"
        raise ArgumentError(name, f"must be {kind}, got '{text}'") from None


def _white_sigma(z: Floats, there: Booleans) -> float:
    """Return the standard deviation of white noise with the steps of this record."""
    steps = np.abs(np.diff(np.where(there, z, np.nan)))
    steps = steps[np.isfinite(steps)]
    if not steps.any():
        return 0.0
    typical = _SIGMA_OF_MEDIAN * float(np.median(steps)) or float(np.sqrt(np.mean(steps**2)))
    return typical / math.sqrt(2.0)
