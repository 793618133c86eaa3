"""Figure of an identification."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Final

from zerorate.identification.conclusions import model_name
from zerorate.identification.identification import Identification
from zerorate.numerals import format_significant, shorten
from zerorate.show.identify_panels import (
    draw_acf,
    draw_ar_orders,
    draw_arma_orders,
    draw_online,
    draw_pacf,
    draw_quantiles,
    draw_residual_acf,
    draw_series,
    draw_spectrum,
    style_orders,
    style_times,
)
from zerorate.show.stack import INNER_WIDTH_MM, LEFT_MM, Stack, write_head
from zerorate.show.style import (
    add_panel,
    new_figure,
    style_decades,
    style_panels,
    write_caption,
    write_title,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.tasks.identify import Identified

# Sizes in mm.
_WIDTH: Final = 180.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 14.0, 4.0, 9.0, 16.0
_PANEL: Final = 36.0
_BETWEEN_COLUMNS, _BETWEEN_ROWS = 14.0, 14.0
_ROWS, _COLUMNS = 4, 3

# Sizes for the usual six panels in a page column.
_HEIGHTS_MM: Final = (15.0, 24.0, 20.0, 20.0)
_PANEL_COUNT: Final = 6
_AXIS_HEIGHT_MM, _COLUMN_GAP_MM = 6.5, 10.0
_BETWEEN: Final = 3.0 * _AXIS_HEIGHT_MM
_SIGNIFICANCE: Final = 0.05
_QUESTION: Final = "Which model describes the drift?"
_SHORT_CAPTION: Final = (
    "Grey: 95 % bounds of white noise, and criteria within the margin of the minimum. Hollow: "
    "minimum; filled: clear choice."
)


def plot_identified(result: Identified) -> Figure:
    """Return the figure of the first axis; `plot_identification` draws the other axes."""
    return plot_identification(result.axes[0])


def plot_identification(identification: Identification, everything: bool = False) -> Figure:
    """Return the figure of one axis, as wide as a page column.

    The panels are:

    - record with its motion and the means of its segments
    - spectrum of the record and of the models
    - autocorrelation, and the criteria of all orders
    - autocorrelation and quantiles of the residuals

    `everything`: draw all nine panels instead, 180 mm wide. This adds the partial autocorrelation,
    the orders of autoregressive models, and the coefficients during online learning.
    """
    if everything:
        return _plot_all_panels(identification)
    stack = Stack(_QUESTION, _describe_model(identification), _SHORT_CAPTION, _HEIGHTS_MM, _BETWEEN)
    series, spectrum = _add_panel(stack), _add_panel(stack)
    half = 0.5 * (INNER_WIDTH_MM - _COLUMN_GAP_MM)
    lefts = LEFT_MM, LEFT_MM + half + _COLUMN_GAP_MM
    acf, orders, residuals, quantiles = (
        _add_panel(stack, left, half, left == lefts[1]) for _ in range(2) for left in lefts
    )
    draw_series(series, identification)
    draw_spectrum(spectrum, identification)
    draw_acf(acf, identification)
    draw_arma_orders(orders, identification)
    draw_residual_acf(residuals, identification)
    draw_quantiles(quantiles, identification)
    for panel, text in (
        (series, f"record [{identification.unit}]"),
        (spectrum, f"spectrum [({identification.unit})²/Hz]"),
        (acf, "its autocorrelation"),
        (orders, "ARMA orders"),
        (residuals, residuals.get_title()),
        (quantiles, "quantiles of residuals"),
    ):
        panel.set_title("")
        panel.set_ylabel("")
        write_head(panel, text)
    quantiles.set_xlabel("Gaussian [σ]")
    record = identification.record
    seconds = record.sample_count / record.rate
    figure = stack.finish(identification.name, record.rate, seconds)
    if spectrum.lines:
        style_decades(spectrum, min_decades=2)
    style_orders(orders, identification.arma_orders.margin)
    return figure


def _add_panel(
    stack: Stack, left: float = LEFT_MM, width: float = INNER_WIDTH_MM, last: bool = True
) -> Axes:
    """Return the next panel; in a row of panels it leaves room for its own axis."""
    panel = stack.add(left, width, last)
    if last and len(stack.panels) < _PANEL_COUNT:
        stack.skip(_AXIS_HEIGHT_MM)
    return panel


def _describe_model(identification: Identification) -> str:
    """Return the model's description, and True if its residuals are white."""
    p = identification.whiteness.ljung_box.p_value
    verdict = "its residuals may be white" if p > _SIGNIFICANCE else "its residuals are not white"
    name = model_name(identification.model.order)
    return f"{name[0].upper()}{name[1:]}; {verdict} (Ljung-Box, p {_format_p(p)})."


def _format_p(p: float) -> str:
    return "< 1e-6" if p < 1e-6 else f"= {format_significant(p, 2)}"


def _plot_all_panels(identification: Identification) -> Figure:
    height = _TOP + _BOTTOM + _ROWS * _PANEL + (_ROWS - 1) * _BETWEEN_ROWS
    figure = new_figure(_WIDTH, height)
    draw_series(_add_grid_panel(figure, height, 0, 0, 3), identification)
    draw_acf(_add_grid_panel(figure, height, 1, 0), identification)
    draw_pacf(_add_grid_panel(figure, height, 1, 1), identification)
    spectrum = _add_grid_panel(figure, height, 1, 2)
    draw_spectrum(spectrum, identification)
    orders = [_add_grid_panel(figure, height, 2, column) for column in (0, 1)]
    draw_ar_orders(orders[0], identification)
    draw_arma_orders(orders[1], identification)
    draw_residual_acf(_add_grid_panel(figure, height, 2, 2), identification)
    draw_quantiles(_add_grid_panel(figure, height, 3, 0), identification)
    online = _add_grid_panel(figure, height, 3, 1, 2)
    draw_online(online, identification)
    style_panels(figure.axes)
    if spectrum.lines:
        style_decades(spectrum, min_decades=2)
    style_times(online)
    for axes in orders:
        style_orders(axes, identification.arma_orders.margin)
    title = f"{identification.name}: {model_name(identification.model.order)}"
    write_title(figure, title)
    write_caption(figure, textwrap.fill(_make_caption(identification), 170))
    return figure


def _add_grid_panel(figure: Figure, height: float, row: int, column: int, span: int = 1) -> Axes:
    """Return the panel at a position of the grid, `span` columns wide."""
    inner = _WIDTH - _LEFT - _RIGHT - (_COLUMNS - 1) * _BETWEEN_COLUMNS
    single = inner / _COLUMNS
    left = _LEFT + column * (single + _BETWEEN_COLUMNS)
    bottom = height - _TOP - (row + 1) * _PANEL - row * _BETWEEN_ROWS
    width = span * single + (span - 1) * _BETWEEN_COLUMNS
    return add_panel(figure, left, bottom, width, _PANEL)


def _make_caption(identification: Identification) -> str:
    record = identification.record
    margin = identification.arma_orders.margin
    return (
        f"{record.sample_count:,} samples at {shorten(record.rate, 4)} Hz. Grey bands: 95 % "
        "bounds of "
        f"white noise; criteria within {margin:g} of the least. Hollow: minimum of a criterion; "
        f"filled: clear choice. Coloured bands, bottom right: offline values ± one standard "
        f"error; online estimates, from one pass, approach them with time."
    )
