"""Recursive extended least squares with forgetting, in covariance form (FH 8-13)."""

import math

import numpy as np

from oracle.startup import Startup


class LeastSquares:
    """On samples that are centred and scaled; knows nothing at first: zero parameters, P = I."""

    def __init__(self, order, forgetting_factor):
        self.p, self.q = order
        self.size = self.p + self.q + 1
        self.forgetting_factor = forgetting_factor
        self.parameters = np.zeros(self.size)
        self.P = np.eye(self.size)
        self.samples = [0.0] * self.p
        self.residuals = [0.0] * self.q

    @property
    def phi(self):
        return self.parameters[: self.p]

    def observe(self, y):
        if math.isfinite(y):
            residual = self.learn(y)
        else:
            y, residual = self.samples[0], 0.0
        self.samples = [y, *self.samples[:-1]]
        self.residuals = [residual, *self.residuals][: self.q]
        return residual

    def learn(self, y):
        P = self.P
        f = np.array([*self.samples, *self.residuals, 1.0])
        forgetting = self.bounded_forgetting()
        fP = f @ P
        g = P @ f / (forgetting + fP @ f)
        self.parameters = self.parameters + g * (y - f @ self.parameters)
        P = (P - g[:, None] * fP) / forgetting
        self.P = (P + P.T) / 2.0
        return y - f @ self.parameters

    def bounded_forgetting(self):
        """The forgetting factor, or the smallest one with which P keeps the trace it began with."""
        return min(max(self.forgetting_factor, self.P.trace() / self.size), 1.0)


class RecursiveLeastSquares:
    """On raw samples."""

    def __init__(self, order, forgetting_factor=1.0, startup=100, scale=None):
        self.startup = Startup(startup, scale)
        self.model = LeastSquares(order, forgetting_factor)
        self.running = False

    def update(self, z):
        if self.running:
            residual = self.model.observe((z - self.offset) / self.scale)
            return residual * self.scale
        self.startup.observe(z)
        if self.startup.finished:
            self.running = True
            self.offset, self.scale = self.startup.mean, self.startup.scale
        return z - self.startup.mean if np.isfinite(z) else 0.0

    @property
    def coefficients(self):
        if not self.running:
            return np.append(np.zeros(self.model.size - 1), self.startup.mean)
        return raw_coefficients(self.model, self.offset, self.scale)


def raw_coefficients(model, offset, scale):
    """``[φ, θ, c]`` of the samples as they came: the constant has their unit and offset."""
    coefficients = model.parameters.copy()
    coefficients[-1] = model.parameters[-1] * scale + (1.0 - model.phi.sum()) * offset
    return coefficients
