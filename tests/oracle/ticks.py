"""Samples gathered to ticks of a quarter second, and what the rest detector says of them."""

from dataclasses import dataclass

import numpy as np

from oracle.rest import RestDetector


@dataclass
class Tick:
    present: int
    mean: float
    variance: float
    event: str | None


class Ticks:
    def __init__(self, rate):
        self.rate = rate
        self.reset()

    @property
    def length(self):
        return self.detector.length

    def reset(self):
        self.detector = RestDetector(self.rate)
        self.samples = []

    def observe(self, z):
        """The tick that a sample completes."""
        at_rest = self.detector.update(z)
        self.samples.append(z)
        if len(self.samples) < self.length:
            return None
        samples, self.samples = np.array(self.samples), []
        if self.detector.swallowed:
            samples = samples[:0]
        event = self.detector.event
        if event == "restart":
            event = "jump" if at_rest else "forget"
        return tick(samples[np.isfinite(samples)], event)


def tick(samples, event):
    if samples.size == 0:
        return Tick(0, 0.0, 0.0, event)
    # From the first one on, so that a large offset costs no digits.
    differences = samples - samples[0]
    mean = float(samples[0] + differences.mean())
    variance = float(differences.var(ddof=1)) if samples.size > 1 else 0.0
    return Tick(samples.size, mean, variance, event)
