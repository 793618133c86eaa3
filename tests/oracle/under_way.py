"""The velocity of a body that is under way."""

import numpy as np

SLOW, LASTS, MEMORY = 1.5, 6.0, 5.0
SHARE, SWINGS = 0.3, 0.1


class UnderWay:
    """Means of the velocity over seconds: over the ground, and turning with the body."""

    def __init__(self, first=1.0):
        self.ground, self.body = np.zeros(2), np.zeros(3)
        self.over_ground = self.with_body = 0.0
        self.first = first

    def observe(self, v, R, span):
        seen = min(span / SLOW, 1.0)
        self.ground = self.ground + seen * (v - self.ground)
        self.body = self.body + seen * (R.T @ np.append(v, 0.0) - self.body)
        kept = min(span / MEMORY, 1.0)
        self.over_ground += kept * (0.5 * self.ground @ self.ground - self.over_ground)
        self.with_body += kept * (0.5 * self.body @ self.body - self.with_body)
        self.first *= 1.0 - kept

    @property
    def walk(self):
        return 2.0 / LASTS * (self.over_ground + self.first)

    @property
    def turning(self):
        return 2.0 * LASTS * max(self.with_body - self.over_ground, 0.0)

    def doubt(self, noise):
        """How much larger the variance of the tilt is than the filter's own."""
        slow = 2.0 * LASTS * max(min(self.over_ground / noise, 1.0) - SWINGS, 0.0)
        return SHARE + (1.0 - SHARE) * self.first + slow
