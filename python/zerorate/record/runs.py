"""Runs of consecutive samples with a common property."""

import numpy as np

from zerorate.types import Booleans, Integers

__all__ = ["runs", "runs_of_rows"]


def runs(mask: Booleans) -> Integers:
    """Return the first index of each run of True and the index after its last, shape (m, 2)."""
    return np.flatnonzero(np.diff(mask, prepend=False, append=False)).reshape(-1, 2)


def runs_of_rows(rows: Integers, max_step: int = 1) -> Integers:
    """Return the first row of each run of increasing rows and the row after its last, shape (m, 2).

    Rows in one run are at most `max_step` apart.
    """
    last = np.flatnonzero(np.diff(rows) > max_step)
    firsts = np.append(rows[:1], rows[last + 1])
    return np.column_stack((firsts, np.append(rows[last], rows[-1:]) + 1))
