"""Motion in a record that should be at rest."""

from typing import Final, NamedTuple

import numpy as np

from zerorate.types import Floats

__all__ = ["MOVED", "Step", "largest_step"]

MOVED: Final = 8.0
"""Size of a step, over the usual one, from which on a record is taken to have moved.

At rest the largest of 10 000 is 4.5 for Gaussian noise of any colour; recordings at rest reach 4.5
beside a running motor 5.3; those that turn begin at 10.8.
"""

_LEAST_SECONDS: Final = 20
_MEDIAN_OF_NORMAL: Final = 0.6744897501960817


class Step(NamedTuple):
    """A change between the means of two successive seconds, over the usual one, and its time."""

    size: float
    time: float


def largest_step(z: Floats, rate: float) -> Step:
    """Return the largest change from one second's mean to the next.

    Drift is slow and noise is Gaussian, so the changes of a sensor at rest are much alike; those of
    one that is moved now and then are not. Motion that goes on without a pause is not seen.

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
    width = max(round(rate), 1)
    seconds = z[: len(z) // width * width].reshape(-1, width)
    changes = np.diff(_means(seconds))
    present = np.abs(changes[np.isfinite(changes)])
    usual = float(np.median(present)) / _MEDIAN_OF_NORMAL if present.size else 0.0
    if present.size < _LEAST_SECONDS or usual == 0.0:
        return Step(0.0, 0.0)
    place = int(np.nanargmax(np.abs(changes)))
    return Step(float(abs(changes[place])) / usual, (place + 1) * width / rate)


def _means(rows: Floats) -> Floats:
    """Return the mean of each row, NaN where half of it or more is missing."""
    there = np.isfinite(rows)
    count = there.sum(axis=1)
    sums = np.where(there, rows, 0.0).sum(axis=1)
    return np.where(2 * count > rows.shape[1], sums / np.maximum(count, 1), np.nan)
