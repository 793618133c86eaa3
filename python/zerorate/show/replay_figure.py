"""Figure of a replay: the raw rate, and below it the bias of each axis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.numerals import format_with_error, shorten
from zerorate.record.names import split_unit
from zerorate.show.replay_grid import plot_replay_grid
from zerorate.show.replay_panels import drop_outliers, find_certain_rest, mean_duration, rest_means
from zerorate.show.scales import MAX_COLUMNS, column_quantiles, robust_limits
from zerorate.show.stack import (
    Stack,
    add_margin,
    draw_band,
    draw_with_sigma,
    find_spans,
    shade,
    share_time_axis,
    write_head,
    write_names,
)
from zerorate.show.style import (
    AXIS_COLOURS,
    BLACK,
    ORANGE,
    ROSE,
    VERMILION,
    time_unit,
    write_in_middle,
)
from zerorate.tasks.replay import Replay
from zerorate.tasks.replay.result import TRUTH_MEAN_S, trailing_mean
from zerorate.types import Booleans, Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MAX_AXES: Final = 5
"""Largest number of axes with a bias panel; the raw rate is a further panel."""

# Sizes in mm.
_RATE_HEIGHT_MM, _BIAS_HEIGHT_MM = 19.0, 16.0
_MAX_CUT_SHARE: Final = 0.02
"""Largest share of columns that may exceed the raw-rate panel, to keep the rest readable."""

_MAX_DOT_DISTANCE: Final = 1.0
"""Largest distance of a dot from the band, in band widths, that widens the scale."""

_FLATTENING_RATIO: Final = 5.0
"""Ratio of the full range to the usual range above which columns are cut off."""


def plot_replay(replay: Replay, everything: bool = False) -> Figure:
    """Return the figure of a replay, as wide as a page column.

    The panels have one time axis. The first panel is the raw rate of all axes; its band covers the
    middle 90 % of the samples in each pixel. Below are the biases of the first five axes, with a
    band of ±2 σ and the means of the raw rate at rest. Motion is grey, and a stuck or saturated
    sensor is rose.

    With `everything` all panels are drawn, including Allan deviations and the learned noise, gain
    or drift. Each of the first six axes has a column. The figure is as wide as two page columns.
    """
    if everything:
        return plot_replay_grid(replay)
    axis_count = min(replay.log.channels, _MAX_AXES)
    heights = [_RATE_HEIGHT_MM, *[_BIAS_HEIGHT_MM] * axis_count]
    lost, rest = replay.lost, find_certain_rest(replay)
    caption = _make_caption(replay, axis_count, lost)
    stack = Stack(_make_question(replay), _describe_end(replay, axis_count), caption, heights)
    unit, seconds = time_unit(replay.log.duration)
    _draw_rates(stack.add(), replay, axis_count, seconds)
    bias_panels = []
    for i in range(axis_count):
        bias_panels.append(panel := stack.add())
        _draw_bias(panel, replay, i, seconds, rest)
        _shade(panel, replay, i, seconds, lost[:, i])
    if bias_panels:
        stack.share_scale(bias_panels)
    last = max(replay.log.duration, 1.0 / replay.log.rate)
    share_time_axis(stack.panels, 0.0, last / seconds, unit)
    meta = replay.log.meta
    source = meta.get("source") or meta.get("sensor", "log")
    return stack.finish(str(source), replay.log.rate, replay.log.duration)


def mean_truth(truth: Floats, rate: float) -> Floats:
    """Return the mean true bias over the next ten seconds, to which σ refers, shape (n,)."""
    return trailing_mean(truth[::-1], rate)[::-1]


def _make_question(replay: Replay) -> str:
    if replay.output == "compensated":
        return "What is the gyro's bias, and how well is it known?"
    return f"What does {replay.method} make of the gyro's rate?"


def _describe_end(replay: Replay, shown: int) -> str:
    """Return the bias of each axis at the end."""
    bias, sigma = replay.history.bias[-1], replay.history.bias_sigma[-1]
    has_sigma = replay.method == "auto"
    axis_texts = [
        f"{_short_axis_name(replay, i)} "
        f"{format_with_error(bias[i], sigma[i]) if has_sigma else f'{shorten(bias[i], 4)}'}"
        for i in range(shown)
        if np.isfinite(bias[i])
    ]
    return (
        f"At the end: {', '.join(axis_texts)} {replay.log.unit}."
        if axis_texts
        else "Nothing was learned."
    )


def _draw_rates(panel: Axes, replay: Replay, shown: int, seconds: float) -> None:
    lows, highs = [], []
    for i in range(shown):
        quantiles = column_quantiles(replay.log.data[:, i])
        times = quantiles.middle / replay.log.rate / seconds
        draw_band(panel, times, quantiles, _axis_colour(i), _short_axis_name(replay, i))
        lows.append(quantiles.low)
        highs.append(quantiles.high)
    panel.set_ylim(*_cut_limits(np.concatenate(lows), np.concatenate(highs)))
    write_head(panel, f"raw rate [{replay.log.unit}]")
    write_names(panel, shown)
    if not np.isfinite(replay.log.data[:, :shown]).any():
        write_in_middle(panel, "no sample")


def _cut_limits(low: Floats, high: Floats) -> tuple[float, float]:
    """Return limits that include all columns, except a burst that would flatten the others."""
    finite = np.isfinite(low)
    if not finite.any():
        return -1.0, 1.0
    low, high = low[finite], high[finite]
    lowest, highest = np.quantile(low, _MAX_CUT_SHARE), np.quantile(high, 1.0 - _MAX_CUT_SHARE)
    middle, half = 0.5 * (lowest + highest), 0.5 * (highest - lowest)
    if max(middle - low.min(), high.max() - middle) > _FLATTENING_RATIO * half > 0.0:
        return add_margin(float(lowest), float(highest), 0.3)
    return add_margin(float(low.min()), float(high.max()))


def _draw_bias(panel: Axes, replay: Replay, i: int, seconds: float, rest: Booleans | None) -> None:
    history = replay.history
    rows = _even_rows(replay)
    times = history.samples[rows] / replay.log.rate / seconds
    bias, sigma = history.bias[rows, i], history.bias_sigma[rows, i]
    tuned = replay.method == "auto"
    if tuned:
        draw_with_sigma(panel, times, bias, sigma, VERMILION, "bias ± 2σ")
    else:
        quantiles = column_quantiles(replay.bias[:, i])
        draw_band(
            panel, quantiles.middle / replay.log.rate / seconds, quantiles, VERMILION, "filtered"
        )
    centres, means = rest_means(replay, i, rest)
    panel.plot(centres / seconds, means, "o", color=BLACK, ms=1.3, mew=0.0, label="raw, at rest")
    if replay.truth is not None:
        truth = mean_truth(replay.truth[:, i], replay.log.rate)[history.samples[rows] - 1]
        panel.plot(times, truth, color=BLACK, ls="--", lw=0.6, label="truth")
    late = slice(bias.size // 10, None)
    half = 2.0 * sigma if tuned else np.zeros_like(sigma)
    low, high = robust_limits(np.concatenate(((bias - half)[late], (bias + half)[late])), 0.0, 0.0)
    # Dots may widen the scale, but must not flatten the more important band.
    dots, span = drop_outliers(means), high - low
    low, high = (
        min([low, *dots[dots > low - _MAX_DOT_DISTANCE * span]]),
        max([high, *dots[dots < high + _MAX_DOT_DISTANCE * span]]),
    )
    panel.set_ylim(*add_margin(low, high))
    write_head(panel, f"{_panel_name(replay, i)} [{replay.log.unit}]")
    if not replay.ready[i]:
        write_in_middle(panel, "no bias known")


def _even_rows(replay: Replay) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    samples = replay.history.samples
    positions = np.linspace(samples[-1] / MAX_COLUMNS, samples[-1], MAX_COLUMNS)
    return np.unique(np.searchsorted(samples, positions).clip(max=samples.size - 1))


def _axis_colour(i: int) -> str:
    return (*AXIS_COLOURS, BLACK, ORANGE)[i]


def _short_axis_name(replay: Replay, i: int) -> str:
    """Return the part of an axis name that differs from the others, such as "x" of "gyro_x"."""
    name = split_unit(replay.log.names[i])[0]
    return name.rpartition("_")[2] if replay.log.channels == 3 else name


def _panel_name(replay: Replay, i: int) -> str:
    what = "bias of " if replay.output == "compensated" else ""
    return f"{what}{split_unit(replay.log.names[i])[0]}"


def _shade(panel: Axes, replay: Replay, i: int, seconds: float, lost: Booleans) -> None:
    """Shade motion, and a stuck or saturated sensor, behind all curves."""
    scale = 1.0 / (replay.log.rate * seconds)
    if replay.readings is not None:
        begins, ends = find_spans(~(replay.readings.at_rest[:, i] | lost))
        shade(panel, scale * begins, scale * ends)
    begins, ends = find_spans(lost)
    shade(panel, scale * begins, scale * ends, ROSE)


def _make_caption(replay: Replay, shown: int, lost: Booleans) -> str:
    sentences = ["Top: the middle 90 % of the samples in each column, and their median."]
    sentences.append(
        "Below, orange: the bias ± 2σ."
        if replay.method == "auto"
        else f"Below, orange: the output of {replay.method}, drawn the same way."
    )
    if replay.method == "auto":
        sentences.append(
            f"Dots: means of {shorten(mean_duration(replay))} s at rest, noisier than the bias."
        )
    if replay.truth is not None:
        sentences.append(f"Dashed: the true bias, mean of {TRUTH_MEAN_S:g} s.")
    if replay.readings is not None and not (replay.readings.at_rest | lost).all():
        sentences.append("Grey: motion, or no rest seen yet.")
    if lost.any():
        sentences.append("Rose: stuck or saturated.")
    if shown < replay.log.channels:
        sentences.append(f"Shown are the first {shown} of {replay.log.channels} axes.")
    return " ".join(sentences)
