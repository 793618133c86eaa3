"""Learning a hard iron while the attitude is estimated: each sum is taken anew over all its ticks.

A tick has e, the mean of the field turned by each sample's rotation R, and B, the mean of R. With
the hard iron b and a field h that stands still, e = B b + h, in units of the field's size.
"""

import math
from dataclasses import replace

import numpy as np

from oracle.attitude import UP, Attitude
from oracle.field import Field
from oracle.heading import Deviation

SECOND, FIRST, STRONGEST = 1.0, 10, 20.0
# Filters: how many, walk of the field in deviations of the noise by sqrt(s), seconds of the sums.
STARTS, WALK, FADES, FAR = 4, 0.5, 60.0, 9.0
# Price of a new start, what may be dearer than the best, and ticks that nothing explains.
PRICE, DROP, WILD, LONGEST = 24.0, 64.0, 3.0 * (2.0 * math.log(0.35) + 1.0), 60.0
# Deviation of the noise: first and bounds; ticks that tell it, turning; steps up and down.
NOISE, NOISE_LEAST, NOISE_MOST, WINDOW, TURNS = 0.02, 0.005, 1.0, 20, 0.3
FOLLOWS, UP_BY, DOWN_BY = 0.2, 0.6, 0.4
# Deviations: least scatter, seconds of an observation, and how many there are.
FLOOR, ONE, LEAST, MOST = 0.01, 10.0, 0.5, 4.0
# Known: seconds, directions and their deviation; shares of the scatter, by the size of the iron.
SHORTEST, DIRECTIONS, SURE = 5.0, 2, 0.1
HALVED, STAYS, LARGE, SIZES, APART = 0.4, 0.6, 0.7, (0.1, 0.25), 25.0
SAME, SURER, PLACES, BETTER = 16.0, 1.5, 5, 1.1
NEAR, NONE, WITHHELD = 0.15, 0.1, 60.0
RESHAPED, TAKEN_BACK, FREE, UNSURE = 0.1, 0.25, 10.0, 10.0


class Ticks:
    """Ticks and their weights."""

    def __init__(self):
        self.e, self.B, self.weight = np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(0)

    def add(self, e, B, weight=1.0, kept=1.0):
        self.e, self.B = np.vstack([self.e, e]), np.concatenate([self.B, B[None]])
        self.weight = np.append(kept * self.weight, weight)

    def mean(self, values):
        return np.average(values, axis=0, weights=self.weight)

    def field(self, iron):
        return self.mean(self.e - self.B @ iron)

    def scatter(self, iron):
        """RMS of an axis about the mean field."""
        apart = self.e - self.B @ iron - self.field(iron)
        return math.sqrt(self.mean(np.sum(apart**2, axis=1)) / 3.0)

    @property
    def spread(self):
        return self.B - self.mean(self.B)

    @property
    def turning(self):
        return self.mean(np.einsum("kji,kjl->kil", self.spread, self.spread))

    def best(self):
        """The iron of least scatter."""
        seen = self.mean(np.einsum("kji,kj->ki", self.spread, self.e))
        return np.linalg.solve(self.turning + 1e-9 * np.eye(3), seen)

    def covariance(self, iron, seconds):
        count = np.clip(seconds / ONE, LEAST, MOST)
        limit = max(self.scatter(iron), FLOOR)
        return np.linalg.inv(self.turning * count / limit**2 + np.eye(3))


class Start:
    """A Kalman filter of iron and field from one second on."""

    def __init__(self, e):
        self.x, self.P = np.append(np.zeros(3), e), np.eye(6)
        self.ticks, self.cost, self.age = Ticks(), 0.0, 0.0
        # What a field of the sensor's axes did to the heading, and what was taken off did.
        self.shares, self.taken = np.zeros(3), 0.0

    def step(self, e, B, noise, seconds):
        H = np.hstack([B, np.eye(3)])
        self.P[3:, 3:] += WALK**2 * noise * seconds * np.eye(3)
        S = H @ self.P @ H.T + noise * np.eye(3)
        v = e - H @ self.x
        size = v @ np.linalg.solve(S, v)
        # Huber's loss, and the weight of a tick in it.
        far = math.sqrt(max(size / FAR, 1.0))
        self.cost += np.linalg.slogdet(S)[1] + (size if far == 1.0 else 2.0 * FAR * far - FAR)
        S += (far - 1.0) * noise * np.eye(3)
        K = self.P @ H.T @ np.linalg.inv(S)
        self.x = self.x + K @ v
        self.P = self.P - K @ S @ K.T
        self.age += seconds
        self.ticks.add(e, B, 1.0 / far, max(1.0 - seconds / FADES, 0.0))

    def pull(self, gain, share, taken):
        self.shares = (1.0 - gain) * self.shares + gain * share
        self.taken = (1.0 - gain) * self.taken + gain * share @ taken


