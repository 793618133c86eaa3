"""Signals on which metrics are measured."""

import numpy as np

RATE = 100.0


def white(n, *, seed=1, channels=None):
    """White noise of deviation 1, shape (n,) or (n, channels)."""
    return np.random.default_rng(seed).standard_normal(n if channels is None else (n, channels))


def motion(t):
    """A smooth rate at times t."""
    return np.sin(2.0 * t) + 0.5 * np.cos(5.3 * t + 0.4)
