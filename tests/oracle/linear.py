"""The linear Kalman filter and its smoother by the matrices of the textbook, sample by sample."""

import numpy as np


class LinearKalman:
    """x = F x + B u + w, z = H x + v; each step may bring matrices of its own."""

    def __init__(self, F, H, Q, R, B=None, *, x0, P0):
        self.model = {"F": F, "H": H, "Q": Q, "R": R, "B": B}
        self.x, self.P = np.array(x0), np.array(P0)

    def update(self, z, u=None, **given):
        """Predict, then correct by what is finite; innovation, NIS and log-likelihood."""
        F, H, Q, R, B = (given.get(name, self.model[name]) for name in "FHQRB")
        self.x = F @ self.x + (B @ u if u is not None else 0.0)
        self.P = F @ self.P @ F.T + Q
        innovation = np.full(len(z), np.nan)
        there = np.isfinite(z)
        if not there.any():
            return innovation, np.nan, 0.0
        H, R = H[there], R[np.ix_(there, there)]
        y = z[there] - H @ self.x
        S = H @ self.P @ H.T + R
        K = np.linalg.solve(S, H @ self.P).T
        left = np.eye(len(self.x)) - K @ H
        self.x = self.x + K @ y
        self.P = left @ self.P @ left.T + K @ R @ K.T
        self.P = 0.5 * (self.P + self.P.T)
        innovation[there] = y
        nis = y @ np.linalg.solve(S, y)
        density = -0.5 * (nis + np.linalg.slogdet(2.0 * np.pi * S)[1])
        return innovation, nis, density

    def process(self, z, u=None, **given):
        """All that was known after each sample."""
        found = []
        for k in range(len(z)):
            own = {name: x[k] if np.ndim(x) == 3 else x for name, x in given.items()}
            told = self.update(z[k], None if u is None else u[k], **own)
            found.append((self.x, self.P, *told))
        names = ("state", "covariance", "innovation", "nis", "log_likelihood")
        return {name: np.array(x) for name, x in zip(names, zip(*found, strict=True), strict=True)}


def joint(F, H, Q, R, z, u, B, x0, P0):
    """States and measurements of a short record as one normal vector: smoothed states, density.

    The mean and covariance of all states follow from the model; the conditional one given what was
    measured is that of the normal distribution.
    """
    n, count = len(x0), len(z)
    mean, state = np.array(x0, float), np.array(P0, float)
    means, blocks = [], np.zeros((count * n, count * n))
    for k in range(count):
        mean, state = F @ mean + B @ u[k], F @ state @ F.T + Q
        means.append(mean)
        across = state
        for j in range(k, count):
            blocks[j * n : (j + 1) * n, k * n : (k + 1) * n] = across
            blocks[k * n : (k + 1) * n, j * n : (j + 1) * n] = across.T
            across = F @ across
    means = np.concatenate(means)
    measured = np.kron(np.eye(count), H)
    there = np.isfinite(z.ravel())
    measured = measured[there]
    noise = np.kron(np.eye(count), R)[np.ix_(there, there)]
    S = measured @ blocks @ measured.T + noise
    y = z.ravel()[there] - measured @ means
    gain = np.linalg.solve(S, measured @ blocks).T
    covariance = blocks - gain @ measured @ blocks
    density = -0.5 * (y @ np.linalg.solve(S, y) + np.linalg.slogdet(2.0 * np.pi * S)[1])
    covariances = [covariance[k : k + n, k : k + n] for k in range(0, count * n, n)]
    return (means + gain @ y).reshape(count, n), np.array(covariances), density
