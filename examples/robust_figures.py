"""Figures of the guide to robust filtering: effect of outliers, and their rejection in a tick.

python examples/robust_figures.py [FOLDER] [--seconds S] [--figures FOLDER]
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

import zerorate as zr
from recordings import Recording, check_folder, parser, sensors_alone
from zerorate.metrics import coasting_error, running_mean
from zerorate.options import METHODS
from zerorate.show.style import (
    BLACK,
    BLUE,
    FONT_PT,
    GREEN,
    GREY,
    GREY_TEXT,
    ORANGE,
    SKY,
    VERMILION,
    new_figure,
    save_figure,
    style_decades,
    style_panels,
    write_caption,
)
from zerorate.tasks.compare.methods import filter_arguments
from zerorate.tasks.compare.rest import scoring_start

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = npt.NDArray[np.float64]

FIGURES: Final = Path(__file__).resolve().parents[1] / "docs" / "figures"
RATE: Final = 100.0
SECONDS: Final = 2000.0
HORIZON: Final = 60.0
SEEDS: Final = (1, 2)
SHARES: Final = np.array([*np.geomspace(1e-4, 0.1, 10), 0.13, 0.16, 0.2])
STYLES: Final = {
    "auto": (BLACK, "-", "o"),
    "robust": (BLUE, "-", "s"),
    "fading+reject": (SKY, "--", "^"),
    "fading": (VERMILION, "-", "D"),
    "mean": (ORANGE, "-", "v"),
}
CLEAN: Final = 100.0 * SHARES[0] / 2.5
"""Position of the clean record on the logarithmic axis, %."""

MARKS: Final = {
    "counts": {"color": BLUE, "marker": "o", "ms": 2.2, "mew": 0.0},
    "bound": {"color": ORANGE, "marker": "s", "ms": 2.8, "mew": 0.0},
    "far": {"color": VERMILION, "marker": "x", "ms": 3.4, "mew": 0.9},
    "exit": {"color": GREEN, "marker": "^", "ms": 3.0, "mew": 0.0},
}
"""Marks for the samples of a tick, by their treatment."""

NAMES: Final = {"mean": "running mean", "fading+reject": "fading, outliers rejected"}


def main() -> None:
    """Draw both figures."""
    options = parser(__doc__)
    options.add_argument("--figures", type=Path, default=FIGURES, help="where they are written")
    arguments = options.parse_args()
    check_folder(arguments.folder)
    recordings = sensors_alone(arguments.folder, min(arguments.seconds, SECONDS))
    for name, figure in (("contamination", contamination(recordings)), ("tick", burst())):
        path = arguments.figures / f"robust_{name}.png"
        save_figure(figure, path)
        print(f"wrote {path}")


def contamination(recordings: list[Recording]) -> "Figure":
    """Draw the effect of a share of outliers on each method, two-sided and one-sided."""
    height = 78.0
    figure = new_figure(180.0, height)
    left, right = (figure.add_axes((x, 0.225, 0.42, 0.69)) for x in (0.065, 0.565))
    for axes, faults, title in (
        (left, "size=20", "20 deviations, either way"),
        (right, "size=100,one-sided", "100 deviations, one way"),
    ):
        _costs(axes, recordings, faults)
        axes.set_title(f"outliers of {title}")
    left.set_ylabel("coasting error over that of auto, clean")
    for axes in (left, right):
        # The same scale, with room for the legend.
        axes.set_ylim(0.7, 4000.0)
    left.legend(loc="upper left", ncols=2, fontsize=FONT_PT - 0.5, frameon=False)
    style_panels([left, right])
    for axes in (left, right):
        style_decades(axes)
        axes.set_xticks((CLEAN, 0.01, 0.1, 1.0, 10.0), ("none", "0.01", "0.1", "1", "10"))
    write_caption(
        figure,
        "Three axes of an ADIS16405 (first 2000 s) and of an MPU-6050 at rest, two seeds each: the "
        "angle lost by holding the bias for 60 s, mean of the ratios.\n"
        "Fed with the contaminated record, judged by the clean one. None: on the clean record.",
    )
    return figure


def _costs(axes: "Axes", recordings: list[Recording], faults: str) -> None:
    columns = [np.ascontiguousarray(z) for one in recordings for z in one.z.T]
    least = [_error(z, _held("auto", z)) for z in columns]
    for method, (colour, line, mark) in STYLES.items():
        if filter_arguments(method)["method"] not in (*METHODS, "mean"):
            continue
        shares = (0.0, *SHARES)
        costs = [_cost(method, columns, least, share, faults) for share in shares]
        label = NAMES.get(method, method)
        look = {"color": colour, "marker": mark, "ms": 2.5, "mew": 0.0}
        shown = [100.0 * share for share in SHARES]
        axes.plot(shown, costs[1:], ls=line, lw=1.0, label=label, **look)
        axes.plot(CLEAN, costs[0], ls="", **look)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("share of the samples that are outliers [%]")
    axes.set_xlim(CLEAN / 1.4, 110.0 * SHARES[-1])
    axes.grid(color=GREY, lw=0.4)


def _cost(
    method: str, columns: list[Floats], least: list[float], share: float, faults: str
) -> float:
    ratios = [
        _error(z, _held(method, fed)) / best
        for z, best in zip(columns, least, strict=True)
        for fed in _fed(z, share, faults)
    ]
    return float(np.mean(ratios))


def _fed(z: Floats, share: float, faults: str) -> Iterator[Floats]:
    if share == 0.0:
        yield z
        return
    fault = zr.simulation.Contamination.parse(f"share={share:.15g},{faults}")
    for seed in SEEDS:
        yield fault.apply(z, RATE, seed)


def _held(method: str, z: Floats) -> Floats:
    if method == "mean":
        return running_mean(z)
    return zr.DriftFilter(RATE, output="estimate", **filter_arguments(method)).process(z)


def _error(z: Floats, held: Floats) -> float:
    start = round(scoring_start(z.size / RATE) * RATE)
    return float(coasting_error(z[start:], held[start:], RATE, HORIZON))


@dataclass
class Gate:
    """Three zones of `auto` for each sample: centre, scale, and result of a tick.

    Parameters
    ----------
    centre, scale : float
        Level and standard deviation of the samples to date.
    step : float
        Smallest step of the output.
    longest : int
        Longest run of far samples on one side that may be outliers.
    """

    centre: float
    scale: float
    step: float
    longest: int

    @property
    def near(self) -> float:
        """Bound to which samples farther away are limited."""
        return max(3.0 * self.scale, 1.01 * self.step)

    @property
    def far(self) -> float:
        """Bound beyond which samples do not count."""
        return max(4.0 * self.scale, 3.0 * self.step)

    def tick(self, z: Floats) -> "Tick":
        """Process the samples of a tick."""
        d = z - self.centre
        far = np.abs(d) > self.far
        near, bound, centre = self.near, self.far, self.centre
        exits = np.mean(np.abs(d) > near) > 0.3 or self._side(d, far) > self.longest
        if exits:
            level = self.centre = z.mean()
        else:
            level = centre + np.clip(d[~far], -near, near).mean()
            share = np.mean(np.abs(d) < self.scale)
            self.scale *= math.exp(0.05 * (0.682689 - share))
            self.centre += (level - centre) / 4.0
        return Tick(z, far, np.abs(d) > near, exits, float(level), centre, near, bound)

    def _side(self, d: Floats, far: npt.NDArray[np.bool_]) -> int:
        """Return the longest run of far samples on one side."""
        longest = run = 0
        for i in range(d.size):
            goes_on = far[i] and i > 0 and far[i - 1] and (d[i] > 0.0) == (d[i - 1] > 0.0)
            run = run + 1 if goes_on else int(far[i])
            longest = max(longest, run)
        return longest


@dataclass(frozen=True, eq=False)
class Tick:
    """Samples of a tick, their treatment, and the zones that were used."""

    z: Floats
    far: npt.NDArray[np.bool_]
    beyond: npt.NDArray[np.bool_]
    exits: bool
    level: float
    centre: float
    near: float
    bound: float


def burst() -> "Figure":
    """Draw outliers and then a burst, in ticks of a quarter second."""
    length, ticks, deviation = 25, 8, 0.1
    random = np.random.default_rng(8)
    z = deviation * random.standard_normal(length * ticks)
    z[[31, 40, 62]] = (0.85, -0.75, 0.95)
    z[[12, 34, 69]] = (0.36, -0.37, 0.35)
    z[109:129] += 0.8
    gate = Gate(0.0, deviation, 0.0, longest=3)
    found = [gate.tick(part) for part in np.split(z, ticks)]
    height = 78.0
    figure = new_figure(180.0, height)
    axes = figure.add_axes((0.065, 0.235, 0.915, 0.7))
    for i, tick in enumerate(found):
        _draw_tick(axes, tick, i * length / RATE, (i + 1) * length / RATE)
    handles = _legend()
    axes.set_xlim(0.0, z.size / RATE)
    axes.set_ylim(-0.95, 1.5)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("rate [deg/s]")
    axes.legend(handles=handles, loc="upper left", ncols=3, fontsize=FONT_PT - 0.5, frameon=False)
    style_panels([axes])
    write_caption(
        figure,
        "Eight ticks of a simulated gyro at rest, 0.1 deg/s of noise at 100 Hz. Lone outliers and "
        "clipped samples leave the levels where they were. More than three far\n"
        "samples in a row on one side, or more than three in ten of a tick beyond 3 $s$, are no "
        "outliers: the tick counts whole,\nthe centre goes with it, and returns. $s$: the "
        "deviation of the noise as learned.",
    )
    return figure


def _draw_tick(axes: "Axes", tick: Tick, begin: float, end: float) -> None:
    t = begin + np.arange(tick.z.size) / RATE
    for bound, shade in ((tick.bound, "0.93"), (tick.near, "0.86")):
        low, high = tick.centre - bound, tick.centre + bound
        axes.fill_between((begin, end), low, high, color=shade, lw=0)
    # A tick with an exit counts as a whole.
    clipped = tick.beyond & ~tick.far & ~np.bool_(tick.exits)
    for chosen, what in (
        (~tick.far & ~clipped, "counts"),
        (clipped, "bound"),
        (tick.far, "exit" if tick.exits else "far"),
    ):
        axes.plot(t[chosen], tick.z[chosen], ls="", **MARKS[what])
    for at, value in zip(t[clipped], tick.z[clipped], strict=True):
        counted = tick.centre + math.copysign(tick.near, value - tick.centre)
        axes.plot((at, at), (value, counted), color=ORANGE, lw=0.8)
    axes.plot((begin, end), (tick.centre, tick.centre), color=GREY_TEXT, lw=0.7, ls="--")
    axes.plot((begin, end), (tick.level, tick.level), color=BLACK, lw=1.3)
    axes.axvline(end, color="0.7", lw=0.4)
    if tick.exits:
        axes.text((begin + end) / 2, -0.85, "exit: all count", ha="center", size=FONT_PT - 0.5)


def _legend() -> list[object]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    def mark(what: str, label: str) -> Line2D:
        return Line2D([], [], ls="", label=label, **MARKS[what])

    return [
        mark("counts", "counts"),
        mark("bound", "counts as if at the bound"),
        mark("far", "far: left out"),
        mark("exit", "far, but counts: exit"),
        Patch(color="0.86", label="within 3 $s$ of the centre"),
        Patch(color="0.93", label="within 4 $s$"),
        Line2D([], [], color=GREY_TEXT, lw=0.7, ls="--", label="centre $c$"),
        Line2D([], [], color=BLACK, lw=1.3, label="level of the tick"),
    ]


if __name__ == "__main__":
    main()
