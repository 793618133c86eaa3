"""Errors in orientation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from zerorate.io.missing import floats
from zerorate.metrics import rotations
from zerorate.metrics.channels import positive
from zerorate.types import Floats, Integers
from zerorate.units import whole_samples

__all__ = ["orientation_error_growth"]


def orientation_error_growth(
    rates: npt.ArrayLike,
    quaternions: npt.ArrayLike,
    rate: float,
    horizons: Sequence[float] = (1.0, 10.0, 60.0),
    every: float = 0.5,
) -> Floats:
    """Return how far integrated rates turn away from a reference within each horizon.

    Every `every` seconds the integration starts at the reference's orientation; after the horizon
    the angle between both is noted, and its mean taken over all starts. It is what a user of
    angular rates pays, in motion, for bias, scale, misalignment and lateness together, and noise
    hardly counts. A reference mounted askew adds an error that no filter can remove.

    Parameters
    ----------
    rates : array_like, shape (n, 3)
        Angular rates about the sensor's axes, rad/s; the sample at each time is that of the
        interval which ends there.
    quaternions : array_like, shape (n, 4)
        Reference orientation w, x, y, z, from sensor to world, of any length.
    rate : float
        Samples per second, Hz.
    horizons : sequence of float, default 1, 10 and 60
        Seconds, rounded to whole samples.
    every : float, default 0.5
        Seconds from start to start.

    Returns
    -------
    ndarray, shape of `horizons`
        Angles in rad. Starts whose reference is missing at either end, or whose window misses a
        rate, are left out.

    Raises
    ------
    ValueError
        If a shape is wrong, an argument is not positive and finite, a horizon is less than half a
        sample or not shorter than the record, or no window is complete.

    Examples
    --------
    >>> still = np.tile([1.0, 0.0, 0.0, 0.0], (1001, 1))
    >>> wrong = np.tile([0.0, 0.0, 0.01], (1001, 1))
    >>> orientation_error_growth(wrong, still, rate=10.0, horizons=(1.0, 60.0)).round(12).tolist()
    [0.01, 0.6]
    """
    w, reference = _of_width("rates", rates, 3), _of_width("quaternions", quaternions, 4)
    if len(w) != len(reference):
        raise ValueError(
            f"rates and quaternions must be of one length, got {len(w)} and {len(reference)}"
        )
    hertz = positive("rate", rate)
    step = max(1, whole_samples(positive("every", every), hertz))
    missing = np.any(~np.isfinite(w), axis=1)
    vectors = np.where(missing[:, np.newaxis], 0.0, w / hertz)
    turned = rotations.cumulative_product(rotations.of_rotation_vectors(vectors))
    wrong = _Integrated(turned, rotations.unit(reference), np.cumsum(missing))
    return np.array([wrong.after(_samples(h, hertz, len(w)), h, step) for h in horizons])


class _Integrated:
    """Orientations made of rates, the reference, and how many rates were missing so far."""

    def __init__(self, turned: Floats, reference: Floats, gaps: Integers) -> None:
        self._turned, self._reference, self._gaps = turned, reference, gaps

    def after(self, m: int, horizon: float, step: int) -> float:
        """Return the mean angle after m samples, of starts so many samples apart."""
        now = np.arange(0, len(self._turned) - m, step)
        gyro, true = (_between(q, now, now + m) for q in (self._turned, self._reference))
        angles = rotations.angle(rotations.product(rotations.inverse(true), gyro))
        whole = np.isfinite(angles) & (self._gaps[now] == self._gaps[now + m])
        if not whole.any():
            raise ValueError(f"no window of {horizon:g} s has its reference and all its rates")
        return float(angles[whole].mean())


def _between(q: Floats, start: npt.NDArray[np.intp], end: npt.NDArray[np.intp]) -> Floats:
    return rotations.product(rotations.inverse(q[start]), q[end])


def _of_width(name: str, data: npt.ArrayLike, width: int) -> Floats:
    array = floats(data, name)
    if array.ndim != 2 or array.shape[1] != width or array.size == 0:
        raise ValueError(f"{name} must have shape (n, {width}), got {array.shape}")
    return array


def _samples(horizon: float, rate: float, n: int) -> int:
    m = whole_samples(positive("horizon", horizon), rate)
    if not 1 <= m < n:
        raise ValueError(
            f"a horizon of {horizon} s is {m} samples: it must be at least 1 and less than the "
            f"record's {n}"
        )
    return m