class Learner:
    """Filters, their costs and the noise."""

    def __init__(self):
        self.sizes, self.norm = [], 0.0
        self.variance, self.windows = NOISE**2, 0
        self.interrupt()

    def interrupt(self):
        self.window, self.starts = Ticks(), [None] * STARTS
        self.wild, self.wild_for = 0.0, 0.0
        self.since, self.second, self.seen = 0.0, 0.0, False

    @property
    def running(self):
        return [start for start in self.starts if start is not None]

    def take(self, e, B, seconds):
        """Takes a tick, e None without one; at the end of a second what explains it best."""
        self.since += seconds
        if e is not None and self.norm == 0.0:
            self.sizes.append(np.linalg.norm(e))
            self.norm = np.median(self.sizes) if len(self.sizes) == FIRST else 0.0
        elif e is not None and np.linalg.norm(e) < STRONGEST * self.norm:
            self.see(e / self.norm, B)
        self.second += seconds
        if self.second < SECOND - 1e-6:
            return "under way"
        self.second = 0.0
        return self.end()

    def see(self, e, B):
        self.judge_noise(e, B)
        if not self.seen:
            costs = [math.inf if one is None else one.cost for one in self.starts]
            self.starts[costs.index(max(costs))] = Start(e)
        for start in self.running:
            start.step(e, B, self.variance, self.since)
        self.wild += WILD
        self.seen, self.since = True, 0.0

    def judge_noise(self, e, B):
        self.window.add(e, B)
        if len(self.window.e) < WINDOW:
            return
        window, self.window = self.window, Ticks()
        if np.trace(window.turning) < TURNS**2:
            return
        self.windows += 1
        # Six unknowns.
        seen = window.scatter(window.best()) ** 2 * 3 * WINDOW / (3 * WINDOW - 6)
        step = max(FOLLOWS, 1.0 / self.windows)
        step *= UP_BY if seen > self.variance else -DOWN_BY
        self.variance = np.clip(self.variance * math.exp(2.0 * step), NOISE_LEAST**2, NOISE_MOST**2)

    def end(self):
        if not self.seen:
            return "nothing"
        self.seen = False
        self.wild_for += SECOND
        best = min(self.running, key=lambda one: one.cost)
        present = best if best.cost < self.wild else "wild"
        found = PRICE + min(best.cost, self.wild)
        for k, start in enumerate(self.starts):
            if start is not None:
                start.cost -= found
                self.starts[k] = start if start.cost <= DROP else None
        self.wild -= found
        if self.wild > 0.0 or self.wild_for >= LONGEST:
            self.wild, self.wild_for = 0.0, 0.0
        return present


class Choice:
    """The iron that is taken off, and its covariance."""

    def __init__(self):
        self.state, self.iron = "raw", (np.zeros(3), np.zeros((3, 3)))
        self.remembered, self.next = [], 0
        self.field, self.withheld = None, 0.0

    def decide(self, present):
        if present == "nothing":
            return
        if present == "wild":
            self.withhold()
            return
        ticks, iron = present.ticks, present.x[:3]
        covariance = ticks.covariance(iron, present.age)
        variances, axes = np.linalg.eigh(covariance)
        known = axes[:, variances < SURE**2]
        if present.age < SHORTEST or known.shape[1] < DIRECTIONS:
            self.keep(ticks)
            return
        # Nothing is taken off along what is not known.
        iron = known @ known.T @ iron
        if not self.pays(ticks, iron, covariance):
            self.take_least(ticks)
        elif np.linalg.norm(ticks.field(iron)) < NONE:
            self.state = "withheld"
        else:
            self.remember(iron, covariance)
            self.use("known", (iron, covariance))
            self.field = ticks.field(iron)

    def use(self, state, iron):
        self.state, self.iron, self.withheld = state, iron, 0.0

    def pays(self, ticks, iron, covariance):
        share = ticks.scatter(iron) / ticks.scatter(np.zeros(3))
        most = np.interp(np.linalg.norm(iron), SIZES, (HALVED, LARGE))
        sure = iron @ np.linalg.solve(covariance, iron) > APART
        return share < (STAYS if self.state == "known" else HALVED) or (sure and share < most)

    def remember(self, iron, covariance):
        for k, (other, its) in enumerate(self.remembered):
            apart = other - iron
            if apart @ np.linalg.solve(its + covariance, apart) < SAME:
                if np.trace(covariance) < SURER * np.trace(its):
                    self.remembered[k] = iron, covariance
                return
        # The oldest place of five.
        self.remembered[self.next : self.next + 1] = [(iron, covariance)]
        self.next = (self.next + 1) % PLACES

    def cheapest(self, cost, stays=1.0):
        """The cheapest of the one in use, those remembered, and none."""
        all_ = [self.iron, *self.remembered, (np.zeros(3), np.zeros((3, 3)))]
        costs = [cost(iron) for iron, _ in all_]
        costs[0] /= stays
        return all_[int(np.argmin(costs))], min(costs)

    def take_least(self, ticks):
        if not self.remembered:
            self.state = "raw"
            return
        self.use("kept", self.cheapest(ticks.scatter, BETTER)[0])
        self.field = ticks.field(self.iron[0])

    def keep(self, ticks):
        if not self.remembered:
            self.state = "raw"
        elif self.field is None:
            self.state = "kept"
        else:
            found, apart = self.cheapest(
                lambda iron: np.linalg.norm(ticks.field(iron) - self.field)
            )
            if apart > NEAR:
                self.withhold()
            else:
                self.use("kept", found)

    def withhold(self):
        if not self.remembered:
            self.state = "raw"
            return
        self.withheld = min(self.withheld + SECOND, WITHHELD)
        self.state = "withheld" if self.withheld < WITHHELD else "kept"


