"""The stationary covariance of a state, by the discrete Lyapunov equation."""

import numpy as np
import numpy.typing as npt

from zerorate.identify.models.autocovariance import refined

__all__ = ["stationary_covariance"]

Floats = npt.NDArray[np.float64]


def stationary_covariance(F: Floats, G: Floats) -> Floats:
    """Return P of P = F P F' + G G', shape (n, n).

    As n^2 linear equations: n is the order of a drift model, and small.

    Raises
    ------
    ValueError
        If an eigenvalue of F lies on or outside the unit circle.
    """
    n = len(F)
    largest = float(np.max(np.abs(np.linalg.eigvals(F)), initial=0.0))
    # An eigenvalue of one may come out a little below.
    if not largest < 1.0 - n * np.finfo(np.float64).eps:
        raise ValueError(
            "only a stationary model has a covariance: "
            f"its largest eigenvalue is {largest:.6g}, expected below 1"
        )
    wide, noise = F.astype(np.longdouble), G.astype(np.longdouble)
    equations = np.eye(n * n, dtype=np.longdouble) - np.kron(wide, wide)
    P = refined(equations, (noise @ noise.T).ravel()).reshape(n, n)
    return np.asarray((P + P.T) / 2.0)
