"""The panels of one axis of a replay."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from zerorate.run.replay import Replay
from zerorate.run.replay.history import noise_units
from zerorate.show.scales import BUCKETS, limits, outline, parts, spans
from zerorate.show.style import (
    AR_COLOURS,
    BLACK,
    BLUE,
    GREY,
    MA_COLOURS,
    ORANGE,
    ROSE,
    SKY,
    VERMILION,
    time_unit,
    write_in_middle,
)
from zerorate.types import Booleans, Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = [
    "MEMORIES",
    "draw_allan",
    "draw_bias",
    "draw_learned",
    "draw_model",
    "draw_noise",
    "draw_rate",
]

Places = npt.NDArray[np.intp]

MEMORIES: Final = 10.0
"""Filter time constants from which on an Allan deviation is again one of the sensor."""

_MOMENTS: Final = 130
_MEANS: Final = 60
_DEPTH: Final = 1e4
_FAR: Final = 1e3
_SUBSCRIPTS: Final = "₀₁₂₃"
_OUTPUT_NAMES: Final = {"estimate": "filtered", "compensated": "compensated"}


def draw_rate(axes: Axes, replay: Replay, i: int) -> None:
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
    _shade(axes, replay, i)
    axes.set_xlim(0.0, max(replay.log.duration, 1.0 / rate) / seconds)
    axes.set_ylim(*limits(np.concatenate((least, most)), 0.15, 0.35))
    axes.set_xlabel(f"time [{unit}]")
    if not np.isfinite(raw).any():
        write_in_middle(axes, "no sample")
    axes.set_title(replay.log.names[i])


def draw_noise(axes: Axes, replay: Replay, i: int) -> Axes:
    """Draw the root of R, and the Kalman gain on a second scale, which is returned."""
    t, (unit, seconds) = _moments_of(replay), time_unit(replay.log.duration)
    root = np.sqrt(replay.history.measurement_noise[:, i])
    even = _evenly(replay)
    axes.plot(t[even] / seconds, root[even], color=BLUE, lw=0.5, label="√R")
    axes.set_xlim(0.0, max(replay.log.duration, 1.0 / replay.log.rate) / seconds)
    low, high = limits(root)
    axes.set_ylim(max(0.0, low - 0.6 * (high - low)), high + 0.35 * (high - low))
    axes.set_xlabel(f"time [{unit}]")
    if not replay.ready[i]:
        write_in_middle(axes, "nothing learned")
    right = axes.twinx()
    gain = replay.history.gain[even, i, 0]
    right.plot(t[even] / seconds, gain, color=ORANGE, lw=0.5, label="gain")
    right.set_ylim(0.0, 1.0)
    right.tick_params(axis="y", colors=ORANGE)
    axes.tick_params(axis="y", colors=BLUE)
    return right


def draw_model(axes: Axes, replay: Replay, i: int) -> None:
    """Draw the coefficients over the logarithm of time, where learning is seen."""
    (p, q), places = replay.params["order"], _rising(replay)
    t, model = _moments_of(replay)[places], replay.history.coefficients[places, i]
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
        write_in_middle(axes, "nothing learned")


def draw_allan(axes: Axes, replay: Replay, i: int) -> None:
    """Draw Allan deviations, grey where the filter, not the sensor, shapes the filtered one."""
    if replay.allan is None:
        raise ValueError("this replay has no Allan deviations: call replay with allan=True")
    taus = replay.allan.taus
    for curve, colour, label in (
        (replay.allan.raw[i], SKY, "raw"),
        (replay.allan.filtered[i], VERMILION, _OUTPUT_NAMES[replay.output]),
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
        write_in_middle(axes, "no noise")


def _shade_memory(axes: Axes, replay: Replay, i: int) -> None:
    """Smoothing acts below so many time constants, taking off the drift from one on."""
    (left, right), memory = axes.get_xlim(), replay.memory[i]
    if np.isnan(memory):
        return
    if replay.output == "estimate":
        axes.axvspan(left, min(MEMORIES * memory, right), color=GREY, alpha=0.6, lw=0.0)
    elif memory < right:
        axes.axvspan(memory, right, color=GREY, alpha=0.6, lw=0.0)


def _moments_of(replay: Replay) -> Floats:
    """Return the times of a replay's history, s."""
    t: Floats = replay.history.samples / replay.log.rate
    return t


