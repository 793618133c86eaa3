"""Motion told from an accelerometer: means of 1, 2, 4, ... ticks, each against the one before."""

import numpy as np

SCALES = 7
# Part of gravity, and variances, by which successive means differ where a body moves.
TURN, CERTAIN = 1.0 / 150.0, 25.0
INDEPENDENT = 8
# A loud tick prolongs a motion, for a minute at most.
LOUD, SHAKEN = 4.0, 3
FALL, RISE = 1.0 / 8.0, 1.0 / 240.0


class MotionDetector:
    def __init__(self, rate):
        self.length = max(4, int(rate / 4.0 + 0.5))
        self.patience = max(30, int(60.0 * rate / self.length + 0.5))
        self.samples, self.position = [], 0
        self.left, self.since, self.quiet = 0, self.patience, None
        self.ticks = []

    @property
    def moving(self):
        return self.left > 0

    def update(self, sample):
        """Whether the body moves."""
        if np.isfinite(sample).all():
            self.samples.append(np.asarray(sample))
        self.position += 1
        if self.position == self.length:
            self.position = 0
            self.left, self.since = max(0, self.left - 1), min(self.since + 1, self.patience)
            if len(self.samples) >= 4:
                self.judge(np.array(self.samples))
                self.samples = []
        return self.moving

    def judge(self, samples):
        variance = np.sum(np.var(samples, axis=0, ddof=1))
        self.ticks.append((np.mean(samples, axis=0), variance / min(len(samples), INDEPENDENT)))
        scale = self.turned()
        if scale is not None:
            self.left, self.since, self.ticks = max(self.left, 3 * 2**scale - 1), 0, []
        elif self.moving and self.shakes(variance):
            self.left = max(self.left, SHAKEN)
        if not self.moving:
            quiet = variance if self.quiet is None else self.quiet
            self.quiet = quiet + (variance - quiet) * (FALL if variance < quiet else RISE)

    def shakes(self, variance):
        known = self.quiet is not None and self.since < self.patience
        return known and variance > LOUD * self.quiet

    def turned(self):
        """The shortest scale at which the last two means differ."""
        for scale in range(SCALES):
            width = 2**scale
            if len(self.ticks) % width or len(self.ticks) < 2 * width:
                continue
            (before, v_before), (now, v_now) = self.mean(2 * width, width), self.mean(width, 0)
            change = np.sum((now - before) ** 2)
            if change > CERTAIN * (v_before + v_now) and change > TURN**2 * np.sum(now**2):
                return scale
        return None

    def mean(self, first, last):
        """The mean from the first of the last ticks on, and its variance."""
        part = self.ticks[-first : len(self.ticks) - last]
        levels, variances = zip(*part, strict=True)
        return np.mean(levels, axis=0), np.sum(variances) / len(part) ** 2
