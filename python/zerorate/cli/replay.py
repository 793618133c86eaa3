"""``zerorate replay``: one log through the filters."""

from pathlib import Path
from typing import Annotated

import typer

from zerorate.cli.chosen import Chosen
from zerorate.cli.effects import note_on_options
from zerorate.cli.faults import reading
from zerorate.cli.options import (
    RECORDING,
    TOPIC,
    FigureFormat,
    LogFormat,
    Method,
    Motion,
    Noise,
    OutputKind,
    parse_adapt_for,
    parse_columns,
    parse_order,
)
from zerorate.cli.outputs import Outputs
from zerorate.cli.progress import progress_bar
from zerorate.io import open_recording
from zerorate.run.replay import FilterOptions, Summary
from zerorate.run.replay.result import Output
from zerorate.show import format_learned, format_notes, format_table

__all__ = ["compared", "print_result", "replay"]

_PUBLISHED = (Method.kf, Method.akf, Method.fading)


def replay(
    context: typer.Context,
    log: Annotated[Path, typer.Argument(help=RECORDING)],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder of the files.")
    ] = Path("."),
    columns: Annotated[
        str | None, typer.Option(help="Names or indices with commas between.")
    ] = None,
    topic: Annotated[str | None, typer.Option(help=TOPIC)] = None,
    rate: Annotated[float | None, typer.Option(help="Samples per second, Hz.")] = None,
    unit: Annotated[str | None, typer.Option(help="rad/s, deg/s, deg/h.")] = None,
    order: Annotated[str, typer.Option(help="Orders p,q of a published method.")] = "2,1",
    method: Annotated[Method, typer.Option(help="Method of the filtered log.")] = Method.auto,
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
            help="Filtered log: the 'estimate', or the 'compensated' rate, the default of auto.",
        ),
    ] = None,
    fading: Annotated[float, typer.Option(help="Memory of R, 0 to 1.")] = 0.97,
    adapt_for: Annotated[str, typer.Option(help="Seconds of learning, or 'always'.")] = "120",
    forgetting_factor: Annotated[float, typer.Option(help="Of the least squares, 0 to 1.")] = 1.0,
    process_noise: Annotated[
        float, typer.Option(help="Initial G and P, in variances of the start-up.")
    ] = 0.1,
    startup: Annotated[float, typer.Option(help="Seconds of the start-up.")] = 1.0,
    noise: Annotated[Noise, typer.Option(help="Variance that R is taken from.")] = Noise.allan,
    format: Annotated[LogFormat, typer.Option(help="Of the filtered log.")] = LogFormat.parquet,
    figure_format: Annotated[FigureFormat, typer.Option(help="Of the figure.")] = FigureFormat.png,
    no_figure: Annotated[bool, typer.Option("--no-figure", help="Draw no figure.")] = False,
    only: Annotated[
        bool, typer.Option("--only", help="The method alone, without those it is compared with.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
) -> None:
    """Filter every axis of a log, print what it brought, write the filtered log and a figure."""
    options = FilterOptions(
        order=parse_order(order),
        fading=fading,
        adapt_for=parse_adapt_for(adapt_for),
        forgetting_factor=forgetting_factor,
        process_noise=process_noise,
        startup=startup,
        noise=noise.value,
        motion=None if motion is None else motion.value,
    )
    note = note_on_options(context, method, () if only else _baselines(method))
    wanted = parse_columns(columns)
    outputs = Outputs.of(output, log.stem, format, None if no_figure else figure_format, force)
    methods = (method.value,) if only else compared(method)
    kind: Output | None = None if output_kind is None else output_kind.value
    with progress_bar() as progress:
        with reading(wanted is not None):
            recording = open_recording(log, rate, wanted, unit, topic)
        chosen = Chosen(methods, kind, options)
        if no_figure:
            result = chosen.into_file(recording, outputs.log, force, progress)
        else:
            with reading(wanted is not None):
                whole = recording.log()
            result = chosen.in_memory(whole, progress)
            outputs.write(result, progress)
    print_result(result, outputs)
    if note is not None:
        print(note)


def compared(method: Method) -> tuple[str, ...]:
    """Return the published methods up to the chosen one, and that one."""
    return (*(other.value for other in _baselines(method)), method.value)


def _baselines(method: Method) -> tuple[Method, ...]:
    """Return the published methods that the chosen one is compared to."""
    published = _PUBLISHED if method is Method.auto else _PUBLISHED[:2]
    return tuple(other for other in published if other is not method)


def print_result(result: Summary, outputs: Outputs) -> None:
    """Print the table, the notes, and which files were written."""
    parts = (format_table(result), format_learned(result), format_notes(result))
    print("\n\n".join(filter(None, parts)))
    print()
    for path in outputs.paths:
        print(f"wrote {path}")
