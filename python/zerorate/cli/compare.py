"""``zerorate compare``: comparison of methods on the same logs."""

import os
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Final

from zerorate.cli.errors import DataFault, UsageFault, print_alarms, require
from zerorate.cli.options import OUTPUT, RECORDING, FigureFormat, Fix, Force, NoFigure
from zerorate.cli.outputs import check_outputs, print_written, progress_bar
from zerorate.cli.parameters import Argument, Option, option
from zerorate.cli.reading import Reading, ReadingOptions, records
from zerorate.cli.values import parse_words
from zerorate.tasks.compare import ATTITUDE_METHODS, METHODS, MethodError
from zerorate.tasks.compare import compare as compare_filters
from zerorate.tasks.compare.trial import KINDS
from zerorate.tasks.saving import FIGURE_FORMATS, Destination, Outputs, files_of

_NAME: Final = "zerorate-compare"


def _parse_attitude(flag: str, text: str) -> list[str]:
    return [] if text == "none" else parse_words(flag, text)


@dataclass(frozen=True)
class _Compared:
    """Options of a comparison, named as arguments of `zerorate.compare`."""

    simulated: bool = option(False, "Add simulated gyros, whose optimal filter is known.")
    reference: str | None = option(None, "Reference column: an encoder's angle or a true rate.")
    quaternion: Sequence[str] | None = option(
        None, "Columns w,x,y,z of the true orientation.", parse=parse_words
    )
    seeds: int = option(12, "Simulated records per gyro.")
    methods: Sequence[str] = option(
        METHODS,
        "Methods to compare, e.g. auto,kf; NAME=MODULE:FUNCTION adds yours. FUNCTION(z, rate), "
        "from a Python file in this folder, returns the bias after each sample. "
        "After a name +hold learns at rest only, +reject rejects outliers.",
        metavar="NAMES",
        parse=parse_words,
    )
    contaminate: list[str] | None = option(
        None,
        "Add faults to the records, e.g. stuck=10,at-zero. Or share=0.01,size=100,one-sided (in "
        "standard deviations) or burst=20,size=30 (a minute); repeatable.",
        metavar="FAULTS",
    )
    attitude: Sequence[str] = option(
        ATTITUDE_METHODS,
        "Attitude filters, for logs with a true orientation. Filters of other packages must be "
        "installed; none: no such table.",
        metavar="NAMES",
        parse=_parse_attitude,
    )
    frame: str = option("enu", "Earth axes of --quaternion: enu, ned or nwu.")


@dataclass(frozen=True)
class _Written:
    """Options of the written files."""

    panel: ClassVar = OUTPUT

    output: str | None = option(
        None,
        "Folder for numbers (JSON) and figures, or a file's name. Without it nothing is written.",
        "-o --output",
        metavar="PATH",
    )
    figure_format: FigureFormat = None
    no_figure: NoFigure = False
    json: Path | None = option(None, "File for all numbers.", metavar="FILE")
    force: Force = False

    def place(self) -> Destination | None:
        """Return the destination of numbers and figures; a usage fault for unused options."""
        if self.output is not None:
            if not self.no_figure:
                require("matplotlib", "plot")
            suffixes = ["json", *(() if self.no_figure else FIGURE_FORMATS)]
            return Destination.of(self.output, _NAME, suffixes)
        if self.figure_format is not None or self.no_figure:
            option = "--no-figure" if self.figure_format is None else "--figure-format"
            raise UsageFault(f"{option} has no effect without -o")
        return None

    def outputs(self, kinds: Iterable[str]) -> Outputs | None:
        """Return the files of the existing tables; None if no file is written."""
        place, own = self.place(), () if self.json is None else (self.json,)
        if place is None:
            return Outputs(own[0], (), self.force) if own else None
        form = place.choose("figure_format", self.figure_format, FIGURE_FORMATS)
        figures = () if self.no_figure else tuple(place.file(f"-{k}.{form}") for k in kinds)
        return Outputs(place.file(".json"), figures, self.force, own)


def compare(
    *,
    logs: Annotated[list[Path] | None, Argument(RECORDING)] = None,
    compared: _Compared,
    reading: Annotated[Reading, ReadingOptions()],
    fix: Fix = False,
    per_axis: Annotated[bool, Option("Print a table of every axis.")] = False,
    written: _Written,
) -> None:
    """Compare filters on logs by the errors of their angles, at rest and in motion."""
    if not logs and not compared.simulated:
        raise UsageFault("give at least one log, or --simulated")
    # The user's own method may be in the working folder.
    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    possible = written.outputs(KINDS)
    check_outputs([] if possible is None else possible.paths, written.force, None, *(logs or []))
    arguments = {**vars(compared), "fix": fix, **reading.arguments}
    arguments["contaminate"] = compared.contaminate or ()
    with progress_bar() as progress:
        sources = [one.source for log in logs or [] for one in records(log, reading.group_by)]
        try:
            result = compare_filters(sources, progress=progress, **arguments)
        except MethodError as error:
            raise DataFault(str(error)) from None
        files = files_of(result)
        outputs = written.outputs(end[1:] for end in files.figures)
        if outputs is not None:
            writers = [*files.data] * (1 + len(outputs.others))
            outputs.save(files._replace(data=writers), progress, done=0.95)
    print_alarms(result.alarms)
    print(result.table(per_axis=per_axis))
    if outputs is not None:
        print_written(outputs.paths)
