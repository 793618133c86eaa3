"""Panels for one axis of a replay."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from zerorate.show.scales import (
    MAX_BUCKETS,
    bucket_extremes,
    robust_limits,
    split_into_parts,
    trace_outline,
)
from zerorate.show.stack import find_spans
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
from zerorate.tasks.replay import Replay
from zerorate.tasks.replay.history import noise_units
from zerorate.types import Booleans, Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RowIndices = npt.NDArray[np.intp]

SMOOTHING_TIME_CONSTANTS: Final = 10.0
"""Averaging time, in filter time constants, above which Allan deviations show the sensor."""

_MOMENT_COUNT: Final = 130
_MEAN_COUNT: Final = 60
_MAX_DECADE_RATIO: Final = 1e4
_OUTLIER_RATIO: Final = 1e3
_SUBSCRIPTS: Final = "₀₁₂₃"
_OUTPUT_NAMES: Final = {"estimate": "filtered", "compensated": "compensated"}


def draw_rate(axes: Axes, replay: Replay, i: int) -> None:
    """Draw the raw rate as a band, and the bias over it, with all peaks of both."""
    rate, (unit, seconds) = replay.log.rate, time_unit(replay.log.duration)
    raw, filtered = replay.log.data[:, i], replay.bias[:, i]
    t, lows, highs = bucket_extremes(raw, rate)
    if np.array_equal(lows, highs, equal_nan=True):
        axes.plot(t / seconds, lows, color=SKY, lw=0.8, marker=".", ms=2.0, label="raw")
    else:
        axes.fill_between(t / seconds, lows, highs, color=SKY, alpha=0.55, lw=0.3, label="raw")
    t, y = trace_outline(filtered, rate)
    label = "bias" if replay.output == "compensated" else "filtered"
    axes.plot(t / seconds, y, color=VERMILION, lw=0.5, label=label)
    _shade(axes, replay, i)
    axes.set_xlim(0.0, max(replay.log.duration, 1.0 / rate) / seconds)
    axes.set_ylim(*robust_limits(np.concatenate((lows, highs)), 0.15, 0.35))
    axes.set_xlabel(f"time [{unit}]")
    if not np.isfinite(raw).any():
        write_in_middle(axes, "no sample")
    axes.set_title(replay.log.names[i])


def draw_noise(axes: Axes, replay: Replay, i: int) -> None:
    """Draw the square root of the measurement noise R."""
    root = np.sqrt(replay.history.measurement_noise[:, i])
    _draw_evenly(axes, replay, root, BLUE)
    low, high = robust_limits(root)
    axes.set_ylim(max(0.0, low - 0.6 * (high - low)), high + 0.35 * (high - low))
    if not replay.ready[i]:
        write_in_middle(axes, "nothing learned")


def draw_gain(axes: Axes, replay: Replay, i: int) -> None:
    """Draw the Kalman gain, by which an innovation changes the estimate."""
    _draw_evenly(axes, replay, replay.history.gain[:, i, 0], ORANGE)
    axes.set_ylim(0.0, 1.0)


def _draw_evenly(axes: Axes, replay: Replay, values: Floats, colour: str) -> None:
    rows, (unit, seconds) = _even_rows(replay), time_unit(replay.log.duration)
    axes.plot(_history_times(replay)[rows] / seconds, values[rows], color=colour, lw=0.7)
    axes.set_xlim(0.0, max(replay.log.duration, 1.0 / replay.log.rate) / seconds)
    axes.set_xlabel(f"time [{unit}]")


def draw_model(axes: Axes, replay: Replay, i: int) -> None:
    """Draw the coefficients over the logarithm of time, which shows the learning."""
    (p, q), rows = replay.params["order"], _log_spaced_rows(replay)
    t, model = _history_times(replay)[rows], replay.history.coefficients[rows, i]
    for j in range(p):
        axes.plot(t, model[:, j], color=AR_COLOURS[j], lw=0.9, label=f"φ{_SUBSCRIPTS[j + 1]}")
    for j in range(q):
        label = f"θ{_SUBSCRIPTS[j + 1]}"
        axes.plot(t, model[:, p + j], color=MA_COLOURS[j], lw=1.1, ls=":", label=label)
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
    """Draw Allan deviations; grey marks times at which the filter shapes the filtered curve."""
    taus = replay.allan.taus
    # If both curves coincide, both stay visible: the lower is broad, the upper has open marks.
    raw: Any = {"color": SKY, "lw": 2.0, "label": "raw"}
    filtered: Any = {
        "color": VERMILION,
        "lw": 0.7,
        "marker": "o",
        "ms": 2.2,
        "mfc": "w",
        "mew": 0.6,
    }
    filtered["label"] = _OUTPUT_NAMES[replay.output]
    for curve, look in ((replay.allan.raw[i], raw), (replay.allan.filtered[i], filtered)):
        axes.plot(taus, np.where(curve > 0.0, curve, np.nan), **look)
    axes.set_xscale("log")
    axes.set_yscale("log")
    left, right = taus[0] / 1.5, max(taus[-1], 4.0 * taus[0]) * 1.5
    axes.set_xlim(left, right)
    _shade_smoothing(axes, replay, i)
    axes.set_xlabel("averaging time [s]")
    if not (replay.allan.raw[i] > 0.0).any():
        write_in_middle(axes, "no noise")


def _shade_smoothing(axes: Axes, replay: Replay, i: int) -> None:
    """Shade the averaging times at which the filter changes the Allan deviation."""
    (left, right), time_constant = axes.get_xlim(), replay.time_constant[i]
    if np.isnan(time_constant):
        return
    if replay.output == "estimate":
        axes.axvspan(
            left,
            min(SMOOTHING_TIME_CONSTANTS * time_constant, right),
            color=GREY,
            alpha=0.6,
            lw=0.0,
        )
    elif time_constant < right:
        axes.axvspan(time_constant, right, color=GREY, alpha=0.6, lw=0.0)


def _history_times(replay: Replay) -> Floats:
    """Return the times of a replay's history, s."""
    t: Floats = replay.history.samples / replay.log.rate
    return t


