"""Repeated fixes: a receiver's last fix in every row of a table, or a fix sent twice."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.record.fixes import Fixes
from zerorate.types import Booleans, Floats

_MIN_ROWS_PER_FIX: Final = 2.0
"""Smallest median number of rows per fix in a table that holds fixes. In a receiver's own record it
is 1, because fixes repeat at rest only.
"""
_MAX_EARLY_SHARE: Final = 0.5
"""Share of the usual interval within which a repeated fix was sent twice."""


def drop_held_fixes(fixes: Fixes) -> tuple[Fixes, tuple[str, ...]]:
    """Leave out fixes that repeat the fix before.

    Loggers of phones and boards write the receiver's last fix in every row. A fix is then new if
    its position or velocity changes. In a receiver's own record each row is a new fix, except a
    repetition within a fraction of the usual interval.

    Parameters
    ----------
    fixes : Fixes
        Fixes of a receiver, n of them.

    Returns
    -------
    tuple
        Remaining fixes, and a note with the number of excluded fixes.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> from zerorate.checks.held import drop_held_fixes
    >>> east = np.repeat(np.arange(5.0), 10)
    >>> place = np.column_stack((np.full(50, 45.0), 7.0 + 1e-4 * east, np.zeros(50)))
    >>> fixes, notes = drop_held_fixes(zr.Fixes(np.arange(50) / 10.0, place))
    >>> len(fixes), notes
    (5, ('45 of 50 fixes repeat the one before and are left out: a new one comes every 1 s',))
    """
    repeats = _find_repeats(fixes)
    if not repeats.any():
        return fixes, ()
    held = (
        repeats
        if _rows_per_fix(repeats) >= _MIN_ROWS_PER_FIX
        else repeats & _find_early(fixes.time, repeats)
    )
    if not held.any():
        return fixes, ()
    new = fixes.chosen(~held)
    usual = f": a new one comes every {_median_interval(new.time):.3g} s" if len(new) > 1 else ""
    note = f"{held.sum()} of {len(fixes)} fixes repeat the one before and are left out{usual}"
    return replace(new, notes=(*new.notes, note)), (note,)


def _find_repeats(fixes: Fixes) -> Booleans:
    """Return the mask of fixes that repeat the fix before, shape (n,)."""
    same = _equals_previous(fixes.position)
    if fixes.velocity is not None:
        same &= _equals_previous(fixes.velocity)
    return same


def _equals_previous(values: Floats) -> Booleans:
    now, before = values[1:], values[:-1]
    equal = (now == before) | (np.isnan(now) & np.isnan(before))
    return np.concatenate(([False], equal.all(axis=1)))[: len(values)]


def _rows_per_fix(repeats: Booleans) -> float:
    """Return the median number of rows per fix, with repetitions."""
    return float(np.median(np.diff(np.flatnonzero(~repeats), append=len(repeats))))


def _find_early(time: Floats, repeats: Booleans) -> Booleans:
    usual = _median_interval(time[~repeats])
    return np.diff(time, prepend=-np.inf) < _MAX_EARLY_SHARE * usual


def _median_interval(time: Floats) -> float:
    return float(np.median(np.diff(time))) if len(time) > 1 else 0.0
