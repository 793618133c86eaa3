"""``zerorate replay``: one log through the filters."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
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
    FigureFormat,
    FigureFormatOption,
    FigurePanels,
    Force,
    LogArgument,
    LogFormat,
    LogFormatOption,
    NoAccel,
    NoFigure,
    Output,
    PanelsOption,
    Reading,
    check_filter_options,
    flag,
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
    print_written,
    progress_bar,
)
from zerorate.cli.records import print_title, records
from zerorate.io import Log, LogError, LogFile, open_imu, write_log
from zerorate.io.formats import LogSource
from zerorate.io.log import Header
from zerorate.options import used_by, with_limits
from zerorate.progress import Progress
from zerorate.run.replay import Replay, Summary, replay_to_file
from zerorate.run.replay import replay as run_replay
from zerorate.show import format_learned, format_notes, format_table

_COMPARED: Final = ("kf", "akf", "fading")
"""The methods of one source, of which each is meant to better the one before."""


@with_filter_options
@with_options(ARRAY_CONSTANTS, "fusion", array_flag, panel=ARRAY)
@with_reading_options()
def replay(
    *,
    log: LogArgument,
    reading: Reading,
    output: Output = ".",
    format: LogFormatOption = None,
    figure_format: FigureFormatOption = None,
    figure: PanelsOption = FigurePanels.usual,
    no_figure: NoFigure = False,
    only: Annotated[
        bool,
        typer.Option(
            "--only",
            help="Run the chosen method alone; else the table has others beside it to compare.",
            rich_help_panel=OUTPUT,
        ),
    ] = False,
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

    Prints what was learned and how good it is, and writes the filtered log and a figure. The
    default method, auto, needs no settings.
    """
    asked_of_array = ArrayOptions.of(rotations, weights, fusion)
    if array:
        refuse_with_array(options, only=only, calibration=calibration, no_accel=no_accel)
        if figure is FigurePanels.all:
            raise UsageFault("--figure all has no effect on --array")
    elif asked_of_array.given:
        raise UsageFault(f"only --array takes {asked_of_array.given}")
    method = options["method"]
    methods = (method,) if only else (*baselines(method), method)
    check_filter_options(options, methods)
    given = {name: value for name, value in options.items() if name != "method"}
    known = None if calibration is None else read_calibration(calibration)
    everything = all_panels(figure, not no_figure)
    place = place_of(output, log.stem, not no_figure)
    shape = (format, figure_format, not no_figure, force)
    found = records(log, reading.group_by)
    outputs = [Outputs.of(place.of_part(one.ending), *shape) for one in found]
    check_outputs([path for files in outputs for path in files.paths], force, log)
    keep_freed()
    if array:
        replay_arrays(reading, found, [one.paths for one in outputs], force, asked_of_array, given)
        return
    for one, files in zip(found, outputs, strict=True):
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
        print_title(one, first=one is found[0])
        print_alarms(alarms)
        print_result(result, files)
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


def baselines(method: str) -> tuple[str, ...]:
    """Return the published methods that the chosen one is compared with."""
    compared = _COMPARED if method == "auto" else _COMPARED[:2]
    return tuple(other for other in compared if other != method)


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
    parts = (format_table(result), format_learned(result), format_notes(result))
    print("\n\n".join(filter(None, parts)))
    print_written(outputs.paths)


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
