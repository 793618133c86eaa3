"""Samples that equal the one before, and a sensor that is stuck at one."""

import math

# Chance of a run that is no chance, fewest samples of one, changes before which nothing is known,
# and pairs of samples after which those before count half.
CHANCE, LEAST_RUN, TELLING, MEMORY = 1e-9, 4, 32, 20_000
# Two steps, whatever rounding makes of them.
FEW_STEPS = 2.5


class Repeats:
    """``run`` equal samples in a row, of which at least ``limit`` are a stuck sensor's."""

    def __init__(self):
        self.previous, self.run = math.nan, 0
        self.step = math.inf
        # As if there had been one pair of either kind.
        self.equal, self.changed = 1, 1
        self.limit = math.inf

    @property
    def stuck(self):
        return self.run >= self.limit

    def observe(self, z):
        """Takes a sample, NaN for a missing one."""
        if z == self.previous:
            self.run += 1
            return
        change = abs(z - self.previous)
        if change < self.step:
            self.step = change
        if self.run:
            self.count_run(one_step=change <= FEW_STEPS * self.step)
            self.changed += math.isfinite(change)
        self.previous, self.run = z, int(math.isfinite(z))

    def count_run(self, one_step):
        """A run that ends by one step was none of a stuck sensor, however long."""
        most = MEMORY if one_step else min(self.limit, MEMORY)
        self.equal += min(self.run, most) - 1

    def end_tick(self):
        if self.changed < TELLING:
            return
        pairs = self.equal + self.changed
        if pairs > MEMORY:
            self.equal, pairs = self.equal // 2, pairs // 2
            self.changed = pairs - self.equal
        p = max(self.equal, 1) / pairs
        # p^(m - 1) < CHANCE: m samples are m - 1 pairs.
        self.limit = max(LEAST_RUN, math.floor(math.log(CHANCE) / math.log(p)) + 2)
