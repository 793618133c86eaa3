"""The figure of a replay: a column of panels for each axis."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zerorate.run.replay import Replay
from zerorate.run.replay.history import noise_units
from zerorate.show.replay_panels import (
    MEMORIES,
    draw_allan,
    draw_bias,
    draw_learned,
    draw_model,
    draw_noise,
    draw_rate,
)
from zerorate.show.scales import share_decades, share_heights, share_limits
from zerorate.show.style import (
    BLUE,
    FONT,
    ORANGE,
    Corner,
    new_figure,
    style_panels,
    write_caption,
    write_legend,
    write_title,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Grid = np.ndarray[Any, np.dtype[np.object_]]

__all__ = ["plot_replay"]

_MOST_AXES: Final = 6
"""Axes of the log that a figure has room for."""

# Millimetres. A layout engine would draw everything three times to find the same places.
_COLUMN: Final = 60.0
_HEIGHT: Final = 189.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 15.0, 11.5, 16.0, 19.0
_BETWEEN_COLUMNS, _BETWEEN_ROWS = 13.0, 12.0

_GREY: Final = {
    "estimate": f"Grey: averaging times below {MEMORIES:g} filter time constants, where the "
    "filtered curve shows smoothing, not a better sensor.",
    "compensated": "Grey: averaging times above the filter's time constant, where the drift is "
    "taken off as it is learned.",
}


def plot_replay(replay: Replay) -> Figure:
    """Return a figure with a column for each axis of the log, of the first six at most.

    Parameters
    ----------
    replay : Replay
        With Allan deviations.

    Returns
    -------
    matplotlib.figure.Figure
        Rows: raw rate and drift; then of a published method measurement noise and Kalman gain, and
        the ARMA coefficients; of "auto" the bias with two standard deviations, and the noise and
        the drift that were learned; last Allan deviations before and after. Motion is shaded, and
        so is a stuck or saturated sensor. No global state of matplotlib is used. Up to three axes
        are 180 mm wide at most, for a page.

    Raises
    ------
    ValueError
        If the replay has no Allan deviations.
    ImportError
        Without matplotlib, of the extra ``plot``.
    """
    shown = min(replay.log.channels, _MOST_AXES)
    width = _COLUMN * max(shown, 2)
    figure = new_figure(width, _HEIGHT)
    grid = figure.subplots(4, shown, squeeze=False, gridspec_kw=_places(width, shown))
    right = [_draw_column(grid[:, i], replay, i) for i in range(shown)]
    _label(grid, right, replay)
    _share(grid, right, replay)
    style_panels([*grid.ravel(), *right])
    write_title(figure, _HEIGHT, _title(replay, round(0.55 * width)))
    write_caption(figure, _HEIGHT, _caption(replay, shown, round(0.75 * width)), FONT)
    return figure


def _places(width: float, columns: int) -> dict[str, float]:
    """Return the margins and the spaces between panels, in the units of a grid."""
    panel_width = (width - _LEFT - _RIGHT - _BETWEEN_COLUMNS * (columns - 1)) / columns
    panel_height = (_HEIGHT - _TOP - _BOTTOM - 3.0 * _BETWEEN_ROWS) / 4.0
    return {
        "left": _LEFT / width,
        "right": 1.0 - _RIGHT / width,
        "top": 1.0 - _TOP / _HEIGHT,
        "bottom": _BOTTOM / _HEIGHT,
        "wspace": _BETWEEN_COLUMNS / panel_width,
        "hspace": _BETWEEN_ROWS / panel_height,
    }


def _draw_column(column: Grid, replay: Replay, i: int) -> Axes:
    draw_rate(column[0], replay, i)
    if replay.method == "auto":
        draw_bias(column[1], replay, i)
        right = draw_learned(column[2], replay, i)
    else:
        right = draw_noise(column[1], replay, i)
        draw_model(column[2], replay, i)
    draw_allan(column[3], replay, i)
    return right


def _label(grid: Grid, right: list[Axes], replay: Replay) -> None:
    """Name the scales at the outer edges, and the lines in the first column."""
    unit = replay.log.unit
    if replay.method == "auto":
        (white, _), (walk, _) = noise_units(unit)
        between, last, two_scales = (f"bias [{unit}]", f"noise [{white}]"), f"drift [{walk}]", 2
    else:
        between, last, two_scales = (f"√R [{unit}]", "ARMA coefficients"), "Kalman gain", 1
    labels = (f"rate [{unit}]", *between, f"Allan deviation [{unit}]")
    for axes, label in zip(grid[:, 0], labels, strict=True):
        axes.set_ylabel(label)
    right[-1].set_ylabel(last, color=ORANGE)
    grid[two_scales, 0].yaxis.label.set_color(BLUE)
    for axes in right[:-1]:
        axes.tick_params(labelright=False)
    _explain(grid[[0, 3 - two_scales, 3], 0])


def _explain(column: Grid) -> None:
    """Name the lines of panels, the last of which falls to the right."""
    places: tuple[Corner, ...] = ("upper right", "upper right", "lower left")
    for axes, place in zip(column, places, strict=True):
        write_legend(axes, place, 4)


def _share(grid: Grid, right: list[Axes], replay: Replay) -> None:
    """Give panels side by side the same scale where that helps to compare."""
    if replay.method == "auto":
        share_limits(grid[2])
        share_limits(right)
        for axes in grid[2, 1:]:
            axes.tick_params(labelleft=False)
    else:
        share_heights(grid[2])
    share_decades(grid[3])


def _title(replay: Replay, letters: int) -> str:
    """Return the log's name, its middle left out where it is too long, above the filter's."""
    source = replay.log.meta.get("sensor") or Path(replay.log.meta.get("source", "log")).name
    if len(source) > letters:
        source = f"{source[: letters // 2]}…{source[-(letters // 2) :]}"
    order = replay.params.get("order")
    model = "" if order is None else f"ARMA({order[0]}, {order[1]}), "
    return f"{source}\n{replay.method}, {model}{replay.log.n:,} samples at {replay.log.rate:.4g} Hz"


def _caption(replay: Replay, shown: int, width: int) -> str:
    """Return what a reader must know, in lines of at most so many letters."""
    sentences = [_GREY[replay.output], _last_sentence(replay)]
    if shown < replay.log.channels:
        sentences[1] += f" Shown are the first {shown} of {replay.log.channels} axes."
    return "\n".join(textwrap.fill(sentence, width) for sentence in sentences)


def _last_sentence(replay: Replay) -> str:
    lost = replay.lost
    moved = replay.readings is not None and not (replay.readings.at_rest | lost).all()
    sentences = [] if replay.method == "auto" else ["Dotted: end of learning."]
    if moved:
        sentences.append(
            "Shaded over time: motion, or no rest seen yet; Allan deviations are of the rest."
        )
    if lost.any():
        sentences.append("Shaded rose: the sensor was stuck or saturated.")
    return " ".join(sentences)