def _even_rows(replay: Replay) -> RowIndices:
    """Return history rows at nearly even steps of time, for a linear axis."""
    last = replay.history.samples[-1]
    return _nearest_rows(replay, np.linspace(last / _MOMENT_COUNT, last, _MOMENT_COUNT))


def _log_spaced_rows(replay: Replay) -> RowIndices:
    """Return history rows at nearly even steps of the logarithm of time."""
    last = replay.history.samples[-1]
    return _nearest_rows(replay, np.geomspace(1, last, _MOMENT_COUNT))


def _nearest_rows(replay: Replay, positions: Floats) -> RowIndices:
    samples = replay.history.samples
    return np.unique(np.searchsorted(samples, positions).clip(max=len(samples) - 1))


def _rms(z: Floats) -> float:
    finite = z[np.isfinite(z)]
    peak = float(np.abs(finite).max()) if finite.size else 0.0
    return peak * float(np.sqrt(np.mean((finite / peak) ** 2))) if peak > 0.0 else 1.0


def draw_bias(axes: Axes, replay: Replay, i: int) -> None:
    """Draw the bias with two standard deviations, over means of the raw rate."""
    (unit, seconds), rows = time_unit(replay.log.duration), _even_rows(replay)
    t, history = _history_times(replay)[rows], replay.history
    bias, sigma = history.bias[rows, i], history.bias_sigma[rows, i]
    axes.fill_between(
        t / seconds, bias - 2.0 * sigma, bias + 2.0 * sigma, color=VERMILION, alpha=0.25, lw=0.0
    )
    axes.plot(t / seconds, bias, color=VERMILION, lw=0.8, label="bias ± 2σ")
    times, means = rest_means(replay, i, find_certain_rest(replay))
    style: Any = {"color": SKY, "lw": 0.0, "marker": "o", "ms": 1.8, "zorder": 1.5}
    axes.plot(times / seconds, means, label="raw, mean at rest", **style)
    # Use hatching: a colour would mix with the colour of the band.
    _shade(axes, replay, i, hatched=True)
    axes.set_xlim(0.0, max(replay.log.duration, 1.0 / replay.log.rate) / seconds)
    late = t > t[-1] / 10.0
    axes.set_ylim(
        *_enclosing_limits(
            drop_outliers(means), (bias - 2.0 * sigma)[late], (bias + 2.0 * sigma)[late]
        )
    )
    axes.set_xlabel(f"time [{unit}]")
    if not replay.ready[i]:
        write_in_middle(axes, "no bias known")


def draw_white_noise(axes: Axes, replay: Replay, i: int) -> None:
    """Draw the learned white noise over the logarithm of time."""
    (_, white), _ = noise_units(replay.log.unit)
    noise = white * replay.history.angle_random_walk[:, i]
    _draw_learned(axes, replay, noise, BLUE)
    axes.set_ylim(0.0, robust_limits(noise[_log_spaced_rows(replay)])[1] * 1.3)
    if not replay.ready[i]:
        write_in_middle(axes, "nothing learned")


