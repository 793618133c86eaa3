"""A neural network and an autoregression as state equations of gyro noise: tables and a figure.

python examples/network_study.py [FOLDER]

The first table has the result of `zr.identification.fit_network` for each recorded axis. The second
table compares filters with both models. The states are the last five values. The transition matrix
is the companion matrix of the coefficients. For the network it has the gradient at the states (an
extended Kalman filter). The process noise is 1e-4 of the measurement noise. The held estimate is
used as the bias of the next 60 s.
"""

import argparse
from functools import partial
from pathlib import Path

import numpy as np

import zerorate as zr
from recordings import BESIDE, Floats, Recording, check_folder, sensors_alone
from tables import table
from zerorate import identification
from zerorate.show import save_figure
from zerorate.show.style import BLUE, FONT_PT, GREY_TEXT, VERMILION, new_figure, style_panels

FIGURES = Path(__file__).parents[1] / "docs" / "figures"
RATE, HORIZON = 100.0, 60.0
RATIO = 1e-4
FILTERED = 200_000
"""Number of samples for the filters, which are loops in Python."""

Row = tuple[str, ...]
GAIN_HEAD = ("recording", "axis", "units", "gain over AR, %", "left alone", "judgement")
COAST_HEAD = ("recording", "axis", "AR, deg", "network, deg", "auto, deg", "best EMA, deg")


class Linear:
    """The autoregression as a map from past values to the next value."""

    def __init__(self, model: identification.ArmaModel) -> None:
        self.phi, self.mean = model.phi, model.mean

    def step(self, past: Floats) -> float:
        """Return the next value."""
        return float(self.mean + self.phi @ (past - self.mean))

    def gradient(self, _past: Floats) -> Floats:
        """Return the gradient of the next value by the past values."""
        return self.phi


def filtered(map_: Linear | identification.NetworkModel, z: Floats, ratio: float = RATIO) -> Floats:
    """Return the estimates of an extended Kalman filter with unit measurement noise."""
    p = 5
    x, P, F = np.full(p, z[0]), np.eye(p), np.eye(p, k=-1)
    found = np.empty(z.size)
    for k, sample in enumerate(z.tolist()):
        F[0] = map_.gradient(x)
        x = np.concatenate([np.atleast_1d(map_.step(x)), x[:-1]])
        P = F @ P @ F.T
        P[0, 0] += ratio
        gain = P[:, 0] / (P[0, 0] + 1.0)
        x = x + gain * (sample - x[0])
        P = P - np.outer(gain, P[0])
        P = 0.5 * (P + P.T)
        found[k] = x[0]
    return found


def gain_rows(recordings: list[Recording]) -> list[Row]:
    """Return the gain of the network on each axis, with two units and with eight units."""
    rows = []
    for recording in recordings:
        for axis, z in zip(recording.axes, recording.z.T, strict=True):
            for hidden in (2, 8):
                fit = partial(identification.fit_network, z, hidden=hidden)
                starts = [fit(seed=seed) for seed in range(2)]
                found = max(starts, key=lambda model: model.gain_over_ar)
                cells = (f"{100.0 * found.gain_over_ar:+.2f}", f"{found.limit_cycle:.2f}")
                rows.append((recording.name, axis, str(hidden), *cells, found.verdict))
    return rows


def coast_rows(recording: Recording) -> list[Row]:
    """Return the error after coasting for a minute, on each axis."""
    rows = []
    for axis, z in zip(recording.axes, recording.z[:FILTERED].T, strict=True):
        network = identification.fit_network(recording.z[:, recording.axes.index(axis)])
        record = np.ascontiguousarray(z)
        estimates = [filtered(map_, record) for map_ in (Linear(network.ar), network)]
        estimates.append(zr.DriftFilter(RATE, output="estimate").process(record))
        errors = [zr.metrics.coasting_error(record, x, RATE, HORIZON) for x in estimates]
        best = zr.metrics.best_ema(record, RATE, HORIZON).error
        rows.append((recording.name, axis, *(f"{error:.2f}" for error in (*errors, best))))
    return rows


def draw(recording: Recording) -> None:
    """Draw the map without input, and the filter's estimate, for the axis where it oscillates."""
    z = np.ascontiguousarray(recording.z[:, 2])
    network = identification.fit_network(z)
    figure = new_figure(180.0, 70.0)
    alone, held = (
        figure.add_axes((0.08, 0.15, 0.36, 0.75)),
        figure.add_axes((0.55, 0.15, 0.43, 0.75)),
    )
    for map_, colour, name in (
        (network, VERMILION, "network"),
        (Linear(network.ar), BLUE, "autoregression"),
    ):
        past, path = z[4::-1].copy(), []
        for _ in range(120):
            past = np.concatenate([np.atleast_1d(map_.step(past)), past[:-1]])
            path.append(past[0])
        alone.plot(np.arange(120) / RATE, path, color=colour, lw=1.0, label=name)
        part = filtered(map_, z[:60_000])
        held.plot(np.arange(part.size)[::20] / RATE, part[::20], color=colour, lw=0.7, label=name)
    mean = zr.metrics.best_ema(z[:60_000], RATE, HORIZON).estimate
    held.plot(np.arange(60_000)[::20] / RATE, mean[::20], color=GREY_TEXT, lw=1.2, label="best EMA")
    held.set_ylim(-0.45, 0.05)
    alone.set_xlabel("time [s]")
    alone.set_ylabel("ADIS16405, z [deg/s]")
    alone.set_title("both maps left alone")
    held.set_xlabel("time [s]")
    held.set_ylabel("bias that is held [deg/s]")
    held.set_title("filters built on them")
    style_panels([alone, held])
    for axes in (alone, held):
        axes.legend(fontsize=FONT_PT, frameon=False, loc="upper right")
    save_figure(figure, FIGURES / "network_oscillates.png")


def main() -> None:
    """Print the tables, and draw the figure if requested."""
    options = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    options.add_argument("folder", nargs="?", type=Path, default=BESIDE, help="of the recordings")
    options.add_argument("--figure", action="store_true", help="draw it into docs/figures")
    options.add_argument("--markdown", action="store_true", help="tables for the page")
    chosen = options.parse_args()
    check_folder(chosen.folder)
    recordings = sensors_alone(chosen.folder)
    title = "A network of 5 inputs beside AR(5), better of two starts"
    print(table(title, GAIN_HEAD, gain_rows(recordings), chosen.markdown))
    title = f"Coasting {HORIZON:g} s, first {FILTERED / RATE:g} s, Q = 1e-4 R"
    print(table(title, COAST_HEAD, coast_rows(recordings[0]), chosen.markdown))
    if chosen.figure:
        draw(recordings[0])


if __name__ == "__main__":
    main()
