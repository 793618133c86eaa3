"""``zerorate identify``: drift models of the gyros of one log."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Final, Literal

import typer

from zerorate.cli.background import in_background, preloaded
from zerorate.cli.faults import DataFault, UsageFault, in_options, reading
from zerorate.cli.identify_outputs import IdentifyOutputs
from zerorate.cli.options import (
    RECORDING,
    TOPIC,
    Criterion,
    Estimator,
    Outliers,
    Trend,
    parse_columns,
    parse_order,
)
from zerorate.cli.progress import progress_bar
from zerorate.identify.identification import LEAST_SAMPLES, Identification
from zerorate.identify.identification import identify as identify_axis
from zerorate.io import Log, read_log
from zerorate.noise.records import as_record
from zerorate.run.replay.workers import Progress
from zerorate.show.identify_tables import format_identify, log_notes
from zerorate.show.tables import bulleted

__all__ = ["identify"]

_OUTLIERS: Final[dict[Outliers, Literal["hampel", "moving-average"] | None]] = {
    Outliers.none: None,
    Outliers.hampel: "hampel",
    Outliers.moving_average: "moving-average",
}
_TRENDS: Final[dict[Trend, Literal["mean", "linear"] | None]] = {
    Trend.none: None,
    Trend.mean: "mean",
    Trend.linear: "linear",
}


def identify(
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
    order: Annotated[
        str | None, typer.Option(help="Orders p,q of the model, instead of a choice.")
    ] = None,
    criterion: Annotated[
        Criterion, typer.Option(help="That orders are chosen by.")
    ] = Criterion.aic,
    max_order: Annotated[int, typer.Option(help="Largest order of the AR models.")] = 10,
    segments: Annotated[int, typer.Option(help="That the tests of stationarity compare.")] = 100,
    smooth: Annotated[int, typer.Option(help="Width of a moving average, samples.")] = 1,
    outliers: Annotated[Outliers, typer.Option(help="How they are replaced.")] = Outliers.none,
    trend: Annotated[Trend, typer.Option(help="What is taken off.")] = Trend.none,
    decimate: Annotated[int, typer.Option(help="Samples that become one.")] = 1,
    method: Annotated[Estimator, typer.Option(help="Of the ARMA model.")] = Estimator.css,
    no_figure: Annotated[bool, typer.Option("--no-figure", help="Draw no figures.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
) -> None:
    """Find drift models of gyros from a log at rest, and test whether they may be believed."""
    analysis = partial(
        identify_axis,
        order=None if order is None else parse_order(order),
        criterion=criterion.value,
        max_order=max_order,
        segments=segments,
        smooth=smooth,
        outliers=_OUTLIERS[outliers],
        trend=_TRENDS[trend],
        decimate=decimate,
        method=method.value,
    )
    wanted = parse_columns(columns)
    outputs = IdentifyOutputs.of(output, log.stem, not no_figure, force)
    if not no_figure:
        preloaded(_load_plotting)
    with progress_bar() as progress:
        with reading(wanted is not None):
            recording = read_log(log, rate=rate, columns=wanted, unit=unit, topic=topic)
        found = in_background(lambda: _found(analysis, recording, progress))
        outputs.write(recording, found, progress)
    _print_result(recording, found, outputs)


def _found(
    analysis: Callable[..., Identification], log: Log, progress: Progress
) -> list[Identification]:
    _check(log)
    found = []
    for i, (name, z) in enumerate(zip(log.names, log.data.T, strict=True)):

        def tell(step: str, fraction: float, done: int = i) -> None:
            progress(step, (done + fraction) / log.channels)

        try:
            found.append(analysis(z, log.rate, name=name, unit=log.unit, progress=tell))
        except ValueError as error:
            raise UsageFault(f"{name}: {in_options(error)}") from None
    return found


def _check(log: Log) -> None:
    """Raise a fault of the data where a column cannot be modelled, whatever the options."""
    for name, z in zip(log.names, log.data.T, strict=True):
        try:
            as_record(z, LEAST_SAMPLES, "identification")
        except ValueError as error:
            raise DataFault(
                f"{log.meta['source']}: column '{name}': {error}; others are chosen with --columns"
            ) from None


def _print_result(log: Log, found: Sequence[Identification], outputs: IdentifyOutputs) -> None:
    print(format_identify(found))
    notes = bulleted(log_notes(log))
    if notes:
        print(f"\n{notes}")
    print()
    for path in outputs.paths:
        print(f"wrote {path}")


def _load_plotting() -> None:
    import matplotlib.backends.backend_agg
    import matplotlib.backends.backend_svg
    import matplotlib.figure  # noqa: F401

    import zerorate.show.identify_figure  # noqa: F401
