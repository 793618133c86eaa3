"""Models of linear filters for tests."""

import numpy as np


def covariance(rng, n):
    G = rng.standard_normal((n, n))
    return G @ G.T / n


def model(n, m, p=0, seed=0):
    """Arguments of a LinearKalman: a stable model of random matrices."""
    rng = np.random.default_rng([n, m, p, seed])
    F = rng.standard_normal((n, n))
    F *= 0.98 / np.abs(np.linalg.eigvals(F)).max()
    # Noise that no measurement lacks, so that no S is nearly singular.
    return {
        "F": F,
        "H": rng.standard_normal((m, n)),
        "Q": 0.1 * covariance(rng, n),
        "R": covariance(rng, m) + 0.1 * np.eye(m),
        "B": rng.standard_normal((n, p)) if p else None,
        "x0": rng.standard_normal(n),
        "P0": covariance(rng, n),
    }


def measurements(count, *shape, seed=0, missing=0.1):
    """Normal numbers of which some are missing."""
    rng = np.random.default_rng([count, *shape, seed])
    z = rng.standard_normal((count, *shape))
    z[rng.random(z.shape) < missing] = np.nan
    return z


TRACKING = {  # Position and velocity, a white acceleration of deviation 1 held for a second.
    "F": [[1.0, 1.0], [0.0, 1.0]],
    "H": [[1.0, 0.0]],
    "Q": [[0.25, 0.5], [0.5, 1.0]],
    "R": [[1.0]],
}
