"""The heading that a magnetometer holds: how it drifts, and how far it may be off."""

import math

import numpy as np

DEG = math.radians(1.0)
MEAN, RESTED = 10.0, 2.0
SURE, LEAST, WALK = 1.5, 5.0 * DEG, 0.01 * DEG
PLACES, TURNING, FIRST = 60.0, 20.0 * DEG, 3.0 * DEG
LEFT, PLACE, STEEPEST = 0.5 * DEG, 5.0, 10.0
IRON, WALKS, NOISE, KNOWN = 0.4, np.repeat([0.003, 0.0005], 3), 0.2, 0.01


def share_of_places(rate, span):
    return min(span / PLACES * min(rate / TURNING, 1.0), 1.0)


class Drift:
    """A bias of the heading's own, and what fires it."""

    def __init__(self):
        self.mean, self.since = 0.0, MEAN
        self.parts, self.spread = None, FIRST**2
        self.end()

    def end(self):
        self.active = False
        self.bias, self.P, self.with_heading = np.zeros(3), np.zeros((3, 3)), np.zeros(3)

    def predict(self, up, span):
        self.since = min(self.since + span, MEAN)
        if not self.active:
            return 0.0, 0.0
        grown = span**2 * up @ self.P @ up - 2.0 * span * up @ self.with_heading
        self.with_heading = self.with_heading - span * self.P @ up
        self.P = self.P + span * WALK**2 * np.eye(3)
        return -span * up @ self.bias, grown

    def look(self, parts, weight):
        """The level part of a field and the one down."""
        if self.parts is None:
            self.parts = parts
        self.parts = self.parts + weight * (parts - self.parts)
        apart = np.sum((parts - self.parts) ** 2) / (2.0 * self.parts[0] ** 2)
        self.spread += weight * (min(apart, 1.0) - self.spread)

    def judge(self, e, heading, believed, up, span):
        self.mean += min(span / MEAN, 1.0) * ((e if believed else 0.0) - self.mean)
        usual = max(math.sqrt(heading), LEAST, 2.0 * math.sqrt(self.spread))
        if (
            not believed
            or self.since < MEAN * (1.0 - 1e-9)
            or self.mean * e <= 0.0
            or abs(self.mean) <= SURE * usual
        ):
            return 0.0
        grown = max(self.mean**2, e**2)
        self.P = self.P + (self.mean / MEAN) ** 2 * np.outer(up, up) + WALK**2 * np.eye(3)
        self.active, self.mean, self.since = True, 0.0, 0.0
        return grown

    def correct(self, e, variance, gain):
        if self.active:
            self.bias = np.clip(self.bias + self.with_heading * e / variance, -10.0, 10.0)
            self.P = self.P - np.outer(self.with_heading, self.with_heading) / variance
            self.with_heading = (1.0 - gain) * self.with_heading

    def learned(self, by):
        if self.active and np.linalg.norm(self.bias - by) < np.linalg.norm(self.bias):
            self.bias = self.bias - by


class Deviation:
    """Variance of the heading; in units of the first field's strength."""

    def __init__(self, heading):
        self.white, self.own, self.known, self.tilted = 0.0, heading, heading, 0.0
        self.mean, self.places = 0.0, FIRST**2
        self.strength = None
        # The field of the earth, in the frame, and of iron, in the sensor.
        self.x, self.P = np.zeros(6), np.diag([1.0] * 3 + [IRON**2] * 3)
        self.shares = np.zeros(3)

    def look(self, field, R, span, doubt):
        if self.strength is None:
            self.strength = max(np.linalg.norm(field), 1e-9)
        if np.linalg.norm(field) > 100.0 * self.strength:
            return
        self.P = self.P + np.diag(span * WALKS**2)
        H = np.hstack([np.eye(3), R])
        S = H @ self.P @ H.T + NOISE**2 / span * doubt * np.eye(3)
        K = np.linalg.solve(S, H @ self.P).T
        self.x = self.x + K @ (field / self.strength - H @ self.x)
        self.P = self.P - K @ S @ K.T

    def correct(self, gain, R, e, field, tilt, east, weight, span, before, after):
        level = math.hypot(field[0], field[1])
        self.white = (1.0 - gain) ** 2 * self.white + gain**2 * R
        slope = min(abs(field[2]) / level, STEEPEST)
        self.tilted += gain * (slope * math.sqrt(tilt) - self.tilted)
        self.mean += min(span / PLACE, 1.0) * (e - self.mean)
        self.places += weight * (self.mean**2 - self.places)
        own = (1.0 - gain) ** 2 * self.since_field(before)
        self.own = min(own, max(after - self.white, 0.0), self.places + LEFT**2)
        self.known = after
        self.shares = self.shares + gain * (east / level * (self.strength or 1.0) - self.shares)

    def since_field(self, heading):
        return max(self.own + heading - self.known, 0.0)

    def variance(self, heading):
        a, h = self.shares, self.x[3:]
        unsure = min(a @ self.P[3:, 3:] @ a, KNOWN**2 * a @ a)
        own = max(self.since_field(heading), self.places)
        return min(own + LEFT**2 + self.tilted**2 + (a @ h) ** 2 + unsure, 10.0)
