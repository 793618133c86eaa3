"""The heading that a magnetometer holds: how it drifts, what iron does, how far it may be off."""

import math

import numpy as np

DEG = math.radians(1.0)
MEAN, RESTED = 10.0, 2.0
SURE, LEAST, PROVEN, STEEPEST_DRIFT = 1.5, 5.0 * DEG, 2.0, 2.0 * DEG
WALK, SOUGHT, BIAS_SIGMA, BIAS_LIMIT = 0.01 * DEG, 0.05 * DEG, DEG, 10.0 * DEG
PLACES, TURNING, FIRST = 60.0, 20.0 * DEG, 3.0 * DEG
LEFT, PLACE, STEEPEST = 0.5 * DEG, 5.0, 10.0
IRON, WALKS, NOISE, KNOWN = 0.4, np.repeat([0.003, 0.0005], 3), 0.2, 0.01
CHANGED, STAYED = 0.3, 30.0


def share_of_places(rate, span):
    return min(span / PLACES * min(rate / TURNING, 1.0), 1.0)


class Drift:
    """Whether the heading drifts, by what field and iron leave for it, and what fires it."""

    def __init__(self):
        self.lag, self.mean, self.since = 0.0, 0.0, MEAN
        self.parts, self.spread = None, FIRST**2
        self.end()

    def end(self):
        self.active, self.with_heading = False, 0.0

    def predict(self, iron, heading, span):
        self.since = min(self.since + span, MEAN)
        if not self.active:
            return 0.0, 0.0
        variance = iron.P[6, 6]
        grown = span**2 * variance - 2.0 * span * self.with_heading
        least = -math.sqrt((heading + grown) * variance)
        self.with_heading = max(self.with_heading - span * variance, least)
        return -span * iron.x[6], grown

    def look(self, parts, weight):
        """The level part of a field and the one down."""
        if self.parts is None:
            self.parts = parts
        self.parts = self.parts + weight * (parts - self.parts)
        apart = np.sum((parts - self.parts) ** 2) / (2.0 * self.parts[0] ** 2)
        self.spread += weight * (min(apart, 1.0) - self.spread)

    def judge(self, e, heading, believed, iron, span):
        """By what the variances of heading and drift grow, if it drifts."""
        # A drift makes a slope; a field that passes by makes a step.
        most = STEEPEST_DRIFT * span
        e = self.lag = self.lag + min(max(e - self.lag, -most), most)
        self.mean += min(span / MEAN, 1.0) * ((e if believed else 0.0) - self.mean)
        usual = max(math.sqrt(heading), LEAST, 2.0 * math.sqrt(self.spread))
        rate, sigma = iron.x[6], math.sqrt(iron.P[6, 6])
        proven = not self.active and abs(rate) > PROVEN * sigma
        lags = believed and self.mean * e > 0.0 and abs(self.mean) > SURE * usual
        if self.since < MEAN * (1.0 - 1e-9) or not (proven or (lags and self.mean * rate <= 0.0)):
            return None
        grown = max(self.mean**2, e**2), (self.mean / MEAN) ** 2
        self.active, self.mean, self.since = True, 0.0, 0.0
        return grown

    def correct(self, gain):
        self.with_heading *= 1.0 - gain

    @property
    def walk(self):
        return WALK if self.active else SOUGHT


class Iron:
    """The earth's field in the frame, that of iron in the sensor, and the frame's drift.

    Fields in units of the first one's strength.
    """

    def __init__(self):
        self.strength, self.apart = None, 0.0
        self.x, self.P = np.zeros(7), np.diag([1.0] * 3 + [IRON**2] * 3 + [BIAS_SIGMA**2])

    def look(self, field, R, span, doubt, walk):
        if self.strength is None:
            self.strength = max(np.linalg.norm(field), 1e-9)
        self.turn(span)
        self.P = self.P + np.diag(np.append(span * WALKS**2, 0.0))
        self.P[6, 6] += max(min(span * walk**2, BIAS_SIGMA**2 - self.P[6, 6]), 0.0)
        if np.linalg.norm(field) > 100.0 * self.strength:
            return
        H = np.hstack([np.eye(3), R, np.zeros((3, 1))])
        fits = [
            self.correct(row, z, NOISE**2 / span * doubt)
            for row, z in zip(H, field / self.strength, strict=True)
        ]
        self.x[6] = np.clip(self.x[6], -BIAS_LIMIT, BIAS_LIMIT)
        self.apart = 0.0 if all(fits) else self.apart + span
        if self.apart >= STAYED:
            self.forget()

    def forget(self):
        self.restart([0, 1, 2], 1.0)
        self.restart([3, 4, 5], IRON**2)
        self.apart = 0.0

    def correct(self, row, z, noise):
        """By a component of the field; whether it is this one."""
        unsure, apart = row @ self.P @ row, z - row @ self.x
        if apart**2 > CHANGED**2 + 9.0 * unsure:
            return False
        K = self.P @ row / (unsure + noise)
        self.x = self.x + K * apart
        self.P = self.P - np.outer(K, K) * (unsure + noise)
        return True

    def restart(self, states, variance):
        self.P[states, :] = self.P[:, states] = self.x[states] = 0.0
        self.P[states, states] = variance

    def turn(self, span):
        """The earth's field turns as the frame drifts."""
        x, y, sine = self.x[0], self.x[1], span * self.x[6]
        F = np.eye(7)
        F[:2, :2] = [[1.0 - 0.5 * sine**2, -sine], [sine, 1.0 - 0.5 * sine**2]]
        self.x = F @ self.x
        F[:2, 6] = -span * y, span * x
        self.P = F @ self.P @ F.T

    def rest(self, variance):
        self.restart([6], variance)

    def learned(self, rate):
        self.x[6] = np.clip(self.x[6] - rate, -BIAS_LIMIT, BIAS_LIMIT)

    def blur(self, variance):
        level = self.x[0] ** 2 + self.x[1] ** 2
        own = self.P[range(2), range(2)]
        self.P[range(2), range(2)] = own + np.minimum(variance * level, np.maximum(10.0 - own, 0.0))


class Deviation:
    """Variance of the heading."""

    def __init__(self, heading):
        self.white, self.own, self.known, self.tilted = 0.0, heading, heading, 0.0
        self.mean, self.places = 0.0, FIRST**2
        self.shares = np.zeros(3)

    def correct(self, gain, R, e, field, tilt, east, weight, span, before, after, strength):
        level = math.hypot(field[0], field[1])
        self.white = (1.0 - gain) ** 2 * self.white + gain**2 * R
        slope = min(abs(field[2]) / level, STEEPEST)
        self.tilted += gain * (slope * math.sqrt(tilt) - self.tilted)
        self.mean += min(span / PLACE, 1.0) * (e - self.mean)
        self.places += weight * (self.mean**2 - self.places)
        own = (1.0 - gain) ** 2 * self.since_field(before)
        self.own = min(own, max(after - self.white, 0.0), self.places + LEFT**2)
        self.known = after
        self.shares = self.shares + gain * (east / level * strength - self.shares)

    def since_field(self, heading):
        return max(self.own + heading - self.known, 0.0)

    def variance(self, heading, iron):
        a, h = self.shares, iron.x[3:6]
        unsure = min(a @ iron.P[3:6, 3:6] @ a, KNOWN**2 * a @ a)
        own = max(self.since_field(heading), self.places)
        return min(own + LEFT**2 + self.tilted**2 + (a @ h) ** 2 + unsure, 10.0)
