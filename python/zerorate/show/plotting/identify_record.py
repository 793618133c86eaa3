"""Panels of a record over time and frequency, and of what is learned of it online."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal

import numpy as np
import numpy.typing as npt

from zerorate.identify.conclusions import model_name
from zerorate.noise.spectrum import Spectrum
from zerorate.show.plotting.envelope import limits, spans
from zerorate.show.plotting.style import (
    AR_COLOURS,
    BLACK,
    FONT,
    GREEN,
    MA_COLOURS,
    ORANGE,
    SKY,
    VERMILION,
    time_unit,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from zerorate.identify.identification import Identification, Online

__all__ = ["draw_online", "draw_series", "draw_spectrum", "style_times"]

Floats = npt.NDArray[np.float64]

_SUBSCRIPTS: Final = "₁₂₃"
_FREQUENCIES: Final = 300


def draw_series(axes: Axes, found: Identification) -> None:
    """Draw what was modelled with all its peaks, the means of its segments, and its motion."""
    data, rate = found.prepared.data, found.rate
    duration = data.size / rate
    unit, seconds = time_unit(duration)
    t, least, most = spans(data, rate)
    axes.fill_between(t / seconds, least, most, color=SKY, alpha=0.55, lw=0.3, label="record")
    means = found.tests.segment_means
    edges = np.arange(means.size + 1) * found.tests.segment / seconds
    axes.stairs(means, edges, baseline=None, color=BLACK, lw=0.7, label="means of segments")
    for i, span in enumerate(found.moving):
        label = "_" if i else "not at rest"
        axes.axvspan(
            span.start / seconds,
            span.end / seconds,
            color=ORANGE,
            alpha=0.35,
            lw=0.0,
            zorder=0,
            label=label,
        )
    axes.set_xlim(0.0, duration / seconds)
    axes.set_ylim(*limits(np.concatenate((least, most)), 0.15, 0.35))
    axes.set_xlabel(f"time [{unit}]")
    axes.set_ylabel(f"record [{found.unit}]")
    _legend(axes)


def draw_spectrum(axes: Axes, found: Identification) -> None:
    """Draw the averaged periodogram of what was modelled, and the spectra of the models."""
    axes.set_title("spectrum")
    rate = found.rate
    measured = Spectrum.of(found.prepared.data, rate)
    centres, density = _one_sided(measured, rate)
    axes.plot(centres, density, color=SKY, lw=0.7, label="record")
    frequencies = np.geomspace(centres[0], rate / 2.0, _FREQUENCIES)
    for model, colour, style in ((found.ar, GREEN, "-"), (found.model, VERMILION, "--")):
        shown = model.spectrum(frequencies, rate)
        axes.plot(frequencies, shown, color=colour, lw=0.9, ls=style, label=model_name(model.order))
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel(f"density [({found.unit})²/Hz]")
    drawn = np.concatenate([np.asarray(line.get_ydata(), dtype=np.float64) for line in axes.lines])
    low, high = np.log(drawn.min()), np.log(drawn.max())
    # The lower third is for the legend.
    axes.set_ylim(np.exp(high - 1.5 * max(high - low, 2.0)), np.exp(high + 0.1 * (high - low)))
    _legend(axes, "lower left", 1)


def draw_online(axes: Axes, found: Identification) -> None:
    """Draw the coefficients as they are learned, beside the offline ones and their errors."""
    axes.set_title("coefficients learned online")
    axes.set_xlabel("time [s]")
    axes.set_xscale("log")
    online, rate = found.online, found.rate
    axes.set_xlim(100.0 / rate, found.prepared.data.size / rate)
    if online is None:
        axes.tick_params(left=False, labelleft=False)
        _say(axes, f"{model_name(found.model.order)} is not learned online")
        return
    p = found.model.order[0]
    times = online.samples / rate
    known = np.concatenate((found.model.phi, found.model.theta))
    for i, (value, error) in enumerate(zip(known, found.model.standard_errors, strict=False)):
        colour = AR_COLOURS[i] if i < p else MA_COLOURS[i - p]
        label = f"φ{_SUBSCRIPTS[i]}" if i < p else f"θ{_SUBSCRIPTS[i - p]}"
        axes.axhspan(value - error, value + error, color=colour, alpha=0.25, lw=0.0)
        axes.axhline(value, color=colour, lw=0.5, ls=":")
        axes.plot(times, online.coefficients[:, i], color=colour, lw=0.9, label=label)
    axes.set_ylim(*_room(online, known))
    _legend(axes, "upper right", 6)


def style_times(axes: Axes) -> None:
    """Write the decades of time as plain numbers."""
    from matplotlib.ticker import FuncFormatter

    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _one_sided(measured: Spectrum, rate: float) -> tuple[Floats, Floats]:
    """Return the middles of the bands, Hz, and the one-sided density there."""
    bands = measured.bands
    lines = np.asarray(bands.lines)
    first, last = lines[bands.edges[:-1]], lines[bands.edges[1:] - 1]
    middles = np.sqrt(first * last) * rate / (bands.n + 1)
    return middles, 2.0 * measured.density * measured.scale**2 / rate


def _room(online: Online, known: Floats) -> tuple[float, float]:
    """Return limits that hold the end of the way, and as much of its beginning as reads well."""
    late = online.coefficients[online.coefficients.shape[0] // 3 :, : known.size]
    low, high = limits(late, 0.1, 0.3)
    span = known.max() - known.min()
    return min(low, known.min() - 0.1 * span), max(high, known.max() + 0.3 * span)


def _legend(
    axes: Axes, place: Literal["upper right", "lower left"] = "upper right", columns: int = 3
) -> None:
    axes.legend(
        loc=place,
        ncols=columns,
        fontsize=FONT - 0.5,
        frameon=False,
        handlelength=1.3,
        columnspacing=0.8,
        handletextpad=0.4,
        borderaxespad=0.2,
    )


def _say(axes: Axes, text: str) -> None:
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", size=FONT, color="0.4")
