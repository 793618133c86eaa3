"""Rest told from one channel: what each tick shows against what rest has taught."""

import math
from collections import namedtuple
from copy import deepcopy

import numpy as np

CERTAIN, LOUD, LIKELY = 4.9, 3.0, 9.0
NEAR_TICK, NEAR_MEAN = 6.0, 2.0
SCALES = range(3)
MEMORY = 240
# Ticks swallowed in a row after which all begins anew.
LOST = 4
BOUND = 1e75
ROUNDING = 8.0 * np.finfo(float).eps

Seen = namedtuple("Seen", "count level variance weight step")


def bound(freedom, deviations):
    """Wilson & Hilferty: of a mean of that many squares of unit normal numbers."""
    a = 2.0 / (9.0 * freedom)
    return max(1.0 - a + deviations * math.sqrt(a), 0.0) ** 3


def flips(step):
    return 0.26 * step**2


def mean(values):
    return sum(values) / len(values)


class Ticker:
    def __init__(self, length):
        self.length = length
        self.origin, self.unit, self.step, self.centre = None, 0.0, math.inf, 0.0
        self.tick, self.previous, self.swallowed = [], math.nan, 0

    def observe(self, z):
        y = math.nan
        if math.isfinite(z):
            z = min(max(z, -1e300), 1e300)
            self.origin = z if self.origin is None else self.origin
            self.unit = self.unit or abs(z - self.origin)
            if 0.0 < abs(z - self.previous) < self.step:
                self.step = abs(z - self.previous)
            y = (z - self.origin) * self.inverse
            y = min(max(y if self.unit else 0.0, -BOUND), BOUND)
        self.previous = z
        self.tick.append(y)
        return self.end() if len(self.tick) == self.length else None

    @property
    def inverse(self):
        return 1.0 / max(self.unit, 2.2250738585072014e-308)

    @property
    def lost(self):
        return self.swallowed >= LOST

    def end(self):
        distances = [y - self.centre for y in self.tick if not math.isnan(y)]
        count, self.tick, variance, before = len(distances), [], 0.0, self.centre
        if count >= 4:
            far = max(abs(d) for d in distances)
            squares = sum(d * d for d in distances) - far**2
            # One below and one above cancel.
            farthest = sum({d for d in distances if abs(d) == far})
            total, n = sum(distances) - farthest, count - 1
            variance = max((squares - total**2 / n) / (n - 1), 0.0)
            self.centre += total / n
            mean = self.origin + self.unit * (before + sum(distances) / count)
            self.swallowed = self.swallowed + 1 if self.swallows(mean, distances, variance) else 0
        step = min(self.step * self.inverse, BOUND) if self.step < math.inf else 0.0
        rounding = ROUNDING * abs(self.centre)
        weight = math.sqrt(count / self.length)
        count = 0 if self.swallowed else count
        return Seen(count, self.centre, variance, weight, max(step, rounding))

    def swallows(self, mean, distances, variance):
        """Whether little is left of the samples beside the origin, or in the unit."""
        deviation, rounding = math.sqrt(variance), 16.0 * ROUNDING * abs(self.origin)
        coarse = self.step <= rounding and self.unit * deviation <= rounding
        spread = max(0.0, *distances) - min(0.0, *distances)
        return (
            (coarse and abs(mean) < 1e-3 * abs(self.origin))
            or 0.0 < spread < 1.0 / BOUND
            or abs(self.centre) + deviation >= 0.1 * BOUND
        )


class Candidate:
    """Successive ticks alike, whose levels stand still."""

    def __init__(self, seen):
        self.levels, self.variances = [seen.level], [seen.variance]

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

    def take(self, seen, length):
        self.levels.append(seen.level)
        self.variances.append(seen.variance)
        freedom = min(length - 2.0, 14.0)
        slack = flips(seen.step)
        alike = seen.variance <= self.variance * bound(
            freedom, CERTAIN
        ) + slack and seen.variance + slack >= self.variance * bound(freedom, -CERTAIN)
        stands = self.level_variance <= (0.25 + 4.0 / length) * self.variance + slack
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
        return abs(level - self.reference) <= NEAR_MEAN * self.deviation + 1.01 * step