def draw_walk(axes: Axes, replay: Replay, i: int) -> None:
    """Draw the learned strength of the bias drift, with two logarithmic scales."""
    _, (_, walk) = noise_units(replay.log.unit)
    drift = walk * replay.history.rate_random_walk[:, i]
    _draw_learned(axes, replay, drift, ORANGE)
    axes.set_yscale("log")
    axes.set_ylim(*_log_limits(drift[_log_spaced_rows(replay)]))


def _draw_learned(axes: Axes, replay: Replay, values: Floats, colour: str) -> None:
    rows, startup = _log_spaced_rows(replay), replay.params["startup"]
    axes.plot(_history_times(replay)[rows], values[rows], color=colour, lw=0.9)
    axes.set_xscale("log")
    axes.set_xlim(startup, max(replay.log.duration, 2.0 * startup))
    axes.set_xlabel("time [s]")


def _enclosing_limits(*series: Floats) -> tuple[float, float]:
    """Return limits that include all series, with room for a legend above."""
    known = [robust_limits(z) for z in series if np.isfinite(z).any()] or [(0.0, 1.0)]
    low, high = min(low for low, _ in known), max(high for _, high in known)
    return low, high + 0.3 * (high - low)


def drop_outliers(values: Floats) -> Floats:
    """Return the values without outliers that would flatten the other values."""
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return finite
    distances = np.abs(finite - np.median(finite))
    typical = np.median(distances)
    return finite[distances <= _OUTLIER_RATIO * typical] if typical > 0.0 else finite


def _log_limits(values: Floats) -> tuple[float, float]:
    """Return limits of a logarithmic scale, with a readable number of decades."""
    high = float(np.max(values, where=values > 0.0, initial=0.0)) or 1.0
    least = float(np.min(values, where=values > 0.0, initial=high))
    return max(least, high / _MAX_DECADE_RATIO) / 2.0, high * 2.0


def mean_duration(replay: Replay) -> float:
    """Return the averaging time of the dots near a bias, s."""
    return replay.log.n / replay.log.rate / min(_MEAN_COUNT, replay.log.n)


def find_certain_rest(replay: Replay) -> Booleans | None:
    """Return the mask of certain rest, shape (n, k); None if motion was not detected."""
    return None if replay.readings is None else replay.readings.certain_rest(replay.log.rate)


def rest_means(replay: Replay, i: int, rest: Booleans | None) -> tuple[Floats, Floats]:
    """Return times, s, and means of an axis' samples at rest, in equal parts of the record."""
    z = replay.log.data[:, i]
    used = np.isfinite(z)
    if rest is not None:
        used &= rest[:, i]
    starts = split_into_parts(z.size, _MEAN_COUNT)
    counts = np.add.reduceat(used.astype(np.float64), starts)
    # Divide by the number of samples first, so that very large numbers do not overflow.
    sums = np.add.reduceat(np.where(used, z / z.size, 0.0), starts)
    centre = (starts + np.append(starts[1:], z.size)) / (2.0 * replay.log.rate)
    with np.errstate(divide="ignore", invalid="ignore"):
        return centre, np.where(counts > 0.0, sums * (z.size / counts), np.nan)


def _shade(axes: Axes, replay: Replay, i: int, hatched: bool = False) -> None:
    """Mark motion, and shade a stuck or saturated sensor, behind all curves."""
    lost = replay.lost[:, i]
    if replay.readings is not None:
        in_motion = ~(replay.readings.at_rest[:, i] | lost)
        look: Any = {"fc": "none", "ec": GREY, "hatch": "////"} if hatched else {"color": GREY}
        _shade_where(axes, replay, in_motion, look)
    _shade_where(axes, replay, lost, {"color": ROSE})


def _shade_where(axes: Axes, replay: Replay, mask: Booleans, look: Mapping[str, Any]) -> None:
    """Shade the masked samples; each span is wide enough to be visible."""
    if not mask.any():
        return
    unit = time_unit(replay.log.duration)[1]
    begins, ends = (at / replay.log.rate / unit for at in find_spans(mask, 2 * MAX_BUCKETS))
    axes.broken_barh(
        list(zip(begins, ends - begins, strict=True)),
        (0.0, 1.0),
        transform=axes.get_xaxis_transform(),
        lw=0.0,
        zorder=0.5,
        **look,
    )
