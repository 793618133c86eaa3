"""Panels of an identification figure."""

from __future__ import annotations

from statistics import NormalDist
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.identification.conclusions import model_name
from zerorate.identification.order import scores_above_minimum
from zerorate.noise.spectrum import Spectrum
from zerorate.numerals import format_significant
from zerorate.show.scales import bucket_extremes, robust_limits
from zerorate.show.style import (
    AR_COLOURS,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    MA_COLOURS,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    time_unit,
    write_in_middle,
    write_legend,
)
from zerorate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from zerorate.identification.correlogram import Correlogram
    from zerorate.identification.identification import Identification, OnlineFit
    from zerorate.identification.order import OrderSelection

_SUBSCRIPTS: Final = "₁₂₃"
_FREQUENCY_COUNT: Final = 300

_QUANTILE_COUNT: Final = 199

_MAX_RESIDUALS: Final = 100_000
"""Largest number of residuals for quantiles; more would change no point visibly."""

_COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY)
_MARKS = ("o", "s", "^", "D", "v", "P")


def draw_series(axes: Axes, identification: Identification) -> None:
    """Draw the modelled record with all its peaks, the means of its segments, and its motion."""
    data, rate = identification.prepared.data, identification.rate
    duration = data.size / rate
    unit, seconds = time_unit(duration)
    t, least, most = bucket_extremes(data, rate)
    axes.fill_between(t / seconds, least, most, color=SKY, alpha=0.55, lw=0.3, label="record")
    means = identification.tests.segment_means
    edges = np.arange(means.size + 1) * identification.tests.segment / seconds
    axes.stairs(means, edges, baseline=None, color=BLACK, lw=0.7, label="means of segments")
    for i, span in enumerate(identification.moving):
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
    axes.set_ylim(*robust_limits(np.concatenate((least, most)), 0.15, 0.35))
    axes.set_xlabel(f"time [{unit}]")
    axes.set_ylabel(f"record [{identification.unit}]")
    write_legend(axes, "upper right", 3, 1.3)


def draw_spectrum(axes: Axes, identification: Identification) -> None:
    """Draw the averaged periodogram of the modelled record, and the spectra of the models."""
    axes.set_title("spectrum")
    rate = identification.rate
    try:
        measured = Spectrum.of(identification.prepared.data, rate)
    except ValueError:
        # This happens with a stuck sensor, for example. Other parts of the record may be fine.
        axes.tick_params(left=False, labelleft=False, bottom=False, labelbottom=False)
        write_in_middle(axes, "the longest stretch is constant or too short")
        return
    centres, density = _one_sided_density(measured, rate)
    axes.plot(centres, density, color=SKY, lw=0.7, label="record")
    frequencies = np.geomspace(centres[0], rate / 2.0, _FREQUENCY_COUNT)
    for model, colour, style in (
        (identification.ar, GREEN, "-"),
        (identification.model, VERMILION, "--"),
    ):
        shown = model.spectrum(frequencies, rate)
        axes.plot(frequencies, shown, color=colour, lw=0.9, ls=style, label=model_name(model.order))
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel(f"density [({identification.unit})²/Hz]")
    drawn = np.concatenate([np.asarray(line.get_ydata(), dtype=np.float64) for line in axes.lines])
    low, high = np.log(drawn.min()), np.log(drawn.max())
    # Leave the lower third for the legend.
    axes.set_ylim(np.exp(high - 1.5 * max(high - low, 2.0)), np.exp(high + 0.1 * (high - low)))
    write_legend(axes, "lower left", 1, 1.3)


