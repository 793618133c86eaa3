"""What a rest shows: successive ticks alike, and the noise and level of a sensor at rest."""

import math

import numpy as np

CERTAIN, LOUD, LIKELY = 4.9, 3.0, 9.0
ANOTHER = 9.0
NEAR_TICK, NEAR_MEAN = 6.0, 2.0
# Variance of the mean of so many samples at most, over that of white noise, that is even.
EVEN, MANY = 4.0, 25
SCALES = range(3)
MEMORY = 240


def bound(freedom, deviations):
    """Wilson & Hilferty: of a mean of that many squares of unit normal numbers."""
    a = 2.0 / (9.0 * freedom)
    return max(1.0 - a + deviations * math.sqrt(a), 0.0) ** 3


def flips(step):
    return 0.26 * step**2


def is_quieter(quiet, loud, step):
    """Whether one variance is that of a rest beside the other."""
    return loud > ANOTHER * quiet + flips(step)


def mean(values):
    return sum(values) / len(values)


class Candidate:
    """Successive ticks alike, whose levels stand still."""

    def __init__(self, seen):
        self.levels, self.variances, self.counts = [seen.level], [seen.variance], [seen.count]

    @property
    def ticks(self):
        return len(self.levels)

    @property
    def level(self):
        return self.levels[0] + mean([x - self.levels[0] for x in self.levels])

    @property
    def variance(self):
        return mean(self.variances)

    @property
    def level_variance(self):
        return float(np.var(self.levels, ddof=1)) if self.ticks > 1 else 0.0

    def is_even(self, step):
        """Whether the levels vary as the means of nearly white noise, or of two steps, do."""
        coarse = max(self.variance, self.level_variance) <= flips(step)
        return coarse or self.level_variance <= EVEN / min(*self.counts, MANY) * self.variance

    @property
    def level_deviation(self):
        return math.sqrt(self.level_variance / self.ticks)

    def take(self, seen):
        self.levels.append(seen.level)
        self.variances.append(seen.variance)
        self.counts.append(seen.count)
        freedom = min(seen.count - 2.0, 14.0)
        slack = flips(seen.step)
        alike = seen.variance <= self.variance * bound(
            freedom, CERTAIN
        ) + slack and seen.variance + slack >= self.variance * bound(freedom, -CERTAIN)
        stands = self.level_variance <= (0.25 + 4.0 / min(self.counts)) * self.variance + slack
        if not (alike and stands):
            self.__init__(seen)


class Known:
    """Noise and level of a sensor at rest."""

    def __init__(self, candidate, length, trust):
        v = candidate.variance
        self.variance, self.spread, self.weight = v, 2.0 * v**2 / min(length - 2.0, 8.0), 8
        self.squares = [2.0 * candidate.level_variance for _ in SCALES]
        self.weights = [min(candidate.ticks, 16) * 4**i for i in SCALES]
        self.resume(candidate.level, candidate.ticks)
        self.reference, self.trust = candidate.level, trust

    def resume(self, level, ticks):
        self.averages, self.ticks, self.rested = [level for _ in SCALES], ticks, 0

    @property
    def deviation(self):
        return math.sqrt(self.squares[0])

    def is_quiet(self, seen):
        freedom = 2.0 * self.variance**2 / max(self.spread, 2.2250738585072014e-308)
        if seen.weight < 1.0:
            freedom = min(freedom, seen.count - 2.0)
        most = max(LOUD, bound(max(freedom, 1.0), CERTAIN))
        return seen.variance <= self.variance * most + flips(seen.step)

    def holds(self, seen):
        averages, differences, shorter = [], [], seen.level
        for i in SCALES:
            differences.append(shorter - self.averages[i])
            share = max(0.25 ** (i + 1), 1.0 / (self.ticks + 1))
            shorter = self.averages[i] + differences[i] * share
            averages.append(shorter)
        differences[0] *= seen.weight
        if not (self.is_quiet(seen) and self.is_steady(differences, seen.step)):
            return False
        self.averages, self.ticks = averages, self.ticks + 1
        self.learn(seen, differences)
        self.rested, self.trust = self.rested + 1, self.trust + 1
        return True

    def is_steady(self, differences, step):
        youth = max(1.0 / self.ticks - 1.0 / 64.0, 0.0)
        for i in SCALES:
            freedom = self.weights[i] / (2.0 * 4**i)
            unsure = 1.0 + 8.0 / (freedom + 1.0)
            square = self.squares[i] * unsure + self.squares[0] * youth
            if abs(differences[i]) > CERTAIN * math.sqrt(square) + 1.01 * step:
                return False
        return True

    def learn(self, seen, differences):
        self.weight = min(self.weight + 1, MEMORY)
        before = seen.variance - self.variance
        self.variance += before / self.weight
        self.spread += (before * (seen.variance - self.variance) - self.spread) / self.weight
        for i in SCALES:
            self.weights[i] = min(self.weights[i] + 1, MEMORY * 4**i)
            square = min(differences[i] ** 2, LIKELY * self.squares[i] + seen.step**2)
            self.squares[i] += (square - self.squares[i]) / self.weights[i]

    def is_near(self, seen):
        distance = abs(seen.level - self.reference) * seen.weight
        return self.is_quiet(seen) and distance <= NEAR_TICK * self.deviation + 1.01 * seen.step

    def is_level(self, level, step):
        return self.is_near_level(abs(level - self.reference), step)

    def is_near_level(self, distance, step):
        return distance <= NEAR_MEAN * self.deviation + 1.01 * step
