"""``zerorate compare``: many methods on the same logs."""

import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final, Self, cast, get_args

import typer

from zerorate.cli.errors import DataFault, UsageFault, as_usage, require, sentence, writing
from zerorate.cli.options import (
    OUTPUT,
    RECORDING,
    FigureFormat,
    FigureFormatOption,
    Force,
    NoFigure,
    Reading,
    parse_words,
    with_group,
    with_reading_options,
)
from zerorate.cli.outputs import check_outputs, print_written, progress_bar
from zerorate.cli.records import records
from zerorate.geometry.frames import Frame
from zerorate.progress import Progress
from zerorate.record import LogError
from zerorate.record.log import present_axes
from zerorate.show.compare_simulated import format_regret
from zerorate.show.compare_tables import format_compare
from zerorate.simulation import Contamination
from zerorate.tasks.compare import (
    ATTITUDE_METHODS,
    METHODS,
    Comparison,
    MethodError,
    Row,
    Trial,
    compare_attitude,
    read_trial,
)
from zerorate.tasks.compare import compare as run_methods
from zerorate.tasks.compare.as_json import as_json
from zerorate.tasks.compare.attitude import check_attitude
from zerorate.tasks.compare.methods import Chosen, name_of, resolved
from zerorate.tasks.compare.simulated import Regret, run_contaminated
from zerorate.tasks.compare.trial import Kind
from zerorate.tasks.saving import FIGURE_FORMATS, Destination, together


@dataclass(frozen=True)
class _Asked:
    """What is typed of what is compared, and against what."""

    simulated: Annotated[
        bool, typer.Option(help="Also simulated gyros, whose best filter is known.")
    ] = False
    reference: Annotated[
        str | None, typer.Option(help="Column of an encoder's angle or of a true rate.")
    ] = None
    quaternion: Annotated[
        str | None, typer.Option(help="Columns w,x,y,z of the true orientation.")
    ] = None
    seeds: Annotated[int, typer.Option(help="Simulated records of each gyro.")] = 12
    methods: Annotated[
        str,
        typer.Option(
            metavar="NAMES",
            help="With commas between. NAME=MODULE:FUNCTION adds a method of your own, from a "
            "Python file in this folder: FUNCTION(z, rate) returns the bias after each sample. "
            "After a name +hold learns at rest only, +reject rejects outliers.",
        ),
    ] = ",".join(METHODS)
    contaminate: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FAULTS",
            help="Also with faults in the records, e.g. share=0.01,size=100,one-sided "
            "(in deviations), burst=20,size=30 (a minute) or stuck=10,at-zero (s); repeatable.",
        ),
    ] = None
    attitude: Annotated[
        str,
        typer.Option(
            metavar="NAMES",
            help="Filters of attitude, for logs with an accelerometer and the true orientation; "
            "those of other packages where they are installed. none: no table of them.",
        ),
    ] = ",".join(ATTITUDE_METHODS)
    frame: Annotated[str, typer.Option(help="Of the true orientation: enu, ned or nwu.")] = "enu"

    def chosen(self) -> list[Chosen]:
        """Return the methods."""
        return _methods(parse_words("--methods", self.methods))

    def truth(self) -> dict[str, Any]:
        """Return the columns of a log that hold the truth."""
        columns = self.quaternion
        found = None if columns is None else parse_words("--quaternion", columns)
        return {"reference": self.reference, "quaternion": found}

    def faults(self) -> list[Contamination]:
        """Return what is put into the records."""
        with as_usage():
            return [Contamination.parse(text) for text in self.contaminate or []]

    def filters(self) -> list[str]:
        """Return the filters of attitude."""
        with as_usage():
            found = [] if self.attitude == "none" else parse_words("--attitude", self.attitude)
            check_attitude(found, self.frame)
        return found


@dataclass(frozen=True)
class _Written:
    """What is typed of what is written."""

    output: Annotated[
        str | None,
        typer.Option(
            "-o",
            "--output",
            metavar="PATH",
            help="Folder for all numbers (JSON) and a figure of each table, or the name of one of "
            "them; without it nothing is written.",
        ),
    ] = None
    figure_format: FigureFormatOption = None
    no_figure: NoFigure = False
    json: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", help="Write all numbers into this file."),
    ] = None
    force: Force = False

    def files(self) -> "_Files":
        """Return where numbers and figures go."""
        return _Files.of(self.output, self.figure_format, not self.no_figure, self.json)


