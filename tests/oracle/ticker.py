"""Samples gathered to ticks of a quarter second, without outliers and a stuck sensor's."""

import math
from collections import namedtuple
from itertools import groupby

import numpy as np

from oracle.gate import BOUND, Gate
from oracle.repeats import Repeats

LEAST = 4
# Ticks swallowed in a row after which all begins anew, and ticks that a few samples wait.
LOST, PATIENCE = 4, 64
FOLLOW = 0.25
ROUNDING = 8.0 * np.finfo(float).eps
TINY = np.finfo(float).tiny

# Mean and deviation are in the unit of the samples; level and variance, without the farthest
# sample, and the step in that of the ticker.
Seen = namedtuple("Seen", "count mean deviation level variance weight step outliers stuck")


class Ticker:
    """Counts from the first sample on, in units of the first difference that is not zero."""

    def __init__(self, rate, length):
        self.length = length
        self.origin, self.unit, self.centre = None, 0.0, 0.0
        self.repeats, self.gate = Repeats(), Gate(rate)
        self.swallowed = self.waited = 0
        self.runs = []
        self.begin_tick()

    def begin_tick(self):
        self.samples = []
        self.before = self.repeats.previous, self.repeats.run

    def observe(self, z):
        """What the tick shows that a sample completes."""
        z = min(max(z, -1e300), 1e300) if math.isfinite(z) else math.nan
        self.samples.append(z)
        if math.isfinite(z):
            self.origin = z if self.origin is None else self.origin
            self.unit = self.unit or abs(z - self.origin)
            self.gate.learn(z)
        self.repeats.observe(z)
        return self.end() if len(self.samples) == self.length else None

    @property
    def inverse(self):
        return 1.0 / max(self.unit, TINY) if self.unit else 0.0

    @property
    def step(self):
        return min(self.repeats.step * self.inverse, BOUND) if self.repeats.step < math.inf else 0.0

    @property
    def lost(self):
        return self.swallowed >= LOST

    def distance(self, z):
        return min(max((z - self.origin) * self.inverse, -BOUND), BOUND) - self.centre

    def raw(self, distance):
        return self.origin + self.unit * (self.centre + distance)

    def working(self, samples):
        """Runs of equal samples, ``(distance, times)``, but those of a stuck sensor."""
        last, carried = self.before
        runs = []
        for i, (z, equal) in enumerate(groupby(samples)):
            times = len(list(equal))
            length = times + (carried if i == 0 and z == last else 0)
            if math.isfinite(z) and length < self.repeats.limit:
                runs.append((self.distance(z), times))
        return runs

    def judged(self, z):
        """A sample yet to come, as far as can be told: NaN if it will be none that counts."""
        z = min(max(z, -1e300), 1e300) if math.isfinite(z) else math.nan
        if math.isnan(z) or (self.repeats.stuck and z == self.repeats.previous):
            return math.nan
        if self.origin is None:
            return z
        d = self.distance(z)
        if abs(d) > self.gate.far:
            sides = [self.gate.side, *self.gate.side_after([*self.runs, *self.ended()])]
            lasts = abs(sides[-1]) >= self.gate.longest and (sides[-1] > 0) == (d > 0.0)
            return z if self.gate.open or lasts else math.nan
        return z if abs(d) <= self.gate.near else self.raw(self.gate.bounded(d))

    def ended(self):
        """Runs of this tick so far, without the one under way."""
        last = self.repeats.previous
        ended = len(self.samples)
        while ended and self.samples[ended - 1] == last:
            ended -= 1
        return self.working(self.samples[:ended])

    def end(self):
        working = self.working(self.samples)
        there = sum(math.isfinite(z) for z in self.samples)
        stuck = there - sum(times for _, times in working)
        self.runs += working
        self.repeats.end_tick()
        self.begin_tick()
        judged = self.gate.judge(self.runs)
        used = judged.plain if judged.exits else judged.kept
        if len(used) < LEAST:
            self.wait()
            return Seen(0, 0.0, 0.0, self.centre, 0.0, 0.0, self.step, 0, stuck)
        self.swallowed = self.swallowed + 1 if self.swallows(judged.plain) else 0
        seen = self.told(used, 0 if judged.exits else judged.far, stuck)
        self.follow(seen.level - self.centre, judged)
        return seen

    def wait(self):
        self.waited += 1
        if self.waited > PATIENCE:
            self.gate.side = [self.gate.side, *self.gate.side_after(self.runs)][-1]
            self.runs, self.waited = [], 0

    def told(self, used, outliers, stuck):
        above, variance = without_farthest(used, self.centre)
        mean = math.fsum(used) / len(used)
        level = self.centre + above
        return Seen(
            count=0 if self.swallowed else len(used),
            mean=self.raw(mean),
            deviation=self.unit * float(np.std(used, ddof=1)),
            level=level,
            variance=variance,
            weight=math.sqrt(min(len(used) / self.length, 1.0)),
            step=max(self.step, ROUNDING * abs(level)),
            outliers=outliers,
            stuck=stuck,
        )

    def follow(self, above, judged):
        self.gate.end_tick(self.runs, judged, self.step)
        self.centre += above if judged.exits else FOLLOW * above
        if self.gate.learning and self.unit:
            self.gate.start(self.inverse, self.step)
            centre = (self.gate.sketch.median - self.origin) * self.inverse
            self.centre = min(max(centre, -BOUND), BOUND)
        self.runs, self.waited = [], 0

    def swallows(self, distances):
        """Whether little is left of the samples beside the origin, or in the unit."""
        above, variance = without_farthest(distances, self.centre)
        mean = self.raw(math.fsum(distances) / len(distances))
        deviation, rounding = math.sqrt(variance), 16.0 * ROUNDING * abs(self.origin)
        coarse = self.repeats.step <= rounding and self.unit * deviation <= rounding
        spread = max(0.0, *distances) - min(0.0, *distances)
        return (
            (coarse and abs(mean) < 1e-3 * abs(self.origin))
            or 0.0 < spread < 1.0 / BOUND
            or abs(self.centre + above) + deviation >= 0.1 * BOUND
        )


def without_farthest(distances, centre):
    """Mean and variance; of two as far, one below and one above, both stay in the mean."""
    far, n = max(abs(d) for d in distances), len(distances) - 1
    lowest, highest = min(0.0, *distances), max(0.0, *distances)
    rounding = 8.0 * ROUNDING * (abs(centre) + highest - lowest)
    total = math.fsum(distances)
    if abs(highest + lowest) > rounding:
        total -= max(highest, lowest, key=abs)
    squares = math.fsum([d * d for d in distances]) - far**2
    return total / n, max((squares - total**2 / n) / (n - 1), 0.0)
