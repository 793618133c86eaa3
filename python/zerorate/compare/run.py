"""Recordings through all methods, kind by kind."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from zerorate.compare.methods import METHODS
from zerorate.compare.orientation import orientation_rows
from zerorate.compare.recording import Kind, Orientation, Recording
from zerorate.compare.rest import rest_notes, rest_rows
from zerorate.compare.result import Comparison, Row
from zerorate.compare.turning import fitted, turning_rows
from zerorate.progress import Progress, silent

__all__ = ["compare"]

_KINDS: Final[tuple[Kind, ...]] = ("rest", "turning", "orientation")


def compare(
    recordings: Sequence[Recording],
    methods: Sequence[str] = METHODS,
    progress: Progress | None = None,
) -> tuple[Comparison, ...]:
    """Measure every method on every recording.

    Parameters
    ----------
    recordings : sequence of Recording
        Of any kinds.
    methods : sequence of str
        ``"raw"``, ``"mean"`` (the running mean), ``"ema"`` (the best exponential moving average in
        hindsight) and methods of `zerorate.DriftFilter`, which run with their defaults.
    progress : callable, optional
        Called with a step's name and the fraction of it that is done.

    Returns
    -------
    tuple of Comparison
        One a kind that occurs.

    Raises
    ------
    LogError
        If a recording does not allow what its kind asks for.
    ValueError
        If a method is not known.
    """
    listed = list(methods)
    if not listed or len(set(listed)) < len(listed):
        raise ValueError(f"methods must be at least one and all different, got {listed}")
    report = _Report(recordings, len(listed), silent if progress is None else progress)
    found = []
    # Numbers near the largest double overflow when squared: the answer is then infinite.
    with np.errstate(over="ignore", invalid="ignore"):
        for kind in _KINDS:
            own = [recording for recording in recordings if recording.kind == kind]
            if own:
                found.append(_compared(kind, own, listed, report))
    return tuple(found)


def _compared(
    kind: Kind, recordings: list[Recording], methods: list[str], report: "_Report"
) -> Comparison:
    rows: list[Row] = []
    notes: list[str] = []
    for recording in recordings:
        said = (f"{recording.source}: {note}" for note in recording.log.meta.get("notes", ()))
        notes.extend(said)
        for one in _measured(recording, methods, notes):
            rows.append(one)
            report.one_more()
    return Comparison(kind, tuple(rows), tuple(notes))


def _measured(recording: Recording, methods: list[str], notes: list[str]) -> Iterator[Row]:
    if recording.reference is None:
        recording.check_axes()
    if recording.orientation is not None:
        notes.append(_on_orientation(recording.source, recording.orientation))
        return orientation_rows(recording, recording.orientation, methods)
    if recording.reference is not None:
        match = fitted(recording, recording.reference)
        notes.append(match.note(recording.source, recording.reference.name))
        return turning_rows(recording, match, methods)
    notes.extend(rest_notes(recording))
    return rest_rows(recording, methods)


def _on_orientation(source: str, truth: Orientation) -> str:
    return f"{source}: the reference is the orientation in {', '.join(truth.names)}"


class _Report:
    """How much of the work is done."""

    def __init__(self, recordings: Sequence[Recording], methods: int, progress: Progress) -> None:
        axes = (one.log.channels if one.kind == "rest" else 1 for one in recordings)
        self._total, self._done, self._progress = methods * sum(axes), 0, progress

    def one_more(self) -> None:
        self._done += 1
        self._progress("comparing", min(1.0, self._done / self._total))
