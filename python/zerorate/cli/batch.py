"""``zerorate batch``: many logs through the filter, on all cores or on a cluster."""

from collections.abc import Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from zerorate.cli.errors import DataFault, UsageFault, in_options, of_a_file
from zerorate.cli.options import (
    LogFormat,
    Reading,
    check_filter_options,
    with_filter_options,
    with_reading_options,
)
from zerorate.cli.outputs import counting_bar
from zerorate.run.batch import BatchResult, Settings, run_batch

__all__ = ["batch"]


@with_filter_options(
    help={
        "method": "Method of the filtered logs.",
        "output": "Filtered logs: the 'estimate' of the drift, or the rate 'compensated' by it, "
        "the default of auto.",
    },
    method="auto",
    output=None,
)
@with_reading_options(without=["group_by"])
def batch(
    *,
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
    reading: Reading,
    options: Mapping[str, Any],
    format: Annotated[LogFormat, typer.Option(help="Of the filtered logs.")] = LogFormat.parquet,
    force: Annotated[bool, typer.Option("--force", help="Do finished logs again.")] = False,
) -> None:
    """Filter many logs into a folder with a summary; a later run does only what is not finished."""
    check_filter_options(options, [options["method"]])
    try:
        asked = dict(reading.arguments)
        settings = Settings(data_scale=asked.pop("scale"), **asked, format=format.value, **options)
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
        raise DataFault(of_a_file(error)) from None
    _print(result)


_SHOWN: Final = 20
"""Notes that are printed; all stand in the summary."""


def _print(result: BatchResult) -> None:
    """Print what became of the logs; a failed one is a fault of the data."""
    counts = result.counts
    print(
        f"{counts['done']} logs done in {result.seconds:.1f} s, "
        f"{counts['skipped']} skipped, {counts['failed']} failed"
    )
    for one in result.failed:
        print(f"failed: {one.name}: {in_options(one.error)}")
    if result.left_out:
        print(f"left out: {len(result.left_out)} files that a batch has written")
    _print_notes(result.notes)
    print(f"wrote {result.summary}")
    if result.failed:
        raise DataFault(f"{len(result.failed)} of {len(result.outcomes)} logs failed")


def _print_notes(notes: Mapping[str, Sequence[str]]) -> None:
    for note, logs in islice(notes.items(), _SHOWN):
        print(f"note: {logs[0]}{_and_others(len(logs) - 1)}: {in_options(note)}")
    if len(notes) > _SHOWN:
        print(f"{len(notes) - _SHOWN} more notes are in the summary")


def _and_others(count: int) -> str:
    return f" and {count} other{'s' if count > 1 else ''}" if count else ""
