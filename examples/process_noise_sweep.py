"""Effect of the initial process noise on each method, for recordings at rest."""

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from published_tables import METHODS, Method, best_average, published
from recordings import Floats, Recording, check_folder, parser, sensors_alone
from tables import table
from zerorate import metrics
from zerorate.show.style import BLACK, FONT_PT, GREY_TEXT, INCHES_PER_MM, SKY, VERMILION, WIDE_DPI

Scores = dict[Method, Floats]

START = np.logspace(-8.0, 0.0, 17)
DEFAULT = 0.1
HORIZON = 10.0
FIGURE = Path(__file__).resolve().parents[1] / "docs" / "figures" / "process_noise_sweep.png"
COLOURS = dict(zip(METHODS, (BLACK, SKY, VERMILION), strict=True))
LINES = dict(zip(METHODS, ("-", (0, (3, 1.5)), "-"), strict=True))
PRINTED = (1e-8, 1e-6, 1e-4, 1e-2, 1e-1, 1.0)


def scores(recording: Recording, method: Method, start: float, least: Floats) -> Floats:
    """Return deviation over raw, and coasting error over the best average's, shape (2, axes)."""
    z, rate = recording.z, recording.rate
    x = published(rate, method, z.shape[1], start).process(z)
    return np.array([metrics.reduction(z, x), metrics.coasting_error(z, x, rate, HORIZON) / least])


def sweep(recording: Recording) -> Scores:
    """Return the scores of each method, shape (2, axes, starts)."""
    least = best_average(recording.z, recording.rate)[2]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = {
            method: [pool.submit(scores, recording, method, start, least) for start in START]
            for method in METHODS
        }
        return {m: np.stack([job.result() for job in jobs[m]], axis=-1) for m in METHODS}


def middle(values: Floats) -> Floats:
    """Return the geometric mean over the axes."""
    return np.asarray(np.exp(np.log(values).mean(axis=0)))


def crossing(values: Scores) -> str:
    """Return the smallest start from which `fading` has the smallest deviation on every axis."""
    rivals = np.minimum(values["kf"][0], values["akf"][0])
    ahead = (values["fading"][0] < rivals).all(axis=0)
    last_behind = np.flatnonzero(~ahead)
    first = 0 if last_behind.size == 0 else int(last_behind[-1]) + 1
    return f"from {START[first]:.1g}" if first < len(START) else "never"


def draw(results: dict[str, Scores]) -> Figure:
    """Return the figure, with a column per recording, deviation above coasting error."""
    figure = Figure(figsize=(170 * INCHES_PER_MM, 118 * INCHES_PER_MM), dpi=WIDE_DPI)
    panels = figure.subplots(
        2,
        len(results),
        sharex=True,
        sharey="row",
        squeeze=False,
        gridspec_kw={
            "left": 0.072,
            "right": 0.985,
            "top": 0.885,
            "bottom": 0.085,
            "hspace": 0.09,
            "wspace": 0.05,
        },
    )
    for column, (name, values) in zip(panels.T, results.items(), strict=True):
        column[0].set_title(name, size=FONT_PT + 1.5, pad=4)
        for row, panel in enumerate(column):
            draw_panel(panel, {m: values[m][row] for m in METHODS})
        column[0].axhline(1.0, color=BLACK, lw=0.6, ls=":")
        column[1].axhline(1.0, color=BLACK, lw=0.6, ls=":")
        column[1].set_xlabel("initial process noise $G_0$ / start-up variance", size=FONT_PT + 0.5)
    panels[0, 0].set_ylabel("deviation / raw", size=FONT_PT + 0.5)
    panels[1, 0].set_ylabel("10 s coasting error / best average", size=FONT_PT + 0.5)
    panels[0, 0].set_ylim(0.018, 1.25)
    panels[1, 0].set_ylim(0.72, 30.0)
    figure.align_ylabels(panels[:, 0])
    annotate(panels)
    figure.legend(
        handles=legend_lines(),
        loc="upper center",
        ncols=5,
        frameon=False,
        fontsize=FONT_PT + 0.5,
        bbox_to_anchor=(0.53, 1.0),
        handlelength=2.4,
    )
    return figure


