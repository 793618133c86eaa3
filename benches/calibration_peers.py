"""Comparison of imucal and `zerorate.calibrate`: ``python benches/calibration_peers.py [RUNS]``.

The record is a Ferraris calibration: each axis points up and down, and rotates by a revolution
while it is up. All poses and axes have random errors of 0.1, 1 and 3 deg, as by hand.

imucal (Python) gets the meaning of each sample, and assumes exact poses and angles. `zr.calibrate`
gets no such information. It reports that this record is not sufficient. It also gets the same
record with twenty additional poses by hand, which imucal cannot use.

Errors are over all directions and rates, so that the choice of axes does not matter. Times are the
minimum of three.
"""

import sys
import time

import numpy as np
from imucal import FerrarisCalibration
from imucal.ferraris_calibration import FerrarisSignalRegions

import zerorate as zr
from versions import print_versions
from zerorate.geometry import rotations

G = 9.80665
RATE = 100.0
PLACED_WRONG = (0.1, 1.0, 3.0)
MORE = 20
AWAY = 0.5
"""Time that imucal leaves out at both ends of a rest, s."""
ALL_ROUND = np.random.default_rng(0).standard_normal((2000, 3))
ALL_ROUND /= np.linalg.norm(ALL_ROUND, axis=1, keepdims=True)
POSES = ("z_p", "x_p", "y_p", "z_a", "x_a", "y_a")
"""Axis that is up or down in each pose, perpendicular to the previous one; rotations while up."""


def rotation_vector(q):
    q = q if q[0] >= 0.0 else -q
    sine = np.linalg.norm(q[1:])
    return 2.0 * np.arctan2(sine, q[0]) * q[1:] / max(sine, 1e-300)


def with_axis_up(name, tilt):
    """Return the orientation with an axis up or down, tilted by a rotation vector."""
    up = np.eye(3)["xyz".index(name[0])] * (1.0 if name.endswith("p") else -1.0)
    z = np.array([0.0, 0.0, 1.0])
    axis, cosine = np.cross(up, z), up @ z
    vector = axis * (np.pi / 2.0) if cosine > -0.5 else np.array([np.pi, 0.0, 0.0])
    q = rotations.from_rotation_vectors(vector)
    return rotations.product(rotations.from_rotation_vectors(tilt), q)


def motion(wrong, seed):
    """Return the rotation vectors, and the names of the rests and rotations."""
    random = np.random.default_rng(seed)
    q = np.array([1.0, 0.0, 0.0, 0.0])
    turns, rests, names = [], ["z_p"], []

    def go(vector, name, rest):
        nonlocal q
        turns.append(vector)
        names.append(name)
        rests.append(rest)
        q = rotations.unit(rotations.product(q, rotations.from_rotation_vectors(vector)))

    for name in POSES:
        if name != "z_p":
            target = with_axis_up(name, wrong * random.standard_normal(3))
            go(rotation_vector(rotations.product(rotations.inverse(q), target)), None, name)
        if name.endswith("p"):
            axis = np.eye(3)["xyz".index(name[0])] + wrong * random.standard_normal(3)
            axis /= np.linalg.norm(axis)
            go(-(2.0 * np.pi + wrong * random.standard_normal()) * axis, name[0] + "_rot", None)
    return np.array(turns), rests, names


def session_of(wrong, seed):
    """Return the record; axes of rotation are constant, because imucal cannot use a wobble."""
    turns, rests, names = motion(np.radians(wrong), 100 + seed)
    random = np.random.default_rng(200 + seed)
    about = random.standard_normal((MORE, 3))
    about *= np.radians(random.uniform(60.0, 170.0, (MORE, 1))) / np.linalg.norm(
        about, axis=1, keepdims=True
    )
    every = np.concatenate((turns, about))
    session = zr.simulation.simulate_session(
        turns=every, turn=4.0, seed=seed, rate=RATE, wobble=0.0
    )
    return session, rests, names


def first_part(session, rests):
    """Return the part of the record with the Ferraris calibration."""
    stop = session.rests[len(rests) - 1, 1]
    logs = {
        name: zr.Log(log.time[:stop], log.rate, log.data[:stop], log.names, log.unit)
        for name, log in session.recording.items()
    }
    return zr.Recording(logs)


