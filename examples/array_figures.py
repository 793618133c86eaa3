"""Figures of `docs/explanation/arrays.md`, and the errors of eight gyros with two faults.

``python examples/array_figures.py [FOLDER]`` simulates eight gyros on a hand that rests and moves,
at 100 Hz. Their scale errors are 1 %, and their noise differs by up to a factor of four. The third
gyro changes the sign of x at 150 s. The sixth gyro is stuck from 200 s to 230 s.

The program draws ``array.png`` like ``zerorate replay --array``. It prints the RMS errors of the
array, the median, the plain mean and one sensor. The default folder is ``docs/figures``.
"""

import sys
from pathlib import Path

import numpy as np

import zerorate as zr
from tables import table
from zerorate.show import plot_array, save_figure
from zerorate.tasks.array import replay_array

RATE, DURATION, SENSORS = 100.0, 300.0, 8
NOISE, BIAS, SCALE = 0.1, 1.0, 0.01
PERIOD = 40.0
"""Duration of a rest with the following motion, s; each is half of it."""
SIGN, SIGN_AT = 2, 150.0
STUCK, STUCK_AT = 5, (200.0, 230.0)


def truth(seed):
    """Return the rates of the hand, deg/s, shape (n, 3)."""
    motion = zr.simulate_motion("hand", RATE, DURATION, seed=seed)
    part = np.sin(2.0 * np.pi * motion.time / PERIOD)
    return np.rad2deg(motion.rates) * np.where(part < 0.0, part**2, 0.0)[:, np.newaxis]


def array_of(rates, seed):
    """Return the log of the gyros without faults."""
    rng = np.random.default_rng(seed)
    shape = (SENSORS, 3)
    scale = 1.0 + SCALE * rng.standard_normal(shape)
    noise = NOISE * np.exp2(rng.uniform(-1.0, 1.0, shape))
    z = scale * rates[:, np.newaxis] + BIAS * rng.standard_normal(shape)
    z += noise * rng.standard_normal(z.shape)
    labels = tuple(f"imu{k + 1}" for k in range(SENSORS))
    return zr.array.ArrayLog(np.arange(len(z)) / RATE, RATE, z, labels, unit="deg/s")


def with_faults(log):
    """Return the log with the faults of two gyros."""
    z = log.data.copy()
    z[log.time >= SIGN_AT, SIGN, 0] *= -1.0
    stuck = (log.time >= STUCK_AT[0]) & (log.time < STUCK_AT[1])
    z[stuck, STUCK] = z[np.argmax(stuck), STUCK]
    return zr.array.ArrayLog(log.time, log.rate, z, log.labels, unit=log.unit)


def rms(error):
    """Return the root mean square of the values that are not NaN."""
    return float(np.sqrt(np.nanmean(error**2)))


def errors_of(log, rates, found):
    """Return the RMS errors of four estimates, each minus its bias at rest."""
    sound = log.time > 20.0
    rest = sound & (rates == 0.0).all(axis=1)
    ways = {
        "one gyro": log.data[:, 0],
        "plain mean": log.data.mean(axis=1),
        "median": np.median(log.data, axis=1),
        "`GyroArray`": found.rate,
    }
    for name, rate in ways.items():
        bias = 0.0 if name == "`GyroArray`" else rate[rest].mean(axis=0)
        error = rate - bias - rates
        yield name, rms(error[rest]), rms(error[sound & ~rest])


def main(folder):
    """Draw the figure and print the table."""
    rates = truth(2)
    clean = array_of(rates, 1)
    rows = {}
    for log in (clean, with_faults(clean)):
        found = replay_array(log)
        for name, rest, motion in errors_of(log, rates, found):
            rows.setdefault(name, [name]).extend([f"{rest:.3f}", f"{motion:.3f}"])
    save_figure(plot_array(found), folder / "array.png")
    head = ["RMS error, deg/s", "at rest", "in motion", "at rest, faults", "in motion, faults"]
    print(table("Eight gyros", head, list(rows.values()), markdown=True))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/figures"))
