"""Random walks of many strengths, each with its Kalman filter, weighed by their likelihoods."""

import numpy as np
from scipy.special import softmax
from scipy.stats import t as student

NO_DRIFT = 0.3
RATIOS = np.array([0.0, *10.0 ** np.arange(-8.0, 2.1, 0.5)])
PRIOR = np.array([NO_DRIFT, *np.full(RATIOS.size - 1, (1.0 - NO_DRIFT) / (RATIOS.size - 1))])
KEPT = 1.0 - 1.0 / 500.0
DEGREES = 2.0


class Walks:
    def __init__(self, noise):
        """``noise`` is the variance of the white noise of a full block's mean."""
        self.q = RATIOS * noise
        self.x = np.zeros(RATIOS.size)
        self.P = np.zeros(RATIOS.size)
        self.degrees = DEGREES
        self.squares = np.full(RATIOS.size, DEGREES)
        self.evidence = np.zeros(RATIOS.size)
        self.weight = PRIOR

    @property
    def scale(self):
        return self.squares / self.degrees

    def begin(self, mean, variance):
        self.x = np.full(RATIOS.size, mean)
        self.P = np.full(RATIOS.size, variance)

    def wait(self, time):
        self.P = self.P + self.q * time

    def step(self, mean, noise, time):
        """Drift at the end of a block, its variance, and the innovation with its own.

        The drift walks on inside the block: P + qt at its end, P + qt/3 on its mean, and P + qt/2
        in common.
        """
        walked = self.q * time
        S = self.P + walked / 3.0 + noise
        C = self.P + walked / 2.0
        e = mean - self.x
        # P + qt - C^2/S, put together without the terms that cancel.
        left = self.P * walked / 3.0 + walked**2 / 12.0 + (self.P + walked) * noise
        return self.x + C / S * e, left / S, e, S

    def drift(self, block=None):
        """Mean and variance of the mixture with what there is of a block, and the mean of P."""
        x, P = (self.x, self.P) if block is None else self.step(*block)[:2]
        mean = self.weight @ x
        return mean, self.weight @ (P * self.scale + (x - mean) ** 2), self.weight @ P

    def correct(self, block):
        x, P, e, S = self.step(*block)
        likelihood = student.logpdf(e, self.degrees, scale=np.sqrt(S * self.scale))
        self.evidence = KEPT * self.evidence + likelihood
        best = self.evidence.max()
        self.evidence = self.evidence - best
        self.squares = KEPT * self.squares + e**2 / S
        self.degrees = KEPT * self.degrees + 1.0
        self.x, self.P = x, P
        self.weight = softmax(np.log(PRIOR) + self.evidence)
        return best

    @property
    def process_noise(self):
        return self.weight @ (self.q * self.scale)
