"""``zerorate identify``: drift models of the gyros of one log."""

from collections.abc import Callable, Mapping
from contextvars import copy_context
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from io import BytesIO
from pathlib import Path
from threading import Lock
from typing import Annotated, Any, Final, Literal, NoReturn

import typer

from zerorate.cli.errors import DataFault, UsageFault, require
from zerorate.cli.options import (
    FigurePanels,
    Force,
    LogArgument,
    NoFigure,
    Output,
    PanelsOption,
    Reading,
    parse_order,
    with_group,
    with_reading_options,
)
from zerorate.cli.outputs import (
    all_panels,
    check_outputs,
    preload_figure,
    print_written,
    progress_bar,
)
from zerorate.cli.records import print_title, records
from zerorate.faults import said, sentence_of, told
from zerorate.identification.arma import MAX_ORDER
from zerorate.identification.as_json import as_json
from zerorate.identification.identification import LEAST_SAMPLES, Identification
from zerorate.identification.identification import identify as identify_axis
from zerorate.io import read_log
from zerorate.noise.records import as_record
from zerorate.progress import Progress
from zerorate.record import Log
from zerorate.record.log import notes_of
from zerorate.show.identify_page import identification_page
from zerorate.show.identify_tables import format_identify
from zerorate.show.tables import bulleted
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.saving import Destination, Outputs, text_writer
from zerorate.tasks.workers import workers


class Criterion(StrEnum):
    """Criteria of order."""

    fpe = "fpe"
    aic = "aic"
    aicc = "aicc"
    bic = "bic"
    hq = "hq"


class Estimator(StrEnum):
    """Estimates of an ARMA model."""

    css = "css"
    exact = "exact"


class Outliers(StrEnum):
    """Ways to replace outliers."""

    none = "none"
    hampel = "hampel"
    moving_average = "moving-average"


class Trend(StrEnum):
    """What is taken off a record."""

    none = "none"
    mean = "mean"
    linear = "linear"


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


_MODEL: Final = "Model"
_PREPARE: Final = "Before the model: what is done to the record"
"""Panels of help."""


@dataclass(frozen=True)
class _OfModel:
    """What is typed of the model."""

    order: Annotated[
        str | None,
        typer.Option(
            metavar="P,Q",
            help="Take this order of the ARMA model, p autoregressive and q moving-average terms, "
            "instead of choosing one.",
        ),
    ] = None
    criterion: Annotated[Criterion, typer.Option(help="Criterion that chooses the order.")] = (
        Criterion.aic
    )
    max_order: Annotated[int, typer.Option(metavar="P", help="Largest AR order that is tried.")] = (
        10
    )
    estimator: Annotated[
        Estimator,
        typer.Option(
            help="How the ARMA model is estimated: css, the conditional sum of squares, is fast; "
            "exact, the likelihood, bridges missing samples. On long records they differ little."
        ),
    ] = Estimator.css
    segments: Annotated[
        int,
        typer.Option(
            metavar="N", help="Parts of the record that the tests of stationarity compare."
        ),
    ] = 100

    def arguments(self) -> dict[str, Any]:
        """Return those of the identification of an axis."""
        return {
            "order": None if self.order is None else _order(self.order),
            "criterion": self.criterion.value,
            "max_order": self.max_order,
            "method": self.estimator.value,
            "segments": self.segments,
        }


@dataclass(frozen=True)
class _Before:
    """What is typed of what is done to the record first."""

    outliers: Annotated[
        Outliers,
        typer.Option(
            help="How outliers are replaced: by the median of their neighbours (hampel), or by a "
            "moving average."
        ),
    ] = Outliers.none
    smooth: Annotated[
        int,
        typer.Option(
            metavar="N",
            help="Moving average over so many samples first, as some papers do; it changes the "
            "model.",
        ),
    ] = 1
    decimate: Annotated[
        int, typer.Option(metavar="N", help="Keep every N-th sample, after a low-pass.")
    ] = 1
    trend: Annotated[Trend, typer.Option(help="Subtract the mean or a straight line first.")] = (
        Trend.none
    )

    def arguments(self) -> dict[str, Any]:
        """Return those of the identification of an axis."""
        return {
            "outliers": _OUTLIERS[self.outliers],
            "smooth": self.smooth,
            "decimate": self.decimate,
            "trend": _TRENDS[self.trend],
        }