def draw_online(axes: Axes, identification: Identification) -> None:
    """Draw the coefficients during online learning, and the offline values with errors."""
    axes.set_title("coefficients learned online")
    axes.set_xlabel("time [s]")
    axes.set_xscale("log")
    online, rate = identification.online, identification.rate
    axes.set_xlim(100.0 / rate, identification.prepared.data.size / rate)
    if online is None:
        axes.tick_params(left=False, labelleft=False)
        write_in_middle(axes, f"{model_name(identification.model.order)} is not learned online")
        return
    p = identification.model.order[0]
    times = online.samples / rate
    known = np.concatenate((identification.model.phi, identification.model.theta))
    for i, (value, error) in enumerate(
        zip(known, identification.model.standard_errors, strict=False)
    ):
        colour = AR_COLOURS[i] if i < p else MA_COLOURS[i - p]
        label = f"φ{_SUBSCRIPTS[i]}" if i < p else f"θ{_SUBSCRIPTS[i - p]}"
        axes.axhspan(value - error, value + error, color=colour, alpha=0.25, lw=0.0)
        axes.axhline(value, color=colour, lw=0.5, ls=":")
        style = "-" if i < p else "--"
        axes.plot(times, online.coefficients[:, i], color=colour, lw=0.9, ls=style, label=label)
    axes.set_ylim(*_online_limits(online, known))
    write_legend(axes, "upper right", 6, 1.3)


def style_times(axes: Axes) -> None:
    """Write powers of ten on a time axis as plain numbers."""
    from matplotlib.ticker import FuncFormatter

    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _one_sided_density(measured: Spectrum, rate: float) -> tuple[Floats, Floats]:
    """Return the centres of the frequency bands, Hz, and the one-sided density in them."""
    bands = measured.bands
    lines = np.asarray(bands.lines)
    first, last = lines[bands.edges[:-1]], lines[bands.edges[1:] - 1]
    middles = np.sqrt(first * last) * rate / (bands.n + 1)
    return middles, 2.0 * measured.density * measured.scale**2 / rate