def draw_panel(panel: Any, values: Scores) -> None:
    """Draw each method with thin lines for axes and a thick line for their geometric mean."""
    panel.axvline(DEFAULT, color="0.6", lw=0.8, ls="--", zorder=0)
    for method, axes in values.items():
        style = {"color": COLOURS[method], "ls": LINES[method]}
        panel.plot(START, axes.T, lw=0.5, alpha=0.6, **style)
        panel.plot(START, middle(axes), lw=1.6, **style)
        at_default = middle(axes)[np.argmin(abs(START - DEFAULT))]
        panel.plot(DEFAULT, at_default, "o", ms=3.2, color=COLOURS[method], mec="w", mew=0.4)
    panel.set(xscale="log", yscale="log", xlim=(START[0] / 1.5, START[-1] * 1.5))
    panel.xaxis.set_major_locator(LogLocator(numticks=9))
    panel.xaxis.set_minor_locator(LogLocator(subs=(0.5,), numticks=9))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panel.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    panel.yaxis.set_minor_formatter(NullFormatter())
    panel.grid(which="major", color="0.92", lw=0.5)
    panel.set_axisbelow(True)
    panel.tick_params(labelsize=FONT_PT, width=0.5, length=2.5)
    panel.tick_params(which="minor", width=0.4, length=1.5)
    panel.spines[:].set_linewidth(0.5)


def annotate(panels: Any) -> None:
    """Label the auxiliary lines in the first column."""
    grey = {"size": FONT_PT, "color": GREY_TEXT}
    top, bottom = panels[0, 0], panels[1, 0]
    top.text(START[0], 0.97, "raw", va="top", **grey)
    bottom.text(START[-1], 0.96, "best average in hindsight", va="top", ha="right", **grey)
    top.text(DEFAULT * 0.85, 0.0195, "default", ha="right", va="bottom", **grey)
    # Dashes over a black line alone are not clear enough.
    for panel, place in ((top, (3e-5, 0.055)), (bottom, (3e-4, 1.65))):
        panel.text(*place, "kf and akf coincide", va="top", **grey)


def legend_lines() -> list[Line2D]:
    """Return the entries of the legend."""
    methods = [Line2D([], [], color=COLOURS[m], ls=LINES[m], lw=1.6, label=m) for m in METHODS]
    return [
        *methods,
        Line2D([], [], color=GREY_TEXT, lw=1.6, label="thick: mean of the axes"),
        Line2D([], [], color=GREY_TEXT, lw=0.5, label="thin: x, y, z, in the method's colour"),
    ]


def summary(name: str, values: Scores, markdown: bool) -> str:
    """Return a table of a few starts, with geometric means over the axes."""
    head = ("G0", *(f"{m} deviation" for m in METHODS), *(f"{m} coasting" for m in METHODS))
    rows = []
    for start in PRINTED:
        i = int(np.argmin(abs(np.log(START / start))))
        cells = [f"{middle(values[m][row])[i]:.{3 - row}f}" for row in (0, 1) for m in METHODS]
        rows.append((f"{start:.0e}", *cells))
    title = f"{name}: fading has the least deviation on every axis {crossing(values)}"
    return table(title, head, rows, markdown)


def main() -> None:
    """Run from the command line."""
    options = parser(__doc__)
    options.add_argument("--markdown", action="store_true", help="print tables in Markdown")
    options.add_argument("--figure", type=Path, default=FIGURE, help="where the figure goes")
    given = options.parse_args()
    check_folder(given.folder)
    recordings = sensors_alone(given.folder, given.seconds)
    results = {recording.name: sweep(recording) for recording in recordings}
    for name, values in results.items():
        print(summary(name, values, given.markdown))
    draw(results).savefig(given.figure, pil_kwargs={"optimize": True})


if __name__ == "__main__":
    main()
