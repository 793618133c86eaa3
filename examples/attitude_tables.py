"""Attitude errors on a recording, unchanged and with changes.

``python examples/attitude_tables.py RECORDING RATE`` prints a table in Markdown. Values are RMS
errors in motion, in degrees, of `zerorate.Attitude` and, if installed, vqf. The recording has gyro,
accelerometer, magnetometer and the true orientation to east, north, up.
"""

import sys

import numpy as np

import zerorate as zr
from tables import table
from zerorate.tasks.compare.imu import Imu
from zerorate.tasks.compare.orientation import turning_speed
from zerorate.tasks.compare.trial import Trial

CROP = 35.0
"""Length of a record that starts in motion, s."""
SEEDS = 5

try:
    from vqf import VQF
except ImportError:
    VQF = None


def own(z, rate, dt):
    """Return the orientations from nine axes and from six axes."""
    nine = zr.Attitude(rate).process(*z, dt)
    six = zr.Attitude(rate, mag=False).process(*z[:2], dt=dt)
    return nine, six


def theirs(z, rate, dt):
    """Return the orientations of vqf, which does not use sample times."""
    found = VQF(1.0 / rate).updateBatch(*(np.ascontiguousarray(sensor) for sensor in z))
    return found["quat9D"], found["quat6D"]


def errors(method, z, rate, truth, where, dt=None):
    """Return total, heading and inclination errors of nine axes, and heading of six axes, deg."""
    nine, six = method(z, rate, dt)
    of_nine = zr.metrics.orientation_errors(nine, truth, where=where)
    of_six = zr.metrics.orientation_errors(six, truth, where=where, heading="relative")
    found = (of_nine.total, of_nine.heading, of_nine.inclination, of_six.heading)
    return np.degrees(found)


def changed(gyro, accel, rate, random):
    """Yield the name of a change, the changed gyro and the changed accelerometer."""
    askew = np.eye(3) + np.radians(0.5) * np.array([[0, 1, -1], [1, 0, 1], [-1, 1, 0]])
    walk = np.cumsum(random.standard_normal(gyro.shape), axis=0) / np.sqrt(rate)
    noise = random.standard_normal(gyro.shape)
    yield "as it is", gyro, accel
    yield "gyro scale +1 %", 1.01 * gyro, accel
    yield "gyro scale -1 %", 0.99 * gyro, accel
    yield "gyro scale +2 %", 1.02 * gyro, accel
    yield "gyro misaligned by 0.5 deg", gyro @ askew.T, accel
    yield "gyro bias +5 deg/s", gyro + np.radians(5.0), accel
    yield (
        "noise 1 deg/s a sample, walk 0.01 deg/s/sqrt(s)",
        gyro + np.radians(1.0) * noise + np.radians(0.01) * walk,
        accel,
    )
    yield "accelerometer bias 0.2 m/s^2 an axis", gyro, accel + 0.2


def lost(z, truth, moving, rate, share):
    """Yield the kept samples for each seed, with the true time steps."""
    for seed in range(SEEDS):
        kept = np.random.default_rng(seed).random(len(truth)) >= share
        steps = np.diff(np.flatnonzero(kept), prepend=np.flatnonzero(kept)[0] - 1) / rate
        yield [sensor[kept] for sensor in z], truth[kept], moving[kept], steps


def crops(moving, rate):
    """Yield records that start in motion, at intervals of two seconds."""
    length = round(CROP * rate)
    for first in range(0, len(moving) - length, round(2.0 * rate)):
        if moving[first : first + round(2.0 * rate)].all():
            yield slice(first, first + length)


def rows(z, truth, moving, rate):
    """Yield the name of a change, and a function from a method to its errors."""
    for name, gyro, accel in changed(z[0], z[1], rate, np.random.default_rng(0)):
        sensors = (gyro, accel, z[2])
        yield name, lambda method, sensors=sensors: errors(method, sensors, rate, truth, moving)
    for share in (0.003, 0.01, 0.03):
        records = list(lost(z, truth, moving, rate, share))
        for told in (False, True):
            name = f"{share:.1%} of the samples lost, {'with' if told else 'no'} time stamps"
            yield (
                name,
                lambda method, records=records, told=told: np.mean(
                    [
                        errors(method, kept, rate, true, where, dt if told else None)
                        for kept, true, where, dt in records
                    ],
                    axis=0,
                ),
            )
    parts = list(crops(moving, rate))

    def begun(method):
        found = [
            errors(method, [s[part] for s in z], rate, truth[part], np.ones(len(truth[part]), bool))
            for part in parts
        ]
        return np.mean(found, axis=0)

    yield f"{len(parts)} records of {CROP:g} s begun in motion", begun


def main(path, rate):
    """Print the table."""
    trial = Trial.of(zr.read_recording(path, rate))
    imu = Imu.of(trial)
    truth = trial.orientation.quaternions
    moving = turning_speed(truth, imu.rate, 0.5) > np.radians(3.0)
    methods = {"zerorate": own} | ({"vqf": theirs} if VQF else {})
    body = []
    for name, of in rows((imu.gyro, imu.accel, imu.mag), truth, moving, imu.rate):
        told = "with time stamps" in name
        cells = [
            "" if told and method is theirs else " / ".join(f"{x:.2f}" for x in of(method))
            for method in methods.values()
        ]
        body.append((name, *cells))
    title = "Total / heading / inclination of nine axes, and heading of six, deg"
    print(table(title, ("recording", *methods), body, markdown=True))


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
