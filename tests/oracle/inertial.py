"""Samples of an IMU as an attitude filter takes them: what is missing, held or unknown."""

import math
from dataclasses import dataclass, fields

import numpy as np

# Seconds for which the last rate stands for missing ones; above which a time is a gap.
HELD, GAP, GAP_MAX = 0.05, 1.0, 1e9
# A gyro that may be at rest, rad/s; seconds of its zeros that count at most, and from how many on
# zeros are a rate after a low one, and after any.
SLOW, ZEROS_MOST, AFTER_REST, AFTER_MOTION = math.radians(5.0), 4.0, -2.0, 0.5
# Periods that are more than jitter.
LONG = 1.5


@dataclass
class Samples:
    """Arrays over n samples; rows of NaN where a force or a field is missing."""

    gyro: np.ndarray
    known: np.ndarray
    unknown: np.ndarray
    # Seconds since the last known rate, 0 where it is this one.
    age: np.ndarray
    accel: np.ndarray
    mag: np.ndarray
    dt: np.ndarray
    # Seconds of the gap before the sample, 0 if there is none.
    gap: np.ndarray
    # The magnetometer as it was given, whatever is left out of it.
    seen: np.ndarray

    def __len__(self):
        return len(self.dt)

    def __getitem__(self, part):
        return Samples(*(getattr(self, field.name)[part] for field in fields(self)))


def measured(vectors, n, most, least=0.0):
    """Rows of NaN for what is no such measurement."""
    if vectors is None:
        return np.full((n, 3), np.nan)
    with np.errstate(over="ignore", invalid="ignore"):
        size = np.sqrt(np.sum(np.asarray(vectors) ** 2, axis=1))
        return np.where(((size >= least) & (size <= most))[:, None], vectors, np.nan)


def without_zeros(given, dt):
    """Rates in which zeros that stand for missing samples are NaN.

    Zeros of a sensor that is slow, less its samples that are none, tell whether it has any at rest.
    """
    given, zeros, last = given.copy(), 0.0, 0.0
    for k, size in enumerate(np.sqrt(np.sum(given**2, axis=1))):
        if not size <= SLOW:
            last = last if math.isnan(size) else size
        elif size > 0.0:
            zeros, last = max(zeros - dt[k], -ZEROS_MOST), size
        else:
            is_rate = zeros > (AFTER_REST if last <= SLOW else AFTER_MOTION)
            zeros = min(zeros + dt[k], ZEROS_MOST)
            given[k], last = (0.0, 0.0) if is_rate else (np.nan, last)
    return given


def prepared(rate, gyro, accel, mag, dt):
    n = len(gyro)
    accel, mag = measured(accel, n, 1e3, 1e-9), measured(mag, n, 1e9, 1e-9)
    dt = np.full(n, 1.0 / rate) if dt is None else np.where(dt >= 0.0, dt, 1.0 / rate)
    # Over a gap nothing is known.
    given = without_zeros(measured(gyro, n, 1e3), np.where(dt > GAP, 0.0, dt))
    rates, known, unknown, gap = np.zeros((n, 3)), np.ones(n, bool), np.zeros(n), np.zeros(n)
    age, last, since = np.zeros(n), np.zeros(3), math.inf
    for k, time in enumerate(dt):
        present = not math.isnan(given[k, 0])
        rates[k], before = (given[k] if present else last), last
        if present and time <= LONG / rate:
            since = 0.0
        elif present:
            # The mean of two that are known, but for the time after the first that is too long.
            rates[k] = 0.5 * (before + given[k])
            unknown[k], since = max(time - HELD, 0.0), 0.0
        else:
            unknown[k] = min(max(since + time - HELD, 0.0), time)
            since += time
            known[k], age[k] = since <= HELD, since
        last = given[k] if present else last
        if time > GAP:
            # Nothing is integrated over a gap.
            gap[k], dt[k], unknown[k], rates[k] = min(time, GAP_MAX), 0.0, 0.0, last
    gap[0] = 0.0
    return Samples(rates, known, unknown, age, accel, mag, dt, gap, mag)
