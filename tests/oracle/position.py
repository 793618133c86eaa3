"""Positions from fixes by the matrices of the textbook: one receiver, axes side by side."""

import numpy as np

STRONG = 45.0
UNKNOWN = 100.0


def variance(sigma, cn0):
    """Of the white noise of a fix, by the sigma-epsilon form."""
    weak = STRONG - min(max(cn0, 0.0), STRONG) if np.isfinite(cn0) else 0.0
    return sigma**2 * 10.0 ** (weak / 10.0)


class Filter:
    """States x (n, 2 axes) with covariance P: predicted by F and Q, corrected in Joseph's form."""

    def predict(self, F, Q, shift=0.0):
        self.x = F @ self.x + shift
        self.P = F @ self.P @ F.T + Q

    def correct(self, z, H, R):
        K = self.P @ H / (H @ self.P @ H + R)
        self.x = self.x + np.outer(K, z - H @ self.x)
        left = np.eye(2) - np.outer(K, H)
        self.P = left @ self.P @ left.T + R * np.outer(K, K)


class Constant(Filter):
    """Position and velocity."""

    H = np.array([1.0, 0.0])

    def __init__(self, sigma=0.7, process_noise=0.5, weighed=False):
        self.sigma, self.q, self.weighed = sigma, process_noise, weighed
        self.x = None

    def update(self, z, speed, cn0, rest, T):
        R = variance(self.sigma, cn0 if self.weighed else np.nan)
        if self.x is None:
            if np.isfinite(z).all():
                self.x = np.array([z, [0.0, 0.0]])
                self.P = np.diag([R, (100.0 * self.sigma) ** 2])
            return self.position()
        self.predict(
            np.array([[1.0, T], [0.0, 1.0]]),
            self.q * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]]),
        )
        if np.isfinite(z).all():
            self.correct(z, self.H, R)
        return self.position()

    def position(self):
        return np.full(2, np.nan) if self.x is None else self.x[0]

    @property
    def deviation(self):
        return np.sqrt(self.P[0, 0])


class Aided(Filter):
    """Position and slow error of the receiver."""

    H = np.array([1.0, 1.0])

    def __init__(
        self, sigma=0.7, error_sigma=2.5, error_time=120.0, speed_sigma=0.1, acceleration=1.0
    ):
        self.sigma, self.spread, self.time = sigma, error_sigma**2, error_time
        self.speed_sigma, self.acceleration = speed_sigma, acceleration
        self.x = None
        self.velocity, self.unknown, self.rested = np.zeros(2), UNKNOWN, False

    def update(self, z, speed, cn0, rest, T):
        moved, sigma = self.moved(speed, rest, T)
        R = variance(self.sigma, cn0)
        if self.x is None:
            if np.isfinite(z).all():
                # What a position of which nothing was known is after one fix: the limit of ever
                # larger variances.
                self.x = np.array([z, [0.0, 0.0]])
                self.P = self.spread * np.array([[1.0, -1.0], [-1.0, 1.0]])
                self.P[0, 0] += R
            return self.position()
        f = np.exp(-T / self.time)
        self.predict(
            np.diag([1.0, f]),
            np.diag([(sigma * T) ** 2, self.spread * (1.0 - f**2)]),
            np.array([moved * T, [0.0, 0.0]]),
        )
        if np.isfinite(z).all():
            self.correct(z, self.H, R)
        return self.position()

    def moved(self, speed, rest, T):
        """Mean velocity since the last sample and its deviation."""
        before, age, rested = self.velocity, self.unknown, self.rested
        self.rested = rest
        if rest:
            speed = np.zeros(2)
        if np.isfinite(speed).all():
            self.velocity, self.unknown = speed, 0.0
            if rest and rested:
                return np.zeros(2), 0.0
            if age == 0.0:
                return (speed + before) / 2.0, self.speed_sigma
            return speed, self.speed_sigma + self.acceleration * T
        self.unknown = min(age + T, UNKNOWN)
        return before, self.speed_sigma + self.acceleration * max(T, self.unknown)

    def position(self):
        return np.full(2, np.nan) if self.x is None else self.x[0]

    @property
    def deviation(self):
        return np.sqrt(self.P[0, 0])


class Average:
    """Mean of the last fixes."""

    def __init__(self, window=10):
        self.window, self.fixes = window, []

    def update(self, z, speed, cn0, rest, T):
        if np.isfinite(z).all():
            self.fixes = [*self.fixes, z][-self.window :]
        return np.mean(self.fixes, axis=0) if self.fixes else np.full(2, np.nan)


class Course:
    """Short steps that turn the course are not taken."""

    def __init__(self, step=3.0, turn=np.pi / 3.0):
        self.step, self.turn = step, turn
        self.at, self.last = None, None

    def update(self, z, speed, cn0, rest, T):
        if not np.isfinite(z).all():
            return np.full(2, np.nan) if self.at is None else self.at
        if self.at is None:
            self.at = z
            return z
        step = z - self.at
        if not step.any():
            return z
        if self.last is not None and np.hypot(*step) < self.step:
            cross = step[0] * self.last[1] - step[1] * self.last[0]
            if abs(np.arctan2(cross, step @ self.last)) > self.turn:
                return self.at
        self.at, self.last = z, step
        return z


TWINS = {
    "aided": Aided,
    "moving_average": Average,
    "kalman": Constant,
    "heading": Course,
    "strength": lambda **constants: Constant(weighed=True, **constants),
}