def _online_limits(online: OnlineFit, known: Floats) -> tuple[float, float]:
    """Return limits that include the last values, and the start if it stays readable."""
    late = online.coefficients[online.coefficients.shape[0] // 3 :, : known.size]
    low, high = robust_limits(late, 0.1, 0.3)
    span = known.max() - known.min()
    return min(low, known.min() - 0.1 * span), max(high, known.max() + 0.3 * span)


def draw_acf(axes: Axes, identification: Identification) -> None:
    """Draw the autocorrelation of the modelled record."""
    axes.set_title("autocorrelation of the record")
    _draw_lags(axes, identification.correlogram, identification.correlogram.acf, BLUE)


def draw_pacf(axes: Axes, identification: Identification) -> None:
    """Draw the partial autocorrelation of the modelled record."""
    axes.set_title("partial autocorrelation")
    _draw_lags(axes, identification.correlogram, identification.correlogram.pacf, BLUE)


def draw_residual_acf(axes: Axes, identification: Identification) -> None:
    """Draw the autocorrelation of the residuals, and the p value of the Ljung-Box test."""
    white = identification.whiteness
    p = white.ljung_box.p_value
    shown = "< 1e-6" if p < 1e-6 else f"= {format_significant(p, 2)}"
    axes.set_title(f"residuals: Ljung-Box p {shown}")
    _draw_lags(axes, white.correlogram, white.correlogram.acf, VERMILION)


def draw_quantiles(axes: Axes, identification: Identification) -> None:
    """Draw quantiles of the residuals over quantiles of a Gaussian with the same variance."""
    axes.set_title("quantiles of the residuals")
    axes.set_xlabel("Gaussian [standard deviations]")
    axes.set_ylabel("residuals [standard deviations]")
    residuals = identification.residuals
    residuals = residuals[np.isfinite(residuals)]
    residuals = residuals[:: max(1, residuals.size // _MAX_RESIDUALS)] / np.sqrt(
        identification.model.sigma2
    )
    # Extend the quantiles to the extremes of the sample.
    parts = _even_probabilities(residuals.size)
    expected = np.array([NormalDist().inv_cdf(part) for part in parts])
    edge = 1.08 * expected[-1]
    axes.plot((-edge, edge), (-edge, edge), color=BLACK, lw=0.6, ls=(0, (4, 2)))
    axes.plot(
        expected,
        np.quantile(residuals, parts),
        color=VERMILION,
        ls="none",
        marker="o",
        ms=1.6,
        mew=0.0,
    )
    axes.set_xlim(-edge, edge)


def _even_probabilities(n: int) -> Floats:
    """Return probabilities with evenly spaced Gaussian quantiles, as far out as n values reach."""
    end = NormalDist().inv_cdf(1.0 - 0.5 / n)
    return np.array([NormalDist().cdf(x) for x in np.linspace(-end, end, _QUANTILE_COUNT)])


def _draw_lags(axes: Axes, correlogram: Correlogram, values: Floats, colour: str) -> None:
    lags, shown = correlogram.lags, np.nan_to_num(values)
    axes.axhspan(-correlogram.bound, correlogram.bound, color=GREY, lw=0.0)
    axes.axhline(0.0, color=BLACK, lw=0.4)
    axes.vlines(lags, 0.0, shown, color=colour, lw=0.8)
    axes.plot(lags, shown, color=colour, ls="none", marker="o", ms=1.8, mew=0.0)
    size = max(float(np.abs(shown).max()), 2.0 * correlogram.bound)
    axes.set_ylim(
        min(1.25 * shown.min(), -0.15 * size - correlogram.bound),
        max(1.25 * shown.max(), 0.15 * size + correlogram.bound),
    )
    axes.set_xlim(0.0, lags[-1] + 1)
    axes.set_xlabel("lag [samples]")


def draw_ar_orders(axes: Axes, identification: Identification) -> None:
    """Draw the criterion of each AR order minus the minimum."""
    axes.set_title("orders of AR models")
    _draw_orders(axes, identification.ar_orders)


def draw_arma_orders(axes: Axes, identification: Identification) -> None:
    """Draw the criterion of each ARMA order minus the minimum, with a line for each q."""
    axes.set_title("orders of ARMA models")
    _draw_orders(axes, identification.arma_orders)
    write_legend(axes, "upper right", 2)


def _draw_orders(axes: Axes, orders: OrderSelection) -> None:
    above = dict(zip(orders.orders, scores_above_minimum(orders, orders.criterion), strict=True))
    axes.axhspan(0.0, orders.margin, color=GREY, lw=0.0)
    for q in sorted({q for _, q in orders.orders}):
        colour = _COLOURS[q % len(_COLOURS)]
        line = [(p, score) for (p, own), score in above.items() if own == q]
        x, y = zip(*line, strict=True)
        mark = _MARKS[q % len(_MARKS)]
        axes.plot(x, y, color=colour, lw=0.7, marker=mark, ms=2.2, mew=0.0, label=f"q = {q}")
    for order, face in ((orders.minimum, "white"), (orders.clear, None)):
        colour = _COLOURS[order[1] % len(_COLOURS)]
        axes.plot(
            *(order[0], above[order]),
            color=colour,
            marker=_MARKS[order[1] % len(_MARKS)],
            ms=4.0,
            mew=0.8,
            mfc=face or colour,
            ls="none",
            label="_",
        )
    # Linear within the margin, logarithmic above it.
    axes.set_yscale("symlog", linthresh=orders.margin, linscale=1.5)
    decades = max(1.0, np.log10(max(above.values()) / orders.margin + 1.0))
    # Leave the upper quarter for a legend.
    axes.set_ylim(-0.1 * orders.margin, orders.margin * 10.0 ** ((1.5 + decades) / 0.75 - 1.5))
    axes.set_xlabel("p")
    axes.set_ylabel(f"{orders.criterion.upper()} above the least")


def style_orders(axes: Axes, margin: float) -> None:
    """Write zero, the margin, and the powers of ten above it."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    most = axes.get_ylim()[1]
    decades = 10.0 ** np.arange(np.ceil(np.log10(1.5 * margin)), np.log10(most))
    axes.yaxis.set_major_locator(FixedLocator([0.0, margin, *decades]))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: _format_score(value)))


def _format_score(score: float) -> str:
    return f"{score:g}" if score < 1000.0 else f"{score:.0e}".replace("e+0", "e")
