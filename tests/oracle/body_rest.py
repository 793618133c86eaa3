"""Rest of a body, from tick to tick, by its gyro and its accelerometer."""

import math

import numpy as np

# How far samples lie from the means of half a second, rad/s and m/s^2.
GYRO, ACCEL, MEAN = math.radians(2.0), 0.5, 0.5
# Seconds until it counts, near the bias known and far from it.
NEAR, FAR = 1.5, 10.0


class BodyRest:
    def __init__(self):
        self.gyro = self.accel = self.first = None
        self.since = 0.0

    def observe(self, tick, bias):
        """Returns "motion", "rest", or "far": a rest at a rate that is not the bias."""
        if tick.unknown > 0.0 or not tick.forces:
            self.since = 0.0
            return "motion"
        if self.gyro is None:
            self.gyro, self.accel, self.first = tick.gyro, tick.accel, tick.accel
        square_gyro = np.mean(np.sum((tick.samples.gyro - self.gyro) ** 2, axis=1))
        square_accel = np.nanmean(np.sum((tick.samples.accel - self.accel) ** 2, axis=1))
        weight = min(tick.span / MEAN, 1.0)
        self.gyro = self.gyro + weight * (tick.gyro - self.gyro)
        self.accel = self.accel + weight * (tick.accel - self.accel)
        moved = np.sum((self.accel - self.first) ** 2)
        if square_gyro > GYRO**2 or max(square_accel, moved) > ACCEL**2:
            self.since, self.first = 0.0, self.accel
            return "motion"
        self.since += tick.span
        if np.sum((self.gyro - bias) ** 2) > GYRO**2:
            return "far" if self.since >= FAR else "motion"
        return "rest" if self.since >= NEAR else "motion"
