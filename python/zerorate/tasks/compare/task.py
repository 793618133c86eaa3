"""Comparison of many methods on recordings and simulated gyros: ``zerorate compare``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Unpack

from zerorate.checks.preparation import AS_MEASURED_CHOICES, prepare
from zerorate.faults import ArgumentError, sentence_of
from zerorate.geometry.frames import Frame
from zerorate.progress import Progress, choose_reporter
from zerorate.record.log import Log, LogError, drop_empty_channels
from zerorate.record.recording import Recording
from zerorate.simulation import Contamination
from zerorate.tasks.compare.as_json import as_json
from zerorate.tasks.compare.attitude import (
    ATTITUDE_METHODS,
    check_attitude_methods,
    compare_attitude,
)
from zerorate.tasks.compare.comparison import Comparison, compare_methods
from zerorate.tasks.compare.measures import Row
from zerorate.tasks.compare.methods import METHODS, MethodSpec, name_of, resolve_methods
from zerorate.tasks.compare.own_method import OwnMethod
from zerorate.tasks.compare.simulated import Regret, run_contaminated
from zerorate.tasks.compare.trial import Trial, read_with_reference
from zerorate.tasks.saving import Files, Writer, figure_writer, text_writer
from zerorate.tasks.source import ReadingArguments, Source, recording_of
from zerorate.views import Result, table_of


@dataclass(frozen=True)
class Compared(Result):
    """Scores of methods on recordings and simulated gyros, as `zerorate.compare` returns them.

    Parameters
    ----------
    comparisons : tuple of Comparison
        One comparison for each kind of recording, followed by the comparisons of its contaminated
        recordings.
    simulated : tuple of Regret
        Errors relative to the optimal filter on simulated gyros, clean and contaminated.
    alarms : tuple of str
        Contradictions in the recordings, one sentence each.

    Examples
    --------
    >>> import zerorate as zr
    >>> recording = zr.simulate_motion("hand", duration=30.0, seed=1).recording()
    >>> found = zr.compare(recording, methods=["raw", "auto"], attitude=())
    >>> [one.kind for one in found.comparisons]
    ['orientation']
    """

    comparisons: tuple[Comparison, ...]
    simulated: tuple[Regret, ...] = ()
    alarms: tuple[str, ...] = ()

    @property
    def source(self) -> str:
        """Names of the recordings."""
        rows = (row.source for comparison in self.comparisons for row in comparison.rows)
        return ", ".join(dict.fromkeys(rows))

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on the recordings."""
        return tuple(
            dict.fromkeys(note for comparison in self.comparisons for note in comparison.notes)
        )

    def table(self, per_axis: bool = False) -> str:
        """Return the tables as text.

        Parameters
        ----------
        per_axis : bool
            True: a table for every axis. False, the default: the means over the axes, and the worst
            axis.
        """
        return table_of(self, per_axis)

    def to_json(self) -> str:
        """Return every measure of every axis as JSON, with null for missing measures."""
        return as_json(self.comparisons, self.simulated)