def regions(session, rests, names):
    gyro, accel = session.recording.gyro.data, session.recording.accel.data * G
    found, away = {}, round(AWAY * RATE)
    for name, (first, stop) in zip(rests, session.rests, strict=False):
        if name is not None:
            found[f"acc_{name}"] = accel[first + away : stop - away]
            found[f"gyr_{name}"] = gyro[first + away : stop - away]
    for name, (first, stop) in zip(names, session.turns, strict=False):
        if name is not None:
            found[f"acc_{name}"], found[f"gyr_{name}"] = accel[first:stop], gyro[first:stop]
    return FerrarisSignalRegions(**found)


def by_imucal(session, rests, names):
    known = regions(session, rests, names)
    calibration = FerrarisCalibration(grav=G, expected_angle=-360)

    def run():
        return calibration.compute(known, RATE, from_acc_unit="m/s^2", from_gyr_unit="deg/s")

    info = run()

    def correct(accel, gyro):
        force, rates = info.calibrate(accel * G, gyro, "m/s^2", "deg/s")
        return force / G, rates

    return run, correct, ""


def by_zerorate(recording):
    def run():
        return zr.calibrate(recording, gravity=G)

    found = run()

    def correct(accel, gyro):
        A, W = found.accel, found.gyro
        force = (accel - np.array(A.bias)) @ A.correction.T
        rates = gyro - np.array(W.bias) - force @ np.array(W.g_sensitivity).T
        return force, rates @ W.correction.T

    return run, correct, "valid" if found.valid else "refused"


def errors(session, correct):
    """Return the RMS errors of gravity's norm, mg, and of rates at 100 deg/s, %."""
    truth = session.truth
    A, W = np.array(truth.accel.matrix), np.array(truth.gyro.matrix)
    accel = ALL_ROUND @ A.T + np.array(truth.accel.bias)
    true_rates = 100.0 * np.roll(ALL_ROUND, 1, axis=0)
    gyro = true_rates @ W.T + np.array(truth.gyro.bias)
    gyro += ALL_ROUND @ np.array(truth.gyro.g_sensitivity).T
    force, rates = correct(accel, gyro)
    norm = np.linalg.norm(force, axis=1) - 1.0
    size = np.linalg.norm(rates, axis=1) / 100.0 - 1.0
    return 1e3 * np.sqrt(np.mean(norm**2)), 1e2 * np.sqrt(np.mean(size**2))


def least_of(run, times=3):
    taken = []
    for _ in range(times):
        start = time.perf_counter()
        run()
        taken.append(time.perf_counter() - start)
    return min(taken)


def methods(session, rests, names):
    yield "raw", (lambda: None, lambda accel, gyro: (accel, gyro), "")
    yield "imucal", by_imucal(session, rests, names)
    yield "zerorate, the same", by_zerorate(first_part(session, rests))
    yield f"zerorate, {MORE} poses more", by_zerorate(session.recording)


def main(runs):
    print_versions("imucal")
    print(f"{runs} records each; RMS of the errors, median of the times\n")
    head = f"{'placed wrong':14}{'method':26}{'gravity, mg':>13}{'rate, %':>11}{'time, ms':>11}"
    print(f"{head}  says")
    for wrong in PLACED_WRONG:
        rows = {}
        for seed in range(runs):
            session, rests, names = session_of(wrong, seed)
            for name, (run, correct, says) in methods(session, rests, names):
                row = (*errors(session, correct), 1e3 * least_of(run))
                rows.setdefault(name, []).append((row, says))
        for name, found in rows.items():
            norm, size, _ = np.sqrt(np.mean(np.square([row for row, _ in found]), axis=0))
            took = np.median([row[2] for row, _ in found])
            says = ", ".join(sorted({says for _, says in found}))
            line = f"{f'{wrong:g} deg':14}{name:26}{norm:13.3f}{size:11.4f}{took:11.2f}  {says}"
            print(line.rstrip())


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 6)
