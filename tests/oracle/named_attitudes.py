"""The named methods of attitude, from their formulas, for many bodies side by side.

Arrays have a first axis for the bodies; quaternions are (k, 4), the scalar first, from the axes of
the sensor to those of the earth: east, north, up. A sensor whose axes are NaN is missing.
"""

import numpy as np

UP, NORTH = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
GRAVITY = 9.81
# Madgwick's report: with a magnetometer, and without.
BETAS = {True: 0.041, False: 0.033}
# Of the Kalman filters: deviations of an angle that one sample has shown, and of a bias; variance
# of a heading that is to be found; deviation of one that was chosen.
SHOWN, BIAS_SIGMA, FREE, CHOSEN = 0.5, np.radians(0.5), 10.0, 1e-3


def times(p, q):
    """Hamilton's product."""
    w = p[..., :1] * q[..., :1] - np.sum(p[..., 1:] * q[..., 1:], axis=-1, keepdims=True)
    v = p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + np.cross(p[..., 1:], q[..., 1:])
    return np.concatenate([w, v], axis=-1)


def conjugate(q):
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def exponential(phi):
    """The quaternion of a rotation vector."""
    angle = np.linalg.norm(phi, axis=-1, keepdims=True)
    # numpy's sinc is that of pi x.
    return np.concatenate(
        [np.cos(angle / 2.0), np.sinc(angle / (2.0 * np.pi)) * phi / 2.0], axis=-1
    )


def logarithm(q):
    """The rotation vector of a quaternion."""
    q = np.where(q[..., :1] < 0.0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, q[..., :1])
    return q[..., 1:] * np.divide(angle, sine, out=np.full_like(sine, 2.0), where=sine > 0.0)


def matrix(q):
    """Rotation matrices, (..., 3, 3)."""
    cross = skew(q[..., 1:])
    return np.eye(3) + 2.0 * q[..., :1, None] * cross + 2.0 * cross @ cross


def skew(v):
    """The matrix of v x."""
    return np.cross(v[..., None, :], np.eye(3)).swapaxes(-1, -2)


def applied(M, v):
    return np.einsum("...ij,...j->...i", M, v)


def shortest(f):
    """The rotation vector that turns a direction up by the shortest way."""
    f = unit(f)
    axis = np.cross(f, UP)
    sine = np.linalg.norm(axis, axis=-1, keepdims=True)
    return axis / sine * np.arctan2(sine, f[..., 2:])


def east_of_north(h):
    return np.arctan2(h[..., 0], h[..., 1])


class Named:
    """What all share: where they start, and which sensors they see."""

    def __init__(self, bodies, mag=True):
        self.q = np.tile([1.0, 0.0, 0.0, 0.0], (bodies, 1))
        self.levelled = np.zeros(bodies, dtype=bool)
        self.headed = np.zeros(bodies, dtype=bool)
        self.mag = mag

    def update(self, gyro, accel, mag, dt):
        felt = np.isfinite(accel).all(axis=1)
        seen = np.isfinite(mag).all(axis=1) & self.mag
        # What is missing is not looked at, and may be anything.
        accel = np.where(felt[:, None], accel, UP)
        mag = np.where(seen[:, None], mag, NORTH)
        self.step(gyro, accel, mag, dt, felt & self.levelled, seen & self.headed)
        self.begin(accel, mag, felt & ~self.levelled, seen & ~self.headed)
        return self.q

    def begin(self, accel, mag, felt, seen):
        """Up by the first force, then north by the first field."""
        self.turn_earth(np.where(felt[:, None], shortest(self.earth(accel)), 0.0))
        self.levelled |= felt
        seen = seen & self.levelled
        angle = np.where(seen, east_of_north(self.earth(mag)), 0.0)
        self.turn_earth(angle[:, None] * UP)
        self.headed |= seen
        return seen

    def earth(self, v):
        """In the axes of the earth."""
        return applied(matrix(self.q), v)

    def turn(self, phi):
        self.q = unit(times(self.q, exponential(phi)))

    def turn_earth(self, phi):
        self.q = unit(times(exponential(phi), self.q))


class Complementary(Named):
    def __init__(self, bodies, mag=True, time_constant=0.5):
        super().__init__(bodies, mag)
        self.tau = time_constant

    def step(self, gyro, accel, mag, dt, felt, seen):
        share = dt / (self.tau + dt)
        self.turn(gyro * dt)
        self.turn_earth(np.where(felt[:, None], share * shortest(self.earth(accel)), 0.0))
        angle = np.where(seen, east_of_north(self.earth(mag)), 0.0)
        self.turn_earth(share * angle[:, None] * UP)


class Mahony(Named):
    """With the heading of the magnetometer alone."""

    def __init__(self, bodies, mag=True, kp=1.0, ki=0.3):
        super().__init__(bodies, mag)
        self.kp, self.ki = kp, ki
        self.bias = np.zeros((bodies, 3))

    def step(self, gyro, accel, mag, dt, felt, seen):
        v = matrix(self.q)[:, 2]
        error = felt[:, None] * np.cross(unit(accel), v)
        sine = np.sin(east_of_north(self.earth(mag)))
        error += (seen * sine)[:, None] * v
        self.bias = self.bias - self.ki * error * dt
        self.turn((gyro - self.bias + self.kp * error) * dt)


