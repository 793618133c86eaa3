"""Processing of the samples, without ROS."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from statistics import median

import numpy as np

import zerorate as zr
from zerorate.noise import MotionDetector

FIRST = 100
"""Number of messages for the rate: a second at most rates, and longer than any jitter."""

GAP_MOST = 60.0
"""Longest gap that is filled with missing samples, s; a longer gap is a new start."""


@dataclass(frozen=True)
class Sample:
    """A message: time, s, rate, rad/s, and acceleration, m/s² (None if the message has none)."""

    time: float
    gyro: tuple[float, float, float]
    accel: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Answer:
    """State after a sample, in rad/s and rad."""

    rate: np.ndarray
    """Compensated rate, (3,); NaN if the sample is missing."""
    variance: np.ndarray
    """Variance of each axis, (rad/s)²: white noise and uncertainty of the bias; NaN while the noise
    is unknown."""
    bias: np.ndarray
    bias_sigma: np.ndarray
    quaternion: np.ndarray | None = None
    """Quaternion x, y, z, w from the sensor's axes to east, north, up; None without an attitude."""
    tilt_sigma: float = float("nan")
    heading_sigma: float = float("nan")


@dataclass
class Counts:
    """Numbers of irregularities since the start."""

    lost: int = 0
    """Samples that are missing according to the time stamps."""
    late: int = 0
    """Messages that are not later than the previous message; they are left out."""
    restarts: int = 0
    """Gaps after which everything started again."""


@dataclass
class Compensator:
    """Bias of an IMU's gyro, learned at rest and removed, and the attitude.

    Parameters
    ----------
    options : mapping
        Options of `zerorate.DriftFilter`, in rad/s.
    rate : float
        Sampling rate, Hz. 0 takes it from the time stamps of the first messages.
    attitude : bool
        True computes the orientation.

    Raises
    ------
    ValueError
        If an option is out of range.
    """

    options: Mapping[str, float | str]
    rate: float = 0.0
    attitude: bool = True
    counts: Counts = field(default_factory=Counts)

    def __post_init__(self) -> None:
        """Check the options now, not at the first message."""
        self._gyro: zr.DriftFilter | None = None
        self._first: list[float] = []
        self._last: float | None = None
        self._known: bytes | None = None
        zr.DriftFilter(self.rate or 1.0, channels=3, **self.options)
        if self.rate:
            self._begin()

    @property
    def gyro(self) -> zr.DriftFilter | None:
        """The drift filter, once the rate is known."""
        return self._gyro

    def take(self, sample: Sample) -> Answer | None:
        """Process a message; return the state, or None while the rate is unknown."""
        if self._last is not None and sample.time <= self._last:
            self.counts.late += 1
            return None
        if self._gyro is None and not self._learn_rate(sample.time):
            return None
        lost = self._lost(sample.time)
        self._last = sample.time
        for _ in range(lost):
            self._step((np.nan,) * 3, (np.nan,) * 3)
        accel = (np.nan,) * 3 if sample.accel is None else sample.accel
        return self._step(sample.gyro, accel)

    def save(self) -> bytes | None:
        """Return the drift filter as bytes; None while the rate is unknown."""
        return None if self._gyro is None else self._gyro.to_bytes()

    def restore(self, saved: bytes) -> None:
        """Restore the noise of an earlier run; the bias is learned again after power-off.

        Raises
        ------
        ValueError
            If the bytes are not a saved drift filter.
        """
        zr.DriftFilter.from_bytes(saved)
        self._known = saved
        if self._gyro is not None:
            self._begin()

    def _learn_rate(self, time: float) -> bool:
        self._first.append(time)
        if len(self._first) < FIRST:
            return False
        self.rate = 1.0 / median(np.diff(self._first))
        self._begin()
        return True

    def _begin(self) -> None:
        self._gyro = zr.DriftFilter(self.rate, channels=3, **self.options)
        if self._known is not None:
            known = zr.DriftFilter.from_bytes(self._known)
            # With another rate or other options, nothing is restored.
            if (known.rate, known.params) == (self._gyro.rate, self._gyro.params):
                known.power_on()
                self._gyro = known
        self._motion = MotionDetector(self.rate)
        self._attitude = zr.Attitude(self.rate, mag=False) if self.attitude else None

    def _lost(self, time: float) -> int:
        """Return the number of samples lost between the last message and this message."""
        if self._last is None:
            return 0
        span = time - self._last
        if span > GAP_MOST:
            self._known = self.save()
            self._begin()
            self.counts.restarts += 1
            return 0
        lost = max(round(span * self.rate) - 1, 0)
        self.counts.lost += lost
        return lost

    def _step(self, gyro: tuple[float, ...], accel: tuple[float, ...]) -> Answer:
        moving = self._motion.update(accel)
        rate = self._gyro.update(gyro, moving=moving)
        noise = self._gyro.angle_random_walk
        sigma = self._gyro.bias_sigma
        answer = {
            "rate": np.asarray(rate),
            "variance": np.asarray(noise) ** 2 * self.rate + np.asarray(sigma) ** 2,
            "bias": np.asarray(self._gyro.bias),
            "bias_sigma": np.asarray(sigma),
        }
        if self._attitude is not None:
            w, x, y, z = self._attitude.update(gyro, accel)
            answer |= {
                "quaternion": np.array([x, y, z, w]),
                "tilt_sigma": float(self._attitude.tilt_sigma),
                "heading_sigma": float(self._attitude.heading_sigma),
            }
        return Answer(**answer)
