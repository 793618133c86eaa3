"""``zerorate batch``: many logs through the filter, on all cores or on a cluster."""

from pathlib import Path
from typing import Annotated

import typer

from zerorate.cli.faults import DataFault, UsageFault, in_options
from zerorate.cli.options import LogFormat, Method, Motion, OutputKind, parse_columns
from zerorate.cli.progress import counting_bar
from zerorate.run.batch import BatchResult, Settings, run_batch

__all__ = ["batch"]


def batch(
    logs: Annotated[
        list[str], typer.Argument(help="Logs, or patterns such as 'logs/**/*.parquet'.")
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder of the results.")
    ],
    workers: Annotated[int | None, typer.Option(help="Processes; default one a core.")] = None,
    local_cluster: Annotated[
        int | None, typer.Option(metavar="N", help="N Dask workers on this machine instead.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A Dask scheduler's workers instead.")
    ] = None,
    columns: Annotated[
        str | None, typer.Option(help="Names or indices with commas between.")
    ] = None,
    rate: Annotated[float | None, typer.Option(help="Samples per second, Hz.")] = None,
    unit: Annotated[str | None, typer.Option(help="rad/s, deg/s, deg/h.")] = None,
    method: Annotated[Method, typer.Option(help="Method of the filtered logs.")] = Method.auto,
    motion: Annotated[
        Motion | None,
        typer.Option(
            metavar="<kind>",
            help="'hold' the drift in motion, the default of auto, or 'ignore' motion.",
        ),
    ] = None,
    output_kind: Annotated[
        OutputKind | None,
        typer.Option(
            metavar="<kind>",
            help="Filtered logs: the 'estimate', or the 'compensated' rate, the default of auto.",
        ),
    ] = None,
    format: Annotated[LogFormat, typer.Option(help="Of the filtered logs.")] = LogFormat.parquet,
    force: Annotated[bool, typer.Option("--force", help="Do finished logs again.")] = False,
) -> None:
    """Filter many logs into a folder with a summary; a later run does only what is not finished."""
    wanted = parse_columns(columns)
    try:
        settings = Settings(
            method=method.value,
            motion=None if motion is None else motion.value,
            output=None if output_kind is None else output_kind.value,
            rate=rate,
            columns=None if wanted is None else tuple(wanted),
            unit=unit,
            format=format.value,
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
        raise UsageFault(in_options(error)) from None
    except OSError as error:
        raise DataFault(str(error)) from None
    _print(result)


def _print(result: BatchResult) -> None:
    """Print what became of the logs; a failed one is a fault of the data."""
    counts = result.counts
    print(
        f"{counts['done']} logs done in {result.seconds:.1f} s, "
        f"{counts['skipped']} skipped, {counts['failed']} failed"
    )
    for one in result.failed:
        print(f"failed: {one.name}: {one.error}")
    print(f"wrote {result.summary}")
    if result.failed:
        raise DataFault(f"{len(result.failed)} of {len(result.outcomes)} logs failed")
