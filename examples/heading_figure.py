"""Figure of `docs/how-to/heading-drifts.md`: each cause of a heading drift, and its remedy.

``python examples/heading_figure.py [FOLDER]`` draws ``heading_drifts.png``. The default folder is
``docs/figures``.
"""

import sys
from pathlib import Path

import numpy as np

import zerorate as zr
from zerorate.show import save_figure
from zerorate.show.attitude_figure import heading_and_tilt_errors
from zerorate.show.style import (
    BLACK,
    BLUE,
    VERMILION,
    add_panel,
    new_figure,
    style_panels,
    write_legend,
    write_title,
)

RATE, SECONDS = 100.0, 120.0
# Sizes in mm.
WIDTH, PANEL, LEFT, RIGHT, TOP, BOTTOM, BETWEEN = 180.0, 21.0, 15.0, 4.0, 9.0, 10.0, 3.0
IRON = np.array([10.0, -8.0, 7.5])


def moved(**errors):
    """Return the motion of a hand whose sensors have only the given errors."""
    none = vars(zr.simulation.MotionErrors.none())
    told = zr.simulation.MotionErrors(**{**none, "gyro_noise": 1e-4, "accel_noise": 4e-3, **errors})
    return zr.simulate_motion("hand", RATE, SECONDS, seed=2, errors=told)


def off(motion, filter_, there=None, **fed):
    """Return times and heading errors, deg, for the samples that are present."""
    where = slice(None) if there is None else there
    mag = fed.pop("mag", None)
    q = filter_.process(motion.gyro[where], motion.accel[where], mag, **fed)
    error, _ = heading_and_tilt_errors(q, motion.quaternion[where], relative=mag is None)
    return motion.time[where], np.degrees(error)


def cases():
    """Yield the name of a cause, and the curves with and without it."""

    def plain(rate=RATE):
        return zr.Attitude(rate, mag=False, method="madgwick")

    def auto(mag=False):
        return zr.Attitude(RATE, mag=mag)

    motion = moved(gyro_bias=np.radians([0.3, -0.2, 0.4]))
    yield "bias", off(motion, plain()), off(motion, auto())
    motion = moved(gyro_matrix=np.eye(3) / 1.03)
    yield "scale, 3 %", off(motion, plain()), off(motion, auto())
    motion = moved(mag_noise=0.3)
    iron, none = (off(motion, auto(True), mag=motion.mag + one) for one in (IRON, 0.0))
    yield "a magnet on it", iron, none
    motion = moved()
    yield "rate, 3 % wrong", off(motion, plain(0.97 * RATE)), off(motion, plain())
    there = (motion.time % 15.0 > 0.4) | (motion.time < 15.0)
    steps = np.diff(motion.time[there], prepend=-1.0 / RATE)
    yield "lost samples", off(motion, plain(), there), off(motion, plain(), there, dt=steps)


def main(folder):
    """Draw the figure."""
    found = list(cases())
    height = TOP + BOTTOM + len(found) * PANEL + (len(found) - 1) * BETWEEN
    figure = new_figure(WIDTH, height)
    panels = []
    for i, (name, wrong, cured) in enumerate(found):
        bottom = height - TOP - (i + 1) * PANEL - i * BETWEEN
        axes = add_panel(figure, LEFT, bottom, WIDTH - LEFT - RIGHT, PANEL)
        axes.axhline(0.0, color=BLACK, linewidth=0.3)
        axes.plot(*wrong, color=VERMILION, linewidth=0.6, label=name)
        axes.plot(*cured, color=BLUE, linewidth=0.6, label="cured")
        axes.set_xlim(0.0, SECONDS)
        axes.set_ylabel("heading [deg]")
        axes.margins(y=0.3)
        write_legend(axes, "upper left", 2)
        axes.tick_params(labelbottom=i == len(found) - 1)
        panels.append(axes)
    panels[-1].set_xlabel("time [s]")
    style_panels(panels)
    figure.align_ylabels(panels)
    write_title(figure, "Error of the heading of a simulated hand that rests for 5 s and turns")
    save_figure(figure, folder / "heading_drifts.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/figures"))
