"""A piece of a recording on its way through the filters."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

__all__ = ["Block"]

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Block:
    """Samples from `first` on of k axes, and what the filters said of them; arrays are (k, n).

    `drift` is by method; `bias_sigma` and `at_rest` are of the chosen one, where they are noted.
    """

    first: int
    raw: Floats
    drift: Mapping[str, Floats]
    bias_sigma: Floats | None
    at_rest: Flags | None

    @property
    def end(self) -> int:
        """The sample after the last."""
        return self.first + int(self.raw.shape[1])
