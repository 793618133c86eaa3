"""The default attitude filter: plain matrices of all 17 errors, and the textbook's formulas.

Errors in this order: rotation about the frame's x, y and up (PHI), bias (B), the gyro's matrix row
by row (S), velocity along x and y (V). The frame is level and turned by nothing but the gyro; the
heading is the angle from it to east, north, up.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from oracle import quaternions
from oracle.body_rest import BodyRest
from oracle.field import Field, Held, Spikes
from oracle.heading import Deviation, Drift, Iron, share_of_places
from oracle.inertial import Samples, prepared
from oracle.under_way import UnderWay

PHI, B, S, V = 0, 3, 6, 15
UP = 2
DEG = math.radians(1.0)
G = 9.81
TICK, LOOKS = 0.1, 4
# Noise of the rotation: white, of what the gyro's matrix does not hold, and of every turn.
N, SCALE, TURN = 0.01 * DEG, 0.0015, 0.003
BIAS_WALK, BIAS_FOLLOWED, BIAS_SIGMA, BIAS_LIMIT = 0.01 * DEG, 0.5 * DEG, DEG, 10.0 * DEG
REFUTED_BIAS, REFUTED_TILT, BIAS_REVIVED = 0.02 * DEG, 0.2, 0.15 * DEG
MATRIX_WALK, MATRIX_SIGMA = 1e-5, np.where(np.eye(3), 0.008, 0.005).ravel()
VELOCITY_WALK, SPEED, MEMORY = 0.01, 0.25, 5.0
REST_VELOCITY = 1e-4
FIELD, FIELD_WALK, FIELD_HOLDS = (25.0 * DEG) ** 2, (0.02 * DEG) ** 2, 1.0
LEVEL = 0.1
# The start: seconds, speed and tilt.
START, START_SPEED, START_TILT = 1.0, 1.0, 0.5
# The gyro's scale: seconds of the sums and of following, usual and largest ratio, largest growth.
SUMMED, FOLLOWS, USUAL, LARGEST, MOST = 2.0, 3.0, 0.3, 6.0, 150.0
LOST_TURNING = 1.5**2
UNKNOWN, STILL = 1.0, 0.01
# Lost samples: seconds in which a rate is forgotten, and those of the usual one.
FORGOTTEN, USUAL_RATE, ANGLE_MOST = 0.3, 5.0, 10.0
BEGUN = 0.25
# A step that may be of garbage, rad: its change by its size, rad/s^2, and how near the next is.
LARGE, CHANGED, ACCELERATED, BACK = 0.05, 0.75, 500.0, 0.25
# A wrong tilt: seconds of the force and between two, persistence, level part; a fallen frame.
FORCE, BETWEEN, PERSIST, LEVEL_FORCE, UPRIGHT, FALLEN = 1.5, 2.0, 2.0, 2.5, 0.7, 3.0
# What speeds up: share of the level part, the same where it is sure, m/s^2; ticks of known gravity;
# seconds, and the doubt of its velocity.
PUSHED, SURELY, STRONG, WEIGHED, PUSHED_LONG, DOUBTED = 0.25, 0.5, 1.0, 20, 3.0, 10.0
# A body that goes straight on: rate and seconds, and the density of its rate.
STRAIGHT, STRAIGHT_FOR, STRAIGHT_NOISE = 3.0 * DEG, 1.5, DEG
# Votes for a rate: the largest, how near, the most of them, how many count; seconds of one, and of
# the rate; a body that leans this fast shows the bias along the vertical.
STRAIGHT_MOST, AGREES, VOTES, MAJORITY = 3.0 * BIAS_SIGMA, 0.7 * DEG, 10.0, 2.0
VOTE, FOLLOWED, LEANING = 20.0, 10.0, 20.0 * DEG
ACCEL_BIAS = 0.05
BOUNDS = {PHI: 0.5, PHI + 1: 0.5, UP: 10.0, V: 100.0, V + 1: 100.0}


@dataclass
class Tick:
    """Samples of a tick, in the frame after each of them."""

    samples: Samples
    R: np.ndarray
    # Rate without bias; it fades where it is unknown.
    rate: np.ndarray

    def __post_init__(self):
        self.span, self.unknown = self.samples.dt.sum(), self.samples.unknown.sum()
        forces, fields = (~np.isnan(v[:, 0]) for v in (self.samples.accel, self.samples.mag))
        self.forces, self.fields = forces.sum(), fields.sum()
        self.gyro = self.samples.gyro.mean(axis=0)
        self.accel = self.samples.accel[forces].sum(axis=0) / max(self.forces, 1)
        self.force = self.in_frame(self.samples.accel, forces)
        self.field = self.in_frame(self.samples.mag, fields)

    def in_frame(self, vectors, present):
        turned = np.einsum("nij,nj->ni", self.R[present], vectors[present])
        return turned.sum(axis=0) / max(present.sum(), 1)

    def places(self):
        """Samples at which it is looked how the frame is turned."""
        places, next_look, elapsed = [], 0.5 * TICK / LOOKS, 0.0
        for k, dt in enumerate(self.samples.dt):
            elapsed += dt
            if elapsed >= next_look:
                places.append(k)
                next_look += TICK / LOOKS
        return places

    def mean_rotation(self):
        return np.mean(self.R[self.places()], axis=0)

    def turned_by(self):
        """A (3, 12): how errors of bias and matrix turn the frame within the tick."""
        places = self.places()
        R, w = self.R[places], self.rate[places]
        by_matrix = np.mean(np.einsum("nir,nc->nirc", R, w), axis=0).reshape(3, 9)
        return self.span * np.hstack([-np.mean(R, axis=0), by_matrix])


class Attitude:
    """In rad/s, m/s^2 and the frame east, north, up; a whole record at once."""

    def __init__(self, rate, *, mag=True, bias=(0.0, 0.0, 0.0)):
        self.rate, self.mag = rate, mag
        self.q, self.heading = (1.0, 0.0, 0.0, 0.0), 0.0
        self.before, self.doubted, self.wrong = np.zeros(3), None, None
        self.given, self.b, self.M = bias, np.array(bias), np.eye(3)
        self.v = np.zeros(2)
        self.P = self.ignorance(10.0 if mag else 1e-6)
        self.begun, self.begun_for, self.up, self.northed = False, 0.0, 0.0, 0
        self.rest, self.at_rest = BodyRest(), False
        self.field, self.field_age = Field(), 0.0
        self.spikes, self.held, self.pull = Spikes(), Held(), None
        self.drift, self.iron, self.by_bias = Drift(), Iron(), np.zeros(3)
        self.deviation = Deviation(self.P[UP, UP])
        self.lost = self.lost_variance = self.covered = self.usual = 0.0
        self.straight = self.straight_for = self.usual_straight = self.votes = 0.0
        self.stand()
        self.accelerations = 0.5**2
        self.under_way = UnderWay()
        self.forget_scale()
        self.speed = 0.0
        self.weighed = []
        self.first_turned = self.first_moved = 0.0

    def stand(self):
        self.mean_force, self.recovered, self.pushed = np.array([0.0, 0.0, G]), BETWEEN, 0.0
        self.felt = np.zeros(3)

    def ignorance(self, heading, bias=BIAS_SIGMA**2):
        tilt, speed = START_TILT**2, START_SPEED**2
        gyro = [*np.full(3, bias), *MATRIX_SIGMA**2]
        return np.diag([tilt, tilt, heading, *gyro, speed, speed])

    def forget_scale(self):
        self.scale, self.sum, self.expected = SCALE**2, np.zeros(2), 0.0

    # A record.

    def run(self, gyro, accel, mag=None, dt=None):
        """Named arrays over the samples."""
        samples = prepared(self.rate, gyro, accel, mag, dt)
        told, first, elapsed = [], 0, 0.0
        for k, (step, gap) in enumerate(zip(samples.dt, samples.gap, strict=True)):
            if gap:
                if k > first:
                    told += self.follow(self.taken(samples[first:k]))[1]
                self.lose(gap)
                first, elapsed = k, 0.0
            elapsed += step
            if elapsed + 0.5 * step >= TICK:
                tick, known = self.follow(self.taken(samples[first : k + 1]))
                self.end(tick)
                told += [*known[:-1], self.known()]
                first, elapsed = k + 1, 0.0
        if first < len(samples):
            told += self.follow(self.taken(samples[first:]))[1]
        return {name: np.array([one[name] for one in told]) for name in told[0]}

    def taken(self, samples):
        """The samples of a tick as they are used."""
        return replace(samples, mag=self.spikes.without(samples.mag))

    def known(self):
        sigma = np.sqrt(np.diag(self.P) * max(self.doubt, 1.0))
        return {
            "quaternion": quaternions.product(quaternions.about_up(self.heading), self.q),
            "bias": self.b,
            "bias_sigma": sigma[B:S],
            "gyro_matrix": self.M,
            "gyro_matrix_sigma": sigma[S:V].reshape(3, 3),
            "tilt_sigma": math.sqrt(self.tilt),
            "heading_sigma": math.sqrt(self.heading_variance),
            "at_rest": self.at_rest,
            "disturbed": self.field.disturbed or self.held.stuck,
        }

    @property
    def heading_variance(self):
        own = self.P[UP, UP]
        if self.mag:
            return self.deviation.variance(own, self.iron)
        return own + (self.first_turned / 2.5) ** 2

    @property
    def doubt(self):
        return self.under_way.doubt(self.velocity_noise)

    @property
    def velocity_noise(self):
        return SPEED**2 + max(self.accelerations, self.under_way.turning)

    @property
    def tilt(self):
        """Variance of the angle between true and estimated up."""
        own = min(self.doubt * np.trace(self.P[:UP, :UP]), 1.0)
        return own + 2.0 * (ACCEL_BIAS / G) ** 2

    def follow(self, samples):
        """Samples of a tick, and what is known after each: but for the orientation, what was."""
        rate = self.fading(samples)[:, None] * (samples.gyro - self.b)
        told, turned, known = [], [], self.known()
        self.wrong = None
        for k, step in enumerate((rate @ self.M.T) * samples.dt[:, None]):
            self.turn(step, samples, k)
            if not self.begun and not np.isnan(samples.accel[k, 0]):
                self.level(samples.accel[k], samples.seen[k], not np.isnan(samples.mag[k, 0]))
            turned.append(self.q)
            earth = quaternions.product(quaternions.about_up(self.heading), self.q)
            told.append({**known, "quaternion": earth})
        return Tick(samples, quaternions.matrices(turned), rate), told

    def turn(self, step, samples, k):
        """By a step and what coning adds; one before it that stands alone was none."""
        if self.doubted is not None:
            before, angle = self.doubted
            if np.linalg.norm(step - before) <= BACK * np.linalg.norm(angle):
                self.before = 0.5 * (before + step)
                for turned in (-angle, self.before):
                    self.q = quaternions.product(self.q, as_quaternion(turned))
                if self.wrong is not None:
                    samples.gyro[self.wrong] = samples.gyro[k]
        angle = step + np.cross(self.before, step) / 12.0
        size, changed = np.linalg.norm(step), np.linalg.norm(step - self.before)
        garbage = size > LARGE and changed > max(CHANGED * size, ACCELERATED * samples.dt[k] ** 2)
        self.doubted, self.wrong = ((self.before, angle), k) if garbage else (None, None)
        self.q = quaternions.product(self.q, as_quaternion(angle))
        self.before = step

    def fading(self, samples):
        """The share of the last rate that is believed; how far the body may have turned since."""
        kept = np.exp(-samples.age / FORGOTTEN)
        for k in range(len(samples)):
            if samples.age[k] == 0.0:
                self.lost = 0.0
                continue
            self.covered += samples.unknown[k] if samples.age[k] < math.inf else 0.0
            rate = max(np.linalg.norm(samples.gyro[k] - self.b), math.sqrt(self.usual), STILL)
            begun = rate_begun(samples.age[k]) if np.isnan(samples.accel[k, 0]) else 0.0
            rate = max((1.0 - kept[k]) * rate, begun)
            angle = min(self.lost + samples.dt[k] * rate, ANGLE_MOST)
            self.lost_variance += angle**2 - self.lost**2
            self.lost = angle
        return kept

    # The start.

    def level(self, accel, mag, known):
        """The sum of the forces so far points up; a first field may be a spike's."""
        u = np.array([0.0, 0.0, self.up]) + self.R @ accel
        size = np.linalg.norm(u)
        if size >= 1e-6:
            self.q = quaternions.unit(quaternions.product(upright(u / size), self.q))
            self.up = size
        told = 0 if np.isnan(mag[0]) else 1 + known
        if self.mag and told > self.northed:
            self.northed = told
            self.heading += self.east_of_north(self.R @ mag)

    @property
    def R(self):
        return quaternions.matrices([self.q])[0]

    def starting(self, span):
        """Whether a tick belongs to the start; then tilt and velocity are those of a mean force."""
        if self.begun or self.up == 0.0:
            return not self.begun
        self.begun_for += span
        if self.begun_for > START * (1.0 + 1e-9) and self.begun_for > span:
            self.begun = True
            return False
        k = START_SPEED / (G * self.begun_for)
        tilt = min(2.0 * k**2, START_TILT**2)
        self.restart([PHI, PHI + 1], tilt)
        self.restart([V, V + 1], START_SPEED**2)
        if tilt < START_TILT**2:
            for i, j, sign in ((PHI + 1, V, 1.0), (PHI, V + 1, -1.0)):
                self.P[i, j] = self.P[j, i] = sign * k * START_SPEED
        return True

    def restart(self, states, variance):
        self.P[states, :] = self.P[:, states] = 0.0
        self.P[states, states] = variance

    # A tick.

    def end(self, tick):
        self.news = self.has_news(tick)
        if self.P[PHI, PHI] > START_TILT**2 and tick.forces == 0:
            self.begun, self.begun_for, self.up = False, 0.0, 0.0
        told = self.look(tick)
        self.speed = math.sqrt(np.mean(np.sum((tick.samples.gyro - self.b) ** 2, axis=1)))
        self.predict(tick)
        if not self.mag and self.first_moved < 3.0:
            self.doubt_first_rest(tick.span)
        moving = not self.starting(tick.span) and tick.forces > 0
        if not moving:
            self.v = np.zeros(2)
        self.correct(tick, told, moving)
        if self.mag:
            self.see(tick)
        self.q = quaternions.unit(self.q)

    def doubt_first_rest(self, span):
        """A table that turns from the first sample on would have led the heading away."""
        rate, rest = abs(self.R[2] @ self.b), self.rest.candidate
        if rate > 0.8 * DEG:
            self.first_turned = min(self.first_turned + rate * span, 10.0)
        quiet = rest.ticks and rest.seconds >= 0.5 * (1.0 - 1e-9)
        if not quiet and self.first_turned > 0.0:
            self.first_moved += span
        if self.first_moved >= 3.0:
            self.first_turned = 0.0

    def has_news(self, tick):
        if not self.mag or not tick.fields:
            return False
        turned = (tick.gyro - self.b) * tick.span
        return self.held.observe(self.spikes.usual, turned, tick.span)

    def look(self, tick):
        """Whether it rests; returns what a rest says of the bias, and the variance of that."""
        field = self.R.T @ tick.field if self.news else None
        most = np.max(np.diag(self.P)[B:S])
        pushed = self.pushed > 0.0
        state, told = self.rest.observe(tick, field, self.b, most, BIAS_LIMIT, pushed)
        self.at_rest = state not in ("motion", "denied", "unclear")
        if state == "unclear":
            up, least = told
            more = max(least - up @ self.P[B:S, B:S] @ up, 0.0)
            self.P[B:S, B:S] += more * np.outer(up, up)
            return None
        if state == "jumped":
            heading = max(self.P[UP, UP], 10.0 if self.mag else 0.0)
            self.relearn(told[0], BIAS_FOLLOWED**2, heading)
            return tick.gyro, told[1]
        if state == "refuted":
            self.undo(told[0], max(told[1], REFUTED_BIAS**2))
            return None
        if state == "denied":
            self.undo(np.array(self.given), BIAS_SIGMA**2)
            self.by_bias = np.zeros(3)
        return told

    def undo(self, level, variance):
        self.heading += self.by_bias @ (level - self.b)
        self.relearn(level, variance, self.P[UP, UP])
        self.restart([PHI, PHI + 1], REFUTED_TILT**2)

    def relearn(self, level, variance, heading):
        """Nothing that was learned of the gyro holds."""
        self.b, self.M, self.v = level, np.eye(3), np.zeros(2)
        self.P = self.ignorance(heading, variance)
        self.forget_scale()
        self.end_drift()

    def predict(self, tick):
        h = tick.span * tick.force[2]
        turning, lifting = np.eye(17), np.eye(17)
        turning[PHI:B, B:V] = tick.turned_by()
        if self.drift.active:
            # The heading follows bias and drift together.
            turning[UP, B:S] = 0.0
        self.by_bias = self.by_bias + turning[UP, B:S]
        lifting[V, PHI + 1], lifting[V + 1, PHI] = h, -h
        F = lifting @ turning
        self.P = F @ self.P @ F.T + np.diag(self.noise(tick))
        if tick.forces:
            self.v = self.v + tick.span * tick.force[:2]
        self.bound()
        if not tick.forces:
            self.restart([V, V + 1], START_SPEED**2)

    def noise(self, tick):
        """Variances that a tick adds; those of bias and matrix not beyond their start."""
        rotation = N**2 + self.scale * self.speed**2 + TURN**2 * self.speed
        if self.lost == 0.0:
            self.usual += min(tick.span / USUAL_RATE, 1.0) * (self.speed**2 - self.usual)
        Q = np.zeros(17)
        Q[PHI:B] = tick.span * rotation + UNKNOWN * max(tick.unknown - self.covered, 0.0)
        Q[PHI:B] += self.lost_variance
        self.lost_variance = self.covered = 0.0
        Q[UP] += tick.span * FIELD_WALK if self.mag else 0.0
        Q[B:S], Q[S:V] = tick.span * BIAS_WALK**2, tick.span * MATRIX_WALK**2
        Q[V:] = tick.span * (VELOCITY_WALK**2 + self.under_way.walk)
        most = np.append(np.full(3, BIAS_FOLLOWED**2), MATRIX_SIGMA**2)
        # A prediction leaves these variances as they were.
        Q[B:V] = np.minimum(Q[B:V], np.maximum(most - np.diag(self.P)[B:V], 0.0))
        return Q

    def bound(self):
        for i, most in BOUNDS.items():
            if self.P[i, i] > most:
                shrink = np.eye(17)
                shrink[i, i] = math.sqrt(most / self.P[i, i])
                self.P = shrink @ self.P @ shrink
                if i == UP:
                    self.drift.with_heading = self.drift.with_heading * shrink[i, i]

    def correct(self, tick, told, moving):
        """The velocity stays near zero; at rest it is zero, and the rate is the bias."""
        x = np.zeros(17)
        before = self.upright_variances()
        ratio = self.slow(tick.span, x) if moving else None
        told_by_rest = self.rest.used or self.rest.denied or self.rest.support > 0.0
        if moving and not (self.at_rest or told_by_rest):
            self.give_back(tick, before, x)
        if told is not None:
            for i, rate in enumerate(told[0] - self.b):
                self.measure(B + i, rate, told[1], x)
        if self.at_rest:
            self.weigh(np.linalg.norm(tick.accel))
        elif moving and not (self.rest.used or self.rest.denied):
            self.go_straight(tick, x)
        self.apply(x)
        if moving:
            self.recover(tick, ratio)

    def slow(self, span, x):
        """Returns how much longer corrections of the tilt point one way than is expected."""
        R = REST_VELOCITY / span
        if self.at_rest:
            self.under_way = UnderWay(first=0.0)
        else:
            self.under_way.observe(self.v, self.R, span)
            weight = min(span / MEMORY, 1.0)
            self.accelerations += weight * (0.5 * self.v @ self.v - self.accelerations)
            doubt = DOUBTED if self.pushed > PUSHED_LONG * (1.0 + 1e-9) else 1.0
            R = doubt * self.velocity_noise / span
        by, both = self.P[V:, V:] + R * np.eye(2), self.P[PHI:UP, V:]
        expected = np.trace(both @ np.linalg.solve(by, both.T))
        for j in range(2):
            self.measure(V + j, -self.v[j], R, x)
        return None if self.at_rest else self.judge(x[PHI:UP], expected, span)

    def go_straight(self, tick, x):
        if tick.unknown > 0.0:
            self.straight_for = 0.0
            return
        up, first = self.R[2], self.straight_for < STRAIGHT_FOR * (1.0 - 1e-9)
        rate, given = up @ tick.gyro, up @ self.given
        apart = abs(rate - self.straight)
        self.straight += min(tick.span / STRAIGHT_FOR, 1.0) * (rate - self.straight)
        mean = self.straight
        steady = (
            apart <= STRAIGHT and abs(mean - given) <= STRAIGHT_MOST and abs(mean) <= BIAS_LIMIT
        )
        self.straight_for = self.straight_for + tick.span if steady else 0.0
        if self.straight_for < STRAIGHT_FOR * (1.0 - 1e-9):
            return
        if self.agrees(1.0 if first else tick.span / VOTE, tick.span) and self.votes >= MAJORITY:
            H = np.zeros(17)
            H[B:S] = up
            self.measure(H, rate - up @ self.b, STRAIGHT_NOISE**2 / tick.span, x)

    def agrees(self, vote, span):
        """Whether the present rate is that of most straights."""
        apart = self.straight - self.usual_straight
        if abs(apart) <= AGREES:
            self.votes = min(self.votes + vote, VOTES)
            self.usual_straight += min(span / FOLLOWED, 1.0) * apart
            return True
        self.votes -= 0.5 * vote
        if self.votes < 0.0:
            self.usual_straight, self.votes = self.straight, 1.0
        return False

    def give_back(self, tick, before, x):
        """Of a body that does not lean, gravity says nothing of the bias along the vertical."""
        up, rate = self.R[2], tick.gyro - self.b
        s = 1.0 - min(max(rate @ rate - (up @ rate) ** 2, 0.0) / LEANING**2, 1.0)
        x[B:S] -= s * up * (up @ x[B:S])
        x[UP] *= 1.0 - s
        less = [max(a - b, 0.0) for a, b in zip(before, self.upright_variances(), strict=True)]
        self.P[B:S, B:S] += s * less[0] * np.outer(up, up)
        self.P[UP, UP] += s * less[1]

    def upright_variances(self):
        """Of the bias along the vertical, and of the heading."""
        up = self.R[2]
        return up @ self.P[B:S, B:S] @ up, self.P[UP, UP]

    def weigh(self, force):
        """Strength of gravity: the mean of rests, of about a hundred ticks in the end."""
        count, mean = self.weighed or (0, 0.0)
        count = min(count + 1, 100)
        self.weighed = count, mean + (force - mean) / count

    def is_pushed(self, gravity, share):
        """A body that speeds up adds to gravity, a wrong tilt turns it."""
        x, y, z = self.mean_force
        return z > 0.0 and x * x + y * y + z * z - gravity**2 > share * (x * x + y * y)

    def recover(self, tick, ratio):
        """A tilt that is wrong although the filter is sure of it."""
        known = self.weighed and self.weighed[0] >= WEIGHED
        gravity = self.weighed[1] if known else None
        # What never changes while the body turns is stuck.
        if np.linalg.norm(tick.accel - self.felt) > 1e-9 or self.speed**2 <= 0.01:
            weight = min(tick.span / FORCE, 1.0)
            self.mean_force = self.mean_force + weight * (tick.force - self.mean_force)
            self.recovered = min(self.recovered + tick.span, BETWEEN)
            x, y, z = self.mean_force
            sure = gravity is not None and self.is_pushed(gravity, SURELY)
            sure = sure and math.hypot(x, y) > STRONG
            self.pushed = self.pushed + tick.span if sure else 0.0
        self.felt = tick.accel
        if self.is_pushed(G if gravity is None else gravity, PUSHED):
            return
        x, y, z = self.mean_force
        size, angle = np.linalg.norm(self.mean_force), (x * x + y * y) / G**2
        if z < UPRIGHT * size and size > FALLEN:
            self.begun, self.begun_for, self.up = False, 0.0, 0.0
            self.stand()
            return
        if (
            ratio is None
            or ratio <= PERSIST
            or math.hypot(x, y) <= LEVEL_FORCE
            or angle <= self.P[PHI, PHI] + self.P[PHI + 1, PHI + 1]
            or self.recovered < BETWEEN * (1.0 - 1e-9)
        ):
            return
        self.recovered = 0.0
        self.restart([V, V + 1], START_SPEED**2)
        mean = 0.5 * (self.P[PHI, PHI] + self.P[PHI + 1, PHI + 1])
        self.P[range(2), range(2)] += max(min(angle, START_TILT**2) - mean, 0.0)
        self.bound()
        up = self.R[2]
        self.P[B:S, B:S] += BIAS_REVIVED**2 * (np.eye(3) - np.outer(up, up))
        self.v, self.accelerations = np.zeros(2), 0.5**2
        self.sum, self.expected = np.zeros(2), 0.0

    def measure(self, i, innovation, R, x):
        """One state was measured, or a sum of them: gain, and Joseph's form of its covariance."""
        H = np.eye(17)[i] if isinstance(i, int) else i
        K = self.P @ H / (H @ self.P @ H + R)
        x += K * (innovation - H @ x)
        rest = np.eye(17) - np.outer(K, H)
        self.P = rest @ self.P @ rest.T + R * np.outer(K, K)

    def judge(self, tilt, expected, span):
        """Corrections of the tilt that persist are the gyro's."""
        self.sum = max(1.0 - span / SUMMED, 0.0) * self.sum + tilt
        self.expected = max(1.0 - 2.0 * span / SUMMED, 0.0) * self.expected + expected
        ratio = self.sum @ self.sum / (self.expected + 1e-12)
        share = min(span / FOLLOWS, 1.0) * min(self.speed**2 / LOST_TURNING, 1.0)
        scale = self.scale * (1.0 + share * (min(ratio, LARGEST) - USUAL))
        self.scale = min(max(scale, SCALE**2), MOST * SCALE**2)
        return ratio

    def apply(self, x):
        tilt = quaternions.steps(np.array([[x[PHI], x[PHI + 1], 0.0]]))[0].tolist()
        self.q = quaternions.product(tilt, self.q)
        self.heading += x[UP]
        self.iron.learned(self.R[2] @ x[B:S])
        self.b = np.clip(self.b + x[B:S], -10.0, 10.0)
        self.M = np.eye(3) + np.clip(self.M - np.eye(3) + x[S:V].reshape(3, 3), -0.2, 0.2)
        self.v = np.clip(self.v + x[V:], -1e4, 1e4)

    # The magnetometer.

    def see(self, tick):
        """Corrects the heading alone: the gain of all others is zero, whatever it should be."""
        self.pull = None
        self.follow_drift(tick.span)
        self.field_age = min(self.field_age + tick.span, FIELD_HOLDS)
        if not self.news:
            return
        seconds, self.field_age = self.field_age, 0.0
        doubt = self.field.observe(tick.field, seconds, self.speed)
        east, north, up = tick.field
        weight, e = share_of_places(self.speed, seconds), self.east_of_north(tick.field)
        self.drift.look(np.array([math.hypot(east, north), -up]), weight)
        turned = tick.mean_rotation()
        unused = 16.0 if doubt is None else doubt
        self.iron.look(tick.field, turned, seconds, unused, self.drift.walk)
        if self.begun and not self.at_rest:
            believed = self.field.believed
            grown = self.drift.judge(e, self.P[UP, UP], believed, self.iron, seconds)
            if grown is not None:
                self.blur_heading(grown[0])
                self.iron.P[6, 6] += grown[1]
                self.by_bias = np.zeros(3)
        if doubt is None:
            return
        level = (east**2 + north**2) / (east**2 + north**2 + up**2)
        R = FIELD / seconds * doubt * max(LEVEL / level, 1.0)
        before, K = self.P[UP, UP], np.zeros(17)
        K[UP] = gain = before / (before + R)
        self.drift.correct(gain)
        rest = np.eye(17) - np.outer(K, np.eye(17)[UP])
        self.P = rest @ self.P @ rest.T + R * np.outer(K, K)
        self.by_bias = (1.0 - gain) * self.by_bias
        c, s = math.cos(self.heading), math.sin(self.heading)
        east = c * turned[0] - s * turned[1]
        tilt, after = 0.5 * self.tilt, self.P[UP, UP]
        place = (weight, seconds, before, after, self.iron.strength)
        self.deviation.correct(gain, R, e, tick.field, tilt, east, *place)
        self.heading += gain * e
        # By what a field of the sensor's axes turns the one that the heading follows.
        self.pull = gain, east / math.hypot(*tick.field[:2])

    def follow_drift(self, span):
        turned, grown = self.drift.predict(self.iron, self.P[UP, UP], span)
        if grown:
            self.blur_heading(grown)
            self.heading += turned
        if self.at_rest:
            kept = max(1.0 - span / 2.0, 0.0)
            self.drift.lag, self.drift.mean = kept * self.drift.lag, kept * self.drift.mean
            if self.rest.lasted >= 2.0:
                self.end_drift()

    def end_drift(self):
        self.drift.end()
        up = self.R[2]
        self.iron.rest(up @ self.P[B:S, B:S] @ up)

    def blur_heading(self, grown):
        self.P[UP, UP] += grown
        self.bound()

    def east_of_north(self, direction):
        """Angle from north to a direction in the frame, clockwise."""
        angle = math.atan2(direction[0], direction[1]) - self.heading
        return math.remainder(angle, 2.0 * math.pi)

    # A gap.

    def lose(self, seconds):
        """It may have turned as it did, another way every second, or from rest on."""
        turned = (max(self.speed**2, self.usual) + STILL**2) * seconds
        turned = max(turned, (0.5 * rate_begun(seconds) * seconds) ** 2)
        self.rest.interrupt()
        self.at_rest = False
        self.lost = self.lost_variance = self.covered = self.usual = 0.0
        self.stand()
        self.v, self.before, self.under_way = np.zeros(2), np.zeros(3), UnderWay()
        self.doubted = None
        self.restart([V, V + 1], START_SPEED**2)
        self.P[range(3), range(3)] += turned
        self.bound()
        self.iron.blur(turned)
        if self.P[PHI, PHI] > START_TILT**2:
            self.begun, self.begun_for, self.up = False, 0.0, 0.0


def rate_begun(seconds):
    """Rate that a body may have that rested so many seconds ago."""
    return BEGUN * seconds if 1.0 < seconds < math.inf else 0.0


def as_quaternion(turn):
    return quaternions.steps(turn[None])[0].tolist()


def upright(u):
    """The least rotation that turns a direction up; of straight down about x."""
    w = math.sqrt(max(0.5 * (1.0 + u[2]), 0.0))
    if w < 1e-6:
        return (0.0, 1.0, 0.0, 0.0)
    return (w, u[1] / (2.0 * w), -u[0] / (2.0 * w), 0.0)
