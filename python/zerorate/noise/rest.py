"""Motion in a record that should be at rest: its spans, and the largest step."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.noise.quantities import Quantity, si_unit
from zerorate.noise.records import as_record, centred, resolution
from zerorate.record.named import rate_of
from zerorate.record.runs import runs_of_rows
from zerorate.types import Booleans, Floats

MOVED: Final = 8.0
"""How many usual deviations from rest are motion.

At rest the largest of 10 000 steps from the mean of a second to the next is 4.5 for Gaussian noise
of any colour; recordings at rest reach 4.5, next to a running motor 5.3. The logarithm of the
variance of a second reaches 4.2. Recordings that turn begin at 10.8, motion by hand at 30.
"""

LEAST_SECONDS: Final = 21.0
"""A shorter record does not tell whether it is one of a sensor at rest."""

_LEAST_WINDOWS: Final = 20
_LEAST_SAMPLES: Final = 10

_SHORTEST_REST: Final = 5
"""Windows: a shorter pause between two motions is no rest that could be characterised."""

_QUIET: Final = 0.25
"""Share of the windows that is at rest at least."""

_LEAST_RATIO: Final = 3.0
"""Variance of motion over that at rest, at least: vibration of the surroundings is no motion."""

_ROUGHEST: Final = 10.0
"""Mean square step of a random walk over its variance within a window, its slope taken off.

No noise of a gyro is smoother; what is, moves.
"""

_MEDIAN_OF_NORMAL: Final = 0.6744897501960817
_QUANTILES: Final = 0.9703637767
"""Between the 0.05 and the 0.25 quantile of the standard normal distribution."""


_RESTLESS: Final[Mapping[Quantity, float]] = {
    "angular rate": math.radians(0.5),
    "acceleration": 0.2,
}
"""Usual change of the mean of a second, rad/s or m/s^2, that no sensor at rest shows.

