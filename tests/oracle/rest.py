"""Rest told from one channel: what each tick shows against what rest has taught."""

import math
from copy import deepcopy

from oracle.known import LOUD, Candidate, Known, is_quieter, mean
from oracle.still import Still
from oracle.ticker import Ticker

# Doubts after which the time that a rest needs no longer doubles.
PATIENCE = 8
# Deviations of the level of a candidate within which it may be that of the rest before.
CONFIDENT = 3.0


class RestDetector:
    def __init__(self, rate, rest_limit=None, bias_limit=None):
        self.rate, self.limits = rate, (rest_limit, bias_limit)
        self.length = max(4, int(rate / 4.0 + 0.5))
        seconds = rate / self.length
        self.dwell = max(6, int(1.5 * seconds + 0.5))
        self.short = max(10, int(10.0 * seconds + 0.5))
        self.long = max(30, int(60.0 * seconds + 0.5))
        self.begin_anew()

    def begin_anew(self):
        self.ticker = Ticker(self.rate, self.length)
        self.still = Still(*self.limits)
        self.limited = self.limits[0] is not None
        self.at_rest = self.deceived = False
        self.proven, self.doubts = self.limited, 0
        self.known = self.home = self.candidate = None
        self.back, self.home_again = [], []

    def update(self, z, moving=False):
        """Whether it rests."""
        self.observe(z, moving)
        return self.at_rest

    def observe(self, z, moving=False):
        """The tick that a sample completes, and what changed with it: an event or None.

        It is a rest, a motion, or a restart: what was taken for rest was none, or not at its level.
        """
        seen = self.ticker.observe(z)
        if seen is None:
            return None
        if self.ticker.lost:
            self.begin_anew()
            return seen, "restart"
        return seen, self.decide(seen, moving) if seen.count else None

    @property
    def stuck(self):
        return self.ticker.repeats.stuck

    @property
    def standing(self):
        """Ticks in a row that may become the first rest."""
        return 0 if self.known or not self.candidate else self.candidate.ticks

    def decide(self, seen, moving):
        possible = self.still.take(seen)
        if self.known and not self.at_rest:
            event = self.motion(seen, possible, moving)
        else:
            event = (self.rest if self.known else self.begin)(seen, possible and not moving)
        if event and self.at_rest:
            self.ticker.gate.rest(math.sqrt(self.known.variance), self.ticker.step)
        return event

    def take(self, seen):
        if self.candidate is None:
            self.candidate = Candidate(seen)
        else:
            self.candidate.take(seen)

    def begin(self, seen, possible):
        if not possible:
            self.candidate = None
            return "restart"
        self.take(seen)
        doubted = self.deceived and not self.limited
        needed = self.short if doubted else self.dwell
        if self.limited:
            needed = self.needed_within_limits(seen.step)
        if self.candidate.ticks < needed or not self.still.lasts:
            return None
        trust = self.short if doubted else 0
        self.known, self.at_rest = Known(self.candidate, self.length, trust), True
        return "rest"

    def rest(self, seen, possible):
        event = self.goes_home(seen)
        if event:
            return event
        if possible and self.known.holds(seen):
            self.proven |= self.known.trust >= self.long
            return None if self.proven else self.doubt(seen)
        self.at_rest, self.candidate, self.back = False, None, []
        if possible:
            self.take(seen)
        early = self.known.trust < self.short
        if early and not self.limited:
            self.known, self.deceived = None, True
            return "restart"
        self.doubts += early
        self.proven |= is_quieter(self.known.variance, seen.variance, seen.step)
        if self.known.rested >= self.short:
            self.known.reference = self.known.averages[1]
        return "motion"

    def doubt(self, seen):
        """A quieter level ends a rest that nothing has proven."""
        self.take(seen)
        quieter = is_quieter(self.candidate.variance, self.known.variance, seen.step)
        if self.candidate.ticks < self.dwell or not quieter:
            return None
        self.known = Known(self.candidate, self.length, self.short)
        self.home, self.home_again, self.proven = None, [], True
        return "restart"

    def motion(self, seen, possible, moving):
        self.proven |= is_quieter(self.known.variance, seen.variance, seen.step)
        if not possible:
            self.candidate, self.back, self.home_again = None, [], []
            return None
        self.back = [*self.back, seen.level] if self.known.is_near(seen) else []
        if moving:
            self.candidate, self.home_again = None, []
            return None
        self.take(seen)
        if not self.still.lasts:
            return None
        if self.has_arrived(self.back, self.known, seen):
            self.resume(self.known, self.back)
            return "rest"
        return self.goes_home(seen) or self.adopt(seen)

    def returned(self, known, level, seen):
        return "rest" if known.is_level(level, seen.step) else "restart"

    def has_arrived(self, levels, known, seen):
        return len(levels) >= self.dwell and known.is_level(mean(levels), seen.step)

    def resume(self, known, levels):
        known.resume(mean(levels), len(levels))
        self.known, self.at_rest, self.home_again = known, True, []

    def goes_home(self, seen):
        if self.home is None:
            return None
        self.home_again = [*self.home_again, seen.level] if self.home.is_near(seen) else []
        louder = self.known.variance > LOUD * self.home.variance
        if not self.has_arrived(self.home_again, self.home, seen) or (self.at_rest and not louder):
            return None
        event = self.returned(self.home, self.known.averages[2], seen)
        self.resume(self.home, self.home_again)
        self.home = None
        return event

    def needed_within_limits(self, step):
        """Ticks of a candidate of which nothing is known but that it may be rest."""
        first = self.dwell + self.dwell // 2
        if not self.candidate.is_even(step):
            return self.short
        return min(first * 2 ** min(self.doubts, PATIENCE), self.short)

    def needed(self, step):
        """Ticks after which the candidate is a rest."""
        known, candidate = self.known, self.candidate
        limit = 2.0 * known.deviation + 0.505 * step
        level = known.is_level(candidate.level, step) and candidate.level_variance <= limit**2
        if level or is_quieter(candidate.variance, known.variance, step):
            return 2 * self.dwell
        louder = is_quieter(known.variance, candidate.variance, step)
        if self.limited and known.trust < self.short and not louder:
            return self.needed_within_limits(step)
        if known.variance == 0.0:
            return self.long
        deviation = math.sqrt(known.variance)
        louder = max((candidate.variance / known.variance) ** 0.25, 1.0)
        far = abs(candidate.level - known.reference) / deviation
        return min(self.short * (far + louder), self.long)

    def adopt(self, seen):
        if self.candidate.ticks < self.needed(seen.step):
            return None
        old = self.known
        weak = self.limited and old.trust < self.short
        adopted = Known(self.candidate, self.length, 0 if weak else self.short)
        far = abs(self.candidate.level - old.reference)
        unsure = CONFIDENT * self.candidate.level_deviation
        event = "rest" if old.is_near_level(max(far - unsure, 0.0), seen.step) else "restart"
        if is_quieter(adopted.variance, old.variance, seen.step):
            self.proven = True
        elif old.trust >= self.long:
            self.home = old
        if old.variance / LOUD <= adopted.variance <= old.variance * LOUD:
            for name in ("variance", "spread", "weight", "squares", "weights"):
                setattr(adopted, name, deepcopy(getattr(old, name)))
        self.known, self.at_rest, self.home_again = adopted, True, []
        return event
