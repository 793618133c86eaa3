"""``zerorate batch``: many logs filtered, characterised or reported on, on cores or a cluster."""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from zerorate.cli.calibrations import read_calibration
from zerorate.cli.errors import DataFault, UsageFault, of_a_file, sentence
from zerorate.cli.options import (
    LogFormat,
    NoAccel,
    Reading,
    check_filter_options,
    flag,
    with_filter_options,
    with_reading_options,
)
from zerorate.cli.outputs import counting_bar
from zerorate.faults import told
from zerorate.numerals import significant
from zerorate.options import FILTER_OPTIONS
from zerorate.record import atomic_path
from zerorate.show.tables import GAP, Table, as_text, prose
from zerorate.tasks.batch import BatchResult, Outlier, Settings, run_batch
from zerorate.tasks.batch.fleet import LEAST_LOGS

OVERVIEW: Final = "overview.html"
_WHERE: Final = "Where it runs"


class Command(StrEnum):
    """What is done with each log."""

    replay = "replay"
    allan = "allan"
    report = "report"


@with_filter_options
@with_reading_options(
    without=["group_by"],
    help={
        "unit": "Unit of the gyro columns if their names do not say: rad/s, deg/s or deg/h; for "
        "--command allan or report and for --calibration also of the accelerometers: deg/s,g. "
        "Values are not converted."
    },
)
def batch(
    *,
    logs: Annotated[
        list[str], typer.Argument(help="Folders, logs, or patterns such as 'logs/**/*.parquet'.")
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder of the results.")
    ],
    command: Annotated[
        Command,
        typer.Option(
            help="Filter each log (replay), find its noise (allan), or tell what is seen of its "
            "IMU (report)."
        ),
    ] = Command.replay,
    report: Annotated[
        bool,
        typer.Option(
            "--report", help="The same as --command report: a page a log, and overview.html of all."
        ),
    ] = False,
    workers: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Processes; one a core if not said.", rich_help_panel=_WHERE
        ),
    ] = None,
    local_cluster: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="N Dask workers on this machine instead.", rich_help_panel=_WHERE
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Workers of a Dask scheduler instead.", rich_help_panel=_WHERE
        ),
    ] = None,
    reading: Reading,
    options: Mapping[str, Any],
    format: Annotated[
        LogFormat | None, typer.Option(help="Of the filtered logs; parquet if not said.")
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(
            metavar="CAL",
            help="Correct the gyro of each log by this calibration first (JSON of zerorate "
            "calibrate), and by the log's accelerometer, if it has one.",
        ),
    ] = None,
    no_accel: NoAccel = False,
    force: Annotated[bool, typer.Option("--force", help="Do finished logs again.")] = False,
) -> None:
    """Filter many logs, find their noise, or report on them; what is finished is not redone."""
    if report and command is Command.allan:
        raise UsageFault("--report is --command report: leave --command allan out")
    command = Command.report if report else command
    if command is not Command.replay:
        given = True if no_accel else None
        _check_unused(command, options, format=format, calibration=calibration, no_accel=given)
        options = {}
    else:
        check_filter_options(options, [options["method"]])
    try:
        asked = dict(reading.arguments)
        settings = Settings(
            command=command.value,
            format=None if format is None else format.value,
            calibration=None if calibration is None else read_calibration(calibration),
            data_scale=asked.pop("scale"),
            accel=not no_accel,
            **asked,
            **options,
        )
        with counting_bar("logs") as progress:
            result = run_batch(
                logs,
                output,
                settings,
                workers=workers,
                local_cluster=local_cluster,
                scheduler=scheduler,
                force=force,
                progress=progress,
            )
    except (ValueError, ImportError) as error:
        raise UsageFault(sentence(error)) from None
    except OSError as error:
        raise DataFault(of_a_file(error)) from None
    if command is Command.report:
        _write_overview(result)
    _print(result, command)