Gyros of phones reach 0.1 deg/s, accelerometers 0.02 m/s^2.
"""


class Span(NamedTuple):
    """A part of a record, in seconds from its first sample.

    Examples
    --------
    >>> from zerorate.identification import Span
    >>> Span(20.0, 25.0).end
    25.0
    """

    start: float
    end: float


class Step(NamedTuple):
    """A change between the means of two successive seconds, over the usual one, and its time."""

    size: float
    time: float


def moving_spans(z: npt.ArrayLike, rate: float | None = None) -> tuple[Span, ...]:
    """Return when a sensor was not at rest.

    Windows of one second move if their variance, or the step from one's mean to the next, is far
    outside of what the quiet ones show. Neighbours are put together, also over pauses under 5 s.

    Turning at one rate looks like a bias and is seen only where it begins and ends. Motion without
    a pause is seen if it takes more than some 4 s to and fro, and changes by more than some 25
    deviations of the noise from one second to the next; otherwise it looks like noise. Strong
    vibration counts as motion, and so do outliers: see `hampel`.

    Parameters
    ----------
    z : array_like, shape (n,)
        Gyro output of one axis in any unit, at rest for a quarter of the time at least; samples
        not finite are missing.
    rate : float
        Samples per second, Hz; by default that of a `Log`. Below 10 Hz a window has 10 samples.

    Returns
    -------
    tuple of Span
        In order, in seconds; empty for a sensor at rest, and for a record that cannot tell, of
        under 20 windows or without any noise.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis with a sample, or the rate not positive and finite.

    Examples
    --------
    >>> z = np.random.default_rng(1).standard_normal(6000)
    >>> z[2000:2500] += 50.0 * np.sin(np.arange(500) / 50.0)
    >>> moving_spans(z, rate=100.0)
    (Span(start=20.0, end=25.0),)
    """
    hertz = rate_of(rate, z)
    record = as_record(z)
    width = max(round(hertz), _LEAST_SAMPLES)
    count = record.size // width
    if count < _LEAST_WINDOWS or resolution(record) == 0.0:
        return ()
    windows = centred(record)[: count * width].reshape(count, width)
    return _spans(_moving(windows), width / hertz)


def largest_step(z: Floats, rate: float) -> Step:
    """Return the largest change from one second's mean to the next.

    Drift is slow and noise is Gaussian, so the changes of a sensor at rest are much alike; those of
    one that is moved now and then are not. Motion that goes on without a pause is not found.

    Parameters
    ----------
    z : ndarray, shape (n,)
        Record, NaN where missing.
    rate : float
        Samples per second, Hz.

    Returns
    -------
    Step
        Its size is 0 where the record is shorter than 20 s or so coarse that most means are equal.
    """
    return _Seconds.of(z, rate).largest


def doubts_of_rest(
    record: npt.NDArray[np.generic], rate: float, unit: str, names: Sequence[str]
) -> tuple[Doubt, ...]:
    """Return why noise coefficients of each axis of a sensor are not to be trusted.

    One that was moved now and then is known by `largest_step`, one in motion all the time by how
    much its second means change, where the unit is known. Where most axes moved, all did.

    Parameters
    ----------
    record : ndarray, shape (n,) or (n, k)
        Samples, NaN where missing.
    rate : float
        Samples per second, Hz.
    unit : str
        Of the samples, as `zerorate.noise.quantities` has it.
    names : sequence of str
        One name an axis; "" for none.

    Returns
    -------
    tuple of Doubt
        One an axis; its `why` is empty without a doubt.
    """
    factor, quantity = si_unit(unit)
    most = _RESTLESS.get(quantity, math.inf) / factor
    columns = record.reshape(len(record), -1)
    axes = [_Seconds.of(columns[:, i], rate) for i in range(columns.shape[1])]
    moved = [one.largest.size > MOVED or one.usual > most for one in axes]
    together = 2 * sum(moved) > len(moved)
    whys = (_why(one, its, together, most) for one, its in zip(axes, moved, strict=True))
    return tuple(
        Doubt(f"{name}: {why}" if name and why else why, itself or together)
        for name, why, itself in zip(names, whys, moved, strict=True)
    )


class Doubt(NamedTuple):
    """Why the noise of an axis is not to be trusted, and whether that is motion."""

    why: str = ""
    moved: bool = False


def _why(one: _Seconds, itself: bool, together: bool, most: float) -> str:
    if itself:
        return f"looks as if it moved ({one.sign(most)}): {_DESCRIBES}"
    if together:
        return "the other axes of this sensor moved, so it probably did too"
    if one.duration < LEAST_SECONDS:
        return f"{one.duration:.3g} s are too short to tell noise from motion"
    return ""


_DESCRIBES: Final = "the numbers describe the motion, not the sensor"


class _Seconds(NamedTuple):
    """What the means of the seconds of a record show."""

    duration: float
    usual: float
    largest: Step

    @classmethod
    def of(cls, z: npt.NDArray[np.generic], rate: float) -> _Seconds:
        width = max(round(rate), 1)
        changes = np.diff(_means(z[: len(z) // width * width].reshape(-1, width)))
        present = np.abs(changes[np.isfinite(changes)])
        usual = _usual(present) if present.size else 0.0
        duration = len(z) / rate
        if present.size < _LEAST_WINDOWS or usual == 0.0:
            return cls(duration, usual, Step(0.0, 0.0))
        place = int(np.nanargmax(np.abs(changes)))
        size = float(abs(changes[place])) / usual
        return cls(duration, usual, Step(size, (place + 1) * width / rate))

    def sign(self, most: float) -> str:
        """Return what shows the motion."""
        if self.usual > most:
            return "its mean over one second changes all the time, as no sensor's at rest"
        return (
            f"at {self.largest.time:g} s its mean over one second changes "
            f"{self.largest.size:.0f} times as much as usual"
        )


def _moving(windows: Floats) -> Booleans:
    """Return which windows move, shape (m,)."""
    found = _Windows.of(windows)
    noisy = found.variance > _variance_limit(found.variance, windows.shape[1])
    steps = np.abs(np.diff(found.mean))
    # A step into a window that moves anyway says nothing of its neighbour.
    between = ~(noisy[1:] | noisy[:-1]) & np.isfinite(steps)
    if not between.any():
        return noisy
    usual = _usual(steps[between])
    smoothest = float(np.sqrt(_ROUGHEST * np.nanquantile(found.about_line, _QUIET)))
    far = between & (steps > MOVED * min(usual, smoothest)) & (usual > 0.0)
    moving = noisy.copy()
    moving[1:] |= far
    moving[:-1] |= far
    return moving


class _Windows(NamedTuple):
    """Mean, variance, and variance about a straight line of each window, NaN of half-empty ones."""

    mean: Floats
    variance: Floats
    about_line: Floats

    @classmethod
    def of(cls, windows: Floats) -> _Windows:
        there = np.isfinite(windows)
        count = np.maximum(there.sum(axis=1), 1)
        mean = _means(windows)
        level = np.where(there, windows - mean[:, None], 0.0)
        squares = np.einsum("ij,ij->i", level, level)
        time = np.arange(windows.shape[1]) - (windows.shape[1] - 1) / 2.0
        line = (level @ time) ** 2 / np.maximum(there @ time**2, 1.0)
        # A step of quantisation is the least that can be told apart.
        least = resolution(windows.reshape(-1)) ** 2 / 12.0
        # NaN where the mean is, in windows without any sample too.
        blank = 0.0 * mean
        return cls(
            mean,
            np.maximum(squares / count, least) + blank,
            np.maximum((squares - line) / count, least) + blank,
        )


def _means(rows: npt.NDArray[np.generic]) -> Floats:
    """Return the mean of each row, NaN where half of it or more is missing."""
    whole: Floats = np.asarray(rows.sum(axis=1, dtype=np.float64))
    if np.isfinite(whole).all():
        return np.asarray(whole / rows.shape[1])
    there = np.isfinite(rows)
    count = there.sum(axis=1)
    sums = np.where(there, rows, 0.0).sum(axis=1)
    found: Floats = np.where(2 * count > rows.shape[1], sums / np.maximum(count, 1), np.nan)
    return found


def _usual(steps: Floats) -> float:
    """Return the deviation of Gaussian steps whose sizes have this median."""
    return float(np.median(steps)) / _MEDIAN_OF_NORMAL


def _variance_limit(variance: Floats, width: int) -> float:
    lowest, quiet = np.nanquantile(variance, [0.05, _QUIET])
    # The logarithm of a variance of Gaussian noise varies by sqrt(2 / width) at least.
    spread = max(float(np.log(quiet / lowest)) / _QUANTILES, float(np.sqrt(2.0 / width)))
    return float(quiet) * max(float(np.exp(MOVED * spread)), _LEAST_RATIO)


def _spans(moving: Booleans, seconds: float) -> tuple[Span, ...]:
    joined = runs_of_rows(np.flatnonzero(moving), _SHORTEST_REST)
    return tuple(Span(start, end) for start, end in (joined * seconds).tolist())
