"""Attitude errors in simulated motions, and the validity of their standard deviations.

``python examples/attitude_study.py [SEEDS]`` prints a table in Markdown. It has the RMS inclination
error over the motion as mean over the seeds (default 12), for `zerorate.Attitude` and, if
installed, vqf. It also has the share of errors within one standard deviation after 15 s.
"""

import sys

import numpy as np

import zerorate as zr
from tables import table
from zerorate.geometry import rotations

RATE, DURATION = 100.0, 60.0
KINDS = ("pendulum", "spinning pendulum", "arm", "vehicle", "circle", "hand")
LATE = slice(1500, None, 50)
"""Samples at which standard deviations are checked, after the start."""

try:
    from vqf import VQF
except ImportError:
    VQF = None


def inclination(quaternions, motion):
    """Return the RMS angle between true and estimated vertical, deg."""
    return np.degrees(zr.metrics.orientation_errors(quaternions, motion.quaternion).inclination)


def covered(trace, motion):
    """Return the shares of tilt, heading and bias errors within one standard deviation."""
    true = motion.quaternion[LATE]
    wrong = rotations.product(trace["quaternion"][LATE], rotations.inverse(true))
    tilt = 2.0 * np.arctan2(np.hypot(*wrong.T[1:3]), np.hypot(wrong[:, 0], wrong[:, 3]))
    heading = 2.0 * np.arctan(wrong[:, 3] / wrong[:, 0])
    bias = np.abs(trace["bias"] - motion.bias)[LATE]
    return [
        np.mean(tilt < trace["tilt_sigma"][LATE]),
        np.mean(np.abs(heading) < trace["heading_sigma"][LATE]),
        np.mean(bias < trace["bias_sigma"][LATE]),
    ]


def one(kind, start, seed):
    """Return the inclination errors of zerorate and vqf, and the shares."""
    motion = zr.simulate_motion(kind, RATE, DURATION, seed=seed, start=start)
    sensors = [np.ascontiguousarray(z) for z in (motion.gyro, motion.accel, motion.mag)]
    trace = zr.Attitude(RATE).trace(*sensors)
    own = inclination(trace["quaternion"], motion)
    if VQF is None:
        return [own, np.nan, *covered(trace, motion)]
    theirs = inclination(VQF(1.0 / RATE).updateBatch(*sensors)["quat9D"], motion)
    return [own, theirs, *covered(trace, motion)]


def main(seeds):
    """Print the table."""
    rows = []
    for kind in KINDS:
        for start in ("rest", "motion"):
            found = np.mean([one(kind, start, seed) for seed in range(seeds)], axis=0)
            rows.append((f"{kind}, from {start}", *(f"{x:.2f}" for x in found)))
    head = ("recording", "inclination, deg", "vqf", "tilt within", "heading", "bias")
    print(table("Simulated motions of a minute", head, rows, markdown=True))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 12)
