"""Figures of `docs/how-to/attitude.md`: gain from learning the scale and ignoring a magnet.

``python examples/attitude_figures.py [FOLDER]`` draws ``attitude_study.png``. It also draws
``attitude.png`` from a simulated recording, like ``zerorate attitude``. The default folder is
``docs/figures``.
"""

import sys
from pathlib import Path

import numpy as np

import zerorate as zr
from attitude_panels import plot_attitude_study
from zerorate.show import save_figure

RATE, DURATION = 100.0, 120.0
# These methods have no states for scale and misalignment; Mahony's filter integrates its bias.
OTHERS = ("ekf", "mahony")
SCALES = np.array([-0.03, -0.02, -0.01, 0.0, 0.01, 0.02, 0.03])
SEEDS = (2, 3, 4)
MAGNET = [[60.0, 80.0]]


def motion(seed, scale=None, magnet=()):
    """Return the motion of a hand with a gyro that reads too much on all axes."""
    errors = None
    if scale is not None:
        errors = zr.simulation.MotionErrors(gyro_matrix=np.eye(3) / (1.0 + scale))
    return zr.simulate_motion("hand", RATE, DURATION, seed=seed, errors=errors, magnet=magnet)


def six_axes(moved, method="auto"):
    """Return the attitude without the magnetometer."""
    return zr.estimate_attitude(moved.recording(), mag=False, method=method)


def mean_error(method, scale):
    """Return the RMS heading error over several motions."""
    found = [six_axes(motion(seed, scale), method).errors().heading for seed in SEEDS]
    return np.sqrt(np.mean(np.square(found)))


def main(folder):
    """Draw both figures."""
    moved = motion(2, scale=0.02)
    drift = {"auto": six_axes(moved), **{name: six_axes(moved, name) for name in OTHERS}}
    near = motion(2, magnet=MAGNET).recording()
    magnet = {name: zr.estimate_attitude(near, method=name) for name in ("auto", "madgwick")}
    errors = {
        name: np.array([mean_error(name, scale) for scale in SCALES]) for name in ("auto", *OTHERS)
    }
    figure = plot_attitude_study(drift, magnet, moved.gyro_matrix, SCALES, errors)
    save_figure(figure, folder / "attitude_study.png")
    save_figure(magnet["auto"].plot(), folder / "attitude.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/figures"))
