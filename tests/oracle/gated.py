"""A published filter that is not told of motion, outliers or the ends of the sensor's range."""

import math
from copy import deepcopy
from dataclasses import replace

import numpy as np

from oracle.drift import DriftFilter
from oracle.ticks import Tally, Ticks


class GatedFilter:
    """Takes the parameters of ``zerorate.DriftFilter`` with a published method."""

    def __init__(self, rate, motion="ignore", outliers="keep", limit=None, **arguments):
        self.hold, self.rejects = motion == "hold", outliers == "reject"
        self.tally, self.detector = Tally(limit), Ticks(rate)
        self.new = lambda: DriftFilter(rate=rate, **arguments)
        # A filter with what it has told last, now and after the last two ticks at rest.
        self.filter = self.new(), None
        self.before = [deepcopy(self.filter)] * 2
        self.at_rest = True

    def trace(self, z):
        """All that is known after each sample, as arrays by name."""
        steps = [self.update(sample) for sample in z.tolist()]
        return {name: np.array([now[name] for now in steps]) for name in steps[0]}

    def update(self, z):
        z = self.tally.within_range(z)
        accepted = self.detector.judged(z) if self.rejects else self.without_stuck(z)
        self.feed(accepted if self.at_rest else math.nan)
        tick = self.detector.observe(z) if self.hold or self.rejects else None
        if tick is not None:
            self.tally.add(tick if self.rejects else replace(tick, outliers=0))
            if self.hold:
                self.take(tick)
        return {
            **self.filter[1],
            "missing": not math.isfinite(z),
            "at_rest": self.at_rest,
            "saturated": self.tally.saturated,
            "stuck": self.detector.stuck,
        }

    def without_stuck(self, z):
        """Missing, if the sample makes its run a stuck sensor's or goes on with such a one."""
        repeats = self.detector.detector.ticker.repeats
        return math.nan if z == repeats.previous and repeats.run + 1 >= repeats.limit else z

    def feed(self, z):
        twin = self.filter[0]
        self.filter = twin, twin.update(z)

    def take(self, tick):
        if tick.event == "rest":
            self.at_rest = True
        elif tick.event == "motion":
            self.at_rest, self.filter = False, deepcopy(self.before[1])
        elif tick.event is not None:
            twin = self.new()
            told = {**twin.startup_reading(0.0, False), "guarded": False}
            self.at_rest, self.filter = tick.event == "jump", (twin, told)
        if self.at_rest:
            self.before = [deepcopy(self.filter), self.before[0]]
