"""Figure of several replays: the bias of each log over time, axis by axis."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.record.names import split_unit
from zerorate.show.scales import robust_limits
from zerorate.show.stack import Stack, draw_with_sigma, share_time_axis, write_head, write_names
from zerorate.show.style import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    shorten_source,
    time_unit,
    write_in_middle,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.tasks.replay import Replays, Summary
    from zerorate.types import Floats

_COLOURS: Final = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY)
_MAX_AXES: Final = 6
_PANEL_HEIGHT_MM: Final = 18.0
"""Height of a panel, mm."""
_MAX_SIGMA_RATIO: Final = 5.0
"""Largest width of a band that the scale must include, relative to the width at the end."""


def plot_summary(replay: Summary) -> Figure:
    """Return a figure of one log's biases."""
    return plot_biases({Path(replay.source).name: replay})


def plot_replays(replays: Replays) -> Figure:
    """Return a figure with the biases of several logs."""
    return plot_biases(replays.results)


def plot_biases(replays: Mapping[str, Summary]) -> Figure:
    """Return a figure with the biases of several logs over the time since each log's start.

    It has one panel per axis and is as wide as a page column. The colours repeat after six logs.

    `replays`: replays by the names of the logs. Logs with another unit than the first log are left
    out. The first six axes are compared, in their order.
    """
    unit_of_data = next(iter(replays.values())).header.unit
    replays = {
        name: summary for name, summary in replays.items() if summary.header.unit == unit_of_data
    }
    labels = max((summary.header.names for summary in replays.values()), key=len)[:_MAX_AXES]
    methods = " and ".join(sorted({summary.method for summary in replays.values()}))
    stack = Stack(
        "Is the bias the same in all logs?",
        f"by {methods}, two standard deviations to either side",
        "Time since the first sample of each log.",
        [_PANEL_HEIGHT_MM] * len(labels),
    )
    longest = max(summary.header.duration for summary in replays.values())
    unit, length = time_unit(longest)
    for i, label in enumerate(labels):
        panel = stack.add()
        for k, (name, replay) in enumerate(replays.items()):
            if i < len(replay.header.names):
                _draw(
                    panel, replay, i, length, _COLOURS[k % len(_COLOURS)], shorten_source(name, 16)
                )
        _fit_scale(panel, replays, i)
        write_head(panel, f"{split_unit(label)[0]} [{unit_of_data}]")
    write_names(stack.panels[0], 3)
    stack.share_scale(stack.panels)
    share_time_axis(stack.panels, 0.0, longest / length, unit)
    return stack.finish(f"{len(replays)} log{'s' if len(replays) > 1 else ''}", 0.0, 0.0)


def _draw(panel: Axes, replay: Summary, axis: int, length: float, colour: str, name: str) -> None:
    bias, sigma = replay.history.bias[:, axis], replay.history.bias_sigma[:, axis]
    known = np.isfinite(bias)
    times = replay.history.samples[known] / replay.header.rate / length
    draw_with_sigma(panel, times, bias[known], sigma[known], colour, name)


def _fit_scale(panel: Axes, replays: Mapping[str, Summary], axis: int) -> None:
    """Set the scale by the bias after convergence, not by its uncertain start."""
    histories = [
        history.history for history in replays.values() if axis < len(history.header.names)
    ]
    edges = [
        values
        for history in histories
        for values in _band_edges(history.bias[:, axis], history.bias_sigma[:, axis])
    ]
    if not edges:
        write_in_middle(panel, "no bias was learned")
        return
    panel.set_ylim(*robust_limits(np.array(edges)))


def _band_edges(bias: Floats, sigma: Floats) -> list[float]:
    """Return the edges of the band where it is not much wider than at the end."""
    finite = np.isfinite(bias) & np.isfinite(sigma)
    known = finite & (sigma <= _MAX_SIGMA_RATIO * sigma[finite][-1]) if finite.any() else finite
    return [*(bias[known] - 2.0 * sigma[known]), *(bias[known] + 2.0 * sigma[known])]
