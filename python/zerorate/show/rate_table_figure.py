"""Figure of a gyro's non-linearity on a rate table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.show.style import (
    BLUE,
    ORANGE,
    VERMILION,
    add_panel,
    new_figure,
    style_panels,
    write_caption,
    write_legend,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.calibration.rate.rate_table import RateTable

# Sizes in mm.
_WIDTH, _PANEL, _LEFT, _BELOW, _ABOVE = 90.0, 38.0, 16.0, 13.0, 6.0
_COLOURS: Final = (BLUE, VERMILION, ORANGE)


def plot_rate_table(table: RateTable) -> Figure:
    """Return a figure of the residuals from the line of bias and scale, one panel per axis.

    The residuals are divided by the scale, so they have the unit of the rates.

    `table`: fit of the rate table. Its means are drawn with two standard errors, and the fitted
    curve.
    """
    count = len(table.axes)
    height = _BELOW + count * (_PANEL + _ABOVE)
    figure = new_figure(_WIDTH, height)
    panels = []
    for i in range(count):
        bottom = _BELOW + (count - 1 - i) * (_PANEL + _ABOVE)
        panels.append(add_panel(figure, _LEFT, bottom, _WIDTH - _LEFT - 4.0, _PANEL))
        _draw_axis(panels[-1], table, i)
    panels[-1].set_xlabel("rate")
    style_panels(panels)
    for panel in panels:
        write_legend(panel, "upper right", 2)
    write_caption(figure, "After subtraction of bias and scale. Bars: ± 2σ.")
    return figure


def _draw_axis(axes: Axes, table: RateTable, i: int) -> None:
    axis_fit, w = table.axes[i], table.rates[:, i]
    fitted = table.means - table.residuals
    # The curve is the prediction for rates about this axis alone, minus the line.
    single_axis_rates = np.zeros((401, len(table.axes)))
    single_axis_rates[:, i] = np.linspace(w.min(), w.max(), len(single_axis_rates))
    line = axis_fit.bias + axis_fit.scale * single_axis_rates[:, i]
    curve = (table.predict(single_axis_rates)[:, i] - line) / axis_fit.scale
    axis_rates = np.zeros(table.rates.shape)
    axis_rates[:, i] = w
    bend = table.predict(axis_rates)[:, i] - axis_fit.bias - axis_fit.scale * w
    differences = (table.means[:, i] - fitted[:, i] + bend) / axis_fit.scale
    bars = 2.0 * table.sigma[:, i] / abs(axis_fit.scale)
    name = "" if len(table.axes) == 1 else f"{'xyz'[i]}: "
    axes.axhline(0.0, color="0.6", lw=0.5)
    axes.plot(
        single_axis_rates[:, i],
        curve,
        color=_COLOURS[i],
        lw=1.0,
        label=f"{name}{_describe_terms(axis_fit.terms)}",
    )
    axes.errorbar(w, differences, bars, fmt="o", ms=2.0, lw=0.6, color="black", label="means")
    axes.set_ylabel("difference from the line")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.2 * (high - low))


def _describe_terms(terms: tuple[str, ...]) -> str:
    return "line" if not terms else f"line, {', '.join(terms)}"
