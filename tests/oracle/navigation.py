"""The navigation filter with whole matrices: one sample, one fix, one scalar at a time.

Errors are those of position, velocity and orientation, estimated less true, and of the biases, true
less estimated. A velocity's is that in the frame which is believed in: v_hat - exp(-[phi x]) v.
Eight constants follow, true less estimated: scale, yaw and pitch of wheels, the place of the
antenna, the reference of the barometer and the offset of the compass; one that is known has no
variance.
"""

import numpy as np

from oracle.aids import COMPASS, Aided

RADIUS, ECCENTRICITY, ROTATION = 6378137.0, 6.6943799901413e-3, 7.292115e-5
EQUATOR, POLE = 9.7803253359, 9.8321849378
LATITUDE_MAX, HEIGHT_MAX = np.radians(89.5), 1e6

SAMPLE_MAX, BIAS_MAX, VELOCITY_MAX = 1e4, 10.0, 1e5
GAP, HELD, COASTING = 1.0, 0.1, 2.0
# A gyro that is unknown for longer is a gap.
UNKNOWN_MAX = 2.0
# Least noise of a scalar, over what the errors do to it.
NOISE_MIN = 1e-8
# A correction after which the earth is that of another place, m.
FAR = 1e3
LATE, AHEAD = 1.0, 0.1
SIGMAS = (1e-3, 1e6)
INNOVATION_MAX = 1e8
# Of what nothing is known: densities of a rate and a force, and deviation of a velocity.
UNKNOWN, UNKNOWN_VELOCITY = (1.0, 25.0), 10.0
# Level, level, heading: what a filter that was wrong, or had a gap, gains in variance.
WRONG = np.array([1e-3, 1e-3, 0.03])
LOST = np.array([1e-2, 1e-2, 0.25])
ANGLE_MAX = 10.0
COURSE_SPEED, COURSE_DEVIATIONS, COURSE_SIGMA = 1.0, 10.0, 0.03
APART_DEVIATIONS, APART_SECONDS = 20.0, 10.0
WHEELS_EVERY, WHEELS_SPEED = 0.2, 1.0
REST_SIGMA, REST_SPEED, REST_RATE = 0.05, 0.5, 1e-7
SIZES_MAX = (1e14, 1e10, 1e3)

# The wheels' constants before they tell anything; beyond three deviations they slip, for 10 s.
WHEELS_PRIOR, SLIP, SLIP_SECONDS = np.array([0.03, 0.035, 0.035]), 9.0, 10.0
CONSTANT_MAX, LEVER_MAX, SPEED_MAX = 1.5, 1e3, 1e4
# What fixes may leave after an outage, squared and over their noise.
SURPRISE = 16.27

R, V, PHI, GYRO, ACCEL, ROLL, ANTENNA = (slice(i, i + 3) for i in range(0, 21, 3))
ERRORS, ALL = 15, 23
I3 = np.eye(3)


def cross(a, b):
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def skew(v):
    x, y, z = v.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rotation(phi):
    """exp([phi x]), by Rodrigues."""
    angle = float(np.sqrt(phi @ phi))
    if angle == 0.0:
        return np.eye(3)
    K = skew(phi)
    return I3 + np.sinc(angle / np.pi) * K + 0.5 * np.sinc(0.5 * angle / np.pi) ** 2 * (K @ K)


def nearest_rotation(C):
    u, _, v = np.linalg.svd(C)
    return u @ v


def matrix(q):
    w, x, y, z = np.asarray(q) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def wrapped(angle):
    return angle if abs(angle) <= np.pi else angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))


def is_known(v):
    return bool(np.all(np.abs(v) <= SAMPLE_MAX))


class Place:
    """The earth at a latitude and a height: it is found anew at steps of the covariance only."""

    def __init__(self, latitude, height):
        sine, cosine = np.sin(latitude), np.cos(latitude)
        root = np.sqrt(1.0 - ECCENTRICITY * sine**2)
        self.meridian = RADIUS * (1.0 - ECCENTRICITY) / root**3 + height
        self.normal = RADIUS / root + height
        self.parallel = self.normal * cosine
        k = np.sqrt(1.0 - ECCENTRICITY) * POLE / EQUATOR - 1.0
        self.gravity = EQUATOR * (1.0 + k * sine**2) / root * (1.0 - 2.0 * height / RADIUS)
        self.earth = ROTATION * np.array([cosine, 0.0, -sine])
        self.tangent = sine / cosine

    def transport(self, v):
        north, east, _ = v
        return np.array(
            [east / self.normal, -north / self.meridian, -east * self.tangent / self.normal]
        )


