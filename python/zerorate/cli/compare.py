"""``zerorate compare``: many methods on the same logs."""

import os
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from zerorate.cli.errors import DataFault, UsageFault, print_alarms, require
from zerorate.cli.options import (
    OUTPUT,
    RECORDING,
    FigureFormat,
    FigureFormatOption,
    Fix,
    Force,
    NoFigure,
    Reading,
    parse_words,
    with_group,
    with_reading_options,
)
from zerorate.cli.outputs import check_outputs, print_written, progress_bar
from zerorate.cli.records import records
from zerorate.tasks.compare import ATTITUDE_METHODS, METHODS, MethodError
from zerorate.tasks.compare import compare as compare_filters
from zerorate.tasks.compare.trial import KINDS
from zerorate.tasks.saving import FIGURE_FORMATS, Destination, Outputs, files_of


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

    def arguments(self) -> dict[str, Any]:
        """Return those of `zerorate.compare`."""
        # A method of one's own is looked for in the working folder, too.
        if os.getcwd() not in sys.path:
            sys.path.insert(0, os.getcwd())
        columns, none = self.quaternion, self.attitude == "none"
        return {
            "methods": parse_words("--methods", self.methods),
            "contaminate": self.contaminate or (),
            "attitude": () if none else parse_words("--attitude", self.attitude),
            "frame": self.frame,
            "reference": self.reference,
            "quaternion": None if columns is None else parse_words("--quaternion", columns),
            "simulated": self.simulated,
            "seeds": self.seeds,
        }


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

    def place(self) -> Destination | None:
        """Return where numbers and figures go; a usage fault for what means nothing without."""
        if self.output is not None:
            if not self.no_figure:
                require("matplotlib", "plot")
            suffixes = ["json", *(() if self.no_figure else FigureFormat)]
            return Destination.of(self.output, _NAME, suffixes)
        if self.figure_format is not None or self.no_figure:
            option = "--no-figure" if self.figure_format is None else "--figure-format"
            raise UsageFault(f"{option} has no effect without -o")
        return None

    def outputs(self, kinds: Iterable[str]) -> Outputs | None:
        """Return the files of the tables that there are; None where nothing is written."""
        place, own = self.place(), () if self.json is None else (self.json,)
        if place is None:
            return Outputs(own[0], (), self.force) if own else None
        form = place.choose("figure_format", self.figure_format, FIGURE_FORMATS)
        figures = () if self.no_figure else tuple(place.file(f"-{k}.{form}") for k in kinds)
        return Outputs(place.file(".json"), figures, self.force, own)


_NAME: Final = "zerorate-compare"


@with_group(_Asked, "asked")
@with_group(_Written, "written", OUTPUT)
@with_reading_options()
def compare(
    *,
    logs: Annotated[list[Path] | None, typer.Argument(help=RECORDING, show_default=False)] = None,
    asked: _Asked,
    reading: Reading,
    fix: Fix = False,
    per_axis: Annotated[bool, typer.Option("--per-axis", help="A table of every axis.")] = False,
    written: _Written,
) -> None:
    """Compare filters on logs by what they cost their user, at rest and in motion."""
    if not logs and not asked.simulated:
        raise UsageFault("give at least one log, or --simulated")
    arguments = {**asked.arguments(), "fix": fix, **reading.arguments}
    possible = written.outputs(KINDS)
    check_outputs([] if possible is None else possible.paths, written.force, None, *(logs or []))
    with progress_bar() as progress:
        sources = [one.source for log in logs or [] for one in records(log, reading.group_by)]
        try:
            found = compare_filters(sources, progress=progress, **arguments)
        except MethodError as error:
            raise DataFault(str(error)) from None
        files = files_of(found)
        outputs = written.outputs(end[1:] for end in files.figures)
        if outputs is not None:
            writers = [*files.data] * (1 + len(outputs.others))
            outputs.save(files._replace(data=writers), progress, done=0.95)
    print_alarms(found.alarms)
    print(found.table(per_axis=per_axis))
    if outputs is not None:
        print_written(outputs.paths)
