"""All panels of a replay, one column per axis: learned parameters and Allan deviations."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zerorate.numerals import shorten
from zerorate.show.replay_panels import (
    SMOOTHING_TIME_CONSTANTS,
    draw_allan,
    draw_bias,
    draw_gain,
    draw_model,
    draw_noise,
    draw_rate,
    draw_walk,
    draw_white_noise,
    mean_duration,
)
from zerorate.show.scales import share_decades, share_heights, share_limits
from zerorate.show.style import (
    FONT_PT,
    INCHES_PER_MM,
    Corner,
    new_figure,
    style_panels,
    write_caption,
    write_legend,
    write_title,
)
from zerorate.tasks.replay import Replay
from zerorate.tasks.replay.history import noise_units

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Grid = np.ndarray[Any, np.dtype[np.object_]]

_MAX_AXES: Final = 6
"""Largest number of axes in a figure."""

# Sizes in mm. A layout engine would draw everything three times to find the same positions.
_COLUMN_WIDTH_MM: Final = 60.0
_HEIGHT_MM: Final = 212.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 16.5, 4.0, 16.0, 21.0
_BETWEEN_COLUMNS, _BETWEEN_ROWS = 13.0, 11.0
_LABEL_DISTANCE_MM: Final = 10.2
"""Distance from a left panel to the label of its scale, mm."""

_LOW_PANEL_RATIO: Final = 0.62
"""Height of a panel with one line, relative to the other panels."""

_HEIGHT_RATIOS: Final = {
    True: (1.0, 1.0, _LOW_PANEL_RATIO, _LOW_PANEL_RATIO, 1.0),
    False: (1.0, _LOW_PANEL_RATIO, _LOW_PANEL_RATIO, 1.0, 1.0),
}
"""Relative heights of the rows: True for the self-tuning filter, False for other methods."""

_GREY_NOTES: Final = {
    "estimate": (
        f"Grey: averaging times below {SMOOTHING_TIME_CONSTANTS:g} filter time constants, where "
        f"the filtered curve shows smoothing, not a better sensor."
    ),
    "compensated": "Grey: averaging times above the filter's time constant, where the learned bias "
    "is subtracted: a lower curve there is not a better sensor.",
}


def plot_replay_grid(replay: Replay) -> Figure:
    """Return a figure with a column for each axis of the log, for at most six axes.

    The first rows are the raw rate and the bias, the last row has Allan deviations before and
    after. Between them, a published method has measurement noise, Kalman gain and ARMA
    coefficients. "auto" has the bias with two standard deviations, and the learned white noise and
    drift. Motion is shaded, and a stuck or saturated sensor is shaded, too. With up to three axes
    the figure is at most 180 mm wide, for a page.

    Raises ValueError if the replay has no Allan deviations.
    """
    axis_count = min(replay.log.channels, _MAX_AXES)
    width = _COLUMN_WIDTH_MM * max(axis_count, 2)
    figure = new_figure(width, _HEIGHT_MM)
    heights = _HEIGHT_RATIOS[replay.method == "auto"]
    grid = figure.subplots(
        5,
        axis_count,
        squeeze=False,
        height_ratios=heights,
        gridspec_kw=_grid_spacing(width, axis_count),
    )
    for i in range(axis_count):
        _draw_column(grid[:, i], replay, i)
    _label_scales(grid, replay)
    _share_scales(grid, replay)
    style_panels(list(grid.ravel()))
    write_title(figure, _make_title(replay, round(0.55 * width)))
    write_caption(figure, _make_caption(replay, axis_count, round(0.83 * width)), FONT_PT)
    return figure


def _grid_spacing(width: float, columns: int) -> dict[str, float]:
    """Return the margins and the gaps between panels, in units of the grid."""
    panel_width = (width - _LEFT - _RIGHT - _BETWEEN_COLUMNS * (columns - 1)) / columns
    panel_height = (_HEIGHT_MM - _TOP - _BOTTOM - 4.0 * _BETWEEN_ROWS) / 5.0
    return {
        "left": _LEFT / width,
        "right": 1.0 - _RIGHT / width,
        "top": 1.0 - _TOP / _HEIGHT_MM,
        "bottom": _BOTTOM / _HEIGHT_MM,
        "wspace": _BETWEEN_COLUMNS / panel_width,
        "hspace": _BETWEEN_ROWS / panel_height,
    }


def _draw_column(column: Grid, replay: Replay, i: int) -> None:
    published = (draw_rate, draw_noise, draw_gain, draw_model, draw_allan)
    auto_panels = (draw_rate, draw_bias, draw_white_noise, draw_walk, draw_allan)
    for axes, draw in zip(
        column, auto_panels if replay.method == "auto" else published, strict=True
    ):
        draw(axes, replay, i)


def _label_scales(grid: Grid, replay: Replay) -> None:
    """Label the scales at the left edge, and the lines in the first column."""
    unit = replay.log.unit
    if replay.method == "auto":
        (white, _), (walk, _) = noise_units(unit)
        between = (f"bias [{unit}]", f"white noise\n[{white}]", f"bias drift\n[{walk}]")
    else:
        between = (f"√R [{unit}]", "Kalman\ngain", "ARMA coefficients")
    labels = (f"rate [{unit}]", *between, f"Allan deviation [{unit}]")
    panel = grid[0, 0].get_position().width * grid[0, 0].figure.get_figwidth() / INCHES_PER_MM
    for axes, label in zip(grid[:, 0], labels, strict=True):
        axes.set_ylabel(label)
        axes.yaxis.set_label_coords(-_LABEL_DISTANCE_MM / panel, 0.5)
    legend_rows = (0, 1, 4) if replay.method == "auto" else (0, 3, 4)
    corners: tuple[Corner, ...] = ("upper right", "upper right", "lower left")
    for row, corner in zip(legend_rows, corners, strict=True):
        write_legend(grid[row, 0], corner, 4)


def _share_scales(grid: Grid, replay: Replay) -> None:
    """Give panels in a row the same scale where this helps to compare them."""
    if replay.method == "auto":
        for row in grid[2:4]:
            share_limits(row)
            for axes in row[1:]:
                axes.tick_params(labelleft=False)
    else:
        share_heights(grid[3])
        for axes in grid[2, 1:]:
            axes.tick_params(labelleft=False)
    share_decades(grid[4])


def _make_title(replay: Replay, letters: int) -> str:
    """Return the log's name, shortened if necessary, above the filter's name."""
    source = replay.log.meta.get("sensor") or Path(replay.log.meta.get("source", "log")).name
    if len(source) > letters:
        source = f"{source[: letters // 2]}…{source[-(letters // 2) :]}"
    order = replay.params.get("order")
    model = "" if order is None else f"ARMA({order[0]}, {order[1]}), "
    rate = shorten(replay.log.rate, 4)
    return f"{source}\n{replay.method}, {model}{replay.log.n:,} samples at {rate} Hz"


def _make_caption(replay: Replay, shown: int, width: int) -> str:
    """Return notes for the reader, in lines that fit the width."""
    sentences = [_GREY_NOTES[replay.output], _describe_shading(replay)]
    if shown < replay.log.channels:
        sentences[1] += f" Shown are the first {shown} of {replay.log.channels} axes."
    return "\n".join(textwrap.fill(sentence, width) for sentence in sentences)


def _describe_shading(replay: Replay) -> str:
    lost = replay.lost
    has_motion = replay.readings is not None and not (replay.readings.at_rest | lost).all()
    if replay.method == "auto":
        seconds = mean_duration(replay)
        sentences = [f"Dots: means of {shorten(seconds)} s, noisier than the bias. Band: ± 2σ."]
    else:
        sentences = ["Dotted: end of learning."]
    if has_motion:
        sentences.append(
            "Grey or hatched over time: motion, or no rest seen yet. Allan deviations are from "
            "rest only."
        )
    if lost.any():
        sentences.append("Shaded rose: the sensor was stuck or saturated.")
    return " ".join(sentences)
