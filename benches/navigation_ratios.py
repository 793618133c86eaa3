"""Time of navigation compared with strapdown in C: ``python benches/navigation_ratios.py``.

The input is a simulated drive at 100 Hz with one fix per second. C only integrates the sensors,
without covariance, fixes, checks and biases. Each row is the minimum of several rounds. Every round
times every row once, so that a disturbance of the machine affects all rows equally.
"""

import ctypes
import time

import numpy as np

import peers
import zerorate as zr
from ratios import least, print_table
from versions import print_versions
from zerorate.geometry.rotations import inverse, product
from zerorate.navigation.events import pack_fixes

CALLS = 10_000
FIXES = 2_000


class InC:
    """Strapdown navigation in C."""

    def __init__(self, drive):
        source = peers.SOURCE.with_name("strapdown.c")
        library = ctypes.CDLL(str(peers.compile_library("strapdown.so", "-O3", source=source)))
        pointer = np.ctypeslib.ndpointer(np.float64, flags="C")
        self.run = library.strapdown
        self.run.argtypes = [pointer, pointer, pointer, ctypes.c_size_t, ctypes.c_double, pointer]
        self.run.restype = None
        self.drive, self.out = drive, np.zeros((len(drive.time), 6))

    def __call__(self):
        drive, q = self.drive, self.drive.truth_quaternion[0]
        axes = np.concatenate((np.zeros((3, 1)), np.eye(3)), axis=1)
        columns = product(product(np.tile(q, (3, 1)), axes), inverse(np.tile(q, (3, 1))))[:, 1:]
        place = np.radians(drive.truth_position[0, :2])
        state = np.concatenate(
            (columns.T.ravel(), drive.truth_velocity[0], place, drive.truth_position[0, 2:])
        )
        gyro, accel = drive.gyro - drive.gyro_bias[0], drive.accel - drive.accel_bias[0]
        start = time.perf_counter()
        self.run(state, gyro, accel, len(gyro), 1.0 / drive.rate, self.out)
        return (time.perf_counter() - start) / len(gyro)


def main():
    print_versions("cc")
    drive = zr.simulate_drive(duration=400.0)
    n, rows = len(drive.time), pack_fixes(drive.fixes)
    begin = zr.align(drive.recording(), latitude=48.0, heading="course")
    fresh, wheeled = zr.NavigationFilter(begin), zr.NavigationFilter(begin, vehicle="wheeled")
    samples = drive.time, drive.gyro, drive.accel
    moving = fresh.copy()
    moving.process_arrays(*(x[:5000] for x in samples), rows)

    def batch(nav, fixes=rows):
        copied = nav.copy()
        start = time.perf_counter()
        copied.process_arrays(*samples, fixes)
        return (time.perf_counter() - start) / n

    def calls():
        nav, ticks = moving.copy(), drive.time[5000 : 5000 + CALLS].tolist()
        rates, forces = list(drive.gyro[5000:]), list(drive.accel[5000:])
        start = time.perf_counter()
        for t, gyro, accel in zip(ticks, rates, forces, strict=False):
            nav.update(t, gyro, accel)
        return (time.perf_counter() - start) / CALLS

    def fixes():
        nav, place, speed = moving.copy(), moving.position, moving.velocity
        start = time.perf_counter()
        for _ in range(FIXES):
            nav.update_gnss(nav.time, place, speed)
        return (time.perf_counter() - start) / FIXES

    _, steps = fresh.copy().process_arrays(*samples, rows, record=True)

    def smoother():
        start = time.perf_counter()
        steps.smoothed()
        return (time.perf_counter() - start) / len(steps)

    found = {
        "C: the strapdown alone, a sample": InC(drive),
        "process, a sample": lambda: batch(fresh),
        "process, wheeled, a sample": lambda: batch(wheeled),
        "process, few fixes, a sample": lambda: batch(fresh, rows[:60]),
        "update, a call": calls,
        "update_gnss, a call": fixes,
        "smoother, a step of the covariance": smoother,
    }
    print_table("Navigation at 100 Hz", list(found), least(list(found.values())))


if __name__ == "__main__":
    main()
