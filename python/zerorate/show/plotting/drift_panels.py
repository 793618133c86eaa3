"""The panels of a filter that tunes itself: the drift, and what was learned of the sensor."""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from zerorate.run.replay import Replay
from zerorate.run.replay.history import noise_units
from zerorate.show.plotting.envelope import limits
from zerorate.show.plotting.motion import shade_motion
from zerorate.show.plotting.panels import evenly, moments_of, rising, say
from zerorate.show.plotting.style import BLUE, ORANGE, SKY, VERMILION, time_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_bias", "draw_learned"]

Floats = npt.NDArray[np.float64]

_MEANS = 60
_DEPTH = 1e4


def draw_bias(axes: "Axes", replay: Replay, i: int) -> None:
    """Draw the bias with two standard deviations to either side, over means of the raw rate."""
    (unit, seconds), even = time_unit(replay.log.duration), evenly(replay)
    t, history = moments_of(replay)[even], replay.history
    bias, sigma = history.bias[even, i], history.bias_sigma[even, i]
    axes.fill_between(
        t / seconds, bias - 2.0 * sigma, bias + 2.0 * sigma, color=VERMILION, alpha=0.25, lw=0.0
    )
    axes.plot(t / seconds, bias, color=VERMILION, lw=0.8, label="bias ± 2σ")
    times, means = _means_at_rest(replay, i)
    label = "raw, mean at rest"
    axes.plot(
        times / seconds, means, color=SKY, lw=0.0, marker="o", ms=1.8, label=label, zorder=1.5
    )
    shade_motion(axes, replay, i)
    axes.set_xlim(0.0, max(replay.log.duration, 1.0 / replay.log.rate) / seconds)
    late = t > t[-1] / 10.0
    axes.set_ylim(*_holding(means, (bias - 2.0 * sigma)[late], (bias + 2.0 * sigma)[late]))
    axes.set_xlabel(f"time [{unit}]")
    if not replay.ready[i]:
        say(axes, "no drift known")


def draw_learned(axes: "Axes", replay: Replay, i: int) -> "Axes":
    """Draw white noise, and the strength of the drift on a second scale, which is returned."""
    (_, white), (_, walk) = noise_units(replay.log.unit)
    places = rising(replay)
    t = moments_of(replay)[places]
    noise = white * replay.history.angle_random_walk[places, i]
    drift = walk * replay.history.rate_random_walk[places, i]
    axes.plot(t, noise, color=BLUE, lw=0.9, label="noise")
    axes.set_xscale("log")
    axes.set_xlim(replay.params["startup"], max(replay.log.duration, 2 * replay.params["startup"]))
    axes.set_ylim(0.0, limits(noise)[1] * 1.3)
    axes.set_xlabel("time [s]")
    axes.tick_params(axis="y", colors=BLUE)
    if not replay.ready[i]:
        say(axes, "nothing learned")
    right = axes.twinx()
    right.plot(t, drift, color=ORANGE, lw=0.9, label="drift")
    right.set_yscale("log")
    right.set_ylim(*_decades(drift))
    right.tick_params(axis="y", colors=ORANGE)
    return right


def _holding(*series: Floats) -> tuple[float, float]:
    """Return limits that hold each series, with room for a legend above."""
    known = [limits(z) for z in series if np.isfinite(z).any()] or [(0.0, 1.0)]
    low, high = min(low for low, _ in known), max(high for _, high in known)
    return low, high + 0.3 * (high - low)


def _decades(values: Floats) -> tuple[float, float]:
    """Return limits of a logarithmic scale, of at most so many decades as can be read."""
    high = float(np.max(values, where=values > 0.0, initial=0.0)) or 1.0
    least = float(np.min(values, where=values > 0.0, initial=high))
    return max(least, high / _DEPTH) / 2.0, high * 2.0


def _means_at_rest(replay: Replay, i: int) -> tuple[Floats, Floats]:
    """Return times, s, and means of the samples at rest in equal parts of the record."""
    z = replay.log.data[:, i]
    used = np.isfinite(z)
    if replay.readings is not None:
        used &= replay.readings.certain_rest(replay.log.rate)[:, i]
    starts = np.unique(np.linspace(0, z.size, min(_MEANS, z.size), endpoint=False).astype(int))
    counts = np.add.reduceat(used.astype(np.float64), starts)
    # Scaled by the number of samples, numbers near the largest double can be summed.
    sums = np.add.reduceat(np.where(used, z / z.size, 0.0), starts)
    centre = (starts + np.append(starts[1:], z.size)) / (2.0 * replay.log.rate)
    with np.errstate(divide="ignore", invalid="ignore"):
        return centre, np.where(counts > 0.0, sums * (z.size / counts), np.nan)
