"""``zerorate compare``: many methods on the same logs."""

from pathlib import Path
from typing import Annotated

import typer

from zerorate.cli.faults import DataFault, UsageFault, as_usage, in_options, reading, writing
from zerorate.cli.options import parse_columns, parse_names
from zerorate.cli.progress import progress_bar
from zerorate.compare import METHODS, Comparison, Recording, read_recording
from zerorate.compare import compare as run_methods
from zerorate.compare.as_json import as_json
from zerorate.io import LogError, atomic_path, check_writable
from zerorate.replay.workers import Progress
from zerorate.report.compare import format_compare

__all__ = ["compare"]


def compare(
    logs: Annotated[
        list[Path], typer.Argument(help="Recordings: csv, tsv, txt, npy, npz or parquet.")
    ],
    reference: Annotated[
        str | None, typer.Option(help="Column of an encoder's angle or of a true rate.")
    ] = None,
    quaternion: Annotated[
        str | None, typer.Option(help="Columns w,x,y,z of the true orientation.")
    ] = None,
    methods: Annotated[str, typer.Option(help="Names with commas between.")] = ",".join(METHODS),
    columns: Annotated[
        str | None, typer.Option(help="Names or indices with commas between.")
    ] = None,
    rate: Annotated[float | None, typer.Option(help="Samples per second, Hz.")] = None,
    unit: Annotated[str | None, typer.Option(help="rad/s, deg/s, deg/h.")] = None,
    per_axis: Annotated[bool, typer.Option("--per-axis", help="A table of every axis.")] = False,
    json: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write all numbers, too.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
) -> None:
    """Compare filters on logs by what they cost their user, at rest and in motion."""
    wanted = parse_columns(columns)
    names = parse_names("--methods", methods)
    truth = None if quaternion is None else parse_names("--quaternion", quaternion)
    if json is not None:
        with as_usage():
            check_writable(json, force)
    with progress_bar() as progress:
        recordings = []
        for log in logs:
            with reading(bool(wanted or reference or truth)):
                recordings.append(read_recording(log, rate, wanted, unit, reference, truth))
        found = _compared(recordings, names, progress)
    if json is not None:
        with writing(), atomic_path(json, force) as temporary:
            temporary.write_text(as_json(found), encoding="utf-8", newline="\n")
    print(format_compare(found, per_axis))
    if json is not None:
        print(f"\nwrote {json}")


def _compared(
    recordings: list[Recording], methods: list[str], progress: Progress
) -> tuple[Comparison, ...]:
    try:
        return run_methods(recordings, methods, progress)
    except LogError as error:
        raise DataFault(in_options(error)) from None
    except ValueError as error:
        raise UsageFault(in_options(error)) from None
