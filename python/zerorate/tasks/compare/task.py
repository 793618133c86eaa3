"""What ``zerorate compare`` does: many methods on the same recordings, and on simulated gyros."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Unpack

from zerorate.checks.preparation import AS_MEASURED, prepare
from zerorate.faults import ArgumentError, sentence_of
from zerorate.geometry.frames import Frame
from zerorate.progress import Progress, reported
from zerorate.record.log import Log, LogError, present_axes
from zerorate.record.recording import Recording
from zerorate.simulation import Contamination
from zerorate.tasks.compare.as_json import as_json
from zerorate.tasks.compare.attitude import ATTITUDE_METHODS, check_attitude, compare_attitude
from zerorate.tasks.compare.comparison import Comparison, compare_methods
from zerorate.tasks.compare.measures import Row
from zerorate.tasks.compare.methods import METHODS, Chosen, name_of, resolved
from zerorate.tasks.compare.own import OwnMethod
from zerorate.tasks.compare.simulated import Regret, run_contaminated
from zerorate.tasks.compare.trial import Trial, read_with_truth
from zerorate.tasks.saving import Files, Writer, figure_writer, text_writer
from zerorate.tasks.source import ReadingArguments, Source, recording_of
from zerorate.views import Result, table_of


@dataclass(frozen=True)
class Compared(Result):
    """What methods reached on recordings and on simulated gyros, as `zerorate.compare` returns it.

    Parameters
    ----------
    comparisons : tuple of Comparison
        One a kind of recording, each followed by those of its contaminated recordings.
    simulated : tuple of Regret
        On simulated gyros, clean and contaminated.
    alarms : tuple of str
        What contradicts the recordings, a sentence each.

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
        rows = (row.source for one in self.comparisons for row in one.rows)
        return ", ".join(dict.fromkeys(rows))

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on the recordings."""
        return tuple(dict.fromkeys(note for one in self.comparisons for note in one.notes))

    def table(self, per_axis: bool = False) -> str:
        """Return the tables as text.

        Parameters
        ----------
        per_axis : bool
            Tables of every axis; by default means over all axes, with the worst.
        """
        return table_of(self, per_axis)

    def to_json(self) -> str:
        """Return every measure of every axis as JSON, null where there is none."""
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
    """Compare filters on recordings by what they cost their user, at rest and in motion.

    Recordings are checked first; rates stay as they were measured. ``zerorate compare`` does the
    same.

    Parameters
    ----------
    source : Recording, Trial, Log, path, data frame or mapping of arrays, or a list of these
        With a gyro; in motion with a reference.
    methods : sequence of str, OwnMethod or callable
        As of `zerorate.tasks.compare.compare_methods`.
    contaminate : sequence of str or Contamination
        Faults that are put into the recordings, for comparisons of their own.
    attitude : sequence of str
        Filters of attitude, for recordings with an accelerometer and the true orientation; () for
        none.
    frame : {"enu", "ned", "nwu"}
        Of the true orientation.
    reference : str, optional
        Column of an encoder's angle or of a true rate.
    quaternion : sequence of str, optional
        Columns w, x, y, z of the true orientation.
    simulated : bool
        Also on simulated gyros, whose best filter is known.
    seeds : int
        Simulated records of each gyro.
    fix : bool
        Put right a unit or axes of the gyro that the motion contradicts, where that is sure.
    progress : callable, optional
        Called with a step's name and the fraction that is done. By default a bar in a notebook.
    **reading
        Arguments of `zerorate.read_log`, for sources that are read.

    Returns
    -------
    Compared
        The comparisons; `table`, `plot`, `save`.

    Raises
    ------
    LogError
        If a recording cannot be read, or does not allow what its kind asks for.
    ValueError
        If a method, a fault or the frame is not known, or there is nothing to compare on.
    MethodError
        If a method of your own fails.

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
    chosen, faults = resolved(methods), _faults(contaminate)
    check_attitude(attitude, frame)
    report = reported(progress)
    trials: list[Trial] = []
    alarms: list[str] = []
    for one in sources:
        trial, said = _trial(one, reference, quaternion, fix, reading)
        trials.append(replace(trial, log=present_axes(trial.log)))
        alarms += said
    found = compare_methods(trials, chosen, report, faults) if trials else ()
    found += _attitudes(trials, attitude, frame, report)
    regret = _simulated(chosen, faults, seeds, report) if simulated else []
    return Compared(found, tuple(regret), tuple(dict.fromkeys(alarms)))


def _faults(given: Sequence[str | Contamination]) -> list[Contamination]:
    return [Contamination.parse(one) if isinstance(one, str) else one for one in given]


def _trial(
    source: Any,  # noqa: ANN401
    reference: str | None,
    quaternion: Sequence[str] | None,
    fix: bool,
    reading: ReadingArguments,
) -> tuple[Trial, tuple[str, ...]]:
    """Return the trial of a source after the preparation, and the alarms."""
    if isinstance(source, Trial):
        return source, ()
    if isinstance(source, Recording | Log):
        recording = recording_of(source, reading)
    else:
        asked: dict[str, Any] = dict(reading)
        unit = asked.pop("unit", None)
        recording = read_with_truth(source, unit, reference, quaternion, **asked)
    made = prepare(recording, replace(AS_MEASURED, gravity=False, fix=fix, skip=()))
    return Trial.of(made.recording), made.alarms


def _attitudes(
    trials: Sequence[Trial], methods: Sequence[str], frame: Frame, progress: Progress
) -> tuple[Comparison, ...]:
    """Return the comparison of filters of attitude on the recordings that allow it."""
    rows: list[Row] = []
    notes: list[str] = []
    for one in trials if methods else ():
        if one.orientation is None or one.accel is None:
            continue
        try:
            found = compare_attitude([one], methods, progress, frame=frame)
        except LogError as error:
            notes.append(f"no attitude: {sentence_of(error)}")
        else:
            rows.extend(found.rows)
            notes.extend(found.notes)
    if not rows and not notes:
        return ()
    return (Comparison("attitude", tuple(rows), tuple(dict.fromkeys(notes))),)


def _simulated(
    methods: Sequence[Chosen], faults: list[Contamination], seeds: int, progress: Progress
) -> list[Regret]:
    # Simulated gyros rest.
    plain = [method for method in methods if "+hold" not in name_of(method)]
    return run_contaminated(plain, faults, seeds=seeds, progress=progress)


def files_of(found: Compared) -> Files:
    """Return what a comparison is saved as: all numbers as JSON, and a figure of each table."""
    figures: dict[str, Writer] = {}
    for one in found.comparisons:
        if one.rows:
            faults = sum(name.startswith(f"-{one.kind}") for name in figures)
            name = f"-{one.kind}" if not faults else f"-{one.kind}-{faults + 1}"
            figures[name] = figure_writer(one.plot)
    return Files("-compare", ".json", [text_writer(found.to_json())], (), figures, "zerorate")
