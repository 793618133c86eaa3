"""``zerorate identify``: drift models of the gyros of a log."""

from dataclasses import dataclass
from functools import partial
from typing import Annotated, ClassVar, Literal

from zerorate.cli.errors import UsageFault, require
from zerorate.cli.options import FigurePanels, Fix, Force, LogArgument, NoFigure, Output
from zerorate.cli.outputs import check_panels, parts_of, preload_figure, print_result
from zerorate.cli.parameters import option
from zerorate.cli.reading import Reading, ReadingOptions
from zerorate.cli.values import parse_order
from zerorate.identification.arma import MAX_ORDER
from zerorate.identification.order import Criterion
from zerorate.tasks.identify import identify as find_models
from zerorate.tasks.saving import Destination


def _parse_order(flag: str, text: str) -> tuple[int, int]:
    order = parse_order(flag, text)
    if max(order) > MAX_ORDER:
        raise UsageFault(f"{flag} takes p and q from 0 to {MAX_ORDER}, got '{text}'")
    return order


def _parse_none(_: str, text: str) -> str | None:
    return None if text == "none" else text


@dataclass(frozen=True)
class _Model:
    """Options of the model, named as arguments of `zerorate.identify`."""

    panel: ClassVar = "Model"

    order: tuple[int, int] | None = option(
        None,
        "Use this ARMA order: p AR terms and q MA terms.",
        metavar="P,Q",
        parse=_parse_order,
    )
    criterion: Criterion = option("aic", "Criterion for the order.")
    max_order: int = option(10, "Largest AR order to try.", metavar="P")
    estimator: Literal["css", "exact"] = option(
        "css",
        "Estimator of the ARMA model: css (fast) or exact. exact maximises the likelihood and "
        "bridges missing samples. On long records both differ little.",
    )
    segments: int = option(100, "Segments compared by the tests of stationarity.", metavar="N")


@dataclass(frozen=True)
class _Before:
    """Options of the preprocessing of a record, named as arguments of `zerorate.identify`."""

    panel: ClassVar = "Preprocessing of the record"

    outliers: Literal["hampel", "moving-average"] | None = option(
        None,
        "Replace outliers: by a median or a moving average.",
        shown="none",
        choices=("none", "hampel", "moving-average"),
        parse=_parse_none,
    )
    smooth: int = option(
        1,
        "Smooth first by a moving average over N samples. Some papers do so; it changes the model.",
        metavar="N",
    )
    decimate: int = option(1, "Keep every N-th sample, after a low-pass.", metavar="N")
    trend: Literal["mean", "linear"] | None = option(
        None,
        "Subtract the mean or a straight line first.",
        shown="none",
        choices=("none", "mean", "linear"),
        parse=_parse_none,
    )


def identify(
    *,
    log: LogArgument,
    reading: Annotated[Reading, ReadingOptions()],
    fix: Fix = False,
    output: Output = ".",
    figure: FigurePanels = "usual",
    no_figure: NoFigure = False,
    force: Force = False,
    model: _Model,
    before: _Before,
) -> None:
    """Find an ARMA model of the drift of each gyro from a log at rest, and test it.

    Writes a page (HTML) with tables and figures, and all numbers as JSON.
    """
    panels = check_panels(figure, no_figure)
    if not no_figure:
        require("matplotlib", "plot")
    place = Destination.of(output, f"{log.stem}-zerorate-identify", ("html", "json"))
    files = partial(Destination.files, first=".html", others=[".json"], figures=(), force=force)
    parts = parts_of([(log, place)], reading, files)
    if not no_figure:
        preload_figure("identify_figure", svg=True)
    task = partial(find_models, **vars(model), **vars(before), fix=fix, **reading.arguments)
    for part in parts:
        print_result(*part.run(task, 0.9, drawn=not no_figure, panels=panels))
