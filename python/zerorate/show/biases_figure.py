"""The figure of several replays: how the bias of each log ran, axis by axis."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.record.names import split_unit
from zerorate.show.scales import limits
from zerorate.show.stack import Stack, draw_known, head, names, over_time
from zerorate.show.style import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    shortened,
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
_MOST_AXES: Final = 6
_PANEL: Final = 18.0
"""Millimetres."""
_WIDER: Final = 5.0
"""How many times as wide as at the end a band may be to be shown whole."""


def plot_summary(replay: Summary) -> Figure:
    """Return the biases of one log."""
    return plot_biases({Path(replay.source).name: replay})


def plot_replays(replays: Replays) -> Figure:
    """Return the biases of several logs over each other."""
    return plot_biases(replays.results)


def plot_biases(replays: Mapping[str, Summary]) -> Figure:
    """Return the biases of several logs over the time since each began.

    A panel an axis, a column of a page wide; colours begin anew after six logs.

    `replays`: by the names of the logs; those whose unit is not that of the first are left out.
    Axes are compared in their order, the first six.
    """
    of_data = next(iter(replays.values())).header.unit
    replays = {name: one for name, one in replays.items() if one.header.unit == of_data}
    labels = max((one.header.names for one in replays.values()), key=len)[:_MOST_AXES]
    told = " and ".join(sorted({one.method for one in replays.values()}))
    stack = Stack(
        "Is the bias the same in each log?",
        f"by {told}, two standard deviations to either side",
        "Time since the first sample of each log.",
        [_PANEL] * len(labels),
    )
    longest = max(one.header.duration for one in replays.values())
    unit, length = time_unit(longest)
    for i, label in enumerate(labels):
        panel = stack.add()
        for k, (name, replay) in enumerate(replays.items()):
            if i < len(replay.header.names):
                _draw(panel, replay, i, length, _COLOURS[k % len(_COLOURS)], shortened(name, 16))
        _fit(panel, replays, i)
        head(panel, f"{split_unit(label)[0]} [{of_data}]")
    names(stack.panels[0], 3)
    over_time(stack.panels, 0.0, longest / length, unit)
    return stack.finish(f"{len(replays)} log{'s' if len(replays) > 1 else ''}", 0.0, 0.0)


def _draw(panel: Axes, replay: Summary, axis: int, length: float, colour: str, name: str) -> None:
    bias, sigma = replay.history.bias[:, axis], replay.history.bias_sigma[:, axis]
    known = np.isfinite(bias)
    times = replay.history.samples[known] / replay.header.rate / length
    draw_known(panel, times, bias[known], sigma[known], colour, name)


def _fit(panel: Axes, replays: Mapping[str, Summary], axis: int) -> None:
    """Give a panel the scale of what is known of a bias, not of what its start did not know."""
    found = [one.history for one in replays.values() if axis < len(one.header.names)]
    ends = [values for one in found for values in _ends(one.bias[:, axis], one.bias_sigma[:, axis])]
    if not ends:
        write_in_middle(panel, "no bias was learned")
        return
    panel.set_ylim(*limits(np.array(ends)))


def _ends(bias: Floats, sigma: Floats) -> list[float]:
    """Return where the band lies while the bias is about as well known as at the end."""
    there = np.isfinite(bias) & np.isfinite(sigma)
    known = there & (sigma <= _WIDER * sigma[there][-1]) if there.any() else there
    return [*(bias[known] - 2.0 * sigma[known]), *(bias[known] + 2.0 * sigma[known])]
