"""Rest of a body, from tick to tick, by its gyro, its accelerometer and its magnetometer."""

import math

import numpy as np

DEG = math.radians(1.0)
# How far samples lie from the means of half a second, rad/s and m/s^2, and for how long.
GYRO, ACCEL, MEAN, LONG = 2.0 * DEG, 0.5, 0.5, 1.5
# The same of means of ticks: their spread, and how far gravity turns.
TICK_GYRO, TICK_ACCEL, TURNED = 0.5 * DEG, 0.15, 0.12
# Density of the rate's noise at rest, its share of what shakes, and a slow turn after a second.
NOISE, RECTIFIED, SLOW = 0.04 * DEG, 0.05, 0.1 * DEG
MEASURED = (0.5, 1.0, 2.0)
# Squares of: how much louder than the calmest rest, and how far off a tick; least floors.
LOUDER, OFF, DOUBLES = 9.0, 16.0, 300.0
# The same of the level; ticks from which on it counts, and seconds until it is another rest's.
LEVEL_OFF, SEVERAL, STRAYS = 1.5, 10, 3.0
GYRO_FLOOR, ACCEL_FLOOR = 0.005 * DEG, 0.003
# How far the level lies from the bias: always, in deviations, and these at most.
NEAR, DEVIATIONS, NEAR_MOST = 0.15 * DEG, 3.0, 0.3 * DEG
FAR, STEADY, SUPPORTED = (10.0, 30.0), 0.5 * DEG, 10.0
# The field: deviations, least share, ticks, level share, lag, surety, share of a miss.
MOVED, LEAST, ENOUGH, LEVEL, BEHIND, SURELY, MATCHES = 3.0, 0.01, 20, 0.4, 0.4, 3.0, 0.5
SLACK = 1e-9


def square(v):
    return float(v @ v)


def reached(seconds, needed):
    return seconds >= needed * (1.0 - SLACK)


class Seen:
    """A tick with a rate and a force."""

    def __init__(self, tick):
        self.span, self.gyro, self.accel = tick.span, tick.gyro, tick.accel
        shaken = np.mean(np.sum((tick.samples.gyro - tick.gyro) ** 2, axis=1))
        self.noise = NOISE**2 + RECTIFIED**2 * shaken


class Candidate:
    """Ticks in a row whose means stand still."""

    def __init__(self):
        self.ticks, self.measured = [], 0

    def observe(self, seen):
        """Whether it begins with this tick, or is none."""
        far = lambda one, mean, most: np.linalg.norm(one - mean) > 2.0 * most  # noqa: E731
        if self.ticks and (
            far(seen.gyro, self.gyro, TICK_GYRO) or far(seen.accel, self.accel, TICK_ACCEL)
        ):
            self.__init__()
        self.ticks.append(seen)
        last = self.accels[:5].mean(axis=0)
        for accel in self.accels[5:]:
            last = last + 0.2 * (accel - last)
        turned = np.linalg.norm(last - self.accels[:5].mean(axis=0))
        spread = (self.spread(self.gyros), self.spread(self.accels))
        if spread[0] > TICK_GYRO**2 or spread[1] > TICK_ACCEL**2 or turned > TURNED:
            self.__init__()
        return len(self.ticks) <= 1

    @staticmethod
    def spread(values):
        return np.sum((values - values.mean(axis=0)) ** 2) / max(len(values) - 1, 1)

    @property
    def gyros(self):
        return np.array([seen.gyro for seen in self.ticks])

    @property
    def accels(self):
        return np.array([seen.accel for seen in self.ticks])

    @property
    def gyro(self):
        return self.gyros.mean(axis=0)

    @property
    def accel(self):
        return self.accels.mean(axis=0)

    @property
    def seconds(self):
        return math.fsum(seen.span for seen in self.ticks)

    def measure(self):
        """What it says of the bias, and the variance of that."""
        seen, due = self.ticks[-1], sum(reached(self.seconds, time) for time in MEASURED)
        if due > self.measured:
            self.measured = due
            weights = np.array([seen.span / seen.noise for seen in self.ticks])
            mean = weights @ self.gyros / weights.sum()
            return mean, 1.0 / weights.sum() + (SLOW / self.seconds**2) ** 2
        return (seen.gyro, seen.noise / seen.span) if due == len(MEASURED) else None


