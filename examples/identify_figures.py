"""Figures of the guide to offline identification, from simulated signals.

python examples/identify_figures.py
"""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import zerorate as zr
from zerorate import identification
from zerorate.show import plot_identification, save_figure
from zerorate.show.style import (
    BLACK,
    BLUE,
    FONT_PT,
    GREEN,
    GREY_TEXT,
    ORANGE,
    VERMILION,
    new_figure,
    style_panels,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FOLDER = Path(__file__).parents[1] / "docs" / "figures"
RATE = 100.0
N = 60_000
MODEL = identification.ArmaModel.of([1.2, -0.4], [-0.5], sigma2=0.01)
DRIFT = identification.ArmaModel.of([0.999], [-0.97], sigma2=0.01)
WIDTHS = np.arange(1, 16)
LOOKS = ((BLUE, "-"), (GREEN, "--"), (ORANGE, "-."))


def simulated(model: identification.ArmaModel, n: int, seed: int) -> np.ndarray:
    """Return a record of a model, from its response to white noise."""
    response = model.psi_weights(20_000)
    a = np.sqrt(model.sigma2) * np.random.default_rng(seed).standard_normal(n + response.size)
    size = 1 << (a.size + response.size).bit_length()
    product = np.fft.rfft(a, size) * np.fft.rfft(response, size)
    return np.asarray(np.fft.irfft(product, size)[response.size : response.size + n])


def page() -> None:
    """Draw the command's figure of one axis."""
    found = identification.identify(simulated(MODEL, N, 1), RATE, name="gyro_x", unit="deg/s")
    save(plot_identification(found, everything=True), "identify_axis")


def smoothing() -> None:
    """Draw the AR(1) coefficient of white noise after a moving average."""
    z = np.random.default_rng(1).standard_normal(15_000)
    models = [identification.fit_ar(identification.moving_average(z, int(w)), 1) for w in WIDTHS]
    figure = new_figure(88.0, 58.0)
    axes = figure.add_axes((0.14, 0.17, 0.83, 0.72))
    axes.plot(WIDTHS, (WIDTHS - 1) / WIDTHS, "-", color=BLACK, lw=0.7, label="(w − 1)/w")
    phi = [model.phi[0] for model in models]
    errors = [3.0 * model.standard_errors[0] for model in models]
    axes.errorbar(
        WIDTHS,
        phi,
        errors,
        fmt="o",
        ms=2.5,
        lw=0.8,
        color=BLUE,
        label="fit_ar, ± 3 s.e. in the mark",
    )
    axes.axhline(0.8023, color=VERMILION, lw=0.7, ls="--", label="published, 0.8023")
    axes.set_xlabel("width w of the moving average [samples]")
    axes.set_ylabel("φ₁ of AR(1)")
    axes.set_title("white noise, smoothed")
    axes.legend(fontsize=FONT_PT, frameon=False, loc="lower right")
    style_panels([axes])
    axes.set_xticks((1, 5, 10, 15))
    axes.set_yticks((0.0, 0.2, 0.4, 0.6, 0.8, 1.0))
    save(figure, "identify_smoothing")


def online() -> None:
    """Draw online coefficients next to offline coefficients, for an easy and a difficult model."""
    figure = new_figure(180.0, 62.0)
    panels = [figure.add_axes((left, 0.17, 0.41, 0.71)) for left in (0.07, 0.57)]
    draw_online(panels[0], MODEL, False)
    panels[0].set_title("well determined: φ 1.2, −0.4, θ −0.5")
    panels[0].set_ylabel("coefficient")
    draw_online(panels[1], DRIFT, True)
    panels[1].set_title("faint drift: φ 0.999, θ −0.97")
    panels[1].set_ylabel("distance from the unit circle")
    panels[1].set_yscale("log")
    style_panels(panels)
    save(figure, "identify_online")


def draw_online(axes: "Axes", model: identification.ArmaModel, from_circle: bool) -> None:
    """Draw a model's coefficients over time, with the error band of the offline fit."""
    z = simulated(model, 10 * N, 3)
    p, q = model.order
    offline = identification.fit_arma(z, p, q)
    recursion = zr.identification.RecursiveLeastSquares(order=(p, q))
    ends = np.unique(np.geomspace(200, z.size, 300).astype(int))
    path, start = [], 0
    for end in ends:
        recursion.process(z[start:end])
        path.append(recursion.coefficients[:-1])
        start = end
    values, paths = np.concatenate((offline.phi, offline.theta)), np.array(path)
    names = [f"φ{'₁₂'[i]}" for i in range(p)] + [f"θ{'₁₂'[i]}" for i in range(q)]
    if from_circle:
        values, paths = 1.0 - np.abs(values), 1.0 - np.abs(paths)
        names = ["1 − φ₁", "1 + θ₁"]
    for i, (colour, style) in zip(range(p + q), LOOKS, strict=False):
        error = offline.standard_errors[i]
        axes.axhspan(values[i] - error, values[i] + error, color=colour, alpha=0.3, lw=0)
        axes.plot(ends / RATE, paths[:, i], color=colour, lw=0.9, ls=style, label=names[i])
    # Draw it below the lines, so that it does not cut them.
    axes.axvline(120.0, color=GREY_TEXT, lw=0.6, ls=(0, (4, 3)), zorder=0)
    axes.text(
        128.0,
        0.02,
        "120 s",
        transform=axes.get_xaxis_transform(),
        size=FONT_PT - 0.5,
        color=GREY_TEXT,
    )
    axes.set_xscale("log")
    axes.set_xlim(ends[0] / RATE, ends[-1] / RATE)
    axes.set_xlabel("time [s]")
    axes.legend(fontsize=FONT_PT, frameon=False, loc="best")


def save(figure: object, name: str) -> None:
    """Write a figure to the folder of the documentation."""
    save_figure(figure, FOLDER / f"{name}.png")
    print(f"wrote docs/figures/{name}.png")


if __name__ == "__main__":
    for draw in (page, smoothing, online):
        draw()