class LearningAttitude(Attitude):
    """The default filter, which sees fields without the iron that it learns of them."""

    def __init__(self, rate):
        super().__init__(rate)
        self.learner, self.choice = Learner(), Choice()
        self.hard_iron, self.usual_fields = None, None

    def known(self):
        told, (_, covariance) = super().known(), self.choice.iron
        norm, off = self.learner.norm, self.hard_iron
        sigma = np.full(3, np.nan) if off is None else norm * np.sqrt(np.diag(covariance))
        if off is not None:
            shares = self.deviation.shares / (self.iron.strength or 1.0) * norm
            more = min(shares @ covariance @ shares, UNSURE)
            told["heading_sigma"] = math.hypot(told["heading_sigma"], math.sqrt(more))
        return {
            **told,
            "hard_iron": np.zeros(3) if off is None else off,
            "hard_iron_sigma": sigma,
            "magnetometer_state": self.choice.state,
        }

    def taken(self, samples):
        self.given = samples.mag
        off = np.zeros(3) if self.hard_iron is None else self.hard_iron
        off = np.full(3, np.nan) if self.choice.state == "withheld" else off
        return super().taken(replace(samples, mag=samples.mag - off, seen=samples.seen - off))

    def lose(self, seconds):
        super().lose(seconds)
        self.learner.interrupt()
        self.choice.field = None

    def end(self, tick):
        super().end(tick)
        if self.pull is not None:
            for start in self.learner.running:
                gain, share = self.pull
                start.pull(gain, share * self.learner.norm, self.choice.iron[0])
        before = self.choice.iron[0]
        e, B = self.means(tick)
        held = tick.fields > 0 and not self.news
        present = self.learner.take(None if held else e, B, tick.span)
        if present == "under way":
            return
        self.choice.decide(present)
        if self.choice.state in ("known", "kept"):
            self.take_off(before)
            if isinstance(present, Start):
                self.take_back(present)

    def means(self, tick):
        """e and B; None where fewer samples came than half of what is usual."""
        # The rotation after the last sample is the one that the tick has corrected.
        R = np.concatenate([tick.R[:-1], self.R[None]])
        present = ~np.isnan(self.given[:, 0])
        count = present.sum()
        if count == 0:
            return None, None
        usual = count if self.usual_fields is None else self.usual_fields
        self.usual_fields = 0.95 * usual + 0.05 * count
        if count < 0.5 * self.usual_fields:
            return None, None
        turned = np.einsum("kij,kj->ki", R[present], self.given[present])
        return turned.mean(axis=0), R[present].mean(axis=0)

    def take_off(self, before):
        iron = self.choice.iron[0]
        self.hard_iron = iron * self.learner.norm
        if np.linalg.norm(iron - before) > RESHAPED:
            self.forget_field()

    def take_back(self, start):
        """The heading becomes that without this iron from the start on."""
        turned = start.shares @ self.choice.iron[0] - start.taken
        if abs(turned) > TAKEN_BACK:
            self.find_heading()
            return
        self.heading -= turned
        for one in self.learner.running:
            one.taken += turned

    def find_heading(self):
        self.restart([UP], FREE)
        places = self.deviation.places
        self.deviation = Deviation(FREE)
        self.deviation.places = places
        self.by_bias = np.zeros(3)
        self.forget_field()
        for one in self.learner.running:
            one.shares, one.taken = np.zeros(3), 0.0

    def forget_field(self):
        self.field = Field()
        self.drift.end()
        self.iron.forget()
