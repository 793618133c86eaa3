"""Figure of an array: Allan deviations, and the weights of the sensors over time."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from zerorate.numerals import shorten
from zerorate.show.array_table import array_title
from zerorate.show.scales import robust_limits, split_into_parts, trace_outline
from zerorate.show.style import (
    AXIS_COLOURS,
    BLACK,
    FONT_PT,
    GREY,
    SKY,
    VERMILION,
    YELLOW,
    add_colour_bar,
    add_panel,
    new_figure,
    shorten_source,
    style_decades,
    style_panels,
    time_unit,
    write_caption,
    write_in_middle,
    write_legend,
    write_title,
)
from zerorate.tasks.array import SAMPLE_FATES, ArrayReplay
from zerorate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Sizes in mm.
_WIDTH_MM: Final = 180.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 15.0, 15.0, 8.5, 19.0
_ALLAN_WIDTH_MM: Final = 62.0
_BETWEEN: Final = 20.0
_PANEL_GAP_MM: Final = 5.0
_RATE_HEIGHT_MM: Final = 24.0
_ROW_HEIGHT_MM: Final = 4.2
"""Height of a sensor's row, mm."""
_MIN_ROWS_MM: Final = 40.0
_BAR, _BAR_GAP = 2.2, 2.0
_LETTER_WIDTH_MM: Final = 1.06

_MAX_TIMES: Final = 200
_MAX_WEIGHT_RATIO: Final = 3.0
"""Ratio of a weight to the plain mean's weight at which the shade is darkest."""
_GREY: Final = "#9A9A9A"
_CURVE_COLOURS: Final = AXIS_COLOURS
_MISSING, _SATURATED, _EXCLUDED, _LEFT_OUT = 1, 2, 3, 4


def plot_array(replay: ArrayReplay) -> Figure:
    """Return a figure of the Allan deviations, the rate, and the weights over time.

    The left panel has the Allan deviations of each sensor, the plain mean, and the array, as RMS
    over the axes. On the right are the angular rate and a row for each sensor. The shade of a row
    is the sensor's weight relative to its weight in a plain mean. Where the sensor was excluded,
    the row is vermilion.
    """
    rows = max(_ROW_HEIGHT_MM * replay.log.sensors, _MIN_ROWS_MM)
    height = _BOTTOM + rows + _PANEL_GAP_MM + _RATE_HEIGHT_MM + _TOP
    figure = new_figure(_WIDTH_MM, height)
    right = _LEFT + _ALLAN_WIDTH_MM + _BETWEEN
    panel_width = _WIDTH_MM - right - _RIGHT
    allan = add_panel(
        figure, _LEFT, _BOTTOM, _ALLAN_WIDTH_MM, rows + _PANEL_GAP_MM + _RATE_HEIGHT_MM
    )
    weights = add_panel(figure, right, _BOTTOM, panel_width, rows)
    rate = add_panel(figure, right, _BOTTOM + rows + _PANEL_GAP_MM, panel_width, _RATE_HEIGHT_MM)
    bar_left = right + panel_width + _BAR_GAP
    bar = add_colour_bar(weights, figure, bar_left, _BOTTOM, _BAR, rows)
    _draw_allan(allan, replay)
    _draw_rate(rate, replay)
    _draw_weights(weights, bar, replay)
    style_panels([allan, rate])
    style_panels([weights])
    bar.tick_params(labelsize=FONT_PT - 0.5, width=0.5, length=2.0, pad=1.5)
    bar.yaxis.label.set_fontsize(FONT_PT)
    _label_rows(weights, replay)
    if allan.get_yscale() == "log":
        style_decades(allan)
    write_title(figure, _make_title(replay))
    write_caption(figure, fill(_make_caption(replay), int(_WIDTH_MM / _LETTER_WIDTH_MM)))
    return figure


def _make_title(replay: ArrayReplay) -> str:
    source = shorten_source(str(replay.log.meta.get("source", "array")))
    return f"Is the array quieter than one gyro? {source}: {array_title(replay)}"


def _draw_allan(axes: Axes, replay: ArrayReplay) -> None:
    allan = replay.allan
    axes.set_xlabel("averaging time [s]")
    axes.set_ylabel(f"Allan deviation [{replay.log.unit}]")
    if allan is None:
        write_in_middle(axes, "the body never rested")
        return
    if not (allan.sensors > 0.0).any():
        write_in_middle(axes, "all samples at rest are equal")
        return
    axes.set_xscale("log")
    axes.set_yscale("log")
    octaves = np.flatnonzero(np.isin(allan.taus, allan.taus[0] * 2.0 ** np.arange(allan.taus.size)))
    taus = allan.taus[octaves]
    for k, deviation in enumerate(_rms_over_axes(allan.sensors)[:, octaves]):
        label = "each sensor" if k == 0 else f"_{k}"
        axes.plot(taus, deviation, color=_GREY, lw=0.5, label=label)
    for curve, colour, label in ((allan.mean, SKY, "plain mean"), (allan.fused, BLACK, "array")):
        axes.plot(taus, _rms_over_axes(curve)[octaves], color=colour, lw=1.2, label=label)
    axes.grid(which="major", color=GREY, lw=0.3)
    write_legend(axes, "lower left", 1, 1.6)


