"""Whether a magnetic field is the one known, as in the filter VQF, from tick to tick."""

import math

import numpy as np

# Of the strength, as a share, and of the dip, rad: how far from what is known.
STRENGTH, DIP = 0.1, math.radians(10.0)
# Seconds: over which what is known follows, in it until it is trusted again, of rotation in another
# one until that is the one known (5 for the first), of rejection.
FOLLOWS, TRUSTED, NEW, FIRST, REJECTED = 20.0, 0.5, 20.0, 5.0, 60.0
TURNING = math.radians(20.0)
# How much larger a variance is after the rejection, and how much faster that is forgotten.
DOUBTED, FORGOTTEN = 4.0, 2.0


def shape(field):
    """Strength, and the parts that dip is the angle between: level, and down."""
    return np.array([np.linalg.norm(field), math.hypot(*field[:2]), -field[2]])


def near(seen, other):
    """The mean dip is that of the mean parts, whose length no strength of its own replaces."""
    cosine = seen[1:] @ other[1:] / max(seen[0] * other[0], 1e-300)
    return abs(seen[0] - other[0]) < STRENGTH * other[0] and cosine > math.cos(DIP)


def followed(known, seen, seconds):
    return known + min(seconds / FOLLOWS, 1.0) * (seen - known)


# Times by which the strength of a sample may differ from the last one's, and samples in a row that
# agree on another, of any and of the first, until it is the field's.
LEAPS, AGREE, AGREE_FIRST = 2.0, 3, 2


class Spikes:
    """What is far stronger or weaker than the fields before."""

    def __init__(self):
        self.usual, self.other, self.count = 0.0, 0.0, 0

    def without(self, mag):
        """Fields in which spikes are NaN."""
        kept = mag.copy()
        for k, strength in enumerate(np.linalg.norm(mag, axis=1).tolist()):
            if not math.isnan(strength) and self.is_one(strength):
                kept[k] = np.nan
        return kept

    def is_one(self, strength):
        if not alike(strength, self.usual):
            self.count = self.count + 1 if alike(strength, self.other) else 1
            self.other = strength
            if self.count < (AGREE if self.usual else AGREE_FIRST):
                return True
        self.usual, self.count = strength, 0
        return False


def alike(one, other):
    return one <= LEAPS * other and other <= LEAPS * one


class Held:
    """A magnetometer that gives one value while the body turns."""

    def __init__(self):
        self.last, self.turn, self.seconds = None, np.zeros(3), 0.0

    def observe(self, strength, turned, span):
        """Whether a tick's field is news."""
        self.turn = self.turn + turned if strength == self.last else np.zeros(3)
        self.last = strength
        news = np.linalg.norm(self.turn) <= 0.05
        self.seconds = 0.0 if news else self.seconds + span
        return news

    @property
    def stuck(self):
        return self.seconds >= 2.0 * (1.0 - 1e-9)


class Field:
    def __init__(self):
        self.known, self.candidate = None, np.zeros(3)
        self.turned = self.stayed = self.undisturbed = 0.0
        self.rejected, self.trusted = REJECTED, False

    @property
    def disturbed(self):
        return self.known is not None and not self.trusted

    @property
    def believed(self):
        """Whether its direction says something of a heading that drifts."""
        return self.trusted or (self.known is None and self.stayed >= 30.0)

    def observe(self, field, seconds, rate):
        """By how much the variance of the heading is larger; None if it must not be used."""
        seen = shape(field)
        self.compare(seen, seconds)
        self.consider(seen, seconds, rate)
        if self.trusted:
            self.rejected = max(self.rejected - FORGOTTEN * seconds, 0.0)
            return 1.0
        if self.rejected < REJECTED:
            self.rejected += seconds
            return None
        return DOUBTED

    def compare(self, seen, seconds):
        if self.known is None:
            return
        if not near(seen, self.known):
            self.undisturbed, self.trusted = 0.0, False
            return
        self.undisturbed += seconds
        if self.undisturbed >= TRUSTED:
            self.trusted = True
            self.known = followed(self.known, seen, seconds)

    def consider(self, seen, seconds, rate):
        if not near(seen, self.candidate):
            self.candidate, self.turned, self.stayed = seen, 0.0, 0.0
            return
        self.stayed += seconds
        if rate > TURNING:
            self.turned += seconds
        self.candidate = followed(self.candidate, seen, seconds)
        if not self.trusted and self.turned >= (FIRST if self.known is None else NEW):
            self.known = self.candidate
            self.trusted, self.undisturbed = True, TRUSTED
