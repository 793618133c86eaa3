"""Figures of the guide to Allan deviations, from simulated signals.

python examples/allan_figures.py
"""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import zerorate as zr
from zerorate.show import plot_allan, plot_dynamic, save_figure
from zerorate.units import convert

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLDER = Path(__file__).parents[1] / "docs" / "figures"
RATE = 100.0
HOUR = 3600.0

ALL_TERMS = zr.NoiseModel(
    quantization=convert(1.5, "arcsec", "rad"),
    angle_random_walk=convert(0.3, "deg/sqrt(h)", "rad/s/sqrt(Hz)"),
    bias_instability=convert(4.0, "deg/h", "rad/s"),
    rate_random_walk=convert(20.0, "deg/h/sqrt(h)", "rad/s^2/sqrt(Hz)"),
    rate_ramp=convert(30.0, "deg/h^2", "rad/s^2"),
)
WALKING = replace(ALL_TERMS, quantization=0.0, rate_ramp=0.0)


def terms() -> None:
    """Draw the five terms, with the averaging time at which each is read."""
    signal, _ = zr.simulate(ALL_TERMS, RATE, 10 * HOUR, seed=1)
    result = zr.allan(signal, RATE, unit="rad/s", names="a simulated gyro, and the true model")
    save(plot_allan(result, ALL_TERMS), "allan_terms")


def identifiable() -> None:
    """Draw ten minutes and three hours of one gyro; only the long record shows the random walk."""
    signal, _ = zr.simulate(WALKING, RATE, 3 * HOUR, seed=4)
    short = signal[: int(600 * RATE)]
    results = [
        zr.allan(z, RATE, unit="rad/s", names=name)
        for z, name in ((short, "the first 10 min"), (signal, "all 3 h"))
    ]
    models = [result.fit() for result in results]
    save(plot_allan(results, models, "one simulated gyro"), "allan_identifiable")


def warm_up() -> None:
    """Draw a gyro with a settling bias and decreasing noise in the first half hour."""
    signal, _ = zr.simulate(zr.simulation.device("MPU-6050"), RATE, 2 * HOUR, seed=1)
    t = np.arange(signal.size) / RATE
    settling = convert(1.0, "deg/s", "rad/s") * np.exp(-t / 600.0)
    noisy = signal * (1.0 + np.exp(-t / 900.0)) + settling
    figure = plot_dynamic(zr.noise.dynamic_allan(noisy, RATE, window=600.0, unit="rad/s"))
    about = figure.axes[0]
    about.axvline(30.0, color="white", lw=0.8, ls="--")
    about.annotate(
        "warm-up", (30.0, 1.0), (-4.0, -8.0), xycoords=("data", "axes fraction"),
        textcoords="offset points", ha="right", va="top", size=6.5,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5},
    )  # fmt: skip
    save(figure, "allan_dynamic")


def save(figure: "Figure", name: str) -> None:
    """Write a figure to the folder of the documentation."""
    save_figure(figure, FOLDER / f"{name}.png")
    print(f"wrote docs/figures/{name}.png")


if __name__ == "__main__":
    for draw in (terms, identifiable, warm_up):
        draw()
