"""Fully overlapping Allan and Hadamard deviations, every difference from the samples themselves."""

from math import comb

import numpy as np


class StreamingAllan:
    def __init__(self, octaves):
        self.octaves = octaves
        self.samples = []

    def observe(self, z):
        self.samples.append(z if np.isfinite(z) else np.nan)

    def deviation(self):
        """Deviations and numbers of terms at 1, 2, 4, ... samples."""
        return self.of_order(1)

    def hadamard_deviation(self):
        return self.of_order(2)

    def of_order(self, order):
        pairs = [self.at(2**j, order) for j in range(self.octaves)]
        return np.array([d for d, _ in pairs]), np.array([terms for _, terms in pairs])

    def at(self, m, order):
        """Differences of ``order`` of the averages of m samples, at every sample that has them."""
        z = np.array(self.samples)
        length = (order + 1) * m
        if len(z) < length:
            return np.nan, 0
        windows = np.lib.stride_tricks.sliding_window_view(z, length)
        windows = windows[np.isfinite(windows).all(axis=1)]
        if len(windows) == 0:
            return np.nan, 0
        # Distances from each window's own first sample: differences do not see them.
        near = windows - windows[:, :1]
        averages = near.reshape(len(near), order + 1, m).mean(axis=2)
        squares = np.diff(averages, n=order, axis=1) ** 2
        # White averages of unit variance have differences of this variance: 2 and 6.
        return np.sqrt(squares.mean() / comb(2 * order, order)), len(windows)