@with_group(_OfModel, "model", _MODEL)
@with_group(_Before, "before", _PREPARE)
@with_reading_options()
def identify(
    *,
    log: LogArgument,
    reading: Reading,
    output: Output = ".",
    figure: PanelsOption = FigurePanels.usual,
    no_figure: NoFigure = False,
    force: Force = False,
    model: _OfModel,
    before: _Before,
) -> None:
    """Find an ARMA model of the drift of each gyro from a log at rest, and test it.

    Writes a page (HTML) with tables and figures, and all numbers as JSON.
    """
    analysis = partial(identify_axis, **model.arguments(), **before.arguments())
    everything = all_panels(figure, not no_figure)
    all_of_them = records(log, reading.group_by)
    place = Destination.of(output, f"{log.stem}-zerorate-identify", ("html", "json"))
    if not no_figure:
        require("matplotlib", "plot")
    outputs = [
        place.of_part(one.ending).files(".html", [".json"], (), force) for one in all_of_them
    ]
    check_outputs([path for files in outputs for path in files.paths], force, log)
    if not no_figure:
        preload_figure("identify_figure", svg=True)
    for one, files in zip(all_of_them, outputs, strict=True):
        with progress_bar() as progress:
            recording = reading.read(read_log, one.source)
            draw = None if no_figure else partial(_svg, everything=everything)
            found = in_background(partial(_found, analysis, draw, recording, progress))
            texts = _texts(recording, found)
            files.write([*map(text_writer, texts)], (), progress)
        print_title(one, first=one is all_of_them[0])
        _print_result(found, files)


def _order(text: str) -> tuple[int, int]:
    order = parse_order(text)
    if max(order) > MAX_ORDER:
        raise UsageFault(f"--order takes p and q from 0 to {MAX_ORDER}, got '{text}'")
    return order


@dataclass(frozen=True)
class _Found:
    """What was found out about each axis, figures by name, notes on log and axes left out."""

    axes: list[Identification]
    drawings: Mapping[str, bytes]
    notes: tuple[str, ...]


def _found(
    analysis: Callable[..., Identification],
    draw: Callable[[Identification], bytes] | None,
    log: Log,
    progress: Progress,
) -> _Found:
    """Return what can be said of each axis, which share the cores; a fault if of none.

    An axis is drawn while the next ones are looked at.
    """
    fractions = [0.0] * log.channels
    drawings: dict[str, bytes] = {}
    one_at_a_time = Lock()

    def of_axis(i: int) -> Identification | ValueError:
        def tell(step: str, fraction: float) -> None:
            fractions[i] = fraction
            progress(step, sum(fractions) / log.channels)

        try:
            z, name = log.data[:, i], log.names[i]
            found = analysis(z, log.rate, name=name, unit=log.unit, progress=tell)
        except ValueError as error:
            return error
        if draw:
            # Settings of figures are those of the whole process.
            with one_at_a_time:
                tell("drawing", 1.0)
                drawings[found.name] = draw(found)
        return found

    with workers() as executor:
        # What holds round the caller holds in each thread, such as what arguments are called.
        jobs = [executor.submit(copy_context().run, of_axis, i) for i in range(log.channels)]
        results = [job.result() for job in jobs]
    axes = [found for found in results if isinstance(found, Identification)]
    pairs = zip(log.names, results, strict=True)
    refused = {name: sentence_of(found) for name, found in pairs if isinstance(found, ValueError)}
    if not axes:
        _refuse(log, refused)
    left_out = (said(f"{name} is left out: ", reason) for name, reason in refused.items())
    return _Found(axes, drawings, (*notes_of(log, even=True), *left_out))


def _refuse(log: Log, reasons: Mapping[str, str]) -> NoReturn:
    """Raise a fault of the data where no column can be modelled, else one of the options."""
    listed = "; ".join(f"column '{name}': {told(reason)}" for name, reason in reasons.items())
    for z in log.data.T:
        try:
            as_record(z, LEAST_SAMPLES, "identification")
        except ValueError:
            raise DataFault(
                f"{log.meta['source']}: {listed}; others are chosen with --columns"
            ) from None
    name, reason = next(iter(reasons.items()))
    raise UsageFault(f"{name}: {told(reason)}")


def _print_result(found: _Found, outputs: Outputs) -> None:
    print(format_identify(found.axes))
    notes = bulleted(found.notes)
    if notes:
        print(f"\n{notes}")
    print_written(outputs.paths)


def _texts(log: Log, found: _Found) -> tuple[str, str]:
    """Return the page and the numbers."""
    source = Path(log.meta["source"]).name
    page = identification_page(found.axes, source, found.drawings, found.notes)
    return page, as_json(found.axes, source, found.notes)


def _svg(found: Identification, everything: bool) -> bytes:
    from matplotlib import rc_context

    from zerorate.show import plot_identification

    buffer = BytesIO()
    # The same log gives the same bytes.
    with rc_context({"svg.hashsalt": found.name}):
        plot_identification(found, everything).savefig(
            buffer, format="svg", metadata={"Date": None}
        )
    return buffer.getvalue()