class Madgwick(Named):
    """As in the report, whose first axis is north: north, west, up."""

    # From these axes to east, north, up: a quarter of a turn.
    TO_ENU = np.array([[np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]])

    def __init__(self, bodies, mag=True, beta=None):
        super().__init__(bodies, mag)
        self.beta = BETAS[mag] if beta is None else beta

    def step(self, gyro, accel, mag, dt, felt, seen):
        turn = np.repeat(self.TO_ENU, len(gyro), axis=0)
        q = times(conjugate(turn), self.q)
        rate = np.concatenate([np.zeros((len(gyro), 1)), gyro], axis=1)
        gradient = felt[:, None] * self.of_gravity(q, unit(accel))
        gradient += seen[:, None] * self.of_field(q, unit(mag))
        length = np.linalg.norm(gradient, axis=1, keepdims=True)
        # A gradient of roundings has no direction.
        direction = np.divide(gradient, length, out=np.zeros_like(q), where=length > 1e-12)
        q = unit(q + (0.5 * times(q, rate) - self.beta * direction) * dt)
        self.q = times(turn, q)

    @staticmethod
    def of_gravity(q, a):
        """Eqs. 25, 26 and 20."""
        q1, q2, q3, q4 = q.T
        zero = np.zeros_like(q1)
        f = np.array([2 * (q2 * q4 - q1 * q3), 2 * (q1 * q2 + q3 * q4), 2 * (0.5 - q2**2 - q3**2)])
        J = np.array(
            [
                [-2 * q3, 2 * q4, -2 * q1, 2 * q2],
                [2 * q2, 2 * q1, 2 * q4, 2 * q3],
                [zero, -4 * q2, -4 * q3, zero],
            ]
        )
        return np.einsum("ijk,ik->kj", J, f - a.T)

    @staticmethod
    def of_field(q, m):
        """Eqs. 29, 30, 45 and 46."""
        h = applied(matrix(q), m)
        bx, bz = np.hypot(h[:, 0], h[:, 1]), h[:, 2]
        q1, q2, q3, q4 = q.T
        f = np.array(
            [
                2 * bx * (0.5 - q3**2 - q4**2) + 2 * bz * (q2 * q4 - q1 * q3),
                2 * bx * (q2 * q3 - q1 * q4) + 2 * bz * (q1 * q2 + q3 * q4),
                2 * bx * (q1 * q3 + q2 * q4) + 2 * bz * (0.5 - q2**2 - q3**2),
            ]
        )
        J = np.array(
            [
                [
                    -2 * bz * q3,
                    2 * bz * q4,
                    -4 * bx * q3 - 2 * bz * q1,
                    -4 * bx * q4 + 2 * bz * q2,
                ],
                [
                    -2 * bx * q4 + 2 * bz * q2,
                    2 * bx * q3 + 2 * bz * q1,
                    2 * bx * q2 + 2 * bz * q4,
                    -2 * bx * q1 + 2 * bz * q3,
                ],
                [2 * bx * q3, 2 * bx * q4 - 4 * bz * q2, 2 * bx * q1 - 4 * bz * q3, 2 * bx * q2],
            ]
        )
        return np.einsum("ijk,ik->kj", J, f - m.T)


class Kalman(Named):
    """Six errors: of three angles about the axes of the earth, and of the bias."""

    def __init__(
        self, bodies, mag=True, gyro_noise=2e-4, accel_noise=0.1, mag_noise=0.1, bias_walk=1e-4
    ):
        super().__init__(bodies, mag)
        self.bias = np.zeros((bodies, 3))
        heading = FREE if mag else CHOSEN**2
        self.P = np.tile(
            np.diag([SHOWN**2, SHOWN**2, heading, *[BIAS_SIGMA**2] * 3]), (bodies, 1, 1)
        )
        self.walks = np.diag([gyro_noise**2] * 3 + [bias_walk**2] * 3)
        self.of_accel, self.of_mag = (accel_noise / GRAVITY) ** 2, mag_noise**2

    def step(self, gyro, accel, mag, dt, felt, seen):
        self.predict(gyro, dt)
        self.P = self.P + self.walks * dt
        self.see_up(self.earth(unit(accel)), self.of_accel / dt, felt)
        self.see_north(east_of_north(self.earth(mag)), self.of_mag / dt, seen)

    def begin(self, accel, mag, felt, seen):
        seen = super().begin(accel, mag, felt, seen)
        self.P[seen, 2, :] = self.P[seen, :, 2] = 0.0
        self.P[seen, 2, 2] = SHOWN**2

    def apply(self, x, P, which):
        """Take over what was found where a sensor has seen something."""
        self.P = np.where(which[:, None, None], P, self.P)
        x = np.where(which[:, None], x, 0.0)
        self.turn_earth(x[:, :3])
        self.bias = self.bias + x[:, 3:]


