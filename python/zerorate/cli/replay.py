"""``zerorate replay``: one log through the filters."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, Self

import typer

from zerorate.calibration.calibration import Calibration
from zerorate.cli.array import (
    ARRAY,
    ARRAY_CONSTANTS,
    ArrayOptions,
    array_flag,
    refuse_with_array,
    replay_arrays,
)
from zerorate.cli.calibrations import corrected_imu, read_calibration
from zerorate.cli.checking import checked_files, print_alarms, said_first
from zerorate.cli.errors import (
    UsageFault,
    as_usage,
    of_log,
    read_faults,
    sentence,
    writing,
)
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
from zerorate.io import LogFile, open_imu, write_log
from zerorate.io.formats import LogSource
from zerorate.options import METHODS, used_by, with_limits
from zerorate.progress import Progress
from zerorate.record import Log, LogError
from zerorate.record.log import Header
from zerorate.show import format_biases, format_notes, format_replay, format_table
from zerorate.tasks.replay import Replay, Summary, replay_to_file
from zerorate.tasks.replay import replay as run_replay
from zerorate.tasks.saving import Outputs, make_folders, together


@dataclass(frozen=True)
class _Array:
    """What is typed of an array of gyros."""

    array: Annotated[
        bool,
        typer.Option(
            help="Make one gyro of all gyros of the log, which belong to one body. Of --columns "
            "three in a row are a sensor if they are named x, y, z."
        ),
    ] = False
    rotations: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="From each sensor's axes to those of the body, and positions for accelerometers "
            "(JSON); 'find' finds rotations from the log's motion and writes them. "
            "Default: all are aligned.",
        ),
    ] = None
    weights: Annotated[
        str | None,
        typer.Option(
            metavar="WORD",
            help="How much each sensor counts: auto (by noise at rest, by scale errors in motion), "
            "mean (alike), white (by white noise), or numbers, e.g. 0.5,0.3,0.2. Default: auto.",
        ),
    ] = None

    def options(self, fusion: Mapping[str, Any]) -> ArrayOptions | None:
        """Return those of the array, None where none is made; a usage fault for any then."""
        asked = ArrayOptions.of(self.rotations, self.weights, fusion)
        if not self.array and asked.given:
            raise UsageFault(f"only --array takes {asked.given}")
        return asked if self.array else None


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
@with_group(_Array, "array", ARRAY)
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
    array: _Array,
    fusion: Mapping[str, Any],
    options: Mapping[str, Any],
) -> None:
    """Remove the bias from every axis of a log.

    Prints the bias with its standard deviation, and writes the filtered log and a figure: the log
    holds raw minus bias under the names of the raw columns, and beside them the bias, its standard
    deviation, rest, and a stuck or saturated sensor. The default method, auto, needs no settings.
    """
    of_array = array.options(fusion)
    if of_array is not None:
        refuse_with_array(
            options,
            compared=compared,
            calibration=sensors.calibration,
            no_accel=sensors.no_accel,
            everything=written.figure is FigurePanels.all,
        )
    asked = _Asked.of(options, compared, sensors, written)
    parts = _parts(logs, reading, written)
    overlay = [] if of_array is not None else _overlay(parts[0].files, len(logs))
    for log in logs:
        check_outputs([path for one in parts for path in one.files.paths], written.force, log)
    check_outputs(overlay, written.force)
    keep_freed()
    if of_array is not None:
        found, outputs = [one.record for one in parts], [one.files.paths for one in parts]
        replay_arrays(reading, found, outputs, written.force, of_array, asked.given)
        return
    told = []
    for part in parts:
        one = asked.told(reading, part)
        if len(logs) == 1:
            print_title(part.record, first=part is parts[0])
            print_alarms(one.alarms)
            print_result(one.result, one.files)
        told.append(one.without_samples())
    if len(logs) > 1:
        _print_several(told, overlay, written.force)
    if asked.without_effect:
        print(asked.without_effect)


@dataclass(frozen=True)
class _Part:
    """A record of a log, and the files that it becomes."""

    log: Path
    record: Record
    files: Outputs


def _parts(logs: Sequence[Path], reading: Reading, written: LogAndFigure) -> list[_Part]:
    """Return the records of all logs; a usage fault for one name of several files."""
    places = [written.place(f"{name}-zerorate") for name in own_names(logs)]
    if len(places) > 1 and places[0].named:
        raise UsageFault(f"-o takes a folder where there are several logs, got '{written.output}'")
    return [
        _Part(log, one, written.at(place.of_part(one.ending)))
        for log, place in zip(logs, places, strict=True)
        for one in records(log, reading.group_by)
    ]


@dataclass(frozen=True)
class _Told:
    """What there is to say of one record."""

    title: str
    alarms: Sequence[str]
    result: Summary
    files: Outputs

    def without_samples(self) -> Self:
        summary = {one.name: getattr(self.result, one.name) for one in fields(Summary)}
        return replace(self, result=Summary(**summary))


@dataclass(frozen=True)
class _Asked:
    """What is done with every record."""

    method: str
    methods: Sequence[str]
    given: Mapping[str, Any]
    known: Calibration | None
    sensors: _Sensors
    draws: bool
    everything: bool

    @classmethod
    def of(
        cls,
        options: Mapping[str, Any],
        compared: str | None,
        sensors: _Sensors,
        written: LogAndPanels,
    ) -> Self:
        """Return what was typed; a usage fault if that means nothing."""
        method = options["method"]
        methods = (*_others(compared, method), method)
        check_filter_options(options, methods)
        given = {name: value for name, value in options.items() if name != "method"}
        known = None if sensors.calibration is None else read_calibration(sensors.calibration)
        draws = not written.no_figure
        return cls(method, methods, given, known, sensors, draws, written.everything)

    def told(self, reading: Reading, part: _Part) -> _Told:
        """Filter a record, write its files, and return what there is to say of it."""
        with progress_bar() as progress:
            recording, accel = _opened(reading, part.record.source, self.known)
            recording, alarms = checked_files(recording, accel, self.sensors.fix)
            asked = {
                "methods": self.methods,
                "accel": None if self.sensors.no_accel else accel,
                **with_limits(self.given, self.methods, recording.header.unit),
            }
            with said_first(alarms):
                if self.draws:
                    result = _drawn(recording, part.files, self.everything, progress, asked)
                else:
                    result = _into_file(recording, part.files, progress, asked)
        title = " ".join(filter(None, (str(part.log), part.record.title)))
        return _Told(title, alarms, result, part.files)

    @property
    def without_effect(self) -> str:
        """A sentence on options that the method itself does not use, if there are any."""
        others = [flag(name) for name in self.given if name not in used_by(self.method, self.given)]
        if not others:
            return ""
        verb = "has" if len(others) == 1 else "have"
        return (
            f"{', '.join(others)} {verb} no effect on {self.method}, only on the methods that the "
            "table compares it with"
        )


def _opened(
    reading: Reading, source: LogSource, known: Calibration | None
) -> tuple[LogFile, LogFile | None]:
    """Return a log in blocks, one that is to be corrected first in memory; its accelerometer."""
    if known is None:
        return reading.read(open_imu, source)
    gyro, accel = corrected_imu(reading, source, known)
    return LogFile.of(gyro), None if accel is None else LogFile.of(accel)


_OVERLAY: Final = "replay-zerorate-overlay"
"""Name of the figure of several logs."""


def _overlay(first: Outputs, logs: int) -> list[Path]:
    """Return the figure of several logs, where each has its own, beside that of the first."""
    return [one.with_name(f"{_OVERLAY}{one.suffix}") for one in first.figures if logs > 1]


def _print_several(told: Sequence[_Told], overlay: Sequence[Path], force: bool) -> None:
    """Draw the biases of all logs over each other, print them in one table, then notes on each."""
    results = {one.title: one.result for one in told}
    if overlay:
        from zerorate.show.biases_figure import plot_biases
        from zerorate.views import save_figure

        with writing(), together(overlay, force) as temporary:
            for path in temporary:
                save_figure(plot_biases(results), path)
    print(format_biases(results))
    for one in told:
        compared = format_table(one.result) if len(one.result.speed) > 1 else ""
        parts = ["\n".join(one.alarms), compared, format_notes(one.result)]
        text = "\n\n".join(filter(None, parts))
        if text:
            print(f"\n{one.title}\n{text}")
    print_written([*overlay, *(path for one in told for path in one.files.paths)])


def _others(typed: str | None, method: str) -> tuple[str, ...]:
    """Return the methods that the chosen one is compared with."""
    if typed is None:
        return ()
    names = list(METHODS) if typed == _ALL else parse_words("--methods", typed)
    for name in names:
        if name not in METHODS:
            raise UsageFault(f"--methods takes all, or some of {', '.join(METHODS)}, got '{name}'")
    return tuple(dict.fromkeys(name for name in names if name != method))


_ALL: Final = "all"


def in_memory(log: Log, progress: Progress, **asked: Any) -> Replay:  # noqa: ANN401
    """Return the log after the filters, with all that a figure needs, or raise a fault."""
    with _naming(Header.of(log)), as_usage():
        return run_replay(log, progress=progress, **asked)


def _drawn(
    recording: LogFile,
    files: Outputs,
    everything: bool,
    progress: Progress,
    asked: Mapping[str, Any],
) -> Summary:
    """Write the files of one record, a figure among them, and return the rest, or raise a fault."""
    accel = asked["accel"]
    with read_faults():
        whole = recording.log()
        own = None if accel is None else accel.log()
    result = in_memory(whole, progress, **{**asked, "accel": own, "allan": everything})
    write(files, result, progress, everything)
    return result


def _into_file(
    recording: LogFile, files: Outputs, progress: Progress, asked: Mapping[str, Any]
) -> Summary:
    """Write the filtered log block by block and return the rest, or raise a fault."""
    with writing(), _naming(recording.header), _values():
        make_folders([files.log])
        return replay_to_file(recording, files.log, force=files.force, progress=progress, **asked)


@contextmanager
def _naming(header: Header) -> Iterator[None]:
    """Say which log is at fault."""
    try:
        yield
    except LogError as error:
        raise of_log(error, str(header.meta.get("source", "the log"))) from None


@contextmanager
def _values() -> Iterator[None]:
    """Turn an argument that is not valid into a usage fault."""
    try:
        yield
    except LogError:
        raise
    except ValueError as error:
        raise UsageFault(sentence(error)) from None


def print_result(result: Summary, outputs: Outputs) -> None:
    """Print the table, the notes, and which files were written."""
    print("\n\n".join(filter(None, (format_replay(result), format_notes(result)))))
    print_written(outputs.paths)


def write(outputs: Outputs, result: Replay, progress: Progress, everything: bool = False) -> None:
    """Write the filtered log and the figure."""
    from zerorate.show import plot_replay, save_figure

    outputs.write(
        [partial(write_log, result.filtered_log)],
        lambda path: save_figure(plot_replay(result, everything), path),
        progress,
    )