@with_group(_Asked, "asked")
@with_group(_Written, "written", OUTPUT)
@with_reading_options()
def compare(
    *,
    logs: Annotated[list[Path] | None, typer.Argument(help=RECORDING, show_default=False)] = None,
    asked: _Asked,
    reading: Reading,
    per_axis: Annotated[bool, typer.Option("--per-axis", help="A table of every axis.")] = False,
    written: _Written,
) -> None:
    """Compare filters on logs by what they cost their user, at rest and in motion."""
    if not logs and not asked.simulated:
        raise UsageFault("give at least one log, or --simulated")
    chosen, faults, filters = asked.chosen(), asked.faults(), asked.filters()
    files = written.files()
    check_outputs(files.possible, written.force, None, *(logs or []))
    with progress_bar() as progress:
        recordings = []
        for one in (one for log in logs or [] for one in records(log, reading.group_by)):
            trial = reading.read(read_trial, one.source, **asked.truth())
            recordings.append(replace(trial, log=present_axes(trial.log)))
        try:
            found = _compared(recordings, chosen, faults, progress)
            found += _attitudes(recordings, filters, asked.frame, progress)
            seeds, simulated = asked.seeds, asked.simulated
            regret = _simulated(chosen, faults, seeds, progress) if simulated else []
        except MethodError as error:
            raise DataFault(str(error)) from None
        paths = files.write(found, regret, written.force, progress)
    print("\n\n".join(_texts(found, regret, per_axis)))
    if paths:
        print_written(paths)


@dataclass(frozen=True)
class _Files:
    """Where numbers go, and the figures of the tables, by what these begin and end with."""

    numbers: tuple[Path, ...]
    figures: tuple[Path, str] | None

    @classmethod
    def of(
        cls, output: str | None, form: FigureFormat | None, draws: bool, json: Path | None
    ) -> Self:
        """Return them; a usage fault for what means nothing, or an extra that is missing."""
        numbers = () if json is None else (json,)
        if output is None:
            if form is not None or not draws:
                option = "--no-figure" if form is None else "--figure-format"
                raise UsageFault(f"{option} has no effect without -o")
            return cls(numbers, None)
        suffixes = ["json", *(FigureFormat if draws else ())]
        place = Destination.of(output, "zerorate-compare", suffixes)
        if draws:
            require("matplotlib", "plot")
        chosen = place.choose("figure_format", form, FIGURE_FORMATS)
        figures = (place.base, f".{chosen}") if draws else None
        return cls((*numbers, place.file(".json")), figures)

    def figure(self, name: str) -> Path:
        """Return the file of a figure."""
        assert self.figures is not None
        base, suffix = self.figures
        return base.with_name(f"{base.name}-{name}{suffix}")

    @property
    def possible(self) -> list[Path]:
        """The files that may be written."""
        kinds = () if self.figures is None else _KINDS
        return [*self.numbers, *map(self.figure, kinds)]

    def write(
        self,
        found: Sequence[Comparison],
        regret: list[Regret],
        force: bool,
        progress: Progress,
    ) -> list[Path]:
        """Write them, and return which there are."""
        drawn: dict[Path, Comparison] = {}
        for one in found if self.figures is not None else ():
            if one.rows:
                faults = sum(path.stem.endswith(one.kind) for path in drawn)
                drawn[self.figure(one.kind if not faults else f"{one.kind}-{faults + 1}")] = one
        paths = [*drawn, *self.numbers]
        progress("writing", 0.95)
        with writing(), together(paths, force) as temporary:
            for path, one in zip(temporary, drawn.values(), strict=False):
                _draw(one, path)
            for path in temporary[len(drawn) :]:
                path.write_text(as_json(found, regret), encoding="utf-8", newline="\n")
        return paths


_KINDS: Final = get_args(Kind)


def _draw(found: Comparison, path: Path) -> None:
    from zerorate.views import save_figure

    save_figure(found.plot(), path)


def _texts(found: tuple[Comparison, ...], regret: list[Regret], per_axis: bool) -> Iterator[str]:
    if found:
        yield format_compare(found, per_axis)
    yield from map(format_regret, regret)


def _methods(names: Sequence[str]) -> list[Chosen]:
    """Return methods by their names; a user's own are looked for in the working folder, too."""
    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    with as_usage():
        return resolved(names)


def _compared(
    recordings: list[Trial], methods: list[Chosen], faults: list[Contamination], progress: Progress
) -> tuple[Comparison, ...]:
    if not recordings:
        return ()
    try:
        return run_methods(recordings, methods, progress, faults)
    except LogError as error:
        raise DataFault(sentence(error)) from None
    except ValueError as error:
        raise UsageFault(sentence(error)) from None


def _attitudes(
    recordings: list[Trial], methods: Sequence[str], frame: str, progress: Progress
) -> tuple[Comparison, ...]:
    """Return the comparison of filters of attitude on the recordings that allow it."""
    rows: list[Row] = []
    notes: list[str] = []
    for one in recordings if methods else ():
        if one.orientation is None or one.accel is None:
            continue
        try:
            found = compare_attitude([one], methods, progress, frame=cast(Frame, frame))
        except LogError as error:
            notes.append(f"no attitude: {sentence(error)}")
        else:
            rows.extend(found.rows)
            notes.extend(found.notes)
    if not rows and not notes:
        return ()
    return (Comparison("attitude", tuple(rows), tuple(dict.fromkeys(notes))),)


def _simulated(
    methods: list[Chosen], faults: list[Contamination], seeds: int, progress: Progress
) -> list[Regret]:
    # Simulated gyros rest.
    plain = [method for method in methods if "+hold" not in name_of(method)]
    with as_usage():
        return run_contaminated(plain, faults, seeds=seeds, progress=progress)
