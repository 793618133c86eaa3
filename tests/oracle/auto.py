"""The drift filter that tunes itself, sample by sample."""

import math

import numpy as np

from oracle.learned import Learned
from oracle.startup import Startup
from oracle.ticks import Ticks
from oracle.watch import LOUDER_TICK, Watch

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
        self.watch = Watch()
        self.status = "starting"
        self.experienced = False
        self.reach = 0.0
        self.known = {"estimate": 0.0}

    def trace(self, z):
        """All that is known after each sample, as arrays by name."""
        steps = [self.update(sample) for sample in z.tolist()]
        return {name: np.array([now[name] for now in steps]) for name in steps[0]}

    def update(self, z):
        missing = not math.isfinite(z)
        used = self.learns and not missing
        innovation = z - self.known["estimate"] if used else 0.0
        self.reach = self.reach if missing else max(self.reach, abs(z))
        if self.status == "starting":
            self.startup.observe(z)
        elif used:
            self.follow(innovation)
        tick = self.detector.observe(z)
        if tick is not None:
            self.take(tick)
        if tick is not None or self.begins:
            self.known = self.reading()
        gain = 0.0 if missing else self.known["gain"]
        return {**self.known, "innovation": innovation, "gain": gain, "missing": missing}

    def follow(self, innovation):
        """Until the tick is judged, by no more than four deviations."""
        most = self.known["most"]
        estimate = self.known["estimate"] + self.known["gain"] * min(max(innovation, -most), most)
        self.known = {**self.known, "estimate": estimate, "bias": estimate}

    @property
    def begins(self):
        return self.status in ("starting", "no rest yet")

    @property
    def learns(self):
        return self.status in ("starting", "at rest")

    def reading(self):
        noise = {"measurement_noise": self.startup.variance, "process_noise": 0.0}
        drift = {"estimate": self.startup.mean, "bias_sigma": self.startup_sigma, "gain": 0.0}
        if self.learned is not None:
            noise = self.learned.noises()
            drift = drift if self.begins else self.learned.drift()
        drift["gain"] *= self.learns
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
        if self.disproves(tick):
            self.startup = Startup(self.window, self.known_scale)
            self.learned, self.experienced, self.watch = None, False, Watch()
            self.status = "starting"
        elif self.status == "starting" and self.startup.finished:
            self.finish_startup()
        elif self.status == "at rest":
            self.learned.learn(tick)
        elif self.status == "in motion":
            self.learned.wait()

    def disproves(self, tick):
        told = self.known_scale is not None
        if told or self.learned is None or self.status != "at rest":
            return False
        return self.watch.judge(np.sqrt(tick.variance), self.learned.scale, LOUDER_TICK)

    def rest(self, tick):
        if self.begins or self.learned is None:
            self.status = "starting"
            return
        if self.learned.is_another(tick):
            self.learned.listen_anew(tick)
        self.status = "at rest"

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
        if self.learned is not None and self.learned.is_another(tick):
            self.learned = None
        if self.learned is None or self.begins:
            self.startup = Startup(self.window, self.known_scale)
            self.startup.observe(tick.mean)
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
