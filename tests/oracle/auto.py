"""The drift filter that tunes itself, sample by sample."""

import math

import numpy as np

from oracle.learned import Learned
from oracle.startup import Startup
from oracle.ticks import Tally, Ticks
from oracle.watch import LOUDER_TICK, Watch

STARTUP_MIN = 10


class AutoFilter:
    """Takes the parameters of ``zerorate.DriftFilter(method="auto")`` that it uses."""

    def __init__(
        self,
        rate,
        motion="hold",
        startup=1.0,
        scale=None,
        limit=None,
        rest_limit=None,
        bias_limit=None,
    ):
        self.rate = rate
        self.hold = motion == "hold"
        self.window = max(math.floor(startup * rate + 0.5), STARTUP_MIN)
        self.known_scale = scale
        self.bias_limit = math.inf if bias_limit is None else bias_limit
        # Nothing is taken for rest before it has shown that it can be, where that is known.
        self.waits = self.hold and rest_limit is not None
        self.tally = Tally(limit)
        self.detector = Ticks(rate, rest_limit, bias_limit)
        self.startup = Startup(self.window, scale)
        self.learned = None
        self.watch = Watch()
        self.doing = self.first
        self.experienced = False
        self.restarts = 0
        self.reach = 0.0
        self.estimate = 0.0
        self.drift = None

    def trace(self, z):
        """All that is known after each sample, as arrays by name."""
        steps = [self.update(sample) for sample in z.tolist()]
        return {name: np.array([now[name] for now in steps]) for name in steps[0]}

    def update(self, z):
        z = self.tally.within_range(z)
        missing = not math.isfinite(z)
        innovation = z - self.estimate if self.learns and not missing else 0.0
        self.reach = self.reach if missing else max(self.reach, abs(z))
        if self.doing == "at rest" and not missing:
            self.follow(innovation)
        if self.doing == "starting" or (self.doing == "no rest yet" and self.waits):
            self.startup.observe(z)
        if self.doing == "starting":
            self.estimate = self.believed(self.startup.mean)
        tick = self.detector.observe(z)
        if tick is not None:
            self.take(tick)
        now = self.reading()
        gain = 0.0 if missing else now["gain"]
        return {**now, "innovation": innovation, "gain": gain, "missing": missing}

    def follow(self, innovation):
        """Until the tick is judged; a sample more than four deviations off moves nothing."""
        if abs(innovation) <= self.drift["most"]:
            self.estimate += self.drift["gain"] * innovation

    def believed(self, level):
        """A level, zero for one that no bias has."""
        return level if abs(level) <= self.bias_limit else 0.0

    @property
    def first(self):
        return "no rest yet" if self.waits else "starting"

    @property
    def begins(self):
        return self.doing in ("starting", "no rest yet")

    @property
    def learns(self):
        return self.doing in ("starting", "at rest")

    @property
    def provisional(self):
        return self.hold and self.detector.provisional

    @property
    def status(self):
        if self.detector.stuck:
            return "stuck"
        if self.doing == "at rest" and self.provisional:
            return "provisional"
        return "restarting" if self.doing == "starting" and self.restarts else self.doing

    def reading(self):
        if self.learned is None:
            noise = {"measurement_noise": self.startup.variance, "process_noise": 0.0}
        else:
            noise = self.learned.noises()
        sigma = self.startup_sigma if self.begins else self.drift["bias_sigma"]
        of_walks = self.startup_sigma if self.begins else self.drift["walk_sigma"]
        return {
            **noise,
            "estimate": self.estimate,
            "bias": self.estimate,
            "bias_sigma": self.cautious(sigma, noise["measurement_noise"]),
            "gain": self.drift["gain"] if self.doing == "at rest" else 0.0,
            "covariance": of_walks**2,
            "innovation_variance": noise["measurement_noise"] + of_walks**2,
            "coefficients": 1.0,
            "at_rest": self.learns,
            "saturated": self.tally.saturated,
            "stuck": self.detector.stuck,
        }

    @property
    def startup_sigma(self):
        samples = len(self.startup.samples)
        if samples < 2 or self.doing == "no rest yet":
            return self.reach
        return np.sqrt(self.startup.variance / samples)

    def cautious(self, sigma, noise):
        """What is taken for rest may be motion of the size of the samples until it is proven."""
        if not self.provisional:
            return sigma
        level = self.estimate
        if self.begins:
            level, noise = self.startup.mean, self.startup.variance
        return max(sigma, abs(level) + np.sqrt(noise))

    def power_on(self):
        self.experienced = self.learned is not None
        self.detector.reset()
        self.forget()
        self.doing = self.first

    def take(self, tick):
        self.tally.add(tick)
        if self.hold and tick.event is not None:
            getattr(self, tick.event)(tick)
        if self.hold and tick.event == "jump":
            return
        if self.disproves(tick):
            self.startup = Startup(self.window, self.known_scale)
            self.learned, self.experienced, self.watch = None, False, Watch()
            self.doing = "starting"
            self.restarts += 1
        elif self.doing == "no rest yet" and self.detector.standing < 2:
            # What has been gathered is no rest, nor may the tick be that has ended it.
            self.startup = Startup(self.window, self.known_scale)
        elif self.doing == "starting" and self.startup.finished:
            self.finish_startup()
        elif self.doing == "at rest":
            self.learned.learn(tick)
            self.run()
        elif self.doing == "in motion":
            self.learned.wait()
            self.run()

    def run(self):
        self.drift = self.learned.drift()
        self.estimate = self.drift["estimate"]

    def disproves(self, tick):
        told = self.known_scale is not None
        if told or self.learned is None or self.doing != "at rest":
            return False
        return self.watch.judge(np.sqrt(tick.variance), self.learned.scale, LOUDER_TICK)

    def rest(self, tick):
        if self.begins or self.learned is None:
            self.doing = "starting"
            return
        if self.learned.is_another(tick):
            self.learned.listen_anew(tick)
        self.doing = "at rest"

    def motion(self, tick):
        if self.begins:
            self.forget()
        else:
            self.doing = "in motion"

    def forget(self, tick=None):
        self.startup = Startup(self.window, self.known_scale)
        if not self.experienced:
            self.learned = None
        self.doing = "no rest yet"
        self.estimate = 0.0

    def jump(self, tick):
        if self.learned is not None and self.learned.is_another(tick):
            self.learned = None
        if self.learned is None or self.begins:
            self.startup = Startup(self.window, self.known_scale)
            self.startup.observe(tick.mean)
            self.estimate = self.believed(tick.mean)
            self.doing = "starting"
        else:
            self.learned.begin(tick.mean, tick.present)
            self.doing = "at rest"
            self.run()

    def finish_startup(self):
        offset, samples = self.startup.mean, self.startup.worth
        if self.learned is None:
            length, rate = self.detector.length, self.rate
            self.learned = Learned(offset, self.startup.scale, length, samples, rate)
        else:
            self.learned.begin(offset, samples)
        self.doing = "at rest"
        self.run()
