"""The three zones of a tick's samples: near ones count, farther ones by a bound, far ones not."""

import math
from collections import namedtuple

from oracle.sketch import Sketch

# Bounds of the zones, in deviations and at least in steps.
NEAR, FAR = (3.0, 1.01), (4.0, 3.0)
WITHIN_ONE = math.erf(math.sqrt(0.5))
# Where almost all of many samples are within one deviation, that was of motion.
RATE, FAST, ALMOST_ALL, MANY = 0.05, 0.5, 0.95, 16
LEAST_STEPS = 0.25
# Ratio of two deviations that are not of one noise.
OFF = 2.0
# Far samples that are outliers: seconds and samples on one side.
SIDE, LEAST_SIDE = 0.015, 3
LEAST_LEARNED, TELLING = 32, 8
BOUND = 1e75

Judged = namedtuple("Judged", "plain kept far exits")


class Gate:
    def __init__(self, rate):
        self.sketch, self.learning = Sketch(), max(int(rate), LEAST_LEARNED)
        self.longest = max(int(SIDE * rate), LEAST_SIDE)
        self.scale, self.near, self.far = 0.0, math.inf, math.inf
        # Runs of far samples in a row, above the level or, below zero, below it.
        self.side = 0
        self.open = True

    def learn(self, z):
        if self.learning:
            self.sketch.insert(z)
            self.learning -= 1

    def side_after(self, runs):
        """Far runs of one sign after each of some runs of equal samples, which count as one."""
        side, sides = self.side, []
        for d, _ in runs:
            longer = max(side, 0) + 1 if d > 0.0 else min(side, 0) - 1
            side = longer if abs(d) > self.far else 0
            sides.append(side)
        return sides

    def judge(self, runs):
        """Of runs of equal samples, ``(distance, times)``: all, those that count, and far ones."""
        plain = [d for d, times in runs for _ in range(times)]
        near = [d for d in plain if abs(d) <= self.far]
        far = len(plain) - len(near)
        lasts = any(abs(side) > self.longest for side in self.side_after(runs))
        # Three in ten.
        many = 10 * sum(abs(d) > self.near for d in plain) > 3 * len(plain)
        exits = len(plain) >= 4 and (lasts or many)
        return Judged(plain, [self.bounded(d) for d in near], far, exits)

    def bounded(self, d):
        return min(max(d, -self.near), self.near)

    def end_tick(self, runs, judged, step):
        self.side = [self.side, *self.side_after(runs)][-1]
        self.open = judged.exits
        if not judged.exits:
            share = sum(abs(d) < self.scale for d in judged.plain) / len(judged.plain)
            rate = FAST if share > ALMOST_ALL and len(judged.plain) >= MANY else RATE
            self.scale *= math.exp(rate * (WITHIN_ONE - share))
        self.set_bounds(max(self.scale, LEAST_STEPS * step), step)

    def start(self, inverse, step):
        """From the samples of the first second so far."""
        if len(self.sketch.kept) < TELLING:
            self.set_bounds(0.0, step)
            return
        self.open = False
        self.set_bounds(min(self.sketch.deviation * inverse, BOUND), step)

    def rest(self, deviation, step):
        """A rest begins: a scale that is far off is that of motion, or of the noise before."""
        if not deviation / OFF <= self.scale <= deviation * OFF:
            self.set_bounds(max(deviation, LEAST_STEPS * step), step)

    def set_bounds(self, scale, step):
        self.scale = scale
        if scale > 0.0:
            self.near, self.far = (max(s * scale, q * step) for s, q in (NEAR, FAR))
        else:
            self.near = self.far = math.inf
