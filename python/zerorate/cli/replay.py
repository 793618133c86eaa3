"""``zerorate replay``: one log through the filters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from zerorate.cli.array import (
    ARRAY,
    ARRAY_CONSTANTS,
    OfArray,
    array_flag,
    refuse_with_array,
)
from zerorate.cli.errors import UsageFault, print_alarms
from zerorate.cli.memory import keep_freed
from zerorate.cli.options import (
    OUTPUT,
    PANEL,
    RECORDING,
    FigurePanels,
    Fix,
    NoAccel,
    Reading,
    check_filter_options,
    flag,
    parse_words,
    with_filter_options,
    with_group,
    with_options,
    with_reading_options,
)
from zerorate.cli.outputs import (
    LogAndFigure,
    LogAndPanels,
    check_outputs,
    own_names,
    print_written,
    progress_bar,
)
from zerorate.cli.records import Record, print_title, records
from zerorate.options import METHODS, used_by
from zerorate.tasks.array import replay_array
from zerorate.tasks.replay import Replays, Summary, replay_to_file
from zerorate.tasks.replay import replay as remove_bias
from zerorate.tasks.saving import Outputs, figure_writer, files_of, together


@dataclass(frozen=True)
class _Sensors:
    """What is typed of what is done to the sensors before the filters, and of the accelerometer."""

    calibration: Annotated[
        Path | None,
        typer.Option(
            metavar="CAL",
            help="Correct the gyro by this calibration first (JSON of zerorate calibrate), and by "
            "the log's accelerometer, if it has one.",
        ),
    ] = None
    fix: Fix = False
    no_accel: NoAccel = False


@with_group(LogAndPanels, "written")
@with_group(_Sensors, "sensors", PANEL)
@with_group(OfArray, "array", ARRAY)
@with_filter_options
@with_options(ARRAY_CONSTANTS, "fusion", array_flag, panel=ARRAY)
@with_reading_options()
def replay(
    *,
    logs: Annotated[
        list[Path],
        typer.Argument(
            help=f"{RECORDING} Several have one table, and a figure more.", show_default=False
        ),
    ],
    reading: Reading,
    written: LogAndPanels,
    compared: Annotated[
        str | None,
        typer.Option(
            "--methods",
            metavar="NAMES",
            help="Compare the method with others, of kf, akf, fading, robust and auto; all for all "
            "of them.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    sensors: _Sensors,
    array: OfArray,
    fusion: Mapping[str, Any],
    options: Mapping[str, Any],
) -> None:
    """Remove the bias from every axis of a log.

    Prints the bias with its standard deviation, and writes the filtered log and a figure: the log
    holds raw minus bias under the names of the raw columns, and beside them the bias, its standard
    deviation, rest, and a stuck or saturated sensor. The default method, auto, needs no settings.
    """
    of_array = array.arguments(fusion, options)
    if of_array is not None:
        refuse_with_array(
            options,
            methods=compared is not None,
            calibration=sensors.calibration is not None,
            no_accel=sensors.no_accel,
            figure=written.figure is FigurePanels.all,
        )
    task = _Task.of(options, compared, sensors, written)
    parts = _parts(logs, reading, written, array.finds)
    overlay = [] if of_array is not None else _overlay(parts[0].files, len(logs))
    for log in logs:
        paths = [path for one in parts for path in one.files.paths]
        check_outputs(paths, written.force, log, array.file, sensors.calibration)
    check_outputs(overlay, written.force)
    keep_freed()
    if of_array is not None:
        _replay_arrays(parts, {**of_array, "fix": sensors.fix, **reading.arguments})
        return
    results: dict[str, Summary] = {}
    for part in parts:
        found = task.run(part, reading)
        if len(logs) == 1:
            print_title(part.record, first=part is parts[0])
            print_alarms(found.alarms)
            print(found)
            print_written(part.files.paths)
        results[part.title] = found.summary()
    if len(logs) > 1:
        _print_several(Replays(results), overlay, parts, written.force)
    if task.without_effect:
        print(task.without_effect)


@dataclass(frozen=True)
class _Part:
    """A record of a log, and the files that it becomes."""

    log: Path
    record: Record
    files: Outputs

    @property
    def title(self) -> str:
        """Name of the log, and of its part."""
        return " ".join(filter(None, (str(self.log), self.record.title)))


def _parts(
    logs: Sequence[Path], reading: Reading, written: LogAndFigure, rotations: bool
) -> list[_Part]:
    """Return the records of all logs; a usage fault for one name of several files."""
    places = [written.place(f"{name}-zerorate") for name in own_names(logs)]
    if len(places) > 1 and places[0].named:
        raise UsageFault(f"-o takes a folder where there are several logs, got '{written.output}'")
    parts = []
    for log, whole in zip(logs, places, strict=True):
        for one in records(log, reading.group_by):
            place = whole.of_part(one.ending)
            others = (place.file("-rotations.json"),) if rotations else ()
            parts.append(_Part(log, one, replace(written.at(place), others=others)))
    return parts


@dataclass(frozen=True)
class _Task:
    """What is done with every record."""

    method: str
    arguments: Mapping[str, Any]
    options: Mapping[str, Any]
    panels: str
    draws: bool

    @classmethod
    def of(
        cls,
        options: Mapping[str, Any],
        compared: str | None,
        sensors: _Sensors,
        written: LogAndPanels,
    ) -> "_Task":
        """Return what was typed; a usage fault if that means nothing."""
        method, methods = options["method"], _methods(compared)
        check_filter_options(options, (*methods, method))
        arguments = {
            "method": method,
            "methods": methods,
            "accel": not sensors.no_accel,
            "calibration": sensors.calibration,
            "fix": sensors.fix,
        }
        panels = "all" if written.everything else "usual"
        given = {name: value for name, value in options.items() if name != "method"}
        return cls(method, arguments, given, panels, not written.no_figure)

    def run(self, part: _Part, reading: Reading) -> Summary:
        """Filter a record, and write its files: without a figure block by block."""
        read = {**reading.arguments}
        asked = {**self.arguments, **self.options, "data_scale": read.pop("scale"), **read}
        with progress_bar() as progress:
            if not self.draws:
                path, force = part.files.log, part.files.force
                path.parent.mkdir(parents=True, exist_ok=True)
                return replay_to_file(
                    part.record.source, path, force=force, progress=progress, **asked
                )
            found = remove_bias(part.record.source, progress=progress, **asked)
            part.files.save(files_of(found, panels=self.panels), progress)
        return found

    @property
    def without_effect(self) -> str:
        """A sentence on options that the method itself does not use, if there are any."""
        used = used_by(self.method, self.options)
        others = [flag(name) for name in self.options if name not in used]
        if not others:
            return ""
        verb = "has" if len(others) == 1 else "have"
        return (
            f"{', '.join(others)} {verb} no effect on {self.method}, only on the methods that the "
            "table compares it with"
        )


def _replay_arrays(parts: Sequence[_Part], asked: Mapping[str, Any]) -> None:
    """Replay each record as an array, write its files, and print what is to be said of it."""
    for part in parts:
        with progress_bar() as progress:
            found = replay_array(part.record.source, progress=progress, **asked)
            part.files.save(files_of(found), progress)
        print_title(part.record, first=part is parts[0])
        print_alarms(found.alarms)
        print(found)
        print_written(part.files.paths)


_OVERLAY: Final = "replay-zerorate-overlay"
"""Name of the figure of several logs."""


def _overlay(first: Outputs, logs: int) -> list[Path]:
    """Return the figure of several logs, where each has its own, beside that of the first."""
    return [one.with_name(f"{_OVERLAY}{one.suffix}") for one in first.figures if logs > 1]


def _print_several(
    found: Replays, overlay: Sequence[Path], parts: Sequence[_Part], force: bool
) -> None:
    """Draw the biases of all logs over each other, and print them in one table with notes."""
    with together(overlay, force) as temporary:
        for path in temporary:
            figure_writer(found.plot)(path)
    print(found)
    print_written([*overlay, *(path for one in parts for path in one.files.paths)])


def _methods(typed: str | None) -> list[str]:
    """Return the methods that the chosen one is compared with."""
    if typed is None:
        return []
    names = list(METHODS) if typed == _ALL else parse_words("--methods", typed)
    for name in names:
        if name not in METHODS:
            raise UsageFault(f"--methods takes all, or some of {', '.join(METHODS)}, got '{name}'")
    return names


_ALL: Final = "all"