class Ekf(Kalman):
    def predict(self, gyro, dt):
        phi = (gyro - self.bias) * dt
        self.turn(phi)
        F = np.tile(np.eye(6), (len(phi), 1, 1))
        F[:, :3, 3:] = -matrix(self.q) @ right_jacobian(phi) * dt
        self.P = F @ self.P @ np.swapaxes(F, 1, 2)

    def see_up(self, f, R, which):
        # The estimated direction of up is turned by the error: (I + [phi]x)' up.
        H = np.concatenate([skew(UP), np.zeros((3, 3))], axis=1)
        self.correct(f - UP, H, R * np.eye(3), which)

    def see_north(self, angle, R, which):
        H = np.array([[0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])
        self.correct(angle[:, None], H, R * np.eye(1), which)

    def correct(self, e, H, R, which):
        K = self.P @ H.T @ np.linalg.inv(H @ self.P @ H.T + R)
        A = np.eye(6) - K @ H
        P = A @ self.P @ np.swapaxes(A, 1, 2) + K @ R @ np.swapaxes(K, 1, 2)
        self.apply(applied(K, e), P, which)


def right_jacobian(phi):
    """By its series: angles of a step are small."""
    X, term, total = skew(phi), np.eye(3), 0.0
    for n in range(1, 15):
        total = total + term
        term = -term @ X / (n + 1)
    return total


class Ukf(Kalman):
    """Points of Crassidis and Markley, with lambda = 1."""

    SCALE = 7.0
    WEIGHTS = np.array([1.0 / 7.0, *[0.5 / 7.0] * 12])

    def points(self):
        """The centre, then twelve: (13, k, 6)."""
        L = np.moveaxis(np.linalg.cholesky(self.SCALE * self.P), -1, 0)
        return np.concatenate([np.zeros((1, *L.shape[1:])), L, -L])

    def mean(self, y):
        return np.tensordot(self.WEIGHTS, y, 1)

    def covariance(self, x, y):
        return np.einsum("p,pki,pkj->kij", self.WEIGHTS, x, y)

    def predict(self, gyro, dt):
        points = self.points()
        before = self.q
        self.turn((gyro - self.bias) * dt)
        q = times(exponential(points[..., :3]), before)
        q = times(q, exponential((gyro - self.bias - points[..., 3:]) * dt))
        points[..., :3] = logarithm(times(q, conjugate(self.q)))
        mean = self.mean(points)
        off = points - mean
        self.apply(mean, self.covariance(off, off), np.ones(len(gyro), dtype=bool))

    def see_up(self, f, R, which):
        turned = matrix(exponential(-self.points()[..., :3]))
        self.correct(applied(turned, UP), f, R, which)

    def see_north(self, angle, R, which):
        errors = exponential(self.points()[..., :3])
        twists = 2.0 * np.arctan2(errors[..., 3:], errors[..., :1])
        self.correct(twists, angle[:, None], R, which)

    def correct(self, expected, z, R, which):
        mean = self.mean(expected)
        off = expected - mean
        S = self.covariance(off, off) + R * np.eye(z.shape[1])
        C = self.covariance(self.points(), off)
        K = C @ np.linalg.inv(S)
        self.apply(applied(K, z - mean), self.P - K @ S @ np.swapaxes(K, 1, 2), which)


TWINS = {
    "complementary": Complementary,
    "mahony": Mahony,
    "madgwick": Madgwick,
    "ekf": Ekf,
    "ukf": Ukf,
}


def process(twin, gyro, accel, mag, dt):
    """Quaternions (n, k, 4) of records (n, k, 3) and times (n,)."""
    return np.array([twin.update(*sample) for sample in zip(gyro, accel, mag, dt, strict=True)])


class Tilt:
    """One axis of many bodies: complementary, or the Kalman filter of angle and bias."""

    def __init__(self, method, time_constant=0.5, q=(1e-3, 3e-3), r=3e-2, p=1.0):
        self.kalman, self.tau = method == "kalman", time_constant
        self.q, self.r, self.P = np.diag(q), r, p * np.eye(2)
        self.x = None

    def update(self, gyro, angle, dt):
        """Of rates and angles (k,), one of which may be NaN: then for all of them."""
        if self.x is None:
            self.x = np.array([angle, np.zeros_like(angle)])
        F = np.array([[1.0, -dt], [0.0, 1.0]])
        if not self.kalman:
            a = self.tau / (self.tau + dt)
            predicted = self.x[0] + gyro * dt
            known = np.isfinite(angle)
            self.x[0] = np.where(known, a * predicted + (1.0 - a) * angle, predicted)
            return self.x[0].copy()
        self.x = F @ self.x
        self.x[0] += gyro * dt
        self.P = F @ self.P @ F.T + self.q * dt
        if np.isfinite(angle).all():
            H = np.array([[1.0, 0.0]])
            K = self.P @ H.T / (H @ self.P @ H.T + self.r)
            A = np.eye(2) - K @ H
            self.x = self.x + K * (angle - self.x[0])
            self.P = A @ self.P @ A.T + self.r * K @ K.T
        return self.x[0].copy()
