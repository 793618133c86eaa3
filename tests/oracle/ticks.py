"""Samples gathered to ticks of a quarter second, for a sensor that never moves."""

import math
from dataclasses import dataclass

import numpy as np


@dataclass
class Tick:
    present: int
    mean: float
    variance: float
    event: str | None = None


class Ticks:
    def __init__(self, rate):
        self.length = max(math.floor(rate / 4.0 + 0.5), 1)
        self.reset()

    def reset(self):
        self.samples = []

    def observe(self, z):
        """The tick that a sample completes."""
        self.samples.append(z)
        if len(self.samples) < self.length:
            return None
        samples, self.samples = np.array(self.samples), []
        return tick(samples[np.isfinite(samples)])


def tick(samples):
    if samples.size == 0:
        return Tick(0, 0.0, 0.0)
    # From the first one on, so that a large offset costs no digits.
    differences = samples - samples[0]
    mean = float(samples[0] + differences.mean())
    return Tick(samples.size, mean, float(differences.var()))
