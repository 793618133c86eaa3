"""The four panels of one axis."""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from zerorate.run.replay import Replay
from zerorate.show.plotting.envelope import limits, outline, spans
from zerorate.show.plotting.motion import shade_motion
from zerorate.show.plotting.style import (
    AR_COLOURS,
    BLACK,
    BLUE,
    FONT,
    GREY,
    MA_COLOURS,
    ORANGE,
    SKY,
    VERMILION,
    time_unit,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = [
    "MEMORIES",
    "draw_allan",
    "draw_model",
    "draw_noise",
    "draw_rate",
    "evenly",
    "moments_of",
    "rising",
    "say",
]

Floats = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

MEMORIES = 10.0
"""Filter time constants from which on an Allan deviation speaks of the sensor again."""

_MOMENTS = 130
_SUBSCRIPTS = "₀₁₂₃"
_ANSWER = {"estimate": "filtered", "compensated": "compensated"}


def draw_rate(axes: "Axes", replay: Replay, i: int) -> None:
    """Draw the raw rate as a band, and the drift over it, both with all their peaks."""
    rate, (unit, seconds) = replay.log.rate, time_unit(replay.log.duration)
    raw, filtered = replay.log.data[:, i], replay.drift[:, i]
    t, least, most = spans(raw, rate)
    if np.array_equal(least, most, equal_nan=True):
        axes.plot(t / seconds, least, color=SKY, lw=0.8, marker=".", ms=2.0, label="raw")
    else:
        axes.fill_between(t / seconds, least, most, color=SKY, alpha=0.55, lw=0.3, label="raw")
    t, y = outline(filtered, rate)
    label = "bias" if replay.output == "compensated" else "filtered"
    axes.plot(t / seconds, y, color=VERMILION, lw=0.5, label=label)
    shade_motion(axes, replay, i)
    axes.set_xlim(0.0, max(replay.log.duration, 1.0 / rate) / seconds)
    axes.set_ylim(*limits(np.concatenate((least, most)), 0.15, 0.35))
    axes.set_xlabel(f"time [{unit}]")
    if not np.isfinite(raw).any():
        say(axes, "no sample")
    axes.set_title(replay.log.names[i])


def draw_noise(axes: "Axes", replay: Replay, i: int) -> "Axes":
    """Draw the root of R, and the Kalman gain on a second scale, which is returned."""
    t, (unit, seconds) = moments_of(replay), time_unit(replay.log.duration)
    root = np.sqrt(replay.history.measurement_noise[:, i])
    even = evenly(replay)
    axes.plot(t[even] / seconds, root[even], color=BLUE, lw=0.5, label="√R")
    axes.set_xlim(0.0, max(replay.log.duration, 1.0 / replay.log.rate) / seconds)
    low, high = limits(root)
    axes.set_ylim(max(0.0, low - 0.6 * (high - low)), high + 0.35 * (high - low))
    axes.set_xlabel(f"time [{unit}]")
    if not replay.ready[i]:
        say(axes, "nothing learned")
    right = axes.twinx()
    gain = replay.history.gain[even, i, 0]
    right.plot(t[even] / seconds, gain, color=ORANGE, lw=0.5, label="gain")
    right.set_ylim(0.0, 1.0)
    right.tick_params(axis="y", colors=ORANGE)
    axes.tick_params(axis="y", colors=BLUE)
    return right


def draw_model(axes: "Axes", replay: Replay, i: int) -> None:
    """Draw the coefficients over the logarithm of time, where learning is seen."""
    (p, q), places = replay.params["order"], rising(replay)
    t, model = moments_of(replay)[places], replay.history.coefficients[places, i]
    for j in range(p):
        axes.plot(t, model[:, j], color=AR_COLOURS[j], lw=0.9, label=f"φ{_SUBSCRIPTS[j + 1]}")
    for j in range(q):
        label = f"θ{_SUBSCRIPTS[j + 1]}"
        axes.plot(t, model[:, p + j], color=MA_COLOURS[j], lw=0.9, label=label)
    size = _rms(replay.log.data[:, i])
    axes.plot(t, model[:, -1] / size, color=BLACK, lw=0.9, ls="--", label="c / rms")
    axes.set_xscale("log")
    first = replay.params["startup"]
    last = max(replay.log.duration, 2.0 * first)
    axes.set_xlim(first, last)
    end = None if replay.params["adapt_for"] is None else first + replay.params["adapt_for"]
    if end is not None and end < last:
        axes.axvline(end, color="0.5", lw=0.7, ls=":")
    axes.set_xlabel("time [s]")
    if not replay.ready[i]:
        say(axes, "nothing learned")


def draw_allan(axes: "Axes", replay: Replay, i: int) -> None:
    """Draw Allan deviations, grey where the filter, not the sensor, shapes the filtered one."""
    if replay.allan is None:
        raise ValueError("this replay has no Allan deviations: call replay with allan=True")
    taus = replay.allan.taus
    for curve, colour, label in (
        (replay.allan.raw[i], SKY, "raw"),
        (replay.allan.filtered[i], VERMILION, _ANSWER[replay.output]),
    ):
        shown = np.where(curve > 0.0, curve, np.nan)
        axes.plot(taus, shown, color=colour, lw=1.0, marker="o", ms=1.8, label=label)
    axes.set_xscale("log")
    axes.set_yscale("log")
    left, right = taus[0] / 1.5, max(taus[-1], 4.0 * taus[0]) * 1.5
    axes.set_xlim(left, right)
    _shade_memory(axes, replay, i)
    axes.set_xlabel("averaging time [s]")
    if not (replay.allan.raw[i] > 0.0).any():
        say(axes, "no noise")


def _shade_memory(axes: "Axes", replay: Replay, i: int) -> None:
    """Smoothing acts below so many time constants, taking off the drift from one on."""
    (left, right), memory = axes.get_xlim(), replay.memory[i]
    if np.isnan(memory):
        return
    if replay.output == "estimate":
        axes.axvspan(left, min(MEMORIES * memory, right), color=GREY, alpha=0.6, lw=0.0)
    elif memory < right:
        axes.axvspan(memory, right, color=GREY, alpha=0.6, lw=0.0)


def say(axes: "Axes", text: str) -> None:
    """Write why a panel is empty into its middle."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", size=FONT, color="0.4")


def moments_of(replay: Replay) -> Floats:
    """Return the times of a replay's history, s."""
    t: Floats = replay.history.samples / replay.log.rate
    return t


def evenly(replay: Replay) -> Places:
    """Return the moments that are about evenly spaced, for a linear axis."""
    last = replay.history.samples[-1]
    return _nearest(replay, np.linspace(last / _MOMENTS, last, _MOMENTS))


def rising(replay: Replay) -> Places:
    """Return the moments whose logarithms are about evenly spaced."""
    last = replay.history.samples[-1]
    return _nearest(replay, np.geomspace(1, last, _MOMENTS))


def _nearest(replay: Replay, wanted: Floats) -> Places:
    samples = replay.history.samples
    return np.unique(np.searchsorted(samples, wanted).clip(max=len(samples) - 1))


def _rms(z: Floats) -> float:
    there = z[np.isfinite(z)]
    peak = float(np.abs(there).max()) if there.size else 0.0
    return peak * float(np.sqrt(np.mean((there / peak) ** 2))) if peak > 0.0 else 1.0
