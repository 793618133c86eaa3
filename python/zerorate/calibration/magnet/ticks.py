"""Ticks of a tenth of a second: mean field in the sensor's axes and in a frame of the gyro."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.types import Booleans, Floats, Integers

TICK_S: Final = 0.1
"""Length of a tick, s."""
_MIN_ROTATION_RMS: Final = 0.3
"""Smallest RMS of R about its mean in a window with rotation."""
_WINDOW_TICKS: Final = 20
"""Number of ticks in a window for the noise."""


@dataclass(frozen=True, eq=False)
class Ticks:
    """Means over n ticks; fields are in units of their median size.

    Parameters
    ----------
    number : ndarray of int, shape (n,)
        Number of each tick since the first sample; ticks without samples are left out.
    rotated_field : ndarray, shape (n, 3)
        Mean of R m. R rotates from the sensor to a frame that the gyro holds.
    rotation : ndarray, shape (n, 3, 3)
        Mean of R.
    field : ndarray, shape (n, 3)
        Mean of m.
    norm : float
        Median size of the samples, in their unit.
    """

    number: Integers
    rotated_field: Floats
    rotation: Floats
    field: Floats
    norm: float

    @property
    def n(self) -> int:
        """Number of ticks with samples."""
        return len(self.number)

    @property
    def inverse_rotation(self) -> Floats:
        """The mean of R transposed: from the frame to the sensor, shape (n, 3, 3)."""
        inverse: Floats = self.rotation.transpose(0, 2, 1)
        return inverse

    def select(self, where: Booleans) -> Ticks:
        """Return some of the ticks."""
        return Ticks(
            self.number[where],
            self.rotated_field[where],
            self.rotation[where],
            self.field[where],
            self.norm,
        )


def average_ticks(seconds: Floats, rotation: Floats, field: Floats) -> Ticks:
    """Return the means of R m, R and m over each tick with half of its usual samples.

    Parameters
    ----------
    seconds : ndarray, shape (n,)
        Times of the samples since the first one, s.
    rotation : ndarray, shape (n, 3, 3)
        Rotation from the sensor to a frame that the gyro holds.
    field : ndarray, shape (n, 3)
        Samples of the magnetometer, NaN where missing.
    """
    present = np.isfinite(field).all(axis=1) & np.isfinite(rotation[:, 0, 0])
    present &= np.any(field != 0.0, axis=1)
    index = np.floor(seconds[present] / TICK_S + 1e-6).astype(np.int64)
    turn, samples = rotation[present], field[present]
    if not len(index):
        empty = np.zeros((0, 3))
        return Ticks(index, empty, np.zeros((0, 3, 3)), empty, 1.0)
    norm = float(np.median(np.linalg.norm(samples, axis=1)))
    samples = samples / norm
    first = np.flatnonzero(np.diff(index, prepend=-1))
    count = np.diff(first, append=len(index))

    def mean(values: Floats) -> Floats:
        total: Floats = np.add.reduceat(values.reshape(len(values), -1), first, axis=0)
        return total / count[:, None]

    enough = 2 * count >= np.median(count)
    ticks = Ticks(
        index[first],
        mean((turn @ samples[:, :, None])[:, :, 0]),
        mean(turn).reshape(-1, 3, 3),
        mean(samples),
        norm,
    )
    return ticks.select(enough)


def estimate_noise(ticks: Ticks) -> float:
    """Return the variance of an axis of a tick, from windows with rotation.

    It is a low quantile over the windows, because disturbances increase the variance.
    """
    variances = []
    for start in range(0, ticks.n - _WINDOW_TICKS + 1, _WINDOW_TICKS):
        part = slice(start, start + _WINDOW_TICKS)
        turn = ticks.rotation[part] - ticks.rotation[part].mean(axis=0)
        if np.sqrt((turn**2).sum() / _WINDOW_TICKS) < _MIN_ROTATION_RMS:
            continue
        deviations = ticks.rotated_field[part] - ticks.rotated_field[part].mean(axis=0)
        rows, values = turn.reshape(-1, 3), deviations.ravel()
        normal = rows.T @ rows + 1e-9 * np.eye(3)
        residuals = values - rows @ np.linalg.solve(normal, rows.T @ values)
        variances.append(float(residuals @ residuals) / (3 * _WINDOW_TICKS - 6))
    if not variances:
        return 0.02**2
    return max(float(np.quantile(variances, 0.4)), 0.005**2)
