"""The figure of an identification."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Final

from zerorate.identify.conclusions import model_name
from zerorate.identify.identification import Identification
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

# Millimetres.
_WIDTH: Final = 180.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 14.0, 4.0, 9.0, 16.0
_PANEL: Final = 36.0
_BETWEEN_COLUMNS, _BETWEEN_ROWS = 14.0, 14.0
_ROWS, _COLUMNS = 4, 3


def plot_identification(found: Identification) -> Figure:
    """Return the figure of one axis, 180 mm wide.

    Parameters
    ----------
    found : Identification
        What was found out.

    Returns
    -------
    matplotlib.figure.Figure
        The record with the means of its segments and where it moved; its correlation; its
        spectrum with those of the models; the criteria of all orders; correlation and quantiles
        of the residuals; and the coefficients as they are learned online. No global state of
        matplotlib is used.
    """
    height = _TOP + _BOTTOM + _ROWS * _PANEL + (_ROWS - 1) * _BETWEEN_ROWS
    figure = new_figure(_WIDTH, height)
    draw_series(_axes(figure, height, 0, 0, 3), found)
    draw_acf(_axes(figure, height, 1, 0), found)
    draw_pacf(_axes(figure, height, 1, 1), found)
    spectrum = _axes(figure, height, 1, 2)
    draw_spectrum(spectrum, found)
    orders = [_axes(figure, height, 2, column) for column in (0, 1)]
    draw_ar_orders(orders[0], found)
    draw_arma_orders(orders[1], found)
    draw_residual_acf(_axes(figure, height, 2, 2), found)
    draw_quantiles(_axes(figure, height, 3, 0), found)
    online = _axes(figure, height, 3, 1, 2)
    draw_online(online, found)
    style_panels(figure.axes)
    if spectrum.lines:
        style_decades(spectrum, fewest=2)
    style_times(online)
    for axes in orders:
        style_orders(axes, found.arma_orders.margin)
    title = f"{found.name}: {model_name(found.model.order)}"
    write_title(figure, title)
    write_caption(figure, textwrap.fill(_caption(found), 170))
    return figure


def _axes(figure: Figure, height: float, row: int, column: int, span: int = 1) -> Axes:
    """Return the panel at a place of the grid, so many columns wide."""
    inner = _WIDTH - _LEFT - _RIGHT - (_COLUMNS - 1) * _BETWEEN_COLUMNS
    single = inner / _COLUMNS
    left = _LEFT + column * (single + _BETWEEN_COLUMNS)
    bottom = height - _TOP - (row + 1) * _PANEL - row * _BETWEEN_ROWS
    width = span * single + (span - 1) * _BETWEEN_COLUMNS
    return add_panel(figure, left, bottom, width, _PANEL)


def _caption(found: Identification) -> str:
    record = found.record
    margin = found.arma_orders.margin
    return (
        f"{record.sample_count:,} samples at {record.rate:.4g} Hz. Grey bands: 95 % bounds of "
        f"white noise; criteria within {margin:g} of the least. Hollow: the least of a criterion; "
        "filled: the clear choice. Coloured bands, bottom right: the offline values ± one standard "
        "error; what is learned online, in one pass, comes near them with time, and need not have "
        "reached them."
    )