def _rms_over_axes(deviations: Floats) -> Floats:
    """Return the RMS over the axes, of deviations with shape (..., axes, m)."""
    means: Floats = np.sqrt(np.mean(deviations**2, axis=-2))
    return np.where(means > 0.0, means, np.nan)


def _draw_rate(axes: Axes, replay: ArrayReplay) -> None:
    log = replay.log
    _, seconds = time_unit(log.n / log.rate)
    series = replay.rate.reshape(log.n, -1)
    for i, letter in enumerate(log.axes):
        time, values = trace_outline(series[:, i], log.rate)
        axes.plot(time / seconds, values, color=_CURVE_COLOURS[i], lw=0.5, label=letter or "rate")
    axes.set_ylim(*robust_limits(series.ravel(), 0.1, 0.35))
    axes.set_xlim(0.0, log.n / log.rate / seconds)
    axes.set_ylabel(f"rate [{log.unit}]")
    axes.tick_params(labelbottom=False)
    write_legend(axes, "upper right", 3)


def _draw_weights(axes: Axes, bar: Axes, replay: ArrayReplay) -> None:
    """Draw a row for each sensor, with its weight or the main reason for its exclusion."""
    from matplotlib.colors import to_rgb

    log = replay.log
    name, seconds = time_unit(log.n / log.rate)
    weights, fate = _average_over_time(replay)
    duration = log.n / log.rate / seconds
    extent = (0.0, duration, log.sensors - 0.5, -0.5)
    max_weight = max(min(float(np.nanmax(weights, initial=1.0)), _MAX_WEIGHT_RATIO), 1.5)
    image = axes.imshow(
        weights.T, aspect="auto", extent=extent, cmap="Blues", vmin=0.0, vmax=max_weight,
        interpolation="nearest",
    )  # fmt: skip
    cover = np.zeros((*fate.T.shape, 4))
    for kind, colour in ((_MISSING, _GREY), (_EXCLUDED, VERMILION), (_LEFT_OUT, YELLOW)):
        cover[kind == fate.T] = (*to_rgb(colour), 1.0)
    axes.imshow(cover, aspect="auto", extent=extent, interpolation="nearest")
    axes.set_xlim(0.0, duration)
    axes.set_xlabel(f"time [{name}]")
    scale = axes.figure.colorbar(
        image, cax=bar, extend="max" if max_weight == _MAX_WEIGHT_RATIO else "neither"
    )
    scale.set_label("weight relative to a plain mean")
    scale.outline.set_linewidth(0.5)


def _label_rows(axes: Axes, replay: ArrayReplay) -> None:
    """Write the names of the rows, as many as fit."""
    log = replay.log
    axes.set_yticks(range(log.sensors), log.labels)
    axes.tick_params(axis="y", labelsize=FONT_PT - 0.5, length=0.0)


def _average_over_time(replay: ArrayReplay) -> tuple[Floats, npt.NDArray[np.int8]]:
    """Return, for each interval, the mean weight times N where used, and the most frequent class.

    Both have shape (intervals, N). If a sensor was excluded in any part of an interval, the class
    is excluded.
    """
    log = replay.log
    starts = split_into_parts(log.n, _MAX_TIMES)
    used = replay.fate == SAMPLE_FATES.index("used")
    counts = np.add.reduceat(used, starts, axis=0, dtype=np.int64)
    sums = np.add.reduceat(np.where(used, replay.weights, 0.0), starts, axis=0)
    lengths = np.diff(np.append(starts, log.n))[:, np.newaxis]
    fate = np.zeros(counts.shape, np.int8)
    for kind in (_LEFT_OUT, _MISSING, _EXCLUDED):
        share = np.add.reduceat(replay.fate == kind, starts, axis=0, dtype=np.int64) / lengths
        fate[share > (0.0 if kind == _EXCLUDED else 0.5)] = kind
    weights = np.divide(sums, counts, out=np.full(sums.shape, np.nan), where=counts > 0)
    return weights * log.sensors, fate


def _make_caption(replay: ArrayReplay) -> str:
    sentences = [
        "Allan deviations: root mean squares over the axes, at rest, all biases subtracted."
        if len(replay.log.axes) == 3
        else "Allan deviations: at rest, all biases subtracted."
    ]
    if replay.allan is not None and replay.log.sensors > 1:
        mean_gain, sensor_gain = (
            float(gain[-1, replay.allan.second]) for gain in replay.allan.gains()
        )
        seconds = float(replay.allan.taus[replay.allan.second])
        if np.isfinite(sensor_gain):
            sentences.append(
                f"At {shorten(seconds, 3)} s the plain mean has {mean_gain:.2f} times the array's, "
                "one sensor "
                f"{sensor_gain:.2f} times."
            )
    sentences.append(
        "Weights: from noise at rest, equal in fast motion. Vermilion: excluded, since it "
        "disagrees with the others; yellow: stuck or an outlier most of the time; grey: missing."
    )
    return " ".join(sentences)
