"""Errors of all attitude methods on a recording of BROAD and on simulated motions.

The argument is the recording ``broad_05_undisturbed_slow_rotation_with_breaks_B.parquet``. Without
it only the simulated motions run. Numbers are RMS in degrees: total, heading, inclination.
"""

import sys

import numpy as np

import zerorate as zr
from zerorate.attitude.options import ATTITUDE_METHODS

KINDS = ("hand", "pendulum", "arm", "vehicle")
SEEDS = range(6)
# Settings other than the defaults that users try.
TRIED = {
    "complementary": [{"time_constant": tau} for tau in (0.5, 2.0, 5.0)],
    "mahony": [{"kp": 1.0, "ki": 0.3}, {"kp": 1.0, "ki": 0.0}, {"kp": 0.2, "ki": 0.01}],
    "madgwick": [{"beta": beta} for beta in (0.02, 0.041, 0.1)],
    "ekf": [{"accel_noise": noise} for noise in (0.002, 0.02, 0.1, 0.5)],
    "ukf": [{}],
}


def errors(method, rate, sensors, truth, scored, **constants):
    """Return errors with nine axes, then heading and inclination errors with six axes."""
    gyro, accel, mag = sensors
    nine = zr.Attitude(rate, method=method, **constants).process(gyro, accel, mag)
    six = zr.Attitude(rate, method=method, mag=False, **constants).process(gyro, accel)
    one = zr.metrics.orientation_errors(nine, truth, where=scored)
    other = zr.metrics.orientation_errors(six, truth, where=scored, heading="relative")
    return np.degrees([one.total, one.heading, one.inclination, other.heading, other.inclination])


def broad(path):
    """Return rate, sensors, truth and mask of a trial of BROAD."""
    import pandas as pd

    table = pd.read_parquet(path)
    sensors = [table.filter(like=name).to_numpy(float) for name in ("gyro", "accel", "mag")]
    truth = table.filter(like="ref_quat").to_numpy(float)
    scored = table["movement"].to_numpy() & np.isfinite(truth).all(axis=1)
    return 2000.0 / 7.0, [np.ascontiguousarray(z) for z in sensors], truth, scored


def show(title, found):
    """Print a row."""
    print(f"{title:44}" + " ".join(f"{x:6.2f}" for x in found))


def on_trial(path):
    """Print the errors on the recording."""
    rate, sensors, truth, scored = broad(path)
    print(f"\n{'trial 05':44} total  head.  incl. | 6: head. incl.")
    show("auto", errors("auto", rate, sensors, truth, scored))
    for method, tried in TRIED.items():
        for constants in tried:
            show(f"{method} {constants}", errors(method, rate, sensors, truth, scored, **constants))
    print("\nwith +5 deg/s of bias on each axis")
    biased = [sensors[0] + np.radians(5.0), *sensors[1:]]
    for method in ATTITUDE_METHODS:
        show(method, errors(method, rate, biased, truth, scored))


def on_motions():
    """Print the errors on simulated motions."""
    print(f"\n{'simulated, median of six, inclination':44}" + " ".join(f"{k:>9}" for k in KINDS))
    for method in ATTITUDE_METHODS:
        row = []
        for kind in KINDS:
            each = []
            for seed in SEEDS:
                m = zr.simulate_motion(kind, 100.0, 60.0, seed=seed)
                scored = np.arange(len(m.gyro)) > 1000
                sensors = (m.gyro, m.accel, m.mag)
                each.append(errors(method, 100.0, sensors, m.quaternion, scored)[2])
            row.append(np.median(each))
        print(f"{method:44}" + " ".join(f"{x:9.2f}" for x in row))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        on_trial(sys.argv[1])
    on_motions()
