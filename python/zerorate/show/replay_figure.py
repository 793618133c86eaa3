"""The figure of a replay: the raw rate, and under it the bias of each axis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.numerals import with_error
from zerorate.record.names import split_unit
from zerorate.show.replay_grid import plot_replay_grid
from zerorate.show.replay_panels import certain_rest, length_of_means, means_at_rest, together
from zerorate.show.scales import COLUMNS, band, limits
from zerorate.show.stack import (
    Stack,
    draw_known,
    draw_scatter,
    head,
    names,
    over_time,
    room,
    shade,
    spans_of,
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
from zerorate.types import Booleans, Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_AXES: Final = 5
"""Axes whose bias is shown: with the raw rate there are six panels."""

# Millimetres.
_RATE, _BIAS = 19.0, 16.0
_FEW: Final = 0.02
"""Part of the columns that may lie beyond the panel of the raw rate, if they would flatten it."""

_WIDER: Final = 1.0
"""How many times as far as the band reaches a dot may lie off it and still be shown."""

_FLAT: Final = 5.0
"""How many times as far as the others they must reach for that."""


def plot_replay(replay: Replay, everything: bool = False) -> Figure:
    """Return the figure of a replay, a column of a page wide.

    Over one time axis: the raw rate of all axes, as wide as the middle 90 % of each pixel's
    samples, and the bias of each of the first five, with two standard deviations to either side and
    the means of the raw rate at rest. Motion is shaded, and so is a stuck or saturated sensor.

    `everything`: all panels instead: also the noise, the gain or the drift that were learned, and
    Allan deviations; a column for each axis, of the first six at most, two columns of a page wide.
    """
    if everything:
        return plot_replay_grid(replay)
    shown = min(replay.log.channels, _MOST_AXES)
    heights = [_RATE, *[_BIAS] * shown]
    lost, rest = replay.lost, certain_rest(replay)
    caption = _caption(replay, shown, lost)
    stack = Stack(_question(replay), _answer(replay, shown), caption, heights)
    unit, seconds = time_unit(replay.log.duration)
    _draw_rates(stack.add(), replay, shown, seconds)
    for i in range(shown):
        panel = stack.add()
        _draw_bias(panel, replay, i, seconds, rest)
        _shade(panel, replay, i, seconds, lost[:, i])
    last = max(replay.log.duration, 1.0 / replay.log.rate)
    over_time(stack.panels, 0.0, last / seconds, unit)
    meta = replay.log.meta
    source = meta.get("source") or meta.get("sensor", "log")
    return stack.finish(str(source), replay.log.rate, replay.log.duration)


def _question(replay: Replay) -> str:
    if replay.output == "compensated":
        return "What is the gyro's bias, and how well is it known?"
    return f"What does {replay.method} make of the gyro's rate?"


def _answer(replay: Replay, shown: int) -> str:
    """Return the bias of each axis at the end."""
    bias, sigma = replay.history.bias[-1], replay.history.bias_sigma[-1]
    known = replay.method == "auto"
    each = [
        f"{_short(replay, i)} {with_error(bias[i], sigma[i]) if known else f'{bias[i]:.4g}'}"
        for i in range(shown)
        if np.isfinite(bias[i])
    ]
    return f"At the end: {', '.join(each)} {replay.log.unit}." if each else "Nothing was learned."


def _draw_rates(panel: Axes, replay: Replay, shown: int, seconds: float) -> None:
    lows, highs = [], []
    for i in range(shown):
        drawn = band(replay.log.data[:, i])
        times = drawn.middle / replay.log.rate / seconds
        draw_scatter(panel, times, drawn, _colour(i), _short(replay, i))
        lows.append(drawn.low)
        highs.append(drawn.high)
    panel.set_ylim(*_cut(np.concatenate(lows), np.concatenate(highs)))
    head(panel, f"raw rate [{replay.log.unit}]")
    names(panel, shown)
    if not np.isfinite(replay.log.data[:, :shown]).any():
        write_in_middle(panel, "no sample")


def _cut(low: Floats, high: Floats) -> tuple[float, float]:
    """Return limits that hold all, but for a burst that would flatten the rest to a line."""
    there = np.isfinite(low)
    if not there.any():
        return -1.0, 1.0
    low, high = low[there], high[there]
    least, most = np.quantile(low, _FEW), np.quantile(high, 1.0 - _FEW)
    middle, half = 0.5 * (least + most), 0.5 * (most - least)
    if max(middle - low.min(), high.max() - middle) > _FLAT * half > 0.0:
        return room(float(least), float(most), 0.3)
    return room(float(low.min()), float(high.max()))


def _draw_bias(panel: Axes, replay: Replay, i: int, seconds: float, rest: Booleans | None) -> None:
    history = replay.history
    places = _evenly(replay)
    times = history.samples[places] / replay.log.rate / seconds
    bias, sigma = history.bias[places, i], history.bias_sigma[places, i]
    tuned = replay.method == "auto"
    if tuned:
        draw_known(panel, times, bias, sigma, VERMILION, "bias ± 2σ")
    else:
        drawn = band(replay.bias[:, i])
        draw_scatter(panel, drawn.middle / replay.log.rate / seconds, drawn, VERMILION, "filtered")
    centres, means = means_at_rest(replay, i, rest)
    panel.plot(centres / seconds, means, "o", color=BLACK, ms=1.3, mew=0.0, label="raw, at rest")
    late = slice(bias.size // 10, None)
    half = 2.0 * sigma if tuned else np.zeros_like(sigma)
    low, high = limits(np.concatenate(((bias - half)[late], (bias + half)[late])), 0.0, 0.0)
    # Dots say less than the band: they may widen the scale, not flatten the band to a line.
    near, span = together(means), high - low
    low, high = (
        min([low, *near[near > low - _WIDER * span]]),
        max([high, *near[near < high + _WIDER * span]]),
    )
    panel.set_ylim(*room(low, high))
    head(panel, f"{_name(replay, i)} [{replay.log.unit}]")
    if i == 0:
        names(panel, 2)
    if not replay.ready[i]:
        write_in_middle(panel, "no bias known")


def _evenly(replay: Replay) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    samples = replay.history.samples
    wanted = np.linspace(samples[-1] / COLUMNS, samples[-1], COLUMNS)
    return np.unique(np.searchsorted(samples, wanted).clip(max=samples.size - 1))


def _colour(i: int) -> str:
    return (*AXIS_COLOURS, BLACK, ORANGE)[i]


def _short(replay: Replay, i: int) -> str:
    """Return what tells an axis from the others: "x" of "gyro_x"."""
    name = split_unit(replay.log.names[i])[0]
    return name.rpartition("_")[2] if replay.log.channels == 3 else name


def _name(replay: Replay, i: int) -> str:
    what = "bias of " if replay.output == "compensated" else ""
    return f"{what}{split_unit(replay.log.names[i])[0]}"


def _shade(panel: Axes, replay: Replay, i: int, seconds: float, lost: Booleans) -> None:
    """Shade the times in motion, and those of a stuck or saturated sensor, behind all else."""
    scale = 1.0 / (replay.log.rate * seconds)
    if replay.readings is not None:
        begins, ends = spans_of(~(replay.readings.at_rest[:, i] | lost))
        shade(panel, scale * begins, scale * ends)
    begins, ends = spans_of(lost)
    shade(panel, scale * begins, scale * ends, ROSE)


def _caption(replay: Replay, shown: int, lost: Booleans) -> str:
    said = ["Coloured above: the middle 90 % of the samples at a time, and their median."]
    if replay.method == "auto":
        said.append(
            f"Dots: means of {length_of_means(replay):.2g} s at rest, noisier than the bias."
        )
    if replay.readings is not None and not (replay.readings.at_rest | lost).all():
        said.append("Grey: motion, or no rest seen yet.")
    if lost.any():
        said.append("Rose: stuck or saturated.")
    if shown < replay.log.channels:
        said.append(f"Shown are the first {shown} of {replay.log.channels} axes.")
    return " ".join(said)
