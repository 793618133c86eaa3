"""Wu & Ran's robust filter (2021, equations 7 to 9, figure 1), sample by sample.

``zones="published"`` is the law as printed; two numbers are the law that the library adds an exit
to.
"""

import math

import numpy as np

from oracle.drift import COEFFICIENT_MAX, FLOOR, DriftFilter
from oracle.kalman import Step, companion, large, settled, settled_prediction, step

# β of the source, which says only that it lies between 0 and 1.
BETA = 0.75
EXIT_SECONDS, EXIT_SAMPLES, EXIT_ANYWAY = 0.03, 3, 10
# Accepted innovations after which one counts for 1/e.
MEMORY = 100


class RobustFilter(DriftFilter):
    """Takes the parameters of ``zerorate.DriftFilter``."""

    def __init__(
        self, rate, order=(1, 0), *, zones=(4.0, 0.75), damping=0.0, correction=0.0, **options
    ):
        super().__init__(rate, order, "akf", **options)
        self.arguments = {
            "rate": rate,
            "order": order,
            "zones": zones,
            "damping": damping,
            "correction": correction,
            **options,
        }
        self.zones, self.alpha, self.gamma = zones, damping, correction
        self.exit_samples = max(EXIT_SAMPLES, math.floor(EXIT_SECONDS * rate + 0.5))
        self.E = self.V = self.accepted = 0.0
        self.every = []
        self.outliers = []
        self.exits = 0

    def filter(self, y):
        """One sample, centred and scaled; answers whether it was taken for an outlier."""
        if not math.isfinite(y):
            return super().filter(y)
        phi = np.minimum(np.maximum(self.model.phi, -COEFFICIENT_MAX), COEFFICIENT_MAX)
        A = companion(phi)
        x = A @ self.x
        x[0] = min(max(x[0], -self.peak), self.peak)
        P = A @ self.P @ A.T + self.G
        if large(P, self.P):
            P = settled_prediction(P, A, self.P)
        e = y - x[0]
        law = self.published if self.zones == "published" else self.safe
        is_outlier = law(y, e, x, P, phi)
        self.last.e = e
        self.x, self.P = self.last.x, self.last.P
        return is_outlier

    def learn(self, y):
        """Noise, model and peak."""
        self.noise.observe(y)
        if self.learning_left > 0:
            self.learning_left -= 1
            self.model.observe(y)
        if math.isfinite(y):
            self.peak = max(self.peak, abs(y))

    def published(self, y, e, x, P, phi):
        self.every.append(e)
        r1 = self.scale * np.var(self.every)
        r2 = BETA * r1
        distance = abs(e) - abs(np.mean(self.every))
        self.learn(y)
        H = np.eye(len(x))[0]
        S = H @ P @ H + self.R
        K = P @ H / S
        if distance > r1:
            K = self.alpha * K
        elif distance > r2:
            x = x + self.gamma * e * H
        self.now(x + K * e, (np.eye(len(x)) - np.outer(K, H)) @ P, S, K)
        return distance > r1

    def safe(self, y, e, x, P, phi):
        kappa, beta = self.zones
        S = P[0, 0] + self.R
        if self.accepted == 0:
            self.restart(S)
        r1 = kappa * math.sqrt(max(self.V, P[0, 0]))
        r2 = beta * r1
        distance = abs(e) - abs(self.E)
        if distance > r1:
            self.outliers.append(e)
            if self.is_exit():
                self.leave(y, e, x, P, phi)
                return False
            self.learn(np.nan)
            self.damped(e, x, P)
            return True
        self.outliers = []
        if distance > r2 and self.gamma == 0.0:
            e = max(min(e, r2), -r2)
            y = x[0] + e
        self.accept(e)
        self.learn(y)
        if distance > r2:
            x[0] += self.gamma * e
        self.kalman(y, x, P)
        return False

    def accept(self, e):
        self.accepted = min(self.accepted + 1, MEMORY)
        before = self.E
        self.E = before + (e - before) / self.accepted
        self.V += ((e - before) * (e - self.E) - self.V) / self.accepted

    def is_exit(self):
        """The latest so many are of one sign, or there are ten times as many."""
        latest = np.sign(self.outliers[-self.exit_samples :])
        whole = len(latest) == self.exit_samples
        one_sign = whole and abs(latest.sum()) == self.exit_samples
        return one_sign or len(self.outliers) >= EXIT_ANYWAY * self.exit_samples

    def leave(self, y, e, x, P, phi):
        self.exits += 1
        self.restart(max(P[0, 0] + self.R, np.var(self.outliers)))
        self.outliers = []
        self.learn(y)
        more = max(self.R + e**2 - P[0, 0], 0.0)
        level = np.append(np.ones(len(phi)), 1.0 - phi.sum())
        self.kalman(y, x[0] * level, settled(P + more * np.outer(level, level)))

    def restart(self, V):
        self.accepted, self.E, self.V = self.exit_samples, 0.0, V

    def damped(self, e, x, P):
        """Joseph's form, which is right for any gain."""
        H = np.eye(len(x))[0]
        S = P[0, 0] + self.R
        K = self.alpha * P @ H / S
        left = np.eye(len(x)) - np.outer(K, H)
        self.now(x + K * e, left @ P @ left.T + self.R * np.outer(K, K), S, K)

    def kalman(self, y, x, P):
        # The prediction is made: what is left of the step is the correction.
        self.last = step(x, P, np.eye(len(x)), self.R, y, np.inf)

    def now(self, x, P, S, K):
        self.last = Step(x, (P + P.T) / 2.0, 0.0, S, K)

    @property
    def R(self):
        return max(self.noise.variance, FLOOR)
