"""Offset and scale of a signal: mean and deviation of its first samples."""

from functools import cached_property

import numpy as np

from oracle.sketch import Sketch

TELLING = 8
# Variance of a mean of normal variables over that of their median.
MEDIAN_WORTH = 2.0 / np.pi
SPOILT, LOST = 4.0, 1e-3


class Startup:
    """Collects finite samples until there are enough of them and two of them differ.

    Where a few are far from all others, median and median distance stand for mean and deviation.
    """

    def __init__(self, window, known_scale=None):
        self.window = window
        self.known_scale = known_scale
        self.samples = []
        self.sketch = Sketch()

    def observe(self, z):
        if np.isfinite(z):
            self.samples.append(z)
            self.sketch.insert(z)
            for name in ("spoilt", "variance", "differences"):
                vars(self).pop(name, None)

    @cached_property
    def spoilt(self):
        if len(self.samples) < TELLING or not self.sketch.deviation > 0.0:
            return False
        ratio = np.sqrt(np.var(self.differences, ddof=1)) / self.sketch.deviation
        return ratio > SPOILT or ratio < LOST

    @property
    def finished(self):
        return len(self.samples) >= self.window and self.scale > 0.0

    @property
    def mean(self):
        if self.spoilt:
            return self.sketch.median
        # From the first sample on, so that a large offset costs no digits.
        first = self.samples[0] if self.samples else 0.0
        return first + np.mean(self.differences) if self.samples else 0.0

    @cached_property
    def variance(self):
        if self.spoilt:
            return self.sketch.deviation**2
        return np.var(self.differences, ddof=1) if len(self.samples) > 1 else 0.0

    @property
    def scale(self):
        return np.sqrt(self.variance) if self.known_scale is None else self.known_scale

    @property
    def worth(self):
        """Samples whose mean would be as exact as this one."""
        return len(self.sketch.kept) * MEDIAN_WORTH if self.spoilt else len(self.samples)

    @property
    def unit(self):
        """What variances are counted in as long as the scale is not known."""
        if self.known_scale is not None:
            return self.known_scale if self.samples else 0.0
        unequal = self.differences[self.differences != 0.0]
        return abs(unequal[0]) if unequal.size else 0.0

    @property
    def peak(self):
        """A bound of all samples so far, centred and scaled."""
        largest = np.max(np.abs(self.differences))
        return (largest + abs(np.mean(self.differences))) / self.scale

    @cached_property
    def differences(self):
        samples = np.array(self.samples)
        return samples - samples[0] if self.samples else samples
