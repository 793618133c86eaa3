"""Headings of the navigation filter with and without a magnetometer as compass.

``python examples/compass_study.py [SEEDS]`` prints a table in Markdown, in some minutes. The
vehicles are from ``vehicles.py``. Each runs through ``zr.navigate`` with and without ``mag=True``.
"""

import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np

import zerorate as zr
from tables import table
from vehicles import simulate_vehicle
from zerorate.simulation import magnetometer, with_aids

SEEDS, SECONDS, SETTLED_S = 6, 180.0, 60.0
IRON_UT = 12.0
MAGNET = ((80.0, 110.0, (30.0, 20.0, 10.0)),)
FIELDS = {"clean": {}, "hard iron": {"iron": IRON_UT}, "magnet for 30 s": {"magnets": MAGNET}}


def run(kind, field, seed):
    """Return heading errors and σ, deg, and position errors, m, without and with the compass."""
    drive = simulate_vehicle(kind, SECONDS, seed=seed)
    known = dict(FIELDS[field])
    iron = known.pop("iron", 0.0) * np.random.default_rng([seed, 8]).standard_normal(3)
    samples = magnetometer(drive, 25.0, hard_iron=iron, seed=seed, **known)
    recording = with_aids(drive, mag=samples)
    cells = []
    for mag in (False, True):
        track = zr.navigate(recording, drive.fixes, mag=mag).track
        truth = drive.truth_position, drive.truth_velocity, drive.truth_quaternion
        error, late = track.errors(*truth), track.time > SETTLED_S
        cells += [rms(np.degrees(error[late, 8])), rms(np.degrees(track.sigma[late, 8]))]
        cells += [rms(error[late, 8] / track.sigma[late, 8]), rms(np.hypot(*error[late, :2].T))]
    return cells


def rms(values):
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def main(seeds=SEEDS):
    """Print the table."""
    head = ("vehicle, field", "heading, deg: without, with", "worst", "σ, deg", "error / σ")
    head += ("track, m",)
    rows = []
    with ProcessPoolExecutor(2) as pool:
        for kind in ("drone", "boat", "robot", "car"):
            for field in FIELDS:
                found = np.array(list(pool.map(partial(run, kind, field), range(seeds))))
                means = [rms(column) for column in found.T]
                worst = found.max(axis=0)
                pairs = [(means[0], means[4]), (worst[0], worst[4]), (means[1], means[5])]
                pairs += [(means[2], means[6]), (means[3], means[7])]
                rows.append((f"{kind}, {field}", *(f"{a:.2f}, {b:.2f}" for a, b in pairs)))
                print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
    print(table(f"Magnetometer as compass, {seeds} seeds", head, rows, markdown=True), flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
