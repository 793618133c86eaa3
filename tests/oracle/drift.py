"""The whole drift filter, sample by sample."""

import math

import numpy as np

from oracle.allan_noise import AllanNoise
from oracle.kalman import (
    companion,
    guarded_sage_husa,
    large,
    settled,
    settled_prediction,
    step,
)
from oracle.least_squares import LeastSquares, raw_coefficients
from oracle.startup import Startup
from oracle.watch import PERIOD, Watch

# In variances of the start-up window.
FLOOR = 1e-12
# The largest coefficient of a stationary autoregression of order three.
COEFFICIENT_MAX = 3.0
STARTUP_MIN = 10
# Normalised samples that a filter expects before it has seen any.
PEAK = 5.0


class DriftFilter:
    """Takes the parameters of ``zerorate.DriftFilter``."""

    def __init__(
        self,
        rate,
        order=(2, 1),
        method="fading",
        fading=0.97,
        adapt_for=120.0,
        forgetting_factor=1.0,
        *,
        process_noise=0.1,
        process_noise_memory=0.0,
        noise="allan",
        startup=1.0,
        scale=None,
        start=None,
    ):
        self.arguments = {name: value for name, value in locals().items() if name != "self"}
        self.told = scale is not None or start is not None
        self.watch, self.seen = Watch(), 0
        size = order[0] + 1
        self.method = method
        self.initial = process_noise
        self.startup = Startup(max(round(startup * rate), STARTUP_MIN), scale)
        self.learning_left = np.inf if adapt_for is None else round(adapt_for * rate)
        self.model = LeastSquares(order, forgetting_factor)
        self.noise = AllanNoise(fading if method == "fading" else 1.0, noise)
        self.x = np.zeros(size)
        self.P = self.G = np.eye(size) * max(process_noise, FLOOR)
        self.k = process_noise_memory
        self.running = False
        if start is not None:
            self.know(start)

    def know(self, start):
        """Stands where ``start`` says, R and k as after the start-up that it spares."""
        self.offset, self.scale = start["offset"], start["scale"]
        variance = self.scale**2
        *slopes, constant = start["coefficients"]
        rest = 1.0 - np.sum(slopes[: self.model.p])
        constant = (constant - rest * self.offset) / self.scale
        self.model.parameters = np.array([*slopes, constant])
        P = np.array(start["covariance"])
        self.model.P = P / max(np.trace(P) / len(P), 1.0)
        self.noise.believe(start["measurement_noise"] / variance, self.startup.window)
        self.x[-1] = constant
        self.P = np.array(start["state_covariance"]) / variance
        self.G = np.eye(len(self.x)) * FLOOR
        self.G[0, 0] = max(start["process_noise"] / variance, FLOOR)
        self.k += self.startup.window
        self.peak = PEAK
        self.running = True

    def trace(self, z):
        """All that is known after each sample, as arrays by name."""
        steps = [self.update(sample) for sample in z.tolist()]
        return {name: np.array([now[name] for now in steps]) for name in steps[0]}

    def update(self, z):
        missing = not math.isfinite(z)
        self.k += not missing
        self.seen += 1
        if not self.running:
            return {**self.start(z), "missing": missing, "guarded": False}
        y = (z - self.offset) / self.scale
        guarded = self.filter(np.nan if missing else y)
        reading = {**self.reading(), "missing": missing, "guarded": guarded}
        looks = not self.told and self.seen % PERIOD == 0
        if looks and self.watch.disproves(z, self.scale):
            reading = self.start_anew(reading)
        return reading

    def start_anew(self, reading):
        """Forgets all but the estimate."""
        seen = self.seen
        self.__init__(**self.arguments)
        self.seen = seen
        known = self.startup_reading(0.0, False)
        return {**known, "estimate": reading["estimate"], "missing": False, "guarded": False}

    def filter(self, y):
        """One sample, centred and scaled; answers whether the guard acted."""
        if self.method != "kf":
            self.noise.observe(y)
        guarded = self.correct(y)
        if self.learning_left > 0:
            self.learning_left -= 1
            self.model.observe(y)
        if math.isfinite(y):
            self.peak = max(self.peak, abs(y))
        return guarded

    def correct(self, y):
        A = companion(np.minimum(np.maximum(self.model.phi, -COEFFICIENT_MAX), COEFFICIENT_MAX))
        R = max(self.noise.variance, FLOOR)
        carried = A @ self.P @ A.T
        prior = carried + self.G
        is_large = large(prior, self.P)
        if is_large:
            prior = settled_prediction(prior, A, self.P)
        self.last = step(self.x, prior, A, R, y, self.peak)
        self.x, self.P = self.last.x, self.last.P
        if self.method != "fading":
            return False
        guarded = False
        if math.isfinite(y):
            self.G, guarded = guarded_sage_husa(self.G, self.k, self.last, carried, FLOOR)
        if is_large:
            self.G = settled(settled(self.G))
        return guarded

    def reading(self):
        variance = self.scale**2
        return {
            "estimate": self.offset + self.scale * self.x[0],
            "innovation": self.scale * self.last.e,
            "innovation_variance": variance * self.last.S,
            "gain": self.last.K,
            "measurement_noise": variance * max(self.noise.variance, FLOOR),
            "process_noise": variance * self.G,
            "coefficients": raw_coefficients(self.model, self.offset, self.scale),
            "covariance": variance * self.P,
        }

    def start(self, z):
        """A sample of the start-up, whose answer is the mean so far."""
        innovation = z - self.startup.mean if np.isfinite(z) else 0.0
        self.startup.observe(z)
        self.noise.observe(z)
        if self.startup.finished:
            return self.begin(innovation)
        return self.startup_reading(innovation, np.isfinite(z))

    def startup_reading(self, innovation, seen):
        known, unit = self.startup, self.startup.unit
        identity = np.eye(len(self.x))
        return {
            "estimate": known.mean,
            "innovation": innovation,
            "innovation_variance": known.variance,
            "gain": identity[0] * (1.0 / len(known.samples) if seen else 0.0),
            "measurement_noise": known.variance
            if known.spoilt
            else max(self.noise.variance, FLOOR * unit**2),
            "process_noise": identity * self.initial * known.variance,
            "coefficients": np.append(np.zeros(self.model.size - 1), known.mean),
            "covariance": identity * self.initial * known.variance,
        }

    def begin(self, innovation):
        """The last sample of the start-up: from now on samples are centred and scaled."""
        self.offset, self.scale = self.startup.mean, self.startup.scale
        variance = self.scale**2
        if self.startup.spoilt:
            self.peak = PEAK
            self.noise.previous = [np.nan, np.nan]
            self.noise.believe(self.startup.variance / variance, len(self.startup.samples))
        else:
            self.peak = self.startup.peak
            self.noise.variance /= variance
            self.noise.previous = [(z - self.offset) / self.scale for z in self.noise.previous]
        self.running = True
        return {
            "estimate": self.offset,
            "innovation": innovation,
            "innovation_variance": variance,
            "gain": np.zeros(len(self.x)),
            "measurement_noise": variance * max(self.noise.variance, FLOOR),
            "process_noise": variance * self.G,
            "coefficients": np.append(np.zeros(self.model.size - 1), self.offset),
            "covariance": variance * self.P,
        }
