"""Comparison of methods on recordings, kind by kind."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.compare.measures import Row
from zerorate.compare.methods import METHODS
from zerorate.compare.orientation import orientation_rows
from zerorate.compare.rest import rest_notes, rest_rows
from zerorate.compare.trial import Kind, Orientation, Trial
from zerorate.compare.turning import fitted, turning_rows
from zerorate.io import Recording
from zerorate.io.log import notes_of
from zerorate.progress import Progress, silent

__all__ = ["Comparison", "compare"]


_KINDS: Final[tuple[Kind, ...]] = ("rest", "turning", "orientation")


@dataclass(frozen=True)
class Comparison:
    """All recordings of one kind.

    Attributes
    ----------
    kind : str
        ``"rest"``, ``"turning"`` or ``"orientation"``.
    rows : tuple of Row
        Recording by recording, axis by axis, method by method.
    notes : tuple of str
        Sentences on the recordings.
    """

    kind: Kind
    rows: tuple[Row, ...]
    notes: tuple[str, ...]

    @property
    def methods(self) -> tuple[str, ...]:
        """The methods in their order."""
        return tuple(dict.fromkeys(row.method for row in self.rows))


def compare(
    recordings: Sequence[Recording | Trial],
    methods: Sequence[str] = METHODS,
    progress: Progress | None = None,
) -> tuple[Comparison, ...]:
    """Measure every method on every recording.

    Parameters
    ----------
    recordings : sequence of Recording or Trial
        Of any kinds: `zerorate.read_recording` or `read_trial` gives them.
    methods : sequence of str
        ``"raw"``, ``"mean"`` (the running mean), ``"ema"`` (the best exponential moving average in
        hindsight) and methods of `zerorate.DriftFilter`, which run with the defaults of the command
        line: "auto" with the limits of what rest can be, where the unit is known.
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
    trials = [one if isinstance(one, Trial) else Trial.of(one) for one in recordings]
    report = _Report(trials, len(listed), silent if progress is None else progress)
    found = []
    # Numbers near the largest double overflow when squared: the measure is then infinite.
    with np.errstate(over="ignore", invalid="ignore"):
        for kind in _KINDS:
            own = [trial for trial in trials if trial.kind == kind]
            if own:
                found.append(_compared(kind, own, listed, report))
    return tuple(found)


def _compared(
    kind: Kind, recordings: list[Trial], methods: list[str], report: "_Report"
) -> Comparison:
    rows: list[Row] = []
    notes: list[str] = []
    for recording in recordings:
        said = (f"{recording.source}: {note}" for note in notes_of(recording.log))
        notes.extend(said)
        for one in _measured(recording, methods, notes):
            rows.append(one)
            report.one_more()
    return Comparison(kind, tuple(rows), tuple(notes))


def _measured(recording: Trial, methods: list[str], notes: list[str]) -> Iterator[Row]:
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

    def __init__(self, recordings: Sequence[Trial], methods: int, progress: Progress) -> None:
        axes = (one.log.channels if one.kind == "rest" else 1 for one in recordings)
        self._total, self._done, self._progress = methods * sum(axes), 0, progress

    def one_more(self) -> None:
        self._done += 1
        self._progress("comparing", min(1.0, self._done / self._total))
