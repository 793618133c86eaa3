"""Measurement noise from the Allan variance with fading memory (FH 17, 18, 26-31)."""

import math

import numpy as np


class AllanNoise:
    def __init__(self, fading, kind="allan"):
        self.fading = fading
        self.kind = kind
        self.weight = 1.0
        self.variance = 0.0
        self.previous = [np.nan, np.nan]

    def believe(self, variance, samples):
        """Stands at ``variance``, with the weight that so many samples leave."""
        self.variance, self.weight = variance, 1.0
        for _ in range(samples - (1 if self.kind == "allan" else 2)):
            self.weight = self.weight / (self.weight + self.fading)

    def observe(self, z):
        square = self.squared_difference(z)
        if math.isfinite(square):
            self.variance = (1.0 - self.weight) * self.variance + self.weight * square
            self.weight = self.weight / (self.weight + self.fading)
        self.previous = [z if math.isfinite(z) else math.nan, self.previous[0]]

    def squared_difference(self, z):
        last, before = self.previous
        if self.kind == "allan":
            return (z - last) ** 2 / 2.0
        return (z - 2.0 * last + before) ** 2 / 6.0