def compare(
    source: Source | Trial | Sequence[Any] = (),
    *,
    methods: Sequence[str | OwnMethod | Callable[..., Any]] = METHODS,
    contaminate: Sequence[str | Contamination] = (),
    attitude: Sequence[str] = ATTITUDE_METHODS,
    frame: Frame = "enu",
    reference: str | None = None,
    quaternion: Sequence[str] | None = None,
    simulated: bool = False,
    seeds: int = 12,
    fix: bool = False,
    progress: Progress | None = None,
    **reading: Unpack[ReadingArguments],
) -> Compared:
    """Compare filters on recordings by the errors of their angles, at rest and in motion.

    Recordings are checked first; rates are not changed. ``zerorate compare`` does the same.

    Parameters
    ----------
    source : Recording, Trial, Log, path, data frame or mapping of arrays, or a list of these
        Recording with a gyro. A recording with motion needs a reference.
    methods : sequence of str, OwnMethod or callable
        Methods, as in `zerorate.tasks.compare.compare_methods`.
    contaminate : sequence of str or Contamination
        Faults to add to the recordings; each fault gives a separate comparison.
    attitude : sequence of str
        Attitude filters for recordings with an accelerometer and the true orientation. () for no
        filters.
    frame : {"enu", "ned", "nwu"}
        Frame of the true orientation.
    reference : str, optional
        Reference column: an encoder's angle or a true rate.
    quaternion : sequence of str, optional
        Columns w, x, y, z of the true orientation.
    simulated : bool
        Add simulated gyros with known optimal filters.
    seeds : int
        Number of simulated records of each gyro.
    fix : bool
        Correct the gyro's unit or axes if the motion clearly contradicts them.
    progress : callable, optional
        Called with the name of the step and the fraction done. By default a notebook shows a bar.
    **reading
        Arguments of `zerorate.read_log`, for sources that are read.

    Returns
    -------
    Compared
        The comparisons. The result has the methods `table`, `plot` and `save`.

    Raises
    ------
    LogError
        If a recording cannot be read, or lacks data that its kind of comparison needs.
    ValueError
        If a method, a fault or the frame is unknown, or there is no recording.
    MethodError
        If your own method fails.

    Examples
    --------
    >>> import zerorate as zr
    >>> recording = zr.simulate_motion("hand", duration=30.0, seed=1).recording()
    >>> (found,) = zr.compare(recording, methods=["raw", "auto"], attitude=()).comparisons
    >>> found.methods
    ('raw', 'first rest', 'auto')
    """
    sources = list(source) if isinstance(source, list | tuple) else [source]
    if not sources and not simulated:
        raise ArgumentError("source", "must be at least one recording, unless simulated is true")
    method_specs, faults = resolve_methods(methods), _parse_faults(contaminate)
    check_attitude_methods(attitude, frame)
    report = choose_reporter(progress)
    trials: list[Trial] = []
    alarms: list[str] = []
    for entry in sources:
        trial, trial_alarms = _prepare_trial(entry, reference, quaternion, fix, reading)
        trials.append(replace(trial, log=drop_empty_channels(trial.log)))
        alarms += trial_alarms
    comparisons = compare_methods(trials, method_specs, report, faults) if trials else ()
    comparisons += _compare_attitudes(trials, attitude, frame, report)
    regret = _run_simulated(method_specs, faults, seeds, report) if simulated else []
    return Compared(comparisons, tuple(regret), tuple(dict.fromkeys(alarms)))


def _parse_faults(contaminations: Sequence[str | Contamination]) -> list[Contamination]:
    return [
        Contamination.parse(fault) if isinstance(fault, str) else fault for fault in contaminations
    ]


def _prepare_trial(
    source: Any,  # noqa: ANN401
    reference: str | None,
    quaternion: Sequence[str] | None,
    fix: bool,
    reading: ReadingArguments,
) -> tuple[Trial, tuple[str, ...]]:
    """Return the prepared trial of a source, and the alarms."""
    if isinstance(source, Trial):
        return source, ()
    if isinstance(source, Recording | Log):
        recording = recording_of(source, reading)
    else:
        arguments: dict[str, Any] = dict(reading)
        unit = arguments.pop("unit", None)
        recording = read_with_reference(source, unit, reference, quaternion, **arguments)
    prepared = prepare(recording, replace(AS_MEASURED_CHOICES, gravity=False, fix=fix, skip=()))
    return Trial.of(prepared.recording), prepared.alarms


def _compare_attitudes(
    trials: Sequence[Trial], methods: Sequence[str], frame: Frame, progress: Progress
) -> tuple[Comparison, ...]:
    """Return the comparison of attitude filters on all suitable recordings."""
    rows: list[Row] = []
    notes: list[str] = []
    for trial in trials if methods else ():
        if trial.orientation is None or trial.accel is None:
            continue
        try:
            comparison = compare_attitude([trial], methods, progress, frame=frame)
        except LogError as error:
            notes.append(f"no attitude: {sentence_of(error)}")
        else:
            rows.extend(comparison.rows)
            notes.extend(comparison.notes)
    if not rows and not notes:
        return ()
    return (Comparison("attitude", tuple(rows), tuple(dict.fromkeys(notes))),)


def _run_simulated(
    methods: Sequence[MethodSpec], faults: list[Contamination], seeds: int, progress: Progress
) -> list[Regret]:
    # Simulated gyros are at rest.
    plain = [method for method in methods if "+hold" not in name_of(method)]
    return run_contaminated(plain, faults, seeds=seeds, progress=progress)


def files_of(result: Compared) -> Files:
    """Return the files of a comparison: all numbers as JSON, and a figure of each table."""
    figures: dict[str, Writer] = {}
    for comparison in result.comparisons:
        if comparison.rows:
            faults = sum(name.startswith(f"-{comparison.kind}") for name in figures)
            name = f"-{comparison.kind}" if not faults else f"-{comparison.kind}-{faults + 1}"
            figures[name] = figure_writer(comparison.plot)
    return Files("-compare", ".json", [text_writer(result.to_json())], (), figures, "zerorate")
