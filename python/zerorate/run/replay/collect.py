"""The series of a replay that stays in memory."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from zerorate.run.replay.block import Block
from zerorate.run.replay.readings import Readings

__all__ = ["Collected"]

Floats = npt.NDArray[np.float64]


class Collected:
    """Blocks put together again."""

    def __init__(self, shape: tuple[int, int], methods: Sequence[str], notes: bool) -> None:
        # An axis after the other, as everything that measures or writes them wants them.
        turned = shape[::-1]
        self._drift = {method: np.empty(turned) for method in methods}
        self._beside = (np.empty(turned), np.empty(turned, dtype=np.bool_)) if notes else None

    def take(self, block: Block) -> None:
        """Put one block in its place."""
        place = np.s_[:, block.first : block.end]
        for method, drift in self._drift.items():
            drift[place] = block.drift[method]
        if self._beside is not None:
            self._beside[0][place], self._beside[1][place] = block.bias_sigma, block.at_rest

    @property
    def filtered(self) -> dict[str, Floats]:
        """Drift by method, shape (n, k)."""
        return {method: drift.T for method, drift in self._drift.items()}

    @property
    def readings(self) -> Readings | None:
        """What the chosen filter said at every sample, where that is noted."""
        return None if self._beside is None else Readings(*(part.T for part in self._beside))
