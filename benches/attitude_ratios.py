"""Speed of Attitude relative to vqf, in one run: ``python benches/attitude_ratios.py``.

The motion of a hand is simulated at 100 Hz and repeated. The same samples are also processed with a
stated rate of 286 Hz, at which ticks are rarer. Each row is the minimum of several rounds. Every
round times every row once, so that a disturbance of the machine affects all rows equally.
"""

import time

import numpy as np
from vqf import VQF

import zerorate as zr
from ratios import least, print_table
from versions import print_versions

N = 200_000
CALLS = 20_000
RATES = (100.0, 2000.0 / 7.0)


def samples():
    """Return gyro, accelerometer and magnetometer samples."""
    motion = zr.simulate_motion("hand", 100.0, 200.0, seed=1)
    sensors = (motion.gyro, motion.accel, motion.mag)
    repeats = -(-N // len(motion.gyro))
    return [np.ascontiguousarray(np.tile(z, (repeats, 1))[:N]) for z in sensors]


def own(rate, mag):
    def run(z):
        zr.Attitude(rate, mag=mag).process(*z[: 3 if mag else 2])

    return run


def theirs(rate, mag):
    def run(z):
        VQF(1.0 / rate).updateBatch(*z[: 3 if mag else 2])

    return run


def one_by_one(update):
    def run(z):
        for row in z:
            update(*row)

    return run


def offline(rate):
    return lambda z: zr.Attitude(rate).smooth(*z)


def rows(z):
    """Return name, function, and samples for each row of the table."""
    for rate in RATES:
        for axes, mag in ((6, False), (9, True)):
            told = f"{axes} axes, {rate:.0f} Hz"
            yield f"vqf, {told}", theirs(rate, mag), z
            yield f"Attitude.process, {told}", own(rate, mag), z
    yield "Attitude.smooth, 9 axes, 100 Hz", offline(100.0), z
    calls = [tuple(row) for row in zip(*(sensor[:CALLS] for sensor in z), strict=True)]
    yield "vqf, a call, 9 axes", one_by_one(VQF(0.01).update), calls
    yield "Attitude.update, a call, 9 axes", one_by_one(zr.Attitude(100.0).update), calls
    six = [row[:2] for row in calls]
    yield "Attitude.update, a call, 6 axes", one_by_one(zr.Attitude(100.0, mag=False).update), six


def seconds(run, z):
    """Return the time of a sample of each sensor, or of a call, s."""
    count = len(z[0]) if isinstance(z[0], np.ndarray) else len(z)
    start = time.perf_counter()
    run(z)
    return (time.perf_counter() - start) / count


def main():
    print_versions("vqf")
    todo = list(rows(samples()))
    found = least([lambda run=run, z=z: seconds(run, z) for _, run, z in todo])
    print_table("A sample of an IMU", [name for name, *_ in todo], found)


if __name__ == "__main__":
    main()
