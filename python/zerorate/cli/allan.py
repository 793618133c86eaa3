"""``zerorate allan``: the noise of the sensors of one log."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from zerorate.cli.allan_outputs import AllanOutputs
from zerorate.cli.background import in_background, preloaded
from zerorate.cli.faults import DataFault, UsageFault, as_usage, in_options, reading
from zerorate.cli.options import (
    RECORDING,
    TOPIC,
    CurveFormat,
    FigureFormat,
    parse_columns,
    parse_exports,
    parse_taus,
    parse_units,
)
from zerorate.cli.progress import progress_bar
from zerorate.io import Log, LogError
from zerorate.io.sensors import read_sensors
from zerorate.noise.characterise import Characterisation, characterise
from zerorate.noise.kinds import kind as find_kind
from zerorate.run.replay.workers import Progress
from zerorate.show import format_allan, format_allan_notes

__all__ = ["allan"]


def allan(
    log: Annotated[Path, typer.Argument(help=RECORDING)],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder of the files.")
    ] = Path("."),
    columns: Annotated[
        str | None, typer.Option(help="Names or indices with commas between.")
    ] = None,
    topic: Annotated[str | None, typer.Option(help=TOPIC)] = None,
    rate: Annotated[float | None, typer.Option(help="Samples per second, Hz.")] = None,
    unit: Annotated[
        str | None, typer.Option(help="Of gyros, of accelerometers, or both: deg/s,g.")
    ] = None,
    kind: Annotated[str, typer.Option(help="oadev, mdev, ohdev, totdev, ...")] = "oadev",
    taus: Annotated[str, typer.Option(help="octave, decade, all, or seconds.")] = "octave",
    bridge: Annotated[int, typer.Option(help="Longest gap to fill, samples.")] = 0,
    confidence: Annotated[float, typer.Option(help="Of the bounds, 0 to 1.")] = 0.683,
    markov: Annotated[int, typer.Option(help="Markov terms to find.")] = 0,
    second_opinion: Annotated[
        bool, typer.Option(help="Estimate from the spectrum as well.")
    ] = True,
    export: Annotated[
        str | None, typer.Option(help="Some of kalibr,vins,orbslam3,px4,json.")
    ] = None,
    format: Annotated[CurveFormat, typer.Option(help="Of the curve.")] = CurveFormat.csv,
    figure_format: Annotated[FigureFormat, typer.Option(help="Of the figure.")] = FigureFormat.png,
    no_figure: Annotated[bool, typer.Option("--no-figure", help="Draw no figure.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
) -> None:
    """Characterise the noise of gyros and accelerometers from a log at rest."""
    with as_usage():
        family = find_kind(kind)
    if markov < 0:
        raise UsageFault(f"--markov must not be negative, got {markov}")
    analysis = partial(
        characterise,
        kind=family.name,
        taus=parse_taus(taus),
        bridge=bridge,
        confidence=confidence,
        markov=markov,
        second_opinion=second_opinion,
    )
    figure = None if no_figure else figure_format
    exports = parse_exports(export)
    wanted, units = parse_columns(columns), parse_units(unit)
    outputs = AllanOutputs.of(output, log.stem, format, figure, exports, force)
    if figure is not None:
        preloaded(_load_plotting)
    with progress_bar() as progress:
        with reading(wanted is not None):
            sensors = read_sensors(log, rate=rate, columns=wanted, units=units, topic=topic)
        found = in_background(lambda: [_found(analysis, s, progress) for s in sensors])
        outputs.write(found, progress)
    _print_result(found, outputs)


def _found(analysis: partial[Characterisation], log: Log, progress: Progress) -> Characterisation:
    try:
        with as_usage():
            return analysis(log, progress=progress)
    except LogError as error:
        raise DataFault(f"{log.meta['source']}: {in_options(error)}") from None


def _print_result(found: Sequence[Characterisation], outputs: AllanOutputs) -> None:
    print(format_allan(found))
    notes = format_allan_notes(found)
    if notes:
        print(f"\n{in_options(notes)}")
    print()
    for path in outputs.paths:
        print(f"wrote {path}")


def _load_plotting() -> None:
    import matplotlib.backends.backend_agg
    import matplotlib.figure  # noqa: F401

    import zerorate.show.allan_figure  # noqa: F401
