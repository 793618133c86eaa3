"""Panels of what successive samples share, and of the residuals."""

from __future__ import annotations

from statistics import NormalDist
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from zerorate.numerals import significant
from zerorate.show.plotting.style import BLACK, BLUE, GREY, VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from zerorate.identify.correlogram import Correlogram
    from zerorate.identify.identification import Identification

__all__ = ["draw_acf", "draw_pacf", "draw_quantiles", "draw_residual_acf"]

Floats = npt.NDArray[np.float64]

_QUANTILES: Final = 199
_MOST: Final = 100_000
"""Residuals of which quantiles are taken: more would move no point by a line's width."""


def draw_acf(axes: Axes, found: Identification) -> None:
    """Draw the autocorrelation of what was modelled."""
    axes.set_title("autocorrelation of the record")
    _draw_lags(axes, found.correlogram, found.correlogram.acf, BLUE)


def draw_pacf(axes: Axes, found: Identification) -> None:
    """Draw the partial autocorrelation of what was modelled."""
    axes.set_title("partial autocorrelation")
    _draw_lags(axes, found.correlogram, found.correlogram.pacf, BLUE)


def draw_residual_acf(axes: Axes, found: Identification) -> None:
    """Draw the autocorrelation of the residuals, and what Ljung and Box say of it."""
    white = found.whiteness
    p = white.ljung_box.p_value
    shown = "< 1e-6" if p < 1e-6 else f"= {significant(p, 2)}"
    axes.set_title(f"residuals: Ljung-Box p {shown}")
    _draw_lags(axes, white.correlogram, white.correlogram.acf, VERMILION)


def draw_quantiles(axes: Axes, found: Identification) -> None:
    """Draw quantiles of the residuals over those of a Gaussian of their size."""
    axes.set_title("quantiles of the residuals")
    axes.set_xlabel("Gaussian [deviations]")
    axes.set_ylabel("residuals [deviations]")
    residuals = found.residuals
    residuals = residuals[np.isfinite(residuals)]
    residuals = residuals[:: max(1, residuals.size // _MOST)] / np.sqrt(found.model.sigma2)
    # As far out as the sample reaches.
    parts = _parts(residuals.size)
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


def _parts(n: int) -> Floats:
    """Return probabilities whose Gaussian quantiles are evenly spaced, as far out as n reach."""
    end = NormalDist().inv_cdf(1.0 - 0.5 / n)
    return np.array([NormalDist().cdf(x) for x in np.linspace(-end, end, _QUANTILES)])


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
