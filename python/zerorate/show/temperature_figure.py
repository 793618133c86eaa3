"""Figure of a temperature model: bias against temperature, coloured by time."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.numerals import shorten
from zerorate.show.style import (
    BLACK,
    BLUE,
    FONT_PT,
    GREY,
    add_colour_bar,
    add_panel,
    new_figure,
    style_panels,
    time_unit,
    write_caption,
)
from zerorate.types import Floats
from zerorate.units import UNITS, convert

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import PathCollection
    from matplotlib.figure import Figure

    from zerorate.calibration.temperature import TemperatureModel

_SINGLE_PANEL_MM: Final = (96.0, 54.0)
_PANEL_MM: Final = (52.0, 50.0)
_MAX_COLUMNS: Final = 3

# Sizes in mm: margins, gaps between panels, and the colour bar.
_LEFT, _RIGHT, _TOP, _BOTTOM = 15.0, 15.0, 6.0, 17.0
_COLUMN_GAP_MM, _ROW_GAP_MM = 11.0, 14.0
_BAR, _BAR_GAP = 2.5, 2.5
_LETTER_WIDTH_MM: Final = 1.2
"""Width of a letter in the caption, mm."""

_MARGIN: Final = 0.06
_MIN_SPAN_K: Final = 2.0
_BAND_SIGMAS: Final = 2.0
_POINT_COUNT: Final = 300


def plot_temperature(model: TemperatureModel) -> Figure:
    """Return a figure of a record's mean biases over temperature, with the model.

    Points are coloured by time. The curve has a band of two standard errors. Outside the record's
    range it is dashed on grey. Angular rates are in deg/s or deg/h. A model that was read from a
    file has no points.
    """
    shown = _convert_shown(model)
    columns = min(shown.axes, _MAX_COLUMNS)
    rows = -(-shown.axes // columns)
    width, height = _SINGLE_PANEL_MM if shown.axes == 1 else _PANEL_MM
    full_width = _LEFT + columns * width + (columns - 1) * _COLUMN_GAP_MM + _RIGHT
    full_height = _BOTTOM + rows * height + (rows - 1) * _ROW_GAP_MM + _TOP
    figure = new_figure(full_width, full_height)
    panels = []
    for i in range(shown.axes):
        left = _LEFT + (i % columns) * (width + _COLUMN_GAP_MM)
        bottom = _BOTTOM + (rows - 1 - i // columns) * (height + _ROW_GAP_MM)
        panels.append(add_panel(figure, left, bottom, width, height))
    points = [_draw_axis(axes, shown, i) for i, axes in enumerate(panels)]
    for i, axes in enumerate(panels):
        axes.set_title(shown.names[i])
        axes.set_xlabel("temperature [degC]")
        if i % columns == 0:
            axes.set_ylabel(f"bias [{shown.unit}]")
    style_panels(panels)
    if points[0] is not None:
        left = full_width - _RIGHT + _BAR_GAP
        bar = add_colour_bar(panels[0], figure, left, _BOTTOM, _BAR, height)
        _write_times(bar, points[0], shown)
    write_caption(figure, fill(_make_caption(shown), int(full_width / _LETTER_WIDTH_MM)))
    return figure


def _convert_shown(model: TemperatureModel) -> TemperatureModel:
    """Return the model in a readable unit."""
    if model.unit not in UNITS or UNITS[model.unit].kind != "rate":
        return model
    largest = convert(float(np.abs(model.coefficients).max()), model.unit, "deg/s")
    unit = "deg/s" if largest >= 0.01 else "deg/h"
    return model.scaled(convert(1.0, model.unit, unit), unit)


def _draw_axis(axes: Axes, model: TemperatureModel, i: int) -> PathCollection | None:
    low, high = model.range
    reach = max(0.25 * model.span, 0.5 * _MIN_SPAN_K)
    T = np.unique(
        np.concatenate((np.linspace(low - reach, high + reach, _POINT_COUNT), [low, high]))
    )
    value, sigma = _predict(model, T, i)
    inside = (low <= T) & (high >= T)
    axes.axvspan(T[0], low, color=GREY, lw=0, alpha=0.5)
    axes.axvspan(high, T[-1], color=GREY, lw=0, alpha=0.5)
    axes.fill_between(
        T, value - _BAND_SIGMAS * sigma, value + _BAND_SIGMAS * sigma, color=BLUE, alpha=0.18, lw=0
    )
    axes.plot(T[inside], value[inside], color=BLACK, lw=0.9, zorder=3)
    for beyond in (low >= T, high <= T):
        axes.plot(T[beyond], value[beyond], color=BLACK, lw=0.9, ls=(0, (3, 2)), zorder=3)
    points = _draw_means(axes, model, i)
    axes.set_xlim(T[0], T[-1])
    _set_height(axes, model, i, value)
    return points


def _predict(model: TemperatureModel, T: Floats, i: int) -> tuple[Floats, Floats]:
    prediction = model.predict(T)
    values, sigmas = (
        part.reshape(T.size, -1)[:, i] for part in (prediction.value, prediction.sigma)
    )
    return values, sigmas


def _draw_means(axes: Axes, model: TemperatureModel, i: int) -> PathCollection | None:
    blocks = model.blocks
    if blocks is None:
        return None
    temperature = np.where(np.isfinite(blocks.temperature), blocks.temperature, model.reference)
    _, seconds = time_unit(float(blocks.time[-1]))
    return axes.scatter(
        temperature,
        blocks.bias[:, i],
        c=blocks.time / seconds,
        cmap="viridis",
        s=3.0,
        linewidths=0,
        rasterized=True,
    )


def _set_height(axes: Axes, model: TemperatureModel, i: int, curve: Floats) -> None:
    """Set limits that show points and curve; the band may exceed the panel."""
    blocks = model.blocks
    values = curve if blocks is None else np.concatenate((curve, blocks.bias[:, i]))
    low, high = float(values.min()), float(values.max())
    margin = _MARGIN * (high - low) or 1e-3 * abs(high) or 1.0
    axes.set_ylim(low - margin, high + margin)


def _write_times(bar: Axes, points: PathCollection, model: TemperatureModel) -> None:
    assert model.blocks is not None
    unit, _ = time_unit(float(model.blocks.time[-1]))
    scale = points.figure.colorbar(points, cax=bar)
    scale.set_label(f"time [{unit}]")
    bar.tick_params(labelsize=FONT_PT - 0.5, width=0.5, length=2.0, pad=1.5)
    bar.yaxis.label.set_fontsize(FONT_PT)
    scale.outline.set_linewidth(0.5)


def _make_caption(model: TemperatureModel) -> str:
    parts = []
    if model.blocks is not None:
        parts.append(f"Means of {shorten(model.blocks.length, 3)} s at rest")
    parts.append("curve at the final level, with two standard errors")
    parts.append("grey: beyond the record, along the tangent")
    return "; ".join(parts).capitalize() + "."
