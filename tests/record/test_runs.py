"""Runs of a mask and of row numbers, against a walk over them sample by sample."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from zerorate.record.runs import runs, runs_of_rows


def walked(rows, apart=1):
    """Return the runs of rising rows one by one."""
    found = []
    for row in rows:
        if found and row - (found[-1][1] - 1) <= apart:
            found[-1][1] = row + 1
        else:
            found.append([row, row + 1])
    return found


@given(st.lists(st.booleans(), max_size=40), st.integers(1, 6))
def test_runs_are_those_of_a_walk(flags, apart):
    mask = np.array(flags, dtype=bool)
    rows = np.flatnonzero(mask)
    assert runs(mask).tolist() == walked(rows.tolist())
    assert runs_of_rows(rows, apart).tolist() == walked(rows.tolist(), apart)


def test_nothing_has_no_runs():
    nothing = np.zeros(0, dtype=np.int64)
    assert runs(nothing.astype(bool)).shape == runs_of_rows(nothing).shape == (0, 2)