class Witness:
    """The magnetic field in the axes of the sensor."""

    def __init__(self):
        self.fields, self.noise = [], None
        self.mean = self.anchor = None

    def observe(self, field, span):
        """Whether it has moved since the candidate began, and since the far level's anchor."""
        if self.mean is None:
            self.mean = self.anchor = field
        self.mean = self.mean + min(span / MEAN, 1.0) * (field - self.mean)
        self.fields.append(field)
        limit = self.limit
        away = np.linalg.norm(self.mean - self.anchor) > limit
        if away:
            self.anchor = self.mean
        return np.linalg.norm(self.last - self.first) > limit, away

    @property
    def first(self):
        return np.mean(self.fields[:5], axis=0)

    @property
    def last(self):
        last = self.first
        for field in self.fields[5:]:
            last = last + 0.2 * (field - last)
        return last

    @property
    def own(self):
        changes = np.diff(np.array(self.fields), axis=0)[3:]
        return 0.5 * np.sum(changes**2) / max(len(self.fields) - 1, 1)

    @property
    def limit(self):
        noise = self.own if self.noise is None else self.noise
        return MOVED * math.sqrt(max(noise, (LEAST * np.linalg.norm(self.fields[-1])) ** 2))

    def refutes_turn(self, rate, seconds):
        if len(self.fields) < ENOUGH:
            return False
        changes = np.diff(np.array(self.fields), axis=0)[3:]
        if 0.5 * np.sum(changes**2) <= 1e-12 * square(self.fields[-1]):
            return False
        carried = rate * (seconds - 2.0 * BEHIND) * LEVEL * np.linalg.norm(self.fields[-1])
        return carried > SURELY * self.limit

    def turned_with(self, rate, seconds):
        angle = -rate * max(seconds - 0.25 - BEHIND, 0.0)
        size = np.linalg.norm(angle)
        axis = angle / size if size else angle
        expected = (
            math.cos(size) * self.first
            + math.sin(size) * np.cross(axis, self.first)
            + (1.0 - math.cos(size)) * (axis @ self.first) * axis
        )
        miss = np.linalg.norm(self.last - expected)
        return miss < MATCHES * np.linalg.norm(self.last - self.first)


