"""``zerorate identify``: drift models of the gyros of one log."""

from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import Annotated, Any, Final, Literal

import typer

from zerorate.cli.errors import UsageFault, print_alarms, require
from zerorate.cli.options import (
    FigurePanels,
    Fix,
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
from zerorate.identification.arma import MAX_ORDER
from zerorate.tasks.identify import identify as find_models
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.saving import Destination, files_of


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
        """Return those of `zerorate.identify`."""
        return {
            "order": None if self.order is None else _order(self.order),
            "criterion": self.criterion.value,
            "max_order": self.max_order,
            "estimator": self.estimator.value,
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
        """Return those of `zerorate.identify`."""
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
    fix: Fix = False,
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
    asked = {**model.arguments(), **before.arguments(), "fix": fix, **reading.arguments}
    panels = "all" if all_panels(figure, not no_figure) else "usual"
    parts = records(log, reading.group_by)
    place = Destination.of(output, f"{log.stem}-zerorate-identify", ("html", "json"))
    if not no_figure:
        require("matplotlib", "plot")
    outputs = [place.of_part(one.ending).files(".html", [".json"], (), force) for one in parts]
    check_outputs([path for files in outputs for path in files.paths], force, log)
    if not no_figure:
        preload_figure("identify_figure", svg=True)
    for one, files in zip(parts, outputs, strict=True):
        with progress_bar() as progress:
            found = in_background(partial(find_models, one.source, progress=progress, **asked))
            progress("drawing", 0.9)
            files.save(files_of(found, drawn=not no_figure, panels=panels), progress)
        print_title(one, first=one is parts[0])
        print_alarms(found.alarms)
        print(found)
        print_written(files.paths)


def _order(text: str) -> tuple[int, int]:
    order = parse_order(text)
    if max(order) > MAX_ORDER:
        raise UsageFault(f"--order takes p and q from 0 to {MAX_ORDER}, got '{text}'")
    return order
