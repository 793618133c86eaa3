"""``zerorate batch``: many logs filtered, characterised or reported on, on cores or a cluster."""

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from zerorate.cli.errors import DataFault, UsageFault
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
from zerorate.options import FILTER_OPTIONS
from zerorate.tasks.batch import batch as run

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
    asked = dict(reading.arguments)
    with counting_bar("logs") as progress:
        result = run(
            logs, output, command=command.value, workers=workers, local_cluster=local_cluster,
            scheduler=scheduler, force=force, progress=progress, accel=not no_accel,
            format=None if format is None else format.value, calibration=calibration,
            data_scale=asked.pop("scale"), **asked, **options,
        )  # fmt: skip
    print(result)
    for path in result.files:
        print(f"wrote {path}")
    if result.failed:
        raise DataFault(f"{len(result.failed)} of {len(result.outcomes)} logs failed")


def _check_unused(command: Command, options: Mapping[str, Any], **others: object) -> None:
    """Raise a usage fault for an option that only the filter has; a method may be the default."""
    usual = FILTER_OPTIONS["method"].default
    given = [flag(name) for name, value in options.items() if (name, value) != ("method", usual)]
    for option in [*given, *(flag(name) for name, value in others.items() if value is not None)]:
        raise UsageFault(f"{option} has no effect with --command {command.value}, only with replay")
