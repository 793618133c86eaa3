"""Series moved in time by parts of a sample."""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

_NODES: Final = (-1.0, 0.0, 1.0, 2.0)


def moved(x: Floats, samples: float) -> Floats:
    """Return one row so many samples later, by a cubic through four samples.

    NaN where that needs samples that are missing or beyond the ends.
    """
    whole = math.floor(-samples)
    weights = _weights(-samples - whole)
    first = np.arange(x.size) + whole - 1
    inside = (first >= 0) & (first + len(_NODES) <= x.size)
    start = first[inside]
    known = np.where(np.isfinite(x), x, np.nan)
    shifted = np.full(x.size, np.nan)
    shifted[inside] = sum(w * known[start + i] for i, w in enumerate(weights))
    return shifted


def _weights(part: float) -> list[float]:
    return [
        math.prod((part - other) / (node - other) for other in _NODES if other != node)
        for node in _NODES
    ]
