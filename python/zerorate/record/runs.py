"""Runs: samples next to each other for which something holds."""

import numpy as np

from zerorate.types import Booleans, Integers

__all__ = ["runs", "runs_of_rows"]


def runs(mask: Booleans) -> Integers:
    """Return the first sample of each run of True, and the one after its last, shape (m, 2)."""
    return np.flatnonzero(np.diff(mask, prepend=False, append=False)).reshape(-1, 2)


def runs_of_rows(rows: Integers, max_step: int = 1) -> Integers:
    """Return the first row of each run of rising rows, and the one after its last, shape (m, 2).

    Rows at most so many apart are in one run.
    """
    last = np.flatnonzero(np.diff(rows) > max_step)
    firsts = np.append(rows[:1], rows[last + 1])
    return np.column_stack((firsts, np.append(rows[last], rows[-1:]) + 1))