def _evenly(replay: Replay) -> Places:
    """Return the moments that are about evenly spaced, for a linear axis."""
    last = replay.history.samples[-1]
    return _nearest(replay, np.linspace(last / _MOMENTS, last, _MOMENTS))


def _rising(replay: Replay) -> Places:
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


def draw_bias(axes: Axes, replay: Replay, i: int) -> None:
    """Draw the bias with two standard deviations to either side, over means of the raw rate."""
    (unit, seconds), even = time_unit(replay.log.duration), _evenly(replay)
    t, history = _moments_of(replay)[even], replay.history
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
    _shade(axes, replay, i)
    axes.set_xlim(0.0, max(replay.log.duration, 1.0 / replay.log.rate) / seconds)
    late = t > t[-1] / 10.0
    axes.set_ylim(
        *_holding(_together(means), (bias - 2.0 * sigma)[late], (bias + 2.0 * sigma)[late])
    )
    axes.set_xlabel(f"time [{unit}]")
    if not replay.ready[i]:
        write_in_middle(axes, "no drift known")


def draw_learned(axes: Axes, replay: Replay, i: int) -> Axes:
    """Draw white noise, and the strength of the drift on a second scale, which is returned."""
    (_, white), (_, walk) = noise_units(replay.log.unit)
    places = _rising(replay)
    t = _moments_of(replay)[places]
    noise = white * replay.history.angle_random_walk[places, i]
    drift = walk * replay.history.rate_random_walk[places, i]
    axes.plot(t, noise, color=BLUE, lw=0.9, label="noise")
    axes.set_xscale("log")
    axes.set_xlim(replay.params["startup"], max(replay.log.duration, 2 * replay.params["startup"]))
    axes.set_ylim(0.0, limits(noise)[1] * 1.3)
    axes.set_xlabel("time [s]")
    axes.tick_params(axis="y", colors=BLUE)
    if not replay.ready[i]:
        write_in_middle(axes, "nothing learned")
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


def _together(values: Floats) -> Floats:
    """Return the values without those so far from the others that these would be one line."""
    there = values[np.isfinite(values)]
    if there.size == 0:
        return there
    away = np.abs(there - np.median(there))
    typical = np.median(away)
    return there[away <= _FAR * typical] if typical > 0.0 else there


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
    starts = parts(z.size, _MEANS)
    counts = np.add.reduceat(used.astype(np.float64), starts)
    # Scaled by the number of samples, numbers near the largest double can be summed.
    sums = np.add.reduceat(np.where(used, z / z.size, 0.0), starts)
    centre = (starts + np.append(starts[1:], z.size)) / (2.0 * replay.log.rate)
    with np.errstate(divide="ignore", invalid="ignore"):
        return centre, np.where(counts > 0.0, sums * (z.size / counts), np.nan)


def _shade(axes: Axes, replay: Replay, i: int) -> None:
    """Shade the times in motion, and those of a stuck or saturated sensor, behind all else."""
    lost = replay.lost[:, i]
    if replay.readings is not None:
        _shade_where(axes, replay, ~(replay.readings.at_rest[:, i] | lost), GREY)
    _shade_where(axes, replay, lost, ROSE)


def _shade_where(axes: Axes, replay: Replay, there: Booleans, colour: str) -> None:
    """Shade these samples, each as wide at least as can be seen."""
    if not there.any():
        return
    starts = parts(replay.log.n, 2 * BUCKETS)
    edges = np.append(starts, replay.log.n) / replay.log.rate
    edges /= time_unit(replay.log.duration)[1]
    shaded = np.concatenate(([False], np.logical_or.reduceat(there, starts), [False]))
    begins, ends = edges[shaded[1:] & ~shaded[:-1]], edges[shaded[:-1] & ~shaded[1:]]
    axes.broken_barh(
        list(zip(begins, ends - begins, strict=True)),
        (0.0, 1.0),
        transform=axes.get_xaxis_transform(),
        color=colour,
        lw=0.0,
        zorder=0.5,
    )