class BodyRest:
    def __init__(self):
        self.calm, self.witness = None, Witness()
        self.anchor, self.steady = np.zeros(3), 0.0
        self.used, self.denied, self.support, self.spread = False, False, 0.0, 0.0
        self.lasted = self.strayed = 0.0
        self.interrupt()

    def interrupt(self):
        self.gyro = self.accel = self.first = None
        self.since = self.steady = self.lasted = 0.0
        self.begin()

    def begin(self):
        self.candidate, self.witness.fields = Candidate(), []

    def observe(self, tick, field, bias, variance, most, pushed):
        """Returns "motion", "denied", "rest", "refuted" or "jumped", and what is measured."""
        grown = 1.0 + 2.0 * math.log(2.0) / DOUBLES * tick.span
        if self.calm is not None:
            limits = (TICK_GYRO**2, TICK_ACCEL**2)
            self.calm = [min(x * grown, limit) for x, limit in zip(self.calm, limits, strict=True)]
        if self.witness.noise is not None:
            self.witness.noise *= grown
        if tick.unknown > 0.0 or not tick.forces:
            self.since = 0.0
            self.begin()
            state, told = "motion", None
        elif self.follow(tick, field):
            state, told = "denied", None
        else:
            state, told = self.decide(self.seen, bias, variance, most, pushed)
        self.lasted = 0.0 if state in ("motion", "denied", "unclear") else self.lasted + tick.span
        return state, told

    def follow(self, tick, field):
        """Whether the field shows that the only rest so far was a turn."""
        self.seen = seen = Seen(tick)
        self.look(tick)
        if self.candidate.observe(seen):
            self.witness.fields = []
        self.steady += seen.span
        if np.linalg.norm(self.gyro - self.anchor) > STEADY:
            self.anchor, self.steady = self.gyro, 0.0
        if field is None:
            return False
        moved, away = self.witness.observe(field, seen.span)
        self.steady = 0.0 if away else self.steady
        if not moved:
            return False
        rest, denied = self.candidate, False
        if rest.measured and self.support <= 2.0 * rest.seconds and self.support < SUPPORTED:
            denied = self.witness.turned_with(rest.gyro, rest.seconds)
        self.begin()
        if denied:
            self.calm = self.witness.noise = None
            self.used, self.denied, self.support, self.spread = False, True, 0.0, 0.0
        return denied

    def look(self, tick):
        """Samples and the means of half a second."""
        if self.gyro is None:
            self.gyro, self.accel, self.first = tick.gyro, tick.accel, tick.accel
        square_gyro = np.mean(np.sum((tick.samples.gyro - self.gyro) ** 2, axis=1))
        square_accel = np.nanmean(np.sum((tick.samples.accel - self.accel) ** 2, axis=1))
        weight = min(tick.span / MEAN, 1.0)
        self.gyro = self.gyro + weight * (tick.gyro - self.gyro)
        self.accel = self.accel + weight * (tick.accel - self.accel)
        moved = square(self.accel - self.first)
        if square_gyro > GYRO**2 or max(square_accel, moved) > ACCEL**2:
            self.since, self.first = 0.0, self.accel
        else:
            self.since += tick.span

    def decide(self, seen, bias, variance, most, pushed):
        deviations = DEVIATIONS**2 * variance
        if self.used:
            deviations = min(deviations, NEAR_MOST**2)
        elif self.denied:
            deviations = 0.0
        bound = math.sqrt(NEAR**2 + deviations)
        self.stay(bias, bound)
        calm = self.stays(seen) and self.is_calm(seen)
        if pushed:
            return "motion", None
        rest = self.candidate
        lasts = calm and rest.ticks and reached(rest.seconds, 0.5)
        off = np.linalg.norm(rest.gyro - bias) if rest.ticks else math.inf
        near = off <= bound and (self.used or np.linalg.norm(bias) > most)
        if lasts and not near and math.hypot(*rest.gyro) > most:
            state = self.beyond(seen, most)
            if state is not None:
                return state
        elif lasts:
            refutes = self.witness.refutes_turn(off, rest.seconds)
            if off <= bound or (not self.used and (refutes or not self.denied)):
                return self.quiet(seen)
            spread = rest.spread(rest.gyros)
            long = max(2.0, min(2.0 * self.support, 9.9))
            steadier = reached(rest.seconds, 1.5) and spread < 0.25 * self.spread
            young = self.support < SUPPORTED and (reached(rest.seconds, long) or steadier)
            if young or (reached(rest.seconds, 2.0) and refutes):
                return self.refuted(seen)
            if self.refutes_lean(bias):
                rest.measured, self.used = len(MEASURED), True
                return "jumped", (rest.gyro, NOISE**2 / seen.span)
        return self.usual(seen, bias, min(bound, GYRO), variance, most, calm)

    def stay(self, bias, bound):
        """A level is steady for as long as it is far."""
        if np.linalg.norm(self.gyro - bias) <= min(bound, GYRO):
            self.anchor, self.steady = self.gyro, 0.0

    def stays(self, seen):
        """Whether the level is that of the candidate, as it is not where a turn begins."""
        rest = self.candidate
        off = (
            self.calm is not None
            and len(rest.ticks) >= SEVERAL
            and square(self.gyro - rest.gyro) > LEVEL_OFF * self.calm[0]
        )
        self.strayed = self.strayed + seen.span if off else 0.0
        if self.strayed > STRAYS * (1.0 + SLACK):
            self.begin()
        return not off

    def beyond(self, seen, most):
        """A rate that is larger than a bias should be: gravity or the field may prove it none."""
        rest, size = self.candidate, np.linalg.norm(self.candidate.accel)
        if not reached(rest.seconds, 2.0) or np.linalg.norm(rest.gyro) > 3.0 * most:
            return None
        up = rest.accel / max(size, TURNED)
        about_up = abs(rest.gyro @ up)
        level = np.linalg.norm(rest.gyro - up * (rest.gyro @ up))
        if about_up > most:
            stays = self.witness.refutes_turn(about_up, rest.seconds)
        else:
            stays = level * (rest.seconds - 0.8) * size > 3.0 * TURNED
        if stays:
            return self.refuted(seen)
        return None if self.used else ("unclear", (up, most**2))

    def refuted(self, seen):
        rest = self.candidate
        rest.measured, self.used = len(MEASURED), True
        self.support, self.spread = rest.seconds, rest.spread(rest.gyros)
        self.learn()
        return "refuted", (rest.gyro, seen.noise / rest.seconds)

    def refutes_lean(self, bias):
        """A turn about a level axis would have carried gravity along."""
        rest, size = self.candidate, np.linalg.norm(self.candidate.accel)
        off, up = rest.gyro - bias, rest.accel / max(size, TURNED)
        leans = np.linalg.norm(off - up * (off @ up))
        return (
            reached(rest.seconds, 2.0)
            and leans > 0.2 * np.linalg.norm(off)
            and leans * (rest.seconds - 0.8) * size > 3.0 * TURNED
        )

    def is_calm(self, seen):
        if self.calm is None:
            return True
        rest = self.candidate
        return (
            len(rest.ticks) >= 5
            and rest.spread(rest.gyros) <= LOUDER * self.calm[0]
            and rest.spread(rest.accels) <= LOUDER * self.calm[1]
            and square(seen.gyro - rest.gyro) <= OFF * self.calm[0]
        )

    def quiet(self, seen):
        rest = self.candidate
        self.support += seen.span if rest.measured else rest.seconds
        self.used |= reached(rest.seconds, 1.5)
        self.spread = rest.spread(rest.gyros)
        self.learn()
        return "rest", rest.measure()

    def learn(self):
        rest, witness = self.candidate, self.witness
        if reached(rest.seconds, 2.0):
            seen = (
                max(rest.spread(rest.gyros), GYRO_FLOOR**2),
                max(rest.spread(rest.accels), ACCEL_FLOOR**2),
            )
            self.calm = [min(pair) for pair in zip(self.calm or seen, seen, strict=True)]
        if len(witness.fields) >= ENOUGH:
            known = math.inf if witness.noise is None else witness.noise
            witness.noise = min(known, witness.own)

    def usual(self, seen, bias, bound, variance, most, calm):
        """A rest by the limits of samples."""
        if np.linalg.norm(self.gyro - bias) <= bound:
            if not reached(self.since, LONG) or self.calm is not None:
                return "motion", None
            self.used = True
            return "rest", (seen.gyro, seen.noise / seen.span)
        long = min(self.since, self.steady)
        if not calm or not reached(long, FAR[self.used]) or math.hypot(*self.gyro) > most:
            return "motion", None
        drifts = max(0.9 * DEG, DEVIATIONS * math.sqrt(variance))
        if self.used and np.linalg.norm(self.gyro - bias) > drifts:
            return "motion", None
        self.used = True
        return "jumped", (self.gyro, NOISE**2 / seen.span)
