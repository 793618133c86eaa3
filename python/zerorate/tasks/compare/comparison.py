"""Comparison of methods on recordings, kind by kind."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.progress import Progress, choose_reporter
from zerorate.record import Recording
from zerorate.record.log import notes_of
from zerorate.simulation import Contamination
from zerorate.tasks.compare.measures import Row, add_degradation
from zerorate.tasks.compare.methods import METHODS, MethodSpec, resolve_methods
from zerorate.tasks.compare.orientation import orientation_rows
from zerorate.tasks.compare.own_method import OwnMethod, prefix_errors
from zerorate.tasks.compare.rest import rest_notes, rest_rows, scored_axes
from zerorate.tasks.compare.trial import Kind, Orientation, Trial
from zerorate.tasks.compare.turning import fit_reference, turning_rows
from zerorate.types import Floats
from zerorate.views import Result

Evaluator = Callable[[Sequence[MethodSpec], Floats], Iterator[Row]]
"""Function of methods and input samples, shape (n, k); it yields rows."""

_SEED: Final = 1

_KINDS: Final[tuple[Kind, ...]] = ("rest", "turning", "orientation")


@dataclass(frozen=True)
class Comparison(Result):
    """Measures of methods on all recordings of one kind, clean or contaminated.

    Attributes
    ----------
    kind : str
        ``"rest"``, ``"turning"`` or ``"orientation"``; ``"attitude"`` from `compare_attitude`.
    rows : tuple of Row
        Rows by recording, then axis, then method.
    notes : tuple of str
        Sentences on the recordings.
    contamination : Contamination or None
        Contamination added to the recordings. Errors are relative to the clean recording. The
        measure ``NAME_degradation`` is the error ``NAME`` divided by the same error on the clean
        recording.

    Examples
    --------
    >>> import zerorate as zr
    >>> recording = zr.simulate_motion("hand", duration=30.0, seed=1).recording()
    >>> (found,) = zr.tasks.compare.compare_methods([recording], ["raw", "auto"])
    >>> found.kind, found.methods, len(found.rows)
    ('orientation', ('raw', 'first rest', 'auto'), 3)
    """

    kind: Kind
    rows: tuple[Row, ...]
    notes: tuple[str, ...]
    contamination: Contamination | None = None

    @property
    def methods(self) -> tuple[str, ...]:
        """Methods in the order of the rows."""
        return tuple(dict.fromkeys(row.method for row in self.rows))


def compare_methods(
    recordings: Sequence[Recording | Trial],
    methods: Sequence[str | OwnMethod | Callable[..., Any]] = METHODS,
    progress: Progress | None = None,
    contaminate: str | Contamination | Sequence[str | Contamination] = (),
) -> tuple[Comparison, ...]:
    """Measure every method on every recording.

    Parameters
    ----------
    recordings : sequence of Recording or Trial
        Recordings of any kind, from `zerorate.read_recording` or `read_trial`.
    methods : sequence of str, OwnMethod or callable
        ``"raw"``, ``"mean"`` (running mean) and ``"ema"`` (exponential moving average, the best in
        hindsight). Also methods of `zerorate.DriftFilter`, with the settings of the command line.
        If the unit is known, "auto" has limits of rest. Append ``+hold`` to learn only at rest, and
        ``+reject`` to reject outliers. Two methods use the whole recording: ``"wu-ran"`` (robust
        filter, then wavelet) and ``"visushrink"``. Your own methods are functions or classes (see
        `OwnMethod`), or ``"name=module:function"``. They also run on the first half of each axis.
        If the results differ from the results of the whole axis, the method uses later samples, and
        its rows say so.
    progress : callable, optional
        Called with the name of the step and the fraction done. By default a notebook shows a bar.
    contaminate : str, zerorate.simulation.Contamination, or a sequence of these
        Faults such as ``"share=0.01,size=100"``. Each fault gives a separate comparison: it is
        added to every recording. Random numbers are seeded, so results are reproducible. The best
        moving average keeps its gain from the clean recording.

    Returns
    -------
    tuple of Comparison
        One comparison for each kind of recording, followed by the comparisons of its contaminated
        recordings.

    Raises
    ------
    LogError
        If a recording lacks data that its kind of comparison needs.
    ValueError
        If a method, or a name in a contamination, is unknown.
    MethodError
        If your own method fails, or does not return one finite number per sample.

    Examples
    --------
    >>> import zerorate as zr
    >>> recording = zr.simulate_motion("hand", duration=30.0, seed=1).recording()
    >>> (found,) = zr.tasks.compare.compare_methods([recording], ["raw", "auto"])
    >>> error = {row.method: row.values["growth_10"] for row in found.rows}  # rad after 10 s
    >>> error["auto"] < error["raw"]
    True
    """
    faults = _parse_faults(contaminate)
    listed = resolve_methods(methods)
    trials = [
        recording if isinstance(recording, Trial) else Trial.of(recording)
        for recording in recordings
    ]
    runs = len(listed) * (1 + len(faults))
    report = _RowProgress(trials, runs, choose_reporter(progress))
    comparisons = []
    # Squares of numbers near the largest double overflow; the measure is then infinite.
    with np.errstate(over="ignore", invalid="ignore"):
        for kind in _KINDS:
            kind_trials = [trial for trial in trials if trial.kind == kind]
            if kind_trials:
                comparisons += _compare_kind(kind, kind_trials, listed, faults, report)
    return tuple(comparisons)


def _parse_faults(
    contaminations: str | Contamination | Sequence[str | Contamination],
) -> list[Contamination]:
    listed = [contaminations] if isinstance(contaminations, str | Contamination) else contaminations
    faults = [Contamination.parse(fault) if isinstance(fault, str) else fault for fault in listed]
    if len(set(faults)) < len(faults):
        raise ArgumentError(
            "contaminations", f"must all be different, got {', '.join(map(str, faults))}"
        )
    return faults


def _compare_kind(
    kind: Kind,
    recordings: list[Trial],
    methods: list[MethodSpec],
    faults: list[Contamination],
    report: _RowProgress,
) -> list[Comparison]:
    notes: list[str] = []
    clean: list[Row] = []
    faulty_rows: list[list[Row]] = [[] for _ in faults]
    for recording in recordings:
        notes.extend(
            f"{recording.source}: {note}" for note in notes_of(recording.log, evenly_spaced=True)
        )
        evaluate = _make_evaluator(recording, notes)
        with prefix_errors(recording.source):
            clean_rows = list(report.count_rows(evaluate(methods, recording.log.data)))
            for rows, fault in zip(faulty_rows, faults, strict=True):
                faulty_data = fault.apply(recording.log.data, recording.log.rate, _SEED)
                rows += map(
                    add_degradation, report.count_rows(evaluate(methods, faulty_data)), clean_rows
                )
        clean += clean_rows
    return [
        Comparison(kind, tuple(clean), tuple(notes)),
        *(
            Comparison(kind, tuple(rows), (), fault)
            for rows, fault in zip(faulty_rows, faults, strict=True)
        ),
    ]


def _make_evaluator(recording: Trial, notes: list[str]) -> Evaluator:
    """Return a function that evaluates methods on a recording; notes are appended to `notes`."""
    if recording.reference is None:
        recording.check_axes()
    if recording.orientation is not None:
        notes.append(_orientation_note(recording.source, recording.orientation))
        return partial(orientation_rows, recording, recording.orientation)
    if recording.reference is not None:
        match = fit_reference(recording, recording.reference)
        notes.append(match.note(recording.source, recording.reference.name))
        return partial(turning_rows, recording, match)
    notes.extend(rest_notes(recording))
    return partial(rest_rows, recording, scored_axes(recording))


def _orientation_note(source: str, truth: Orientation) -> str:
    return f"{source}: the reference is the orientation in {', '.join(truth.names)}"


class _RowProgress:
    """Progress of the comparison."""

    def __init__(self, recordings: Sequence[Trial], runs: int, progress: Progress) -> None:
        axes = (trial.log.channels if trial.kind == "rest" else 1 for trial in recordings)
        self._total, self._done, self._progress = runs * sum(axes), 0, progress

    def count_rows(self, rows: Iterable[Row]) -> Iterator[Row]:
        """Yield rows, and report each row."""
        for row in rows:
            self._done += 1
            self._progress("comparing", min(1.0, self._done / self._total))
            yield row