def _write_overview(result: BatchResult) -> None:
    from zerorate.show.overview_page import overview_page

    try:
        with atomic_path(result.summary.with_name(OVERVIEW), force=True) as temporary:
            temporary.write_text(overview_page(result), encoding="utf-8", newline="\n")
    except OSError as error:
        raise DataFault(of_a_file(error)) from None


def _check_unused(command: Command, options: Mapping[str, Any], **others: object) -> None:
    """Raise a usage fault for an option that only the filter has; a method may be the default."""
    usual = FILTER_OPTIONS["method"].default
    given = [flag(name) for name, value in options.items() if (name, value) != ("method", usual)]
    for option in [*given, *(flag(name) for name, value in others.items() if value is not None)]:
        raise UsageFault(f"{option} has no effect with --command {command.value}, only with replay")


_SHOWN: Final = 20
"""Rows and notes that are printed; all stand in the summary."""


def _print(result: BatchResult, command: Command) -> None:
    """Print what became of the logs; a failed one is a fault of the data."""
    counts = result.counts
    _say(
        f"{counts['done']} logs done in {result.seconds:.1f} s, "
        f"{counts['skipped']} skipped, {counts['failed']} failed"
    )
    for one in result.failed:
        _say(f"failed: {one.name}: {told(one.error or '')}")
    if result.left_out:
        count = len(result.left_out)
        _say(f"left out: {count} file{'s' if count > 1 else ''} that zerorate has written")
    if command is Command.report:
        _print_reports(result)
    else:
        _print_fleet(result)
        _print_notes(result.notes)
    print(f"wrote {result.summary}")
    if command is Command.report:
        print(f"wrote {result.summary.with_name(OVERVIEW)}")
    if result.failed:
        raise DataFault(f"{len(result.failed)} of {len(result.outcomes)} logs failed")


def _print_reports(result: BatchResult) -> None:
    """Print a row for each log that needs a person, what needs one most first."""
    from zerorate.show.overview_page import judged, summary

    logs = judged(result.outcomes)
    urgent = [one for one in logs if one.act or one.look]
    _say(summary(logs))
    for one in urgent[:_SHOWN]:
        _say(f"{one.outcome.name}: {one.act} to act on, {one.look} to look at. {one.first}")
    if len(urgent) > _SHOWN:
        print(f"{len(urgent) - _SHOWN} more are in the overview")


def _say(sentence: str) -> None:
    print(prose(sentence, hang=GAP))


def _print_notes(notes: Mapping[str, Sequence[str]]) -> None:
    for note, logs in islice(notes.items(), _SHOWN):
        _say(f"note: {logs[0]}{_and_others(len(logs) - 1)}: {told(note)}")
    if len(notes) > _SHOWN:
        print(f"{len(notes) - _SHOWN} more notes are in the summary")


def _and_others(count: int) -> str:
    return f" and {count} other{'s' if count > 1 else ''}" if count else ""


def _print_fleet(result: BatchResult) -> None:
    """Print which logs stand out, and how many could not be compared."""
    fleet, through = result.fleet, [one for one in result.outcomes if one.rows]
    alone = {log for log, _ in fleet.unjudged}
    if alone:
        _say(
            f"not compared with each other: {len(alone)} of {len(through)} logs; "
            f"it takes {LEAST_LOGS} with the same axis and unit"
        )
    if not fleet.outlying:
        if len(alone) < len(through):
            print("no log stands out from the others")
        return
    head = ("log", "axis", "quantity", "value", "median", "times", "unit")
    rows = tuple(_row(one) for one in fleet.outlying[:_SHOWN])
    more = len(fleet.outlying) - _SHOWN
    note = f"{more} more are in the summary" if more > 0 else ""
    print(as_text(Table("these stand out from the others:", head, rows, words=3, note=note)))


def _row(one: Outlier) -> tuple[str, ...]:
    times = "-" if one.times is None else significant(one.times, 2)
    numbers = (significant(one.value), significant(one.median), times)
    return (one.log, one.axis, one.quantity, *numbers, one.unit)
