"""Figures of `docs/how-to/navigation.md`: a track, and the growth of errors in outages.

``python examples/navigation_figures.py [FOLDER]`` draws two figures. ``navigation_track.png`` is a
simulated drive, as ``zerorate navigate`` draws it. ``navigation_outages.png`` compares the filter
with and without wheels with a held position and velocity. The default folder is ``docs/figures``.
"""

import sys
from pathlib import Path

import numpy as np

import zerorate as zr
from zerorate.show import plot_outages, plot_track, save_figure

SEED, DURATION = 5, 400.0
LENGTHS = (30.0,)
# Noise that the filter assumes for a sensor without a model.
GYRO = zr.NoiseModel(angle_random_walk=np.radians(0.05), rate_random_walk=1e-5)
ACCEL = zr.NoiseModel(angle_random_walk=0.02, rate_random_walk=5e-4, quantity="acceleration")


def main(folder):
    """Draw both figures."""
    drive = zr.simulate_drive(
        duration=DURATION,
        seed=SEED,
        gyro=GYRO,
        accel=ACCEL,
        position_sigma=0.05,
        velocity_sigma=0.05,
    )
    imu, fixes = drive.recording(), drive.fixes
    start = zr.align(imu, latitude=fixes.position[0, 0], heading="course")
    free = zr.NavigationFilter(start)
    wheels = zr.NavigationFilter(start, vehicle="wheeled")
    asked = {"seconds": LENGTHS, "smooth": True}
    outages = zr.navigation.outages(imu, fixes, nav=free, **asked)
    wheeled = zr.navigation.outages(imu, fixes, nav=wheels, **asked)
    track = free.process(imu, fixes)
    save_figure(plot_track(track, outages), folder / "navigation_track.png")
    save_figure(plot_outages(outages, {"wheels": wheeled}), folder / "navigation_outages.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/figures"))
