"""The Kalman step of the drift model (FH 14-24, Table 3) and Sage-Husa's process noise (FH 25)."""

import math
from dataclasses import dataclass

import numpy as np

# In variances of the start-up window: beyond this trace a covariance is kept definite and finite.
TRACE_LARGE = 10.0
TRACE_MAX = 1e36
# Relative: what a step may lose of a variance, generously.
ROUNDING = 8.0 * np.finfo(float).eps


@dataclass
class Step:
    x: np.ndarray
    P: np.ndarray
    e: float
    S: float
    K: np.ndarray


def companion(phi):
    """Transition matrix of ``[y_k, ..., y_{k-p+1}, c]``."""
    p = len(phi)
    A = np.zeros((p + 1, p + 1))
    A[0, :p] = phi
    A[0, p] = 1.0
    A[p, p] = 1.0
    for i in range(1, p):
        A[i, i - 1] = 1.0
    return A


def step(x, P, A, R, z, peak):
    """One sample; a missing one is predicted, not corrected. ``P`` is predicted already."""
    identity = np.eye(len(x))
    H = identity[0]
    x = A @ x
    x[0] = min(max(x[0], -peak), peak)
    S = H @ P @ H + R
    if not math.isfinite(z):
        return Step(x, P, 0.0, S, np.zeros(len(x)))
    K = P @ H / S
    e = z - x[0]
    # Joseph's form of (I - K H) P: with R far below S, 1 - K would lose R's digits.
    left = identity - K[:, None] * H
    P = left @ P @ left.T + R * K[:, None] * K
    return Step(x + K * e, (P + P.T) / 2.0, e, S, K)


def large(prior, P):
    return prior.trace() + P.trace() > TRACE_LARGE


def settled(P):
    """The library's own rule: a large covariance is bounded, and its diagonal raised a little.

    The raise is what rounding may have cost it in definiteness. Over a gap of 1e5 samples it adds
    up to more than 1e-10, so it is repeated here.
    """
    P = P * min(1.0, TRACE_MAX / np.trace(P))
    return P + ROUNDING * np.diag(np.diag(P))


def settled_prediction(prior, A, P):
    """The same; the first variance is a sum that may cancel, and is raised by its terms first."""
    prior = prior.copy()
    prior[0, 0] += ROUNDING * len(P) * (A[0] ** 2 @ np.diag(P))
    return settled(prior)


def sage_husa(G, k, now, carried):
    """FH 25 as printed; ``carried`` is ``A P_{k-1} Aᵀ``."""
    seen = now.K[:, None] * now.K * now.e**2
    G = (1.0 - 1.0 / k) * G + (seen + now.P - carried) / k
    return (G + G.T) / 2.0


def guarded_sage_husa(G, k, now, carried, floor):
    """FH 25, its step shortened where the result would fall below ``floor`` times the identity."""
    candidate = sage_husa(G, k, now, carried)
    if now.e**2 >= now.S or definite(candidate, floor):
        return candidate, False
    return G - room(G, floor, now.K) * now.K[:, None] * now.K, True


def room(G, floor, K):
    """The largest a with ``G - a K Kᵀ`` not below ``floor`` times the identity."""
    if not definite(G, floor):
        return 0.0
    try:
        return 1.0 / (K @ np.linalg.solve(G - floor * np.eye(len(K)), K))
    except np.linalg.LinAlgError:
        return 0.0


def definite(G, floor):
    try:
        np.linalg.cholesky(G - floor * np.eye(len(G)))
    except np.linalg.LinAlgError:
        return False
    return True
