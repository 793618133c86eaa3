"""Stamps in whole seconds: the rows of each second are spread evenly over it."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.clocks.clock import roundest
from zerorate.record.log import LogError
from zerorate.types import Floats, Integers

_MIN_ROWS: Final = 3
"""Smallest number of rows per second for stamps to count as coarse."""
_MIN_CHANGES: Final = 2
"""Smallest number of changes of the second: between them lies one whole second."""
_NEAR: Final = 0.1
"""Largest relative difference in rows between seconds without a fault."""


def spread(seconds: Floats, place: Integers | None = None) -> tuple[Floats, str] | None:
    """Return the times of rows with stamps in whole seconds, and a note; None for other stamps.

    ``place`` is the index of each row, with lost rows counted, shape (n,).

    Raises
    ------
    LogError
        If the log contains no whole second in which rows could be counted.
    """
    if 0 < _changes(seconds) < _MIN_CHANGES:
        lacking = "the stamps are whole seconds, and no whole second lies inside the log; give "
        no_time = keyword_argument("time", "none", "time=False")
        raise LogError(make_sentence(lacking, keyword_argument("rate"), " in Hz and ", no_time))
    if not in_whole_seconds(seconds):
        return None
    edges = np.flatnonzero(np.diff(seconds)) + 1
    place = np.arange(len(seconds)) if place is None else place
    rate = _rate(seconds, place, edges)
    note = f"the stamps are whole seconds: rows are spread in them, {rate:.6g} a second"
    phase = place[edges] / rate - seconds[edges]
    if np.ptp(phase) <= 1.0 / rate * (1.0 + 1e-9):
        return (place - place[edges[0]]) / rate + seconds[edges[0]], note
    # A stamp or rows were lost: spread each second separately, the first one from its end.
    first = np.zeros(len(seconds), np.int64)
    first[edges] = edges
    first = np.maximum.accumulate(first)
    inside = (place - place[first]) / rate
    inside[: edges[0]] += 1.0 - edges[0] / rate
    return seconds + np.minimum(inside, 1.0 - 1e-6), note


def in_whole_seconds(seconds: Floats) -> bool:
    """Return True if the stamps are whole seconds with several rows each."""
    return _changes(seconds) >= _MIN_CHANGES


def _changes(seconds: Floats) -> int:
    """Return the number of changes of the second; 0 if stamps are not whole seconds."""
    steps = np.diff(seconds)
    changes = np.count_nonzero(steps)
    coarse = changes > 0 and len(seconds) > _MIN_ROWS * (changes + 1)
    whole = coarse and (steps >= 0).all() and (np.rint(steps) == steps).all()
    return int(changes) if whole else 0


def _rate(seconds: Floats, place: Integers, edges: Integers) -> float:
    """Return the roundest number of rows per second that agrees with the complete seconds."""
    rows, long = np.diff(place[edges]), np.diff(seconds[edges])
    usual = float(np.median(rows / long))
    good = np.abs(rows / long - usual) <= max(1.0, _NEAR * usual)
    rows, long = rows[good], long[good]
    doubt = 1.0 / rows.sum()
    return roundest(float(long.sum() / rows.sum()), float(doubt))
