"""Panels of the criteria over the orders of the models."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from zerorate.identify.order import above_least
from zerorate.show.plotting.style import BLUE, FONT, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from zerorate.identify.identification import Identification
    from zerorate.identify.order import OrderSelection

__all__ = ["draw_ar_orders", "draw_arma_orders", "style_orders"]

_COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY)


def draw_ar_orders(axes: Axes, found: Identification) -> None:
    """Draw how far the criterion of each AR order is above the least."""
    axes.set_title("orders of AR models")
    _draw(axes, found.ar_orders)


def draw_arma_orders(axes: Axes, found: Identification) -> None:
    """Draw the same of ARMA orders, a line for each q."""
    axes.set_title("orders of ARMA models")
    _draw(axes, found.arma_orders)
    axes.legend(
        loc="upper right",
        ncols=2,
        fontsize=FONT - 0.5,
        frameon=False,
        handlelength=1.1,
        columnspacing=0.8,
        handletextpad=0.4,
        borderaxespad=0.2,
    )


def _draw(axes: Axes, orders: OrderSelection) -> None:
    above = dict(zip(orders.orders, above_least(orders, orders.criterion), strict=True))
    axes.axhspan(0.0, orders.margin, color=GREY, lw=0.0)
    for q in sorted({q for _, q in orders.orders}):
        colour = _COLOURS[q % len(_COLOURS)]
        line = [(p, score) for (p, own), score in above.items() if own == q]
        x, y = zip(*line, strict=True)
        axes.plot(x, y, color=colour, lw=0.7, marker=".", ms=2.5, mew=0.0, label=f"q = {q}")
    for order, face in ((orders.minimum, "white"), (orders.clear, None)):
        colour = _COLOURS[order[1] % len(_COLOURS)]
        axes.plot(
            *(order[0], above[order]),
            color=colour,
            marker="o",
            ms=4.0,
            mew=0.8,
            mfc=face or colour,
            ls="none",
            label="_",
        )
    # Linear where it decides, logarithmic where it does not.
    axes.set_yscale("symlog", linthresh=orders.margin, linscale=1.5)
    decades = max(1.0, np.log10(max(above.values()) / orders.margin + 1.0))
    # The upper quarter is for a legend.
    axes.set_ylim(-0.1 * orders.margin, orders.margin * 10.0 ** ((1.5 + decades) / 0.75 - 1.5))
    axes.set_xlabel("p")
    axes.set_ylabel(f"{orders.criterion.upper()} above the least")


def style_orders(axes: Axes, margin: float) -> None:
    """Write zero, the margin, and the decades beyond it."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    most = axes.get_ylim()[1]
    decades = 10.0 ** np.arange(np.ceil(np.log10(1.5 * margin)), np.log10(most))
    axes.yaxis.set_major_locator(FixedLocator([0.0, margin, *decades]))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: _short(value)))


def _short(score: float) -> str:
    return f"{score:g}" if score < 1000.0 else f"{score:.0e}".replace("e+0", "e")
