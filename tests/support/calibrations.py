"""Calibrations made by hand, sensors that are as they say, and files of such a sensor."""

from dataclasses import replace

import numpy as np

from zerorate import Log, Recording, write_log
from zerorate.calibration import Calibration, Rest, Turn
from zerorate.units import UNITS, convert

RATE = 100.0
GRAVITY = 9.81
UNITS_OF_A_LOG = (("g", "g"), ("deg/s", "deg/s"))
COUNTS = (("unit", "m/s^2"), ("unit", "rad/s"))
FREE = np.delete(np.arange(33), [1, 2, 5])
"""Parameters that frame "x" does not fix."""


def calibration(seed=1, units=UNITS_OF_A_LOG, scales=(1.0, 1.0), rests=0, **fields):
    """Return a calibration of frame "x", whose numbers follow from the seed.

    Scales multiply the parameters of the accelerometer and of the gyro, as those of counts.
    """
    rng = np.random.default_rng(seed)
    size = np.repeat(scales, (12, 21))
    values = size * np.concatenate(
        (
            np.tril(np.eye(3) + 0.02 * rng.standard_normal((3, 3))).ravel(),
            0.02 * rng.standard_normal(3),
            (np.eye(3) + 0.03 * rng.standard_normal((3, 3))).ravel(),
            0.5 * rng.standard_normal(3),
            0.05 * rng.standard_normal(9),
        )
    )
    root = np.zeros((33, 33))
    root[FREE] = 1e-4 * size[FREE, np.newaxis] * rng.standard_normal((30, 33))
    made = Calibration(
        values,
        root @ root.T,
        np.ones(33, dtype=bool),
        *units,
        **{"gravity": GRAVITY, "rate": RATE, **fields},
    )
    return with_rests(made, rests, rng) if rests else made


def with_rests(made, count, rng):
    """Return a calibration with rests and turns between them, of which one each was not used."""
    per_g = convert(made.gravity, "m/s^2", made.accel_units[1])
    rests, turns = [], []
    for i in range(count):
        up = rng.standard_normal(3)
        up /= np.linalg.norm(up)
        error, odd = 3e-4 * rng.standard_normal(), i == 2
        accel = raw_accel(made, per_g * (1.0 + error) * up)
        why = "its mean moved by 12 mg" if odd else ""
        span = (8.0 * i, 8.0 * i + 6.0, 800 * i, 800 * i + 600)
        rests.append(
            Rest(*span, accel, np.zeros(3), np.full(3, 3e-4), up, error, used=not odd, reason=why)
        )
        if i:
            span = (8.0 * i - 2.0, 8.0 * i, 800 * i - 200, 800 * i)
            why = "31 samples of y are saturated" if odd else ""
            angles = rng.uniform(0.8, 2.7), up, abs(rng.normal(0.0, 0.003))
            raw = float(abs(rng.normal(0.0, 0.02)))
            turns.append(
                Turn(*span, (i - 1, i), *angles, used=not odd, reason=why, residual_raw=raw)
            )
    return replace(
        made,
        rests=tuple(rests),
        turns=tuple(turns),
        norm_error=3.1e-4,
        norm_error_raw=0.021,
        carry_error=0.0061,
        carry_error_raw=0.021,
    )


INVALID = {
    "problems": ("the scale of the gyro's x axis is not identifiable", "all poses are within 60°"),
    "advice": ("hold -y up for five seconds",),
}


def raw_accel(made, force):
    """Return what the accelerometer makes of a force in the unit of corrected samples."""
    return force @ made.values[:9].reshape(3, 3).T + made.values[9:12]


def raw_gyro(made, rate, force):
    """Return what the gyro makes of a rate under a force, both as they are corrected."""
    matrix, sensitivity = made.values[12:21].reshape(3, 3), made.values[24:].reshape(3, 3)
    in_g = convert(force, made.accel_units[1], "g")
    return rate @ matrix.T + made.values[21:24] + in_g @ sensitivity.T


def motion(made, n=500, seed=2):
    """Return a rate and a force, shape (n, 3), in the units of corrected samples."""
    rng = np.random.default_rng(seed)
    rate = convert(2.0 * rng.standard_normal((n, 3)), "rad/s", made.gyro_units[1])
    return rate, convert(10.0 * rng.standard_normal((n, 3)), "m/s^2", made.accel_units[1])


def recorded(made, n=500, seed=2):
    """Return a recording of a motion, raw, and the motion itself."""
    rate, force = motion(made, n, seed)
    sensors = {"gyro": raw_gyro(made, rate, force), "accel": raw_accel(made, force)}
    units = {"gyro": made.gyro_units[0], "accel": made.accel_units[0]}
    time = np.arange(n) / RATE
    logs = {
        name: Log(time, RATE, data, [f"{name}_{axis}" for axis in "xyz"], units[name])
        for name, data in sensors.items()
    }
    return Recording(logs, "run.csv"), rate, force


def write_imu(path, recording):
    """Write the logs of a recording, of one clock, as one table."""
    logs = list(recording.values())
    data = np.hstack([log.data for log in logs])
    names = [name for log in logs for name in log.names]
    units = [unit for log in logs for unit in log.units]
    write_log(Log(logs[0].time, logs[0].rate, data, names, units), path)
    return path


def known(unit):
    return unit in UNITS
