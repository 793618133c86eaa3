"""``zerorate replay``: one log through the filters."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

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
from zerorate.cli.checking import Fix, checked_files, print_alarms, said_first
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
    FigureFormat,
    FigureFormatOption,
    FigurePanels,
    Force,
    LogFormat,
    LogFormatOption,
    NoAccel,
    NoFigure,
    Output,
    PanelsOption,
    Reading,
    check_filter_options,
    flag,
    parse_words,
    with_filter_options,
    with_options,
    with_reading_options,
)
from zerorate.cli.outputs import (
    Destination,
    Outputs,
    all_panels,
    check_outputs,
    make_folders,
    own_names,
    print_written,
    progress_bar,
    together,
)
from zerorate.cli.records import print_title, records
from zerorate.io import Log, LogError, LogFile, open_imu, write_log
from zerorate.io.formats import LogSource
from zerorate.io.log import Header
from zerorate.options import METHODS, used_by, with_limits
from zerorate.progress import Progress
from zerorate.run.replay import Replay, Summary, replay_to_file
from zerorate.run.replay import replay as run_replay
from zerorate.show import format_biases, format_notes, format_replay, format_table


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
    output: Output = ".",
    format: LogFormatOption = None,
    figure_format: FigureFormatOption = None,
    figure: PanelsOption = FigurePanels.usual,
    no_figure: NoFigure = False,
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
    force: Force = False,
    calibration: Annotated[
        Path | None,
        typer.Option(
            metavar="CAL",
            help="Correct the gyro by this calibration first (JSON of zerorate calibrate), and by "
            "the log's accelerometer, if it has one.",
            rich_help_panel=PANEL,
        ),
    ] = None,
    fix: Fix = False,
    no_accel: NoAccel = False,
    array: Annotated[
        bool,
        typer.Option(
            "--array",
            help="Make one gyro of all gyros of the log, which belong to one body. Of --columns "
            "three in a row are a sensor if they are named x, y, z.",
            rich_help_panel=ARRAY,
        ),
    ] = False,
    rotations: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="From each sensor's axes to those of the body, and positions for accelerometers "
            "(JSON); 'find' finds rotations from the log's motion and writes them. "
            "Default: all are aligned.",
            rich_help_panel=ARRAY,
        ),
    ] = None,
    weights: Annotated[
        str | None,
        typer.Option(
            metavar="WORD",
            help="How much each sensor counts: auto (by noise at rest, by scale errors in motion), "
            "mean (alike), white (by white noise), or numbers, e.g. 0.5,0.3,0.2. Default: auto.",
            rich_help_panel=ARRAY,
        ),
    ] = None,
    fusion: Mapping[str, Any],
    options: Mapping[str, Any],
) -> None:
    """Remove the bias from every axis of a log.

    Prints the bias with its standard deviation, and writes the filtered log and a figure: the log
    holds raw minus bias under the names of the raw columns, and beside them the bias, its standard
    deviation, rest, and a stuck or saturated sensor. The default method, auto, needs no settings.
    """
    asked_of_array = ArrayOptions.of(rotations, weights, fusion)
    if array:
        refuse_with_array(options, compared=compared, calibration=calibration, no_accel=no_accel)
        if figure is FigurePanels.all:
            raise UsageFault("--figure all has no effect on --array")
    elif asked_of_array.given:
        raise UsageFault(f"only --array takes {asked_of_array.given}")
    method = options["method"]
    methods = (*_others(compared, method), method)
    check_filter_options(options, methods)
    given = {name: value for name, value in options.items() if name != "method"}
    known = None if calibration is None else read_calibration(calibration)
    everything = all_panels(figure, not no_figure)
    shape = (format, figure_format, not no_figure, force)
    places = places_of_logs(logs, output, not no_figure)
    parts = [
        (log, one, Outputs.of(place.of_part(one.ending), *shape))
        for log, place in zip(logs, places, strict=True)
        for one in records(log, reading.group_by)
    ]
    for log in logs:
        check_outputs([path for _, _, files in parts for path in files.paths], force, log)
    overlay = [] if array else _overlay(parts[0][2], len(logs))
    check_outputs(overlay, force)
    keep_freed()
    if array:
        found, outputs = [one for _, one, _ in parts], [files.paths for _, _, files in parts]
        replay_arrays(reading, found, outputs, force, asked_of_array, given)
        return
    several: list[_Told] = []
    for log, one, files in parts:
        with progress_bar() as progress:
            recording, accel = _opened(reading, one.source, known)
            recording, alarms = checked_files(recording, accel, fix)
            accel = None if no_accel else accel
            asked = {
                "methods": methods,
                "accel": accel,
                **with_limits(given, methods, recording.header.unit),
            }
            with said_first(alarms):
                if no_figure:
                    result = _into_file(recording, files.log, files.force, progress, asked)
                else:
                    result = _drawn(recording, files, everything, progress, asked)
        if len(logs) > 1:
            title = " ".join(filter(None, (str(log), one.title)))
            several.append(_Told(title, alarms, _without_samples(result), files))
            continue
        print_title(one, first=one is parts[0][1])
        print_alarms(alarms)
        print_result(result, files)
    if several:
        _print_several(several, overlay, force)
    others = [flag(name) for name in options if name not in used_by(method, options)]
    if others:
        verb = "has" if len(others) == 1 else "have"
        print(
            f"{', '.join(others)} {verb} no effect on {method}, only on the methods that the table "
            "compares it with"
        )


def _opened(
    reading: Reading, source: LogSource, known: Calibration | None
) -> tuple[LogFile, LogFile | None]:
    """Return a log in blocks, one that is to be corrected first in memory; its accelerometer."""
    if known is None:
        return reading.read(open_imu, source)
    gyro, accel = corrected_imu(reading, source, known)
    return LogFile.of(gyro), None if accel is None else LogFile.of(accel)


@dataclass(frozen=True)
class _Told:
    """What there is to say of one log of several."""

    title: str
    alarms: Sequence[str]
    result: Summary
    files: Outputs


def _without_samples(result: Summary) -> Summary:
    return Summary(**{one.name: getattr(result, one.name) for one in fields(Summary)})


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
        from zerorate.show.style import save_figure

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
    recording: LogFile, path: Path, force: bool, progress: Progress, asked: Mapping[str, Any]
) -> Summary:
    """Write the filtered log block by block and return the rest, or raise a fault."""
    with writing(), _naming(recording.header), _values():
        make_folders([path])
        return replay_to_file(recording, path, force=force, progress=progress, **asked)


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


def places_of_logs(logs: Sequence[Path], output: str, figure: bool) -> list[Destination]:
    """Return where the files of each log lie; a usage fault for one name of several."""
    places = [place_of(output, name, figure) for name in own_names(logs)]
    if len(places) > 1 and places[0].named:
        raise UsageFault(f"-o takes a folder where there are several logs, got '{output}'")
    return places


def place_of(output: str, stem: str, figure: bool) -> Destination:
    """Return where the files of a replay lie: `output` may name either of them."""
    suffixes = [*LogFormat, *(FigureFormat if figure else ())]
    return Destination.of(output, f"{stem}-zerorate", suffixes)


def write(outputs: Outputs, result: Replay, progress: Progress, everything: bool = False) -> None:
    """Write the filtered log and the figure."""
    from zerorate.show import plot_replay, save_figure

    outputs.write(
        [partial(write_log, result.filtered_log, beside=result.beside)],
        lambda path: save_figure(plot_replay(result, everything), path),
        progress,
    )
