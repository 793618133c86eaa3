"""Twin of the array of gyros: weights, vote and Allan covariances, sample by sample in NumPy.

The drift of each axis is that of `zerorate.DriftFilter`, which has a twin of its own.
"""

import numpy as np

import zerorate as zr

BEGINS = ("starting", "restarting", "no rest yet")
OCTAVES, SECOND, FOUR = 13, 2, 4


def nanmean_where(values, told):
    return np.mean(values[told]) if told.any() else np.nan


class Octaves:
    """Non-overlapping Allan covariances of the means of 1, 2, 4, … ticks of one axis."""

    def __init__(self, n):
        self.last = np.full((OCTAVES, n), np.nan)
        self.half = [None] * OCTAVES
        self.products = np.zeros((OCTAVES, n, n))
        self.counts = np.zeros((OCTAVES, n, n))

    def take(self, mean):
        for k in range(OCTAVES):
            change = mean - self.last[k]
            there = np.isfinite(change)
            change = np.where(there, change, 0.0)
            self.products[k] += 0.5 * np.outer(change, change)
            self.counts[k] += np.outer(there, there)
            self.last[k] = mean
            if self.half[k] is None:
                self.half[k] = mean
                return
            mean, self.half[k] = 0.5 * mean + 0.5 * self.half[k], None

    def interrupt(self):
        self.last[:] = np.nan
        self.half = [None] * OCTAVES