class Judge:
    """Whether positions, or velocities, are believed, and the noise that their innovations show."""

    def __init__(self):
        self.spread, self.count, self.usual = np.zeros(3), 0, 0.0
        self.restart()

    def restart(self):
        """The filter begins anew; the receiver is the same."""
        self.last, self.last_time = np.zeros(3), np.nan
        self.rejected, self.open_until, self.nis = 0, -np.inf, np.nan
        self.first = None

    def learn(self, time, e):
        """Returns the seconds of an outage that this ends, else None."""
        apart = time - self.last_time
        ended = apart > max(2.0, 5.0 * self.usual)
        if ended:
            self.open_until = time + 1.0
        # Of a receiver whose usual time is not known yet nobody knows what an outage is.
        outage = apart if ended and self.usual > 0.0 else None
        if apart > 0.0:
            part = 0.1 if self.usual > 0.0 else 1.0
            self.usual += part * (min(apart, 60.0) - self.usual)
        if apart <= 1.5:
            self.count += 1
            w = max(0.03, 1.0 / self.count)
            new = 0.5 * (e - self.last) ** 2
            if self.count > 1:
                new = np.minimum(new, 4.0 * self.spread)
            self.spread = (1.0 - w) * self.spread + w * np.minimum(new, INNOVATION_MAX**2)
        self.last, self.last_time = e, time
        return outage

    def after_outage(self, time, outage, e, noise, walk):
        """ "none", "first", or the seconds of an outage after which two positions agree."""
        if outage is not None:
            self.first = (e, time, outage + (self.first[2] if self.first else 0.0))
            return "first"
        if self.first is None:
            return "none"
        there, then, seconds = self.first
        dt = time - then
        most = 3.0 * np.sqrt(2.0 * noise + walk * dt**2) + 0.5 + 4.5 * np.abs(there) * dt / seconds
        if np.all(np.abs(e - there) <= most) or self.rejected >= 10:
            self.first, self.rejected = None, 0
            return seconds
        self.rejected += 1
        self.first = (e, time, seconds + dt)
        return "first"

    def noise(self, told, adapt):
        if self.count < 10 or adapt == "fixed":
            return told
        return np.maximum(self.spread, told if adapt == "inflate" else 1e-4 * told)

    def learned(self):
        return np.sqrt(self.spread) if self.count >= 10 else np.full(3, np.nan)

    def decide(self, time, nis, gate):
        self.nis = nis
        if nis <= gate or time < self.open_until:
            self.rejected = 0
            return "take"
        self.rejected += 1
        if self.rejected <= 10:
            return "reject"
        self.rejected = 0
        return "widen"


