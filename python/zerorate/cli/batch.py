"""``zerorate batch``: filter, noise, report or checks of many logs, on cores or a cluster."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from zerorate.cli.errors import DataFault, UsageFault
from zerorate.cli.filter_options import FilterOptions, check_filter_options, flag
from zerorate.cli.options import NoAccel
from zerorate.cli.outputs import counting_bar
from zerorate.cli.parameters import Argument, Option
from zerorate.cli.reading import Reading, ReadingOptions
from zerorate.options import FILTER_OPTIONS
from zerorate.tasks.batch import batch as run
from zerorate.tasks.saving import LOG_FORMATS

_WHERE: Final = "Where to compute"
"""Panel of help for the place of computation."""

_READING: Final = ReadingOptions(
    without=("group_by",),
    help={
        "unit": "Unit of the gyro: rad/s, deg/s or deg/h. Needed if the columns' names lack it; "
        "values are not converted. For other commands than replay and for --calibration "
        "with that of the accelerometer: deg/s,g."
    },
)


def batch(
    *,
    logs: Annotated[
        list[str],
        Argument("Folders, logs, patterns: 'logs/**/*.parquet'; or addresses: s3://bucket/logs."),
    ],
    output: Annotated[Path, Option("Folder of the results.", "-o --output", metavar="FOLDER")],
    command: Annotated[
        Literal["replay", "allan", "report", "check"],
        Option("Task for each log: replay (filter), allan (noise), report or check (units, axes)."),
    ] = "replay",
    report: Annotated[bool, Option("Same as --command report, with an overview.html.")] = False,
    workers: Annotated[
        int | None,
        Option("Number of processes. Default: one for each core.", metavar="N", panel=_WHERE),
    ] = None,
    local_cluster: Annotated[
        int | None, Option("Use N Dask workers on this machine.", metavar="N", panel=_WHERE)
    ] = None,
    scheduler: Annotated[
        str | None,
        Option("Use the workers of this Dask scheduler.", metavar="ADDRESS", panel=_WHERE),
    ] = None,
    reading: Annotated[Reading, _READING],
    options: FilterOptions,
    format: Annotated[
        str | None, Option("Format of the filtered logs. Default: parquet.", choices=LOG_FORMATS)
    ] = None,
    calibration: Annotated[
        Path | None,
        Option(
            "Apply this calibration first (zerorate calibrate). With a log's accelerometer, if "
            "any, the g-sensitivity is corrected, too.",
            metavar="CAL",
        ),
    ] = None,
    no_accel: NoAccel = False,
    force: Annotated[bool, Option("Process finished logs again.")] = False,
) -> None:
    """Filter many logs, find their noise, report on or check them; finished logs are skipped."""
    if report and command not in ("replay", "report"):
        raise UsageFault(f"--report is --command report: omit --command {command}")
    command = "report" if report else command
    if command != "replay":
        unused = True if no_accel else None
        _check_unused(command, options, format=format, calibration=calibration, no_accel=unused)
        options = {}
    else:
        check_filter_options(options, [options["method"]])
    arguments = dict(reading.arguments)
    with counting_bar("logs") as progress:
        result = run(
            logs, output, command=command, workers=workers, local_cluster=local_cluster,
            scheduler=scheduler, force=force, progress=progress, accel=not no_accel,
            format=format, calibration=calibration, data_scale=arguments.pop("scale"),
            **arguments, **options,
        )  # fmt: skip
    print(result)
    for path in result.files:
        print(f"wrote {path}")
    if result.failed:
        raise DataFault(f"{len(result.failed)} of {len(result.outcomes)} logs failed")


def _check_unused(command: str, options: Mapping[str, Any], **others: object) -> None:
    """Raise a usage fault for filter options with another command, except the default method."""
    usual = FILTER_OPTIONS["method"].default
    used = [flag(name) for name, value in options.items() if (name, value) != ("method", usual)]
    for option in [*used, *(flag(name) for name, value in others.items() if value is not None)]:
        raise UsageFault(f"{option} has no effect with --command {command}, only with replay")