class GyroArray:
    """What `zerorate.GyroArray` does with three axes a sensor and two sensors or more."""

    def __init__(self, rate, sensors, *, rotations=None, limit=None, weights="auto", error=0.01):
        self.rate, self.n, self.kind, self.error = rate, sensors, weights, error
        self.R = np.broadcast_to(np.eye(3), (sensors, 3, 3)) if rotations is None else rotations
        self.filters = [zr.DriftFilter(rate, channels=3, limit=limit) for _ in range(sensors)]
        self.length = max(round(rate / 4.0), 4)
        self.octaves = [Octaves(sensors) for _ in range(3)]
        shape = (sensors, 3)
        self.halves, self.half_counts = np.zeros(shape), np.zeros(shape)
        self.waiting = np.full((2, *shape), np.nan)
        self.ratios, self.white, self.second = np.ones(shape), np.ones(shape), np.full(3, np.nan)
        self.sigma = np.full(shape, np.nan)
        self.known = np.zeros(3, dtype=bool)
        self.excluded = np.zeros(sensors, dtype=bool)
        self.exposed, self.agreed = np.zeros(sensors), np.zeros(sensors, dtype=int)
        self.disputed = False
        # Smallest differences of successive samples.
        self.before, self.steps = np.full(shape, np.nan), np.full(shape, np.inf)
        self.begin_tick()

    def begin_tick(self):
        shape = (self.n, 3)
        self.position = 0
        self.sums, self.counts = np.zeros((2, *shape)), np.zeros((2, *shape), dtype=int)
        self.compared, self.far = np.zeros(shape, dtype=int), np.zeros(shape, dtype=int)
        self.differences, self.products = np.zeros(shape), np.zeros(shape)
        self.largest, self.along = np.zeros(shape), np.zeros(shape)
        self.squares, self.voters, self.speeds = np.zeros(3), np.zeros(3, dtype=int), 0.0

    def update(self, z):
        own = np.array([f.update(one) for f, one in zip(self.filters, z, strict=True)])
        present = np.where(np.isfinite(own), z, np.nan)
        change = np.abs(present - self.before)
        self.steps = np.where(change > 0.0, np.fmin(self.steps, change), self.steps)
        self.before = present
        stuck = np.array([f.stuck for f in self.filters])
        own[stuck] = np.nan
        r = self.turned(own)
        counts = np.isfinite(r) & ~self.excluded[:, np.newaxis]
        counts &= np.isfinite(self.sigma) | ~self.known
        middle = np.array(
            [np.median(r[counts[:, a], a]) if counts[:, a].any() else np.nan for a in range(3)]
        )
        speed = np.sqrt(np.nansum(middle**2))
        self.speeds += np.nansum(middle**2)
        voters = counts.sum(axis=0)
        self.voters = np.maximum(self.voters, voters)
        rate = np.full(3, np.nan)
        self.weights, left_out = np.zeros((self.n, 3)), np.zeros(self.n, dtype=bool)
        for a in range(3):
            used = counts[:, a].copy()
            if voters[a] >= 2:
                far = self.compare(a, r[:, a], middle[a], speed) & (voters[a] > 2)
                used, left_out = used & ~far, left_out | far
            weight = np.where(used, self.weight(a, speed), 0.0)
            if weight.sum() > 0.0:
                self.weights[:, a] = weight / weight.sum()
                rate[a] = np.sum(self.weights[used, a] * r[used, a])
            else:
                rate[a] = middle[a]
        there = np.isfinite(own) & ~left_out[:, np.newaxis]
        half = int(2 * self.position >= self.length)
        self.sums[half] += np.where(there, z, 0.0)
        self.counts[half] += there
        self.position += 1
        if self.position == self.length:
            self.end_tick()
        return rate

    def turned(self, z):
        """In the axes of the body; an axis is missing only if a part of it is."""
        parts = np.where(
            self.R != 0.0, self.R * np.where(np.isfinite(z), z, 0.0)[:, np.newaxis], 0.0
        )
        lost = ((self.R != 0.0) & ~np.isfinite(z)[:, np.newaxis]).any(axis=-1)
        return np.where(lost, np.nan, parts.sum(axis=-1))

    def compare(self, a, r, middle, speed):
        there, d = np.isfinite(r), r - middle
        far = there & (np.abs(d) > 6.0 * self.sigma[:, a] + 0.5 * speed)
        self.compared[:, a] += there
        self.far[:, a] += far
        near = there & ~far
        self.differences[near, a] += d[near]
        self.products[near, a] += d[near] * middle
        larger = near & (np.abs(d) > np.abs(self.largest[:, a]))
        self.largest[larger, a], self.along[larger, a] = d[larger], d[larger] * middle
        self.squares[a] += middle**2
        return far

    def weight(self, a, speed):
        if self.kind == "mean":
            return np.ones(self.n)
        if self.kind == "white":
            return 1.0 / self.white[:, a]
        motion = (self.error * speed) ** 2 / self.second[a] if self.second[a] > 0.0 else 0.0
        return 1.0 / (self.ratios[:, a] + motion)

    def end_tick(self):
        entries = self.R != 0.0
        own = np.array([f.at_rest for f in self.filters])
        rests = np.where(entries, own[:, np.newaxis], True).all(axis=-1)
        self.at_rest = 2 * rests[~self.excluded].sum(axis=0) > (~self.excluded).sum()
        calm = rests & self.at_rest & ~self.excluded[:, np.newaxis]
        self.learn(calm)
        white = np.array([np.square(f.angle_random_walk) * self.rate for f in self.filters])
        settled = [[s not in BEGINS for s in f.status] for f in self.filters]
        white[~np.array(settled)] = np.nan
        noise = white + self.steps**2
        sums = self.differences, self.products, self.largest, self.along
        for one in (self.compared, self.far, *sums):
            one[np.isnan(self.sigma)] = 0
        self.sigma = np.sqrt(np.where(entries, self.R**2 * noise[:, np.newaxis], 0.0).sum(axis=-1))
        for a in range(3):
            own = self.sigma[np.isfinite(self.sigma[:, a]) & ~self.excluded, a]
            if len(own):
                middle = np.sqrt(0.5 * np.pi * len(own)) / np.sum(1.0 / own)
                self.sigma[:, a] = np.hypot(self.sigma[:, a], middle)
        self.vote()
        self.known = (np.isfinite(self.sigma) & ~self.excluded[:, np.newaxis]).any(axis=0)
        self.begin_tick()

    def learn(self, calm):
        means = np.where(
            4 * self.counts > self.length, self.sums / np.maximum(self.counts, 1), np.nan
        )
        means = np.array([self.turned(half) for half in means])
        followed = np.where(calm, self.waiting, np.nan)
        whole = np.isfinite(means).all(axis=0)
        self.waiting = np.where(calm & whole, means, np.nan)
        there = np.isfinite(followed).all(axis=0)
        self.halves[there] += 0.5 * (followed[1] - followed[0])[there] ** 2
        self.half_counts += there
        for a in range(3):
            if not self.at_rest[a]:
                self.octaves[a].interrupt()
                continue
            self.octaves[a].take(0.5 * followed[0, :, a] + 0.5 * followed[1, :, a])
            self.weigh(a)

    def weigh(self, a):
        octaves, each = self.octaves[a], np.arange(self.n)
        sums = [self.halves[:, a], *(octaves.products[k][each, each] for k in (SECOND, FOUR))]
        counts = [self.half_counts[:, a], *(octaves.counts[k][each, each] for k in (SECOND, FOUR))]
        ratios = np.full((3, self.n), np.nan)
        for k, (s, c) in enumerate(zip(sums, counts, strict=True)):
            told = c >= 8
            v = s / np.maximum(c, 1)
            mean = nanmean_where(v, told)
            if k == 1:
                self.second[a] = mean
            if told.any() and mean > 0.0:
                ratios[k, told] = np.clip(v[told] / mean, 1e-2, 1e4)
        told = np.isfinite(ratios)
        self.ratios[:, a] = np.where(
            told.any(axis=0), np.nansum(ratios, axis=0) / np.maximum(told.sum(axis=0), 1), 1.0
        )
        self.white[:, a] = np.where(told[0], ratios[0], self.white[:, a])

    def vote(self):
        speed = np.sqrt(self.speeds / self.length)
        n = np.maximum(self.compared - self.far - 1, 1)
        norms = np.sqrt(np.where(self.squares > 0.0, self.squares, np.inf))
        self.off = (
            np.abs(self.differences - self.largest) / n,
            np.abs(self.products - self.along) / norms,
        )
        wrong = np.array([self.disagrees(i, speed) for i in range(self.n)])
        accused = (wrong & ~self.excluded).sum()
        self.disputed = bool(accused > 0 and 2 * accused >= (~self.excluded).sum())
        back = round(10.0 * self.rate / self.length)
        for i in range(self.n):
            if wrong[i] and (self.excluded[i] or not self.disputed):
                self.excluded[i], self.exposed[i], self.agreed[i] = True, speed, 0
            elif self.excluded[i] and not wrong[i] and self.was_judged(i):
                self.agreed[i] += speed >= 0.3 * self.exposed[i]
                self.excluded[i] = self.agreed[i] < back

    def was_judged(self, i):
        return (self.compared[i] >= 4).all() and np.isfinite(self.sigma[i]).all()

    def typical(self, off, a):
        told = np.sort(off[(self.compared[:, a] >= 4) & ~self.excluded, a])
        return told[(len(told) - 1) // 2] if len(told) > 2 else 0.0

    def disagrees(self, i, speed):
        for a in range(3):
            n, sigma = self.compared[i, a], self.sigma[i, a]
            if n < 4 or np.isnan(sigma) or self.voters[a] < 2:
                continue
            part = 0.5 if self.voters[a] == 2 else 1.0
            limits = 9.0 * sigma / np.sqrt(n) + 0.1 * speed, 9.0 * sigma + 0.1 * np.sqrt(n) * speed
            far = 2 * self.far[i, a] > n
            for off, limit in zip(self.off, limits, strict=True):
                far |= off[i, a] > part * max(limit, 5.0 * self.typical(off, a))
            if far:
                return True
        return False