class Navigation(Aided):
    """Give noise as densities (not squared): white and walk, each of three axes."""

    def __init__(
        self,
        start,
        gyro,
        accel,
        *,
        gyro_vibration=0.0,
        antenna=(0.0, 0.0, 0.0),
        antenna_sigma=0.0,
        consider_antenna=False,
        vehicle=None,
        axle=(0.0, 0.0, 0.0),
        wheel_sigma=0.3,
        speed_sigma=0.15,
        gate=50.0,
        adapt="inflate",
        covariance_step=0.1,
        kind="rate",
        **aids,
    ):
        self.start, self.gate, self.adapt, self.kind = start, gate, adapt, kind
        (self.N_g, self.K_g), (self.N_a, self.K_a) = (np.square(part) for part in (gyro, accel))
        self.gyro_vibration = gyro_vibration
        self.antenna, self.axle = np.array(antenna), np.array(axle)
        self.considers = consider_antenna
        self.wheeled, self.wheel_sigma = vehicle == "wheeled", wheel_sigma
        self.step = covariance_step
        self.by_course = self.wheeled or start.course
        self.C, self.v, self.a = matrix(start.quaternion), np.zeros(3), np.zeros(3)
        self.latitude, self.longitude, self.height = np.radians(start.latitude), 0.0, 0.0
        self.place = Place(self.latitude, 0.0)
        self.b_g, self.b_a = np.array(start.gyro_bias), np.array(start.accel_bias)
        self.speed_sigma, self.roll, self.slips = speed_sigma, np.zeros(3), None
        deviations = np.zeros(ALL)
        deviations[ANTENNA] = antenna_sigma
        deviations[PHI] = [start.level_sigma, start.level_sigma, start.heading_sigma]
        deviations[GYRO], deviations[ACCEL] = start.gyro_bias_sigma, start.accel_bias_sigma
        self.P = np.diag(deviations**2)
        self.sigma = np.full(ERRORS, np.nan)
        self.judges = [Judge(), Judge()]
        self.time = np.nan
        self.w, self.f = np.zeros(3), np.zeros(3)
        self.ages = [0.0, 0.0]
        self.heading_known, self.navigating = start.heading_known, False
        self.before = None
        self.alone, self.since_wheels, self.last_used = 0.0, 0.0, np.nan
        self.fixes = {"used": 0, "rejected": 0, "refused": 0}
        self.rejected = {"positions": 0, "velocities": 0}
        self.moves, self.last_move = 0, None
        self.rolled = []
        self.begin_aids(**aids)
        self.clear()

    def clear(self):
        """Sums since the last step of the covariance."""
        self.seconds, self.samples, self.rests = 0.0, 0, 0
        self.sum_C, self.sum_v, self.sum_w = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
        self.unknown, self.vibration = [0.0, 0.0], np.zeros(3)

    # Samples.

    def update(self, t, gyro, accel, rest=False):
        gyro, accel, dt = np.array(gyro), np.array(accel), t - self.time
        if not dt <= GAP:
            self.begin(t, gyro, accel)
            return
        theta, delta = self.increments(gyro, accel, dt)
        self.time = t
        if not self.navigating:
            if t > self.start.time:
                self.turn(theta, self.place.earth * dt)
                self.settle()
                self.alone += dt
            self.clear()
            return
        self.advance(theta, delta, dt)
        self.seconds += dt
        self.samples += 1
        self.rests += rest
        self.sum_C += self.C
        self.sum_v += self.v
        self.sum_w += self.w
        if self.seconds >= self.step - 0.25 * dt:
            self.propagate()
            self.look_at_wheels()

    def begin(self, t, gyro, accel):
        """The first sample, or the first after a gap."""
        if np.isfinite(self.time):
            self.lose()
        # The first increments belong to a time that is not known.
        known = [self.kind == "rate" and is_known(part) for part in (gyro, accel)]
        self.time = t
        self.w, self.f = gyro if known[0] else np.zeros(3), accel if known[1] else np.zeros(3)
        self.ages = [0.0 if k else HELD for k in known]

    def increments(self, gyro, accel, dt):
        """Rotation vector and gained velocity, biases removed: two samples of coning, sculling."""
        w0, f0 = self.w, self.f
        per = 1.0 if self.kind == "rate" else dt
        w1, f1 = self.measured(gyro / per, accel / per, dt)
        # Increments are means already.
        w, f = ((w0 + w1) / 2.0, (f0 + f1) / 2.0) if self.kind == "rate" else (w1, f1)
        self.vibration += ((w1 - w0) * dt) ** 2
        self.w, self.f = w1, f1
        theta = w * dt + cross(w0, w1) * dt**2 / 12.0 - self.b_g * dt
        sculling = (cross(w0, f1 - f0) + cross(f0, w1 - w0)) * dt**2 / 12.0
        delta = f * dt + sculling + 0.5 * cross(w * dt, f * dt) - self.b_a * dt
        return theta, delta

    def measured(self, gyro, accel, dt):
        """A missing sample is the last one for a tenth of a second, then it is unknown."""
        guess = [self.b_g, np.clip(self.b_a - self.C.T[:, 2] * self.place.gravity, -1e4, 1e4)]
        found = [gyro, accel]
        for i, held in enumerate((self.w, self.f)):
            if is_known(found[i]):
                self.ages[i] = 0.0
                continue
            self.ages[i] += dt
            found[i] = held
            if self.ages[i] > HELD:
                found[i] = guess[i]
                self.unknown[i] += dt
        return found

    def turn(self, theta, frame):
        # The axes of the earth to first order: `settle` takes the square, a stretch, out again.
        self.C = (I3 - skew(frame)) @ self.C @ rotation(theta)

    def advance(self, theta, delta, dt):
        earth, transport = self.place.earth, self.place.transport(self.v)
        gained = self.C @ delta
        change = gained - cross(2.0 * earth + transport, self.v) * dt
        change -= 0.5 * cross(earth + transport, gained) * dt
        change += np.array([0.0, 0.0, self.place.gravity * dt])
        north, east, down = (self.v + 0.5 * change) * dt
        self.v, self.a = self.v + change, change / dt
        self.latitude += north / self.place.meridian
        self.longitude += east / self.place.parallel
        self.height -= down
        self.turn(theta, (earth + transport) * dt)

    def settle(self):
        self.C = nearest_rotation(self.C)
        self.longitude = wrapped(self.longitude)
        self.place = Place(self.latitude, self.height)

    # The covariance.

    def propagate(self):
        """To the last sample, with means over the step."""
        if self.samples == 0:
            return
        self.settle()
        T, C, v = self.seconds, self.sum_C / self.samples, self.sum_v / self.samples
        transition, half = self.transition(T, C, v), self.growth(T, C, v)
        P = transition @ (self.P + half) @ transition.T + half
        self.P = 0.5 * (P + P.T)
        self.walk_constants()
        count, rests, mean_w, unknown = self.samples, self.rests, self.sum_w, self.unknown
        self.clear()
        self.since_wheels += T
        if not self.is_somewhere():
            self.lose()
            return
        self.refresh()
        if rests == count:
            self.stand(mean_w / count, T, unknown[0] > 0.0)
        if self.rolled and self.navigating:
            self.take_rolled()

    def transition(self, T, C, v):
        earth, transport = self.place.earth, self.place.transport(self.v)
        g = skew(np.array([0.0, 0.0, self.place.gravity]))
        F = np.zeros((ALL, ALL))
        F[R, V], F[R, PHI] = I3, skew(v)
        F[V, V], F[V, PHI] = -skew(2.0 * earth + transport), -g
        F[V, GYRO], F[V, ACCEL] = skew(v) @ C, C
        F[PHI, PHI], F[PHI, GYRO] = -skew(earth + transport), -C
        result = np.eye(ALL) + F * T + F @ F * (T**2 / 2.0)
        # Of the third order, only what a bias of the gyro does to the position through gravity.
        result[R, GYRO] += g @ C * (T**3 / 6.0)
        return result

    def growth(self, T, C, v):
        """QT/2."""
        N_g = self.N_g + 0.5 * self.gyro_vibration**2 * self.vibration / T
        W = C @ np.diag(N_g) @ C.T * T + I3 * UNKNOWN[0] * self.unknown[0]
        A = C @ np.diag(self.N_a) @ C.T * T + I3 * UNKNOWN[1] * self.unknown[1]
        G = np.zeros((ALL, ALL))
        G[PHI, PHI], G[V, PHI] = W, -skew(v) @ W
        G[PHI, V], G[V, V] = G[V, PHI].T, skew(v) @ W @ skew(v).T + A
        G[GYRO, GYRO], G[ACCEL, ACCEL] = np.diag(self.K_g * T), np.diag(self.K_a * T)
        return G / 2.0

    def is_somewhere(self):
        sizes = [np.trace(self.P[part, part]) for part in (R, V, PHI)]
        small = all(size < most for size, most in zip(sizes, SIZES_MAX, strict=True))
        return (
            small
            and self.ages[0] <= UNKNOWN_MAX
            and self.v @ self.v < VELOCITY_MAX**2
            and self.is_on_earth()
        )

    def is_on_earth(self):
        return abs(self.height) < HEIGHT_MAX and abs(self.latitude) < LATITUDE_MAX

    def lose(self):
        """Position and velocity, the orientation nearly; biases are kept."""
        variances = np.diag(self.P).copy()
        variances[R], variances[V] = 0.0, 0.0
        variances[PHI] = np.minimum(variances[PHI] + LOST, ANGLE_MAX)
        if self.navigating:
            self.v = np.zeros(3)
            if not self.is_on_earth():
                self.latitude, self.longitude = np.radians(self.start.latitude), 0.0
                self.height, self.a = 0.0, np.zeros(3)
                self.place = Place(self.latitude, 0.0)
        self.begin_anew(variances)
        self.rolled = []
        self.sigma = np.full(ERRORS, np.nan)
        self.restart_aids()
        self.usable = np.zeros(5, dtype=bool)
        self.navigating = False
        self.heading_known = self.start.heading_known and not self.by_course
        self.before, self.alone = None, 0.0
        self.clear()

    def begin_anew(self, variances):
        """Of the constants all that is known stays."""
        constants = self.P[ERRORS:, ERRORS:]
        self.P = np.diag(variances)
        self.P[ERRORS:, ERRORS:] = constants

    def refresh(self):
        """Standard deviations; that of v_hat - v = dv + v x phi for the velocity."""
        P = self.P.copy()
        H = np.zeros((3, ALL))
        H[:, V], H[:, PHI] = I3, skew(self.v)
        P[V, V] = H @ self.P @ H.T
        self.sigma = np.sqrt(np.maximum(np.diag(P), 0.0))[:ERRORS]
        self.judge_outputs()

    # Measurements.

    def correct(self, z, H, noise, x):
        """Scalar by scalar: x are the errors found so far. Returns both, and the NIS."""
        P, nis = self.P, 0.0
        for h, value, variance in zip(H, z, noise, strict=True):
            k = P @ h
            S = h @ k + max(variance, NOISE_MIN * (h @ k))
            e = value - h @ x
            gain = k.copy()
            if self.considers:
                gain[ANTENNA] = 0.0
            x = x + gain * (e / S)
            # Of any gain: (I - Kh) P (I - Kh)' + K R K'.
            P = P - (np.outer(gain, k) + np.outer(k, gain) - np.outer(gain, gain)) / S
            nis += e * e / S
        return 0.5 * (P + P.T), x, nis

    def apply(self, x):
        E = rotation(x[PHI])
        self.C, self.v = E @ self.C, E @ (self.v - x[V])
        self.latitude -= x[0] / self.place.meridian
        self.longitude = wrapped(self.longitude - x[1] / self.place.parallel)
        self.height += x[2]
        self.b_g = np.clip(self.b_g + x[GYRO], -BIAS_MAX, BIAS_MAX)
        self.b_a = np.clip(self.b_a + x[ACCEL], -BIAS_MAX, BIAS_MAX)
        self.roll = np.clip(self.roll + x[ROLL], [-0.5, -1.5, -1.5], [0.5, 1.5, 1.5])
        self.antenna = np.clip(self.antenna + x[ANTENNA], -LEVER_MAX, LEVER_MAX)
        self.take_out(x)
        if not self.is_somewhere():
            self.lose()
            return
        if np.linalg.norm(x[R]) > FAR:
            self.settle()
        self.refresh()

    def stand(self, mean_w, T, rate_unknown):
        if np.linalg.norm(self.v) >= REST_SPEED + 3.0 * np.linalg.norm(self.sigma[V]):
            return
        H = np.zeros((6, ALL))
        H[:3, V], H[:3, PHI], H[3:, GYRO] = I3, skew(self.v), I3
        z = np.append(self.v, mean_w - self.b_g - self.C.T @ self.place.earth)
        noise = np.append(np.full(3, REST_SIGMA**2), self.N_g / T + REST_RATE**2)
        count = 3 if rate_unknown else 6
        self.P, x, _ = self.correct(z[:count], H[:count], noise[:count], np.zeros(ALL))
        self.apply(x)

    def look_at_wheels(self):
        """Sideways and down a wheel does not go."""
        if not (self.wheeled and self.navigating and self.since_wheels >= WHEELS_EVERY - 1e-6):
            return
        self.since_wheels = 0.0
        if self.v @ self.v <= WHEELS_SPEED**2:
            return
        u, H = self.at_the_axle(self.C.T @ self.v, self.w - self.b_g)
        noise = np.full(2, self.wheel_sigma**2)
        self.P, x, _ = self.correct(u[1:], H[1:], noise, np.zeros(ALL))
        self.apply(x)

    def at_the_axle(self, velocity, rate):
        """The velocity there in the axes of the wheels, and what errors do to it."""
        _, yaw, pitch = self.roll
        c, s, d, t = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
        turned = np.array([[d, 0.0, -t], [0.0, 1.0, 0.0], [t, 0.0, d]]) @ np.array(
            [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]
        )
        u = turned @ (velocity + cross(rate, self.axle))
        H = np.zeros((3, ALL))
        H[:, V], H[:, GYRO] = turned @ self.C.T, -turned @ skew(self.axle)
        # To first order in the pitch, as a mount's is small.
        H[:, 16], H[:, 17] = [-u[1], u[0], 0.0], [u[2], 0.0, -u[0]]
        if self.P[15, 15] == 0.0:
            H[:, ROLL] = 0.0
        return u, H

    def update_wheels(self, t, speed, sigma=None):
        age = self.time - t
        there = speed is not None and abs(speed) <= SPEED_MAX and -AHEAD <= age <= LATE
        if not (there and self.navigating):
            return False
        # A heading that is wrong by more would be taken for a mount that is turned.
        if self.P[15, 15] == 0.0 and not self.sigma[8] < 0.1:
            return False
        if self.P[15, 15] == 0.0:
            self.P[ROLL, ROLL] = np.diag(WHEELS_PRIOR**2)
        sigma = np.clip(self.speed_sigma if sigma is None else sigma, 1e-3, SPEED_MAX)
        self.rolled.append((speed, sigma**2, self.C.T @ (self.v - self.a * age), self.w))
        return True

    def take_rolled(self):
        """The mean of what wheels have told since the last step."""
        w, variance, velocity, rate = (
            np.mean(part, axis=0) for part in zip(*self.rolled, strict=True)
        )
        self.rolled = []
        u, H = self.at_the_axle(velocity, rate - self.b_g)
        h, scale = H[:1], 1.0 + self.roll[0]
        # By the speed that is expected: the one that is told has noise of its own.
        h[0, 15] = u[0] / scale
        z, spread = u[0] - scale * w, (h @ self.P @ h.T)[0, 0]
        if z**2 > SLIP * (spread + variance):
            self.slips = self.time if self.slips is None else self.slips
            if self.time - self.slips < SLIP_SECONDS:
                return
            variance = max(variance, z**2 / SLIP - spread)
        else:
            self.slips = None
        self.P, x, _ = self.correct([z], h, [variance], np.zeros(ALL))
        self.apply(x)

    # Fixes.

    def update_gnss(self, t, position, velocity=None, position_sigma=2.0, velocity_sigma=0.1):
        given = self.looked_at(position, velocity, position_sigma, velocity_sigma)
        age = self.time - t
        if given is None or not (t >= self.start.time and -AHEAD <= age <= LATE):
            verdict = "refused"
        else:
            verdict = self.take(t, age, *given)
        self.fixes[verdict] += 1
        if verdict == "used":
            self.last_used = self.time
        return verdict

    def looked_at(self, position, velocity, position_sigma, velocity_sigma):
        """What is there of a fix; a height or a vertical velocity may be missing."""
        p = np.array(position, dtype=float)
        p[:2] = np.radians(p[:2])
        v = np.full(3, np.nan) if velocity is None else np.array(velocity, dtype=float)
        sigmas = [
            np.clip(np.broadcast_to(sigma, 3), *SIGMAS)
            for sigma in (position_sigma, velocity_sigma)
        ]
        for part, sigma in zip((p, v), sigmas, strict=True):
            if np.isnan(part[2]):
                part[2], sigma[2] = 0.0, SIGMAS[1]
        there = abs(p[0]) < LATITUDE_MAX and abs(p[1]) < 7.0 and abs(p[2]) < HEIGHT_MAX
        p, v = p if there else None, v if is_known(v) else None
        return None if p is None and v is None else (p, v, *sigmas)

    def take(self, t, age, p, v, sigma_p, sigma_v):
        if not self.navigating:
            return self.start_from(t, age, p, v, sigma_p, sigma_v)
        self.propagate()
        if not self.navigating:
            return "refused"
        lever = self.C @ self.antenna
        v_a = self.v + self.C @ cross(self.w - self.b_g, self.antenna)
        H_p, H_v = np.zeros((3, ALL)), np.zeros((3, ALL))
        H_p[:, R], H_p[:, PHI], H_p[:, ANTENNA] = I3, skew(lever), -self.C
        H_v[:, V], H_v[:, PHI], H_v[:, GYRO] = I3, skew(v_a), -self.C @ skew(self.antenna)
        H_v[:, ANTENNA] = -self.C @ skew(self.w - self.b_g)
        kinds = []
        if p is not None:
            z = self.offset_from(p) + lever - v_a * age + 0.5 * self.a * age**2
            kinds.append((0, R, z, H_p, sigma_p))
        if v is not None:
            kinds.append((1, V, v_a - self.a * age - v, H_v, sigma_v))
        kinds = [
            (k, part, np.clip(z, -INNOVATION_MAX, INNOVATION_MAX), *of) for k, part, z, *of in kinds
        ]
        outages = {k: self.judges[k].learn(self.time, z) for k, _, z, _, _ in kinds}
        after = "none"
        if p is not None:
            noise, walk = self.judges[0].noise(sigma_p**2, self.adapt), self.sigma[V] ** 2
            after = self.judges[0].after_outage(self.time, outages[0], kinds[0][2], noise, walk)
        if after == "none":
            return self.usual(kinds)
        if after == "first":
            self.believed(kinds)
            self.rejected["positions"] += 1
            return "rejected"
        return self.comes_back(kinds, after)

    def believed(self, kinds):
        """What all of them would make of the filter, and the most that is left, by their noise."""
        kept, x, noises = self.P, np.zeros(ALL), []
        for kind, _, z, H, sigma in kinds:
            noise = self.judges[kind].noise(sigma**2, self.adapt)
            self.P, x, nis = self.correct(z, H, noise, x)
            self.judges[kind].nis = nis
            noises.append(noise)
        found, self.P = self.P, kept
        left = [
            np.sum((z - H @ x) ** 2 / noise)
            for (_, _, z, H, _), noise in zip(kinds, noises, strict=True)
        ]
        return found, x, max(left)

    def comes_back(self, kinds, seconds):
        """Two positions agree after an outage: they are right."""
        P, x, left = self.believed(kinds)
        if left > SURPRISE:
            shown = [judge.nis for judge in self.judges]
            self.P[R, R] += np.diag(kinds[0][2] ** 2)
            fast = kinds[1][2] if len(kinds) > 1 else 2.0 * kinds[0][2] / seconds
            self.P[V, V] += np.diag(fast**2)
            self.P[PHI, PHI] += np.diag(WRONG)
            P, x, _ = self.believed(kinds)
            for judge, nis in zip(self.judges, shown, strict=True):
                judge.nis = nis
        self.P = P
        self.apply(x)
        return "used" if self.navigating else "refused"

    def usual(self, kinds):
        """Each as its gate decides."""
        x, taken = np.zeros(ALL), {}
        for kind, part, z, H, sigma in kinds:
            judge = self.judges[kind]
            noise = judge.noise(sigma**2, self.adapt)
            P, found, nis = self.correct(z, H, noise, x)
            decision = judge.decide(self.time, nis, self.gate)
            taken[kind] = decision != "reject"
            if decision == "reject":
                self.rejected["velocities" if kind else "positions"] += 1
                continue
            if decision == "widen":
                if kind == 0:
                    self.moves, self.last_move = self.moves + 1, (self.time, np.linalg.norm(z))
                # The filter was wrong, by as much as the fix says.
                self.P[part, part] += np.diag(z**2)
                self.P[PHI, PHI] += np.diag(WRONG)
                P, found, _ = self.correct(z, H, noise, x)
            self.P, x = P, found
        if any(taken.values()):
            self.apply(x)
        if not self.navigating:
            return "refused"
        # The position is what a fix is for; the velocity counts where there is none.
        return "used" if taken[min(taken)] else "rejected"

    def offset_from(self, p):
        return np.array(
            [
                (self.latitude - p[0]) * self.place.meridian,
                wrapped(self.longitude - p[1]) * self.place.parallel,
                p[2] - self.height,
            ]
        )

    def start_from(self, t, age, p, v, sigma_p, sigma_v):
        """The first fix, or the first after a gap."""
        if p is None or self.ages[0] > UNKNOWN_MAX:
            return "refused"
        if v is None:
            v, sigma_v = self.between(t, p, sigma_p)
        heading_variance = None
        if not self.heading_known or self.heading_start is not None:
            heading_variance = self.look_along(v, sigma_v)
            if heading_variance is not None:
                self.heading_known, self.heading_start = True, None
        if not self.heading_known:
            return "refused"
        moves = v is not None
        if not moves:
            v, sigma_v = np.zeros(3), np.full(3, UNKNOWN_VELOCITY)
        sigma_v = np.minimum(sigma_v, UNKNOWN_VELOCITY)
        self.begin_at(age, p, v, sigma_p, sigma_v, moves, heading_variance)
        return "used"

    def look_along(self, v, sigma_v):
        """Turn along the course of a body that moves forward fast enough; return its variance."""
        if v is None or not self.by_course:
            return None
        sigma, speed = np.max(sigma_v[:2]), np.hypot(v[0], v[1])
        if speed < COURSE_SPEED or speed < COURSE_DEVIATIONS * sigma:
            return None
        # In a turn an antenna ahead of the axle goes sideways.
        ahead = self.antenna[0] - self.axle[0] if self.wheeled else 0.0
        drift = np.arctan2(np.clip((self.w - self.b_g)[2] * ahead, -speed, speed), speed)
        off = np.arctan2(v[1], v[0]) - drift - np.arctan2(self.C[1, 0], self.C[0, 0])
        self.C = rotation(np.array([0.0, 0.0, off])) @ self.C
        return (sigma / speed) ** 2 + COURSE_SIGMA**2

    def between(self, t, p, sigma_p):
        """The velocity since a fix before that was far enough away, and its deviation."""
        if self.before is None:
            self.before = (t, p)
        then, there = self.before
        seconds, place = t - then, Place(p[0], p[2])
        way = np.array(
            [
                (p[0] - there[0]) * place.meridian,
                wrapped(p[1] - there[1]) * place.parallel,
                there[2] - p[2],
            ]
        )
        far = np.hypot(way[0], way[1]) > APART_DEVIATIONS * np.max(sigma_p[:2])
        if far or not 0.0 <= seconds <= APART_SECONDS:
            self.before = (t, p)
        if not far or not 0.0 < seconds <= APART_SECONDS:
            return None, None
        return way / seconds, sigma_p * 2.0 / max(seconds, 0.1)

    def begin_at(self, age, p, v, sigma_p, sigma_v, moves, heading_variance):
        self.latitude, self.longitude, self.height = p
        self.place = Place(self.latitude, self.height)
        # From the antenna to the sensor, and the way since the fix.
        north, east, down = v * age - self.C @ self.antenna
        swing = self.C @ cross(self.w - self.b_g, self.antenna)
        self.latitude += north / self.place.meridian
        self.longitude += east / self.place.parallel
        self.height -= down
        self.v, self.a = v - swing if moves else np.zeros(3), np.zeros(3)
        self.settle()
        variances = np.diag(self.P).copy()
        # The gyro alone has told of the orientation since the start.
        variances[PHI] += self.N_g * self.alone + variances[GYRO] * self.alone**2
        variances[PHI] = np.minimum(variances[PHI], ANGLE_MAX)
        variances[R], variances[V] = sigma_p**2, sigma_v**2
        if heading_variance is not None:
            variances[8] = heading_variance
        compass = self.take_heading_start()
        if compass is not None:
            variances[8] = compass
            variances[COMPASS] = self.P[COMPASS, COMPASS]
        self.begin_anew(variances)
        if compass is not None:
            self.P[8, COMPASS] = self.P[COMPASS, 8] = -self.P[COMPASS, COMPASS]
        # An error of the orientation is one of the velocity in the frame that is believed in, and
        # one of the antenna is one of the sensor.
        M = np.eye(ALL)
        M[V, PHI], M[R, ANTENNA] = -skew(self.v), self.C
        M[V, ANTENNA] = self.C @ skew(self.w - self.b_g) * moves
        self.P = M @ self.P @ M.T
        for judge in self.judges:
            judge.restart()
        self.restart_aids()
        self.navigating = True
        self.clear()
        self.alone, self.since_wheels = 0.0, 0.0
        self.refresh()

    # What is known.

    @property
    def position(self):
        """In deg, deg, m."""
        if not self.navigating:
            return np.full(3, np.nan)
        longitude = np.degrees(wrapped(self.longitude))
        return np.array([np.degrees(self.latitude), longitude, self.height])

    @property
    def velocity(self):
        return self.v if self.navigating else np.full(3, np.nan)

    @property
    def nis(self):
        return np.array([judge.nis for judge in self.judges])

    @property
    def learned_sigma(self):
        return np.array([judge.learned() for judge in self.judges])

    @property
    def status(self):
        if not self.navigating:
            return "waiting" if self.heading_known else "no heading"
        if max(self.ages) > HELD:
            return "missing"
        return "coasting" if self.time - self.last_used > COASTING else "navigating"
