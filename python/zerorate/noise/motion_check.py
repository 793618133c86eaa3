"""Motion in a record that should be at rest: its spans, and the largest step."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.noise.quantities import Quantity, si_unit
from zerorate.noise.records import as_record, centre_record, resolution
from zerorate.numerals import shorten
from zerorate.record.named import rate_of
from zerorate.record.runs import runs_of_rows
from zerorate.types import Booleans, Floats

MOTION_SIGMAS: Final = 8.0
"""Smallest number of usual deviations of motion from rest.

For Gaussian noise of any colour, the largest of 10 000 steps between successive second means is
4.5. Recordings at rest reach 4.5, or 5.3 next to a running motor. The logarithm of a second's
variance reaches 4.2. Recordings with rotation begin at 10.8, motion by hand at 30.
"""

MIN_REST_S: Final = 21.0
"""Shortest record for a test of rest, s."""

_MIN_WINDOWS: Final = 20
_MIN_SAMPLES: Final = 10

_MIN_REST_WINDOWS: Final = 5
"""Number of windows of the shortest usable rest between two motions."""

_QUIET_SHARE: Final = 0.25
"""Assumed smallest share of the windows at rest."""

_MIN_VARIANCE_RATIO: Final = 3.0
"""Smallest ratio of the variance in motion to the variance at rest: vibration of the surroundings
is not motion.
"""

_MAX_ROUGHNESS: Final = 10.0
"""Mean square step of a random walk, relative to its variance about a line within a window.

No noise of a gyro is smoother than a random walk; a smoother signal is motion.
"""

_MEDIAN_OF_NORMAL: Final = 0.6744897501960817
_QUANTILE_SPAN: Final = 0.9703637767
"""Distance between the 0.05 and the 0.25 quantile of the standard normal distribution."""


_MAX_MEAN_CHANGE: Final[Mapping[Quantity, float]] = {
    "angular rate": math.radians(0.5),
    "acceleration": 0.2,
}
"""Largest usual change between second means of a sensor at rest, rad/s or m/s^2.

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
    """Change between means of successive seconds, relative to the usual change, and its time."""

    size: float
    time: float


def moving_spans(z: npt.ArrayLike, rate: float | None = None) -> tuple[Span, ...]:
    """Return the time spans in which a sensor was not at rest.

    A one-second window counts as motion if its variance is far outside the range of quiet windows.
    It also counts as motion if the mean changes far more to the next window than between quiet
    windows. Windows of motion are merged if they are less than 5 s apart.

    Rotation at a constant rate looks like a bias and is detected only at its beginning and end.
    Motion without a pause is detected only if its period exceeds about 4 s. It must also change the
    one-second means by more than about 25 standard deviations of the noise. Otherwise this motion
    looks like noise. Strong vibration and outliers count as motion; `hampel` removes outliers.

    Parameters
    ----------
    z : array_like, shape (n,)
        Gyro output of one axis in any unit; values that are not finite count as missing. The sensor
        must be at rest for at least a quarter of the time.
    rate : float
        Sampling rate, Hz. Default: the rate of a `Log`. Below 10 Hz a window has 10 samples.

    Returns
    -------
    tuple of Span
        Spans in the order of time. Empty if the sensor is at rest, if the record has fewer than 20
        windows, or if it has no noise.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis with at least one sample, or the rate is not positive and finite.

    Examples
    --------
    >>> z = np.random.default_rng(1).standard_normal(6000)
    >>> z[2000:2500] += 50.0 * np.sin(np.arange(500) / 50.0)
    >>> moving_spans(z, rate=100.0)
    (Span(start=20.0, end=25.0),)
    """
    hertz = rate_of(rate, z)
    record = as_record(z)
    width = max(round(hertz), _MIN_SAMPLES)
    count = record.size // width
    if count < _MIN_WINDOWS or resolution(record) == 0.0:
        return ()
    windows = centre_record(record)[: count * width].reshape(count, width)
    return _join_spans(_find_moving(windows), width / hertz)


def largest_step(z: Floats, rate: float) -> Step:
    """Return the largest change from one second's mean to the next.

    Drift is slow and noise is Gaussian, so the changes of a sensor at rest have about the same
    size. In occasional motion some changes are much larger. Motion without a pause is not found.

    Parameters
    ----------
    z : ndarray, shape (n,)
        Record, NaN where missing.
    rate : float
        Samples per second, Hz.

    Returns
    -------
    Step
        Largest step. Its size is 0 if the record is shorter than 20 s, or so coarse that most means
        are equal.
    """
    return _SecondMeans.of(z, rate).largest


def find_doubts(
    record: npt.NDArray[np.generic], rate: float, unit: str, names: Sequence[str]
) -> tuple[Doubt, ...]:
    """Return the reasons to doubt the noise coefficients of each axis of a sensor.

    `largest_step` detects occasional motion. If the unit is known, the changes of the second means
    detect permanent motion. If most axes moved, all axes count as moved.

    Parameters
    ----------
    record : ndarray, shape (n,) or (n, k)
        Samples, NaN where missing.
    rate : float
        Samples per second, Hz.
    unit : str
        Unit of the samples, as in `zerorate.noise.quantities`.
    names : sequence of str
        Name of each axis; "" for no name.

    Returns
    -------
    tuple of Doubt
        One doubt per axis, with an empty `why` if there is none.
    """
    factor, quantity = si_unit(unit)
    max_change = _MAX_MEAN_CHANGE.get(quantity, math.inf) / factor
    columns = record.reshape(len(record), -1)
    axes = [_SecondMeans.of(columns[:, i], rate) for i in range(columns.shape[1])]
    moved = [axis.largest.size > MOTION_SIGMAS or axis.usual_change > max_change for axis in axes]
    mostly_moved = 2 * sum(moved) > len(moved)
    reasons = (
        _explain_doubt(axis, its, mostly_moved, max_change)
        for axis, its in zip(axes, moved, strict=True)
    )
    return tuple(
        Doubt(f"{name}: {why}" if name and why else why, itself or mostly_moved)
        for name, why, itself in zip(names, reasons, moved, strict=True)
    )


