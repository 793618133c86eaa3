"""The drift filter that tunes itself, sample by sample."""

import math

import numpy as np

from oracle.learned import Learned
from oracle.startup import Startup
from oracle.ticks import Ticks

STARTUP_MIN = 10


class AutoFilter:
    """Takes the parameters of ``zerorate.DriftFilter(method="auto")`` that it uses."""

    def __init__(self, rate, motion="hold", startup=1.0, scale=None, detector=Ticks):
        self.hold = motion == "hold"
        self.window = max(math.floor(startup * rate + 0.5), STARTUP_MIN)
        self.known_scale = scale
        self.detector = detector(rate)
        self.startup = Startup(self.window, scale)
        self.learned = None
        self.status = "starting"
        self.experienced = False
        self.reach = 0.0
        self.known = {"estimate": 0.0}

    def trace(self, z):
        """All that is known after each sample, as arrays by name."""
        steps = [self.update(sample) for sample in z]
        return {name: np.array([now[name] for now in steps]) for name in steps[0]}

    def update(self, z):
        missing = not np.isfinite(z)
        innovation = 0.0 if missing else z - self.known["estimate"]
        self.reach = self.reach if missing else max(self.reach, abs(z))
        if self.status == "starting":
            self.startup.observe(z)
        tick = self.detector.observe(z)
        if tick is not None:
            self.take(tick)
        if tick is not None or self.begins:
            self.known = self.reading()
        gain = self.known["gain"] if self.learns and not missing else 0.0
        return {**self.known, "innovation": innovation, "gain": gain, "missing": missing}

    @property
    def begins(self):
        return self.status in ("starting", "no rest yet")

    @property
    def learns(self):
        return self.status in ("starting", "at rest")

    def reading(self):
        noise = {"measurement_noise": self.startup.variance, "process_noise": 0.0, "gain": 0.0}
        drift = {"estimate": self.startup.mean, "bias_sigma": self.startup_sigma}
        if self.learned is not None:
            noise = self.learned.noises()
            drift = drift if self.begins else self.learned.drift()
        variance = drift["bias_sigma"] ** 2
        return {
            **noise,
            **drift,
            "bias": drift["estimate"],
            "covariance": variance,
            "innovation_variance": noise["measurement_noise"] + variance,
            "coefficients": 1.0,
            "at_rest": self.learns,
        }

    @property
    def startup_sigma(self):
        samples = len(self.startup.samples)
        return np.sqrt(self.startup.variance / samples) if samples > 1 else self.reach

    def power_on(self):
        self.experienced = self.learned is not None
        self.detector.reset()
        self.forget()
        self.status = "starting"
        self.known = self.reading()

    def take(self, tick):
        if self.hold and tick.event is not None:
            getattr(self, tick.event)(tick)
        if self.hold and tick.event == "jump":
            return
        if self.status == "starting" and self.startup.finished:
            self.finish_startup()
        elif self.status == "at rest":
            self.learned.learn(tick)
        elif self.status == "in motion":
            self.learned.wait()

    def rest(self, tick):
        self.status = "starting" if self.begins else "at rest"

    def motion(self, tick):
        if self.begins:
            self.forget()
        else:
            self.status = "in motion"

    def forget(self, tick=None):
        self.startup = Startup(self.window, self.known_scale)
        if not self.experienced:
            self.learned = None
        self.status = "no rest yet"

    def jump(self, tick):
        if self.begins:
            self.startup = Startup(self.window, self.known_scale)
            self.status = "starting"
        else:
            self.learned.begin(tick.mean, tick.present)
            self.status = "at rest"

    def finish_startup(self):
        offset, samples = self.startup.mean, len(self.startup.samples)
        if self.learned is None:
            self.learned = Learned(offset, self.startup.scale, self.detector.length, samples)
        else:
            self.learned.begin(offset, samples)
        self.status = "at rest"
