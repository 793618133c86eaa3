"""Ticks of a tenth of a second: the field in the sensor, and turned into a frame of the gyro."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.types import Booleans, Floats, Integers

TICK: Final = 0.1
"""Seconds."""
_TURNS: Final = 0.3
"""RMS of R about its mean in a window that turns."""
_WINDOW: Final = 20
"""Ticks of a window that tells the noise."""


@dataclass(frozen=True, eq=False)
class Ticks:
    """Means of n ticks, fields in units of their median size.

    Parameters
    ----------
    number : ndarray of int, shape (n,)
        Which tick since the first sample: those without samples are left out.
    turned : ndarray, shape (n, 3)
        Mean of R m, R from the sensor to a frame that the gyro holds.
    rotation : ndarray, shape (n, 3, 3)
        Mean of R.
    field : ndarray, shape (n, 3)
        Mean of m.
    norm : float
        Median size of the samples, in their unit.
    """

    number: Integers
    turned: Floats
    rotation: Floats
    field: Floats
    norm: float

    @property
    def n(self) -> int:
        """Number of ticks that have samples."""
        return len(self.number)

    @property
    def back(self) -> Floats:
        """The mean of R transposed: from the frame to the sensor, shape (n, 3, 3)."""
        back: Floats = self.rotation.transpose(0, 2, 1)
        return back

    def only(self, where: Booleans) -> Ticks:
        """Return some of the ticks."""
        return Ticks(
            self.number[where],
            self.turned[where],
            self.rotation[where],
            self.field[where],
            self.norm,
        )


def ticks_of(seconds: Floats, rotation: Floats, field: Floats) -> Ticks:
    """Return the means of R m, R and m over each tick that has half of its usual samples.

    Parameters
    ----------
    seconds : ndarray, shape (n,)
        Of the samples, since the first.
    rotation : ndarray, shape (n, 3, 3)
        From the sensor to a frame that the gyro holds.
    field : ndarray, shape (n, 3)
        The magnetometer, NaN where it has no sample.
    """
    present = np.isfinite(field).all(axis=1) & np.isfinite(rotation[:, 0, 0])
    present &= np.any(field != 0.0, axis=1)
    place = np.floor(seconds[present] / TICK + 1e-6).astype(np.int64)
    turn, samples = rotation[present], field[present]
    if not len(place):
        none = np.zeros((0, 3))
        return Ticks(place, none, np.zeros((0, 3, 3)), none, 1.0)
    norm = float(np.median(np.linalg.norm(samples, axis=1)))
    samples = samples / norm
    first = np.flatnonzero(np.diff(place, prepend=-1))
    count = np.diff(first, append=len(place))

    def mean(values: Floats) -> Floats:
        total: Floats = np.add.reduceat(values.reshape(len(values), -1), first, axis=0)
        return total / count[:, None]

    enough = 2 * count >= np.median(count)
    found = Ticks(
        place[first],
        mean((turn @ samples[:, :, None])[:, :, 0]),
        mean(turn).reshape(-1, 3, 3),
        mean(samples),
        norm,
    )
    return found.only(enough)


def noise_of(ticks: Ticks) -> float:
    """Return the variance of an axis of a tick, from windows in which the sensor turns.

    A low quantile of the windows counts: those with a disturbance lie above.
    """
    found = []
    for start in range(0, ticks.n - _WINDOW + 1, _WINDOW):
        part = slice(start, start + _WINDOW)
        turn = ticks.rotation[part] - ticks.rotation[part].mean(axis=0)
        if np.sqrt((turn**2).sum() / _WINDOW) < _TURNS:
            continue
        seen = ticks.turned[part] - ticks.turned[part].mean(axis=0)
        rows, values = turn.reshape(-1, 3), seen.ravel()
        normal = rows.T @ rows + 1e-9 * np.eye(3)
        left = values - rows @ np.linalg.solve(normal, rows.T @ values)
        found.append(float(left @ left) / (3 * _WINDOW - 6))
    if not found:
        return 0.02**2
    return max(float(np.quantile(found, 0.4)), 0.005**2)
