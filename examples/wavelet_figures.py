"""Tables and figures of the guide to wavelets, from simulated signals.

python examples/wavelet_figures.py
"""

import math
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

import zerorate as zr
from tables import table
from zerorate.show import save_figure
from zerorate.show.style import (
    BLACK,
    BLUE,
    FONT_PT,
    GREEN,
    GREY_TEXT,
    ORANGE,
    VERMILION,
    new_figure,
    style_decades,
    style_panels,
)
from zerorate.simulation.motions import MOTIONS
from zerorate.units import convert

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = npt.NDArray[np.float64]

FOLDER = Path(__file__).parents[1] / "docs" / "figures"
RATE = 200.0
NOISE = 0.1
DURATION = 600.0
SETTLED = round(20.0 * RATE)
"""Number of samples from which a stream learns its noise."""
SEEDS = range(1, 5)

RECORDS: dict[str, dict[str, Any]] = {
    "VisuShrink, level 5, soft": {"level": 5},
    "VisuShrink, level 5, hard": {"level": 5, "mode": "hard"},
    "VisuShrink, level 8, soft": {"level": 8},
    "Wu & Ran's wavelet, ρ = 0.01": {"level": "psr", "rho": 0.01, "approximation": True},
    "Wu & Ran's wavelet, ρ = 0.2": {"level": "psr", "rho": 0.2, "approximation": True},
    "`psr-normalised`, soft": {"level": "psr-normalised"},
    "`auto`, soft": {},
    "`auto`, hard": {"mode": "hard"},
}
BANKS = list(product(("haar", "db2", "db4"), (2, 3, 4, 5)))
SHOWN = [("haar", 3), ("db2", 3), ("db4", 3), ("db4", 5)]
CUTS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Cut-off frequencies of the low-pass filter, Hz; the best result counts."""


def main() -> None:
    """Print the tables and draw the figures."""
    of_records()
    at_rest()
    levels()
    streams()


def of_records() -> None:
    """Print the errors of whole records in motion, relative to the raw record."""
    rows = []
    for name, how in RECORDS.items():
        still = [_error(_denoised(_noise(seed), how), 0.0) for seed in SEEDS]
        found = [np.mean(still)]
        for motion in MOTIONS.values():
            truths = [motion(RATE, DURATION, seed) for seed in SEEDS]
            noisy = (truth + _noise(seed) for truth, seed in zip(truths, SEEDS, strict=True))
            errors = [_error(_denoised(z, how), x) for z, x in zip(noisy, truths, strict=True)]
            found.append(np.mean(errors))
        rows.append((name, *(f"{x:.3f}" for x in found)))
    head = ("filter", "at rest", *MOTIONS)
    print(table("error over that of the raw record", head, rows, markdown=True))


def _noise(seed: int) -> Floats:
    rng = np.random.default_rng(1000 + seed)
    return NOISE * rng.standard_normal(round(DURATION * RATE))


def _denoised(z: Floats, how: dict[str, Any]) -> Floats:
    return zr.denoise(z, **how).signal


def _error(x: Floats, truth: Floats | float) -> float:
    return math.sqrt(float(np.mean((x - truth) ** 2))) / NOISE


def at_rest() -> None:
    """Print Allan deviations of an hour at rest, and the error relative to the true drift."""
    model = zr.NoiseModel(
        angle_random_walk=convert(0.432237, "deg/sqrt(h)", "rad/s/sqrt(Hz)"),
        bias_instability=convert(3.936395, "deg/h", "rad/s"),
    )
    z, drift = (np.degrees(x) for x in zr.simulate(model, RATE, 3600.0, 1))
    compared = {"raw": z}
    for name in ("VisuShrink, level 5, soft", "`auto`, soft", "Wu & Ran's wavelet, ρ = 0.01"):
        compared[name] = _denoised(z, RECORDS[name])
    compared["the mean of the record"] = np.full_like(z, z.mean())
    compared["`DriftFilter`, bias"] = _bias(z)
    rows = []
    for name, x in compared.items():
        deviation = zr.allan(x, RATE, taus=[0.01, 0.1, 1.0, 10.0, 100.0]).deviation
        late = slice(round(60.0 * RATE), None)
        error = math.sqrt(float(np.mean((x - drift)[late] ** 2)))
        rows.append((name, *(f"{d:.2g}" for d in deviation), f"{error:.2g}"))
    head = ("filter", "0.01 s", "0.1 s", "1 s", "10 s", "100 s", "error to the drift")
    print(table("Allan deviation of an hour at rest, deg/s", head, rows, markdown=True))


def _bias(z: Floats) -> Floats:
    return zr.DriftFilter(RATE, method="auto", output="estimate").process(z)


def levels() -> None:
    """Draw the chosen level over the length of the record, for white noise and motion."""
    lengths = np.unique(np.round(np.geomspace(300, 120_000, 25)).astype(int))
    rules = {
        "psr": (VERMILION, "ρ = 0.05", "s"),
        "psr-normalised": (ORANGE, "cut 1.5", "^"),
        "auto": (BLUE, "", "o"),
    }
    figure = new_figure(180.0, 70.0)
    titles = {"": "white noise", "vehicle": "a car in a town", "hand": "a hand that shakes"}
    panels = []
    for i, (motion, title) in enumerate(titles.items()):
        axes = figure.add_axes((0.06 + 0.32 * i, 0.16, 0.28, 0.74))
        for name, (colour, cut, mark) in rules.items():
            found = [_mean_level(motion, n, name) for n in lengths]
            label = f"{name}, {cut}" if cut else name
            # Use open marks, so that lines on top of each other stay visible.
            look = {"marker": mark, "ms": 3.2, "mfc": "none", "mew": 0.6, "markevery": 2}
            axes.semilogx(lengths, found, color=colour, lw=0.9, label=label, **look)
        deepest = [math.floor(math.log2(n / 7)) for n in lengths]
        axes.semilogx(lengths, deepest, color=BLACK, lw=0.6, ls=":", label="deepest possible")
        axes.set(title=title, xlabel="samples in the record", ylim=(0.0, 14.5))
        panels.append(axes)
    panels[0].set_ylabel("last level thresholded")
    panels[0].legend(fontsize=FONT_PT - 0.5, frameon=False, loc="upper left")
    panels[2].text(1.2e5, 1.4, "auto, psr-normalised: 1", ha="right", size=FONT_PT - 0.5)
    style_panels(panels)
    save_figure(figure, FOLDER / "wavelet_levels.png")


def _mean_level(motion: str, n: int, rule: Any) -> float:
    found = []
    for seed in range(1, 9):
        z = NOISE * np.random.default_rng(seed).standard_normal(n)
        if motion:
            z += MOTIONS[motion](RATE, n / RATE, seed)
        found.append(zr.denoise(z, level=rule).level)
    return float(np.mean(found))


def streams() -> None:
    """Print and draw live results, next to the best low-pass filter with the same delay."""
    truths = {name: motion(RATE, 300.0, 1) for name, motion in MOTIONS.items()}
    white = NOISE * np.random.default_rng(7).standard_normal(round(300.0 * RATE))
    noisy = {name: truth + white for name, truth in truths.items()}
    delays = {bank: zr.WaveletDenoiser(RATE, *bank).delay for bank in BANKS}
    wavelets = {
        (bank, mode, name): _live(bank, mode, noisy[name], truths[name])
        for bank, mode, name in product(BANKS, ("hard", "soft"), MOTIONS)
    }
    lowpass = {
        (delay, name): min(_filtered(delay, cut, noisy[name], truths[name]) for cut in CUTS)
        for delay, name in product(sorted(set(delays.values())), MOTIONS)
    }
    rows = []
    for bank in SHOWN:
        delay = delays[bank]
        for mode in ("hard", "soft"):
            found = [wavelets[bank, mode, name] for name in MOTIONS]
            now = ", ".join(f"{live:.3g}" for live, _ in found)
            late = ", ".join(f"{removed:.2f}" for _, removed in found)
            best = ", ".join(f"{lowpass[delay, name]:.2f}" for name in MOTIONS)
            rows.append(
                (f"{bank[0]} {bank[1]}, {mode}", f"{1e3 * delay / RATE:g}", now, late, best)
            )
    names = ", ".join(MOTIONS)
    head = ("filter", "delay, ms", f"now: {names}", "delay removed", "best low-pass")
    print(table("live, error over that of the raw samples", head, rows, markdown=True))
    shorter = {(delay, name): _best_within(delay, name, lowpass) for delay, name in lowpass}
    for (kind, errors), mode in product(
        {"as long as the delay allows": lowpass, "as long or shorter": shorter}.items(),
        ("hard", "soft"),
    ):
        won = [
            errors[delays[bank], name] < wavelets[bank, mode, name][1]
            for bank, name in product(BANKS, MOTIONS)
        ]
        print(f"a low-pass {kind} is better in {sum(won)} of {len(won)} cases, {mode}")
    _draw_streams(delays, wavelets, shorter)


def _live(bank: tuple[str, int], mode: Any, z: Floats, truth: Floats) -> tuple[float, float]:
    """Return the error relative to the current truth, and relative to the delayed truth."""
    denoiser = zr.WaveletDenoiser(RATE, *bank, mode=mode)
    x, delay = denoiser.process(z), denoiser.delay
    now = _error(x[SETTLED:], truth[SETTLED:])
    return now, _error(x[SETTLED:], truth[SETTLED - delay : -delay])


def _filtered(delay: int, cut: float, z: Floats, truth: Floats) -> float:
    """Return the error of a low-pass filter (windowed sinc) after its delay is removed."""
    k = np.arange(-delay, delay + 1)
    taps = np.sinc(2.0 * cut / RATE * k) * np.hamming(k.size)
    x = np.convolve(z, taps / taps.sum(), "valid")
    return _error(x[SETTLED:], truth[delay:-delay][SETTLED:])


def _best_within(delay: int, name: str, lowpass: dict[tuple[int, str], float]) -> float:
    """Return the smallest error of all low-pass filters with at most this delay."""
    return min(e for (own, motion), e in lowpass.items() if own <= delay and motion == name)


def _draw_streams(
    delays: dict[tuple[str, int], int],
    wavelets: dict[tuple[tuple[str, int], str, str], tuple[float, float]],
    lowpass: dict[tuple[int, str], float],
) -> None:
    figure = new_figure(180.0, 72.0)
    looks = {"haar": (VERMILION, "s"), "db2": (GREEN, "^"), "db4": (BLUE, "o")}
    titles = {"table": "rate table", "vehicle": "a car in a town", "hand": "a hand that shakes"}
    panels = []
    for i, name in enumerate(MOTIONS):
        axes = figure.add_axes((0.065 + 0.32 * i, 0.16, 0.275, 0.74))
        for wavelet, (colour, mark) in looks.items():
            banks = [bank for bank in BANKS if bank[0] == wavelet]
            late = [1e3 * delays[bank] / RATE for bank in banks]
            removed = [wavelets[bank, "hard", name][1] for bank in banks]
            look = {"color": colour, "marker": mark, "lw": 0.8, "ms": 2.8}
            axes.loglog(late, removed, label=wavelet, **look)
        _draw_lowpass(axes, name, lowpass)
        axes.axhline(1.0, color=GREY_TEXT, lw=0.6, ls="--", label="raw")
        axes.set(title=titles[name], xlabel="delay [ms]")
        panels.append(axes)
    panels[0].set_ylabel("error over that of raw, delay removed")
    panels[2].legend(fontsize=FONT_PT - 0.5, frameon=False, loc=(0.3, 0.52))
    style_panels(panels)
    for axes in panels:
        style_decades(axes, min_decades=2)
    save_figure(figure, FOLDER / "wavelet_streams.png")


def _draw_lowpass(axes: "Axes", name: str, lowpass: dict[tuple[int, str], float]) -> None:
    known = sorted(delay for delay, motion in lowpass if motion == name)
    late = [1e3 * delay / RATE for delay in known]
    errors = [lowpass[delay, name] for delay in known]
    axes.loglog(late, errors, color=BLACK, lw=1.2, label="best low-pass")


if __name__ == "__main__":
    main()