class RestDetector:
    def __init__(self, rate):
        self.length = max(4, int(rate / 4.0 + 0.5))
        seconds = rate / self.length
        self.dwell = max(6, int(1.5 * seconds + 0.5))
        self.short = max(10, int(10.0 * seconds + 0.5))
        self.long = max(30, int(60.0 * seconds + 0.5))
        self.begin_anew()

    def begin_anew(self):
        self.ticker = Ticker(self.length)
        self.at_rest = self.deceived = False
        self.known = self.home = self.candidate = None
        self.back, self.home_again = [], []

    def update(self, z):
        """Whether it rests; ``event`` is what changed: a rest, a motion, a restart or None."""
        self.event = None
        seen = self.ticker.observe(z)
        self.swallowed = self.ticker.swallowed > 0
        if seen and self.ticker.lost:
            self.begin_anew()
            self.event = "restart"
        elif seen and seen.count >= 4:
            if self.known is None:
                self.begin(seen)
            elif self.at_rest:
                self.rest(seen)
            else:
                self.motion(seen)
        return self.at_rest

    def take(self, seen):
        if self.candidate is None:
            self.candidate = Candidate(seen)
        else:
            self.candidate.take(seen, self.length)

    def begin(self, seen):
        self.take(seen)
        if self.candidate.ticks >= (self.short if self.deceived else self.dwell):
            trust = self.short if self.deceived else 0
            self.known, self.at_rest = Known(self.candidate, self.length, trust), True
            self.event = "rest"

    def rest(self, seen):
        if self.goes_home(seen) or self.known.holds(seen):
            return
        self.at_rest, self.candidate, self.back = False, Candidate(seen), []
        self.event = "motion"
        if self.known.trust < self.short:
            self.known, self.deceived, self.event = None, True, "restart"
        elif self.known.rested >= self.short:
            self.known.reference = self.known.averages[1]

    def motion(self, seen):
        self.take(seen)
        self.back = [*self.back, seen.level] if self.known.is_near(seen) else []
        if self.has_arrived(self.back, self.known, seen):
            self.resume(self.known, self.back)
            self.event = "rest"
        elif not self.goes_home(seen) and self.candidate.ticks >= self.needed(seen.step):
            self.event = self.returned(self.known, self.candidate.level, seen)
            self.adopt()

    def returned(self, known, level, seen):
        return "rest" if known.is_level(level, seen.step) else "restart"

    def has_arrived(self, levels, known, seen):
        return len(levels) >= self.dwell and known.is_level(mean(levels), seen.step)

    def resume(self, known, levels):
        known.resume(mean(levels), len(levels))
        self.known, self.at_rest, self.home_again = known, True, []

    def goes_home(self, seen):
        if self.home is None:
            return False
        self.home_again = [*self.home_again, seen.level] if self.home.is_near(seen) else []
        louder = self.known.variance > LOUD * self.home.variance
        if self.has_arrived(self.home_again, self.home, seen) and (louder or not self.at_rest):
            self.event = self.returned(self.home, self.known.averages[2], seen)
            self.resume(self.home, self.home_again)
            self.home = None
            return True
        return False

    def needed(self, step):
        known, candidate = self.known, self.candidate
        limit = 2.0 * known.deviation + 0.505 * step
        if known.is_level(candidate.level, step) and candidate.level_variance <= limit**2:
            return 2 * self.dwell
        if known.variance == 0.0:
            return self.long
        deviation = math.sqrt(known.variance)
        louder = max((candidate.variance / known.variance) ** 0.25, 1.0)
        far = abs(candidate.level - known.reference) / deviation
        return min(self.short * (far + louder), self.long)

    def adopt(self):
        adopted = Known(self.candidate, self.length, self.short)
        old = self.known
        if old.variance / LOUD <= adopted.variance <= old.variance * LOUD:
            for name in ("variance", "spread", "weight", "squares", "weights"):
                setattr(adopted, name, deepcopy(getattr(old, name)))
        if old.trust >= self.long:
            self.home = old
        self.known, self.at_rest, self.home_again = adopted, True, []
