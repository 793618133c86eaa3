"""Array types used in the whole package."""

import numpy as np
import numpy.typing as npt

__all__ = ["Booleans", "Floats", "Integers"]

Floats = npt.NDArray[np.float64]
Booleans = npt.NDArray[np.bool_]
Integers = npt.NDArray[np.int64]
