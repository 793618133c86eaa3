"""Where a filter took the sensor for moving."""

from typing import TYPE_CHECKING

import numpy as np

from zerorate.run.replay import Replay
from zerorate.show.plotting.envelope import BUCKETS
from zerorate.show.plotting.style import GREY, time_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["shade_motion"]


def shade_motion(axes: "Axes", replay: Replay, i: int) -> None:
    """Shade the times in motion behind all else, each at least as wide as can be seen."""
    if replay.readings is None or replay.readings.at_rest[:, i].all():
        return
    rest, n = replay.readings.at_rest[:, i], replay.log.n
    starts = np.unique(np.linspace(0, n, min(2 * BUCKETS, n), endpoint=False).astype(int))
    edges = np.append(starts, n) / replay.log.rate / time_unit(replay.log.duration)[1]
    moved = np.concatenate(([False], ~np.logical_and.reduceat(rest, starts), [False]))
    begins, ends = edges[moved[1:] & ~moved[:-1]], edges[moved[:-1] & ~moved[1:]]
    axes.broken_barh(
        list(zip(begins, ends - begins, strict=True)),
        (0.0, 1.0),
        transform=axes.get_xaxis_transform(),
        color=GREY,
        lw=0.0,
        zorder=0.5,
    )
