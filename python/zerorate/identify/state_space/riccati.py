"""The steady state of a Kalman filter."""

from typing import Final

import numpy as np
import numpy.typing as npt

__all__ = ["steady_state"]

Floats = npt.NDArray[np.float64]

# Each round squares the number of samples seen: 2^40 are steady.
_ROUNDS: Final = 40


def steady_state(F: Floats, Q: Floats, H: Floats, R: float) -> tuple[Floats, float]:
    """Return gain (n,) and innovation variance of the steady filter of x+ = F x + w, z = H x + v.

    Structured doubling: each round squares the number of samples that the filter has seen (Chu,
    Fan and Lin, Linear Algebra and its Applications 396, 2005).

    Raises
    ------
    ValueError
        If there is no measurement noise R, or the filter does not settle.
    """
    if not R > 0.0:
        raise ValueError(f"several noises need a measurement noise R above 0, got {R}")
    identity, A, information, P = np.eye(len(F)), F.T, np.outer(H, H) / R, Q
    for _ in range(_ROUNDS):
        known = np.linalg.solve(identity + information @ P, np.column_stack((A, information)))
        left, gained = np.hsplit(known, 2)
        before, P = P, P + A.T @ P @ left
        A, information = A @ left, information + A @ gained @ A.T
        if np.allclose(P, before, rtol=1e-15, atol=0.0):
            break
    variance = float(H @ P @ H + R)
    if not np.isfinite(variance):
        raise ValueError("the Kalman filter of this model has no steady state")
    return P @ H / variance, variance