class Doubt(NamedTuple):
    """Reason for doubt in the noise of an axis, and True if the reason is motion."""

    why: str = ""
    moved: bool = False


def _explain_doubt(means: _SecondMeans, moved: bool, mostly_moved: bool, max_change: float) -> str:
    if moved:
        return f"looks as if it moved ({means.evidence(max_change)}): {_MOTION_WARNING}"
    if mostly_moved:
        return "the other axes of this sensor moved, so it probably did too"
    if means.duration < MIN_REST_S:
        return f"{shorten(means.duration, 3)} s are too short to distinguish noise from motion"
    return ""


_MOTION_WARNING: Final = "the numbers describe the motion, not the sensor"


class _SecondMeans(NamedTuple):
    """Statistics of the means over the seconds of a record."""

    duration: float
    usual_change: float
    largest: Step

    @classmethod
    def of(cls, z: npt.NDArray[np.generic], rate: float) -> _SecondMeans:
        width = max(round(rate), 1)
        changes = np.diff(_row_means(z[: len(z) // width * width].reshape(-1, width)))
        present = np.abs(changes[np.isfinite(changes)])
        usual = _robust_sigma(present) if present.size else 0.0
        duration = len(z) / rate
        if present.size < _MIN_WINDOWS or usual == 0.0:
            return cls(duration, usual, Step(0.0, 0.0))
        index = int(np.nanargmax(np.abs(changes)))
        size = float(abs(changes[index])) / usual
        return cls(duration, usual, Step(size, (index + 1) * width / rate))

    def evidence(self, max_change: float) -> str:
        """Return the evidence of motion."""
        if self.usual_change > max_change:
            return "its mean over one second changes all the time, as no sensor's at rest"
        return (
            f"at {self.largest.time:g} s its mean over one second changes "
            f"{self.largest.size:.0f} times as much as usual"
        )


def _find_moving(windows: Floats) -> Booleans:
    """Return the mask of moving windows, shape (m,)."""
    statistics = _WindowStatistics.of(windows)
    noisy = statistics.variance > _variance_limit(statistics.variance, windows.shape[1])
    steps = np.abs(np.diff(statistics.mean))
    # A step into a window of motion is not evidence for motion in the next window.
    between = ~(noisy[1:] | noisy[:-1]) & np.isfinite(steps)
    if not between.any():
        return noisy
    usual = _robust_sigma(steps[between])
    smoothest = float(np.sqrt(_MAX_ROUGHNESS * np.nanquantile(statistics.about_line, _QUIET_SHARE)))
    jumped = between & (steps > MOTION_SIGMAS * min(usual, smoothest)) & (usual > 0.0)
    moving = noisy.copy()
    moving[1:] |= jumped
    moving[:-1] |= jumped
    return moving


class _WindowStatistics(NamedTuple):
    """Mean, variance, and variance about a line of each window; NaN if half-empty."""

    mean: Floats
    variance: Floats
    about_line: Floats

    @classmethod
    def of(cls, windows: Floats) -> _WindowStatistics:
        there = np.isfinite(windows)
        count = np.maximum(there.sum(axis=1), 1)
        mean = _row_means(windows)
        level = np.where(there, windows - mean[:, None], 0.0)
        squares = np.einsum("ij,ij->i", level, level)
        time = np.arange(windows.shape[1]) - (windows.shape[1] - 1) / 2.0
        line = (level @ time) ** 2 / np.maximum(there @ time**2, 1.0)
        # The smallest visible difference is the step of quantisation.
        least = resolution(windows.reshape(-1)) ** 2 / 12.0
        # The variance is NaN wherever the mean is NaN.
        blank = 0.0 * mean
        return cls(
            mean,
            np.maximum(squares / count, least) + blank,
            np.maximum((squares - line) / count, least) + blank,
        )


def _row_means(rows: npt.NDArray[np.generic]) -> Floats:
    """Return the mean of each row, NaN if half of the row or more is missing."""
    totals: Floats = np.asarray(rows.sum(axis=1, dtype=np.float64))
    if np.isfinite(totals).all():
        return np.asarray(totals / rows.shape[1])
    there = np.isfinite(rows)
    count = there.sum(axis=1)
    sums = np.where(there, rows, 0.0).sum(axis=1)
    means: Floats = np.where(2 * count > rows.shape[1], sums / np.maximum(count, 1), np.nan)
    return means


def _robust_sigma(steps: Floats) -> float:
    """Return the standard deviation of Gaussian steps from the median of their sizes."""
    return float(np.median(steps)) / _MEDIAN_OF_NORMAL


def _variance_limit(variance: Floats, width: int) -> float:
    lowest, quiet = np.nanquantile(variance, [0.05, _QUIET_SHARE])
    # The logarithm of a Gaussian noise's variance has a standard deviation of at least sqrt(2 /
    # width).
    spread = max(float(np.log(quiet / lowest)) / _QUANTILE_SPAN, float(np.sqrt(2.0 / width)))
    return float(quiet) * max(float(np.exp(MOTION_SIGMAS * spread)), _MIN_VARIANCE_RATIO)


def _join_spans(moving: Booleans, seconds: float) -> tuple[Span, ...]:
    joined = runs_of_rows(np.flatnonzero(moving), _MIN_REST_WINDOWS)
    return tuple(Span(start, end) for start, end in (joined * seconds).tolist())
