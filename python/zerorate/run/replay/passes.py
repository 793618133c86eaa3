"""One filter's way through a recording, and what is noted beside it."""

import time
from collections.abc import Sequence
from typing import Literal, TypedDict, cast

import numpy as np
import numpy.typing as npt

from zerorate._native import DriftFilter
from zerorate.run.replay.history import Recorder

__all__ = ["Beside", "FilterOptions", "Run"]

Floats = npt.NDArray[np.float64]
Beside = tuple[Floats, npt.NDArray[np.bool_]]
"""Standard deviation of the drift, and rest, to be filled."""


class FilterOptions(TypedDict, total=False):
    """Keyword arguments of `zerorate.DriftFilter` besides rate, method, output and channels."""

    order: tuple[int, int]
    fading: float
    adapt_for: float | None
    forgetting_factor: float
    process_noise: float
    process_noise_memory: float
    noise: Literal["allan", "hadamard"]
    startup: float
    scale: float | None
    motion: Literal["hold", "ignore"] | None


class Run:
    """One filter, and the time that it took."""

    def __init__(self, rate: float, channels: int, method: str, options: FilterOptions) -> None:
        known = cast(Literal["kf", "akf", "fading", "auto"], method)  # the filter refuses any other
        self.filter = DriftFilter(rate, method=known, channels=channels, **options)
        self._seconds = 0.0

    def through(self, raw: Floats) -> Floats:
        """Return the drift of a block (k, n)."""
        drift = np.empty_like(raw)
        self._advance(raw, drift)
        return drift

    def watched(
        self, raw: Floats, stops: Sequence[int], recorder: Recorder, beside: Beside | None
    ) -> Floats:
        """Return the drift of a block, note the state at some of its samples, and fill `beside`."""
        drift = np.empty_like(raw)
        first = 0
        for stop in dict.fromkeys((*stops, raw.shape[1])):
            part = np.s_[:, first:stop]
            told = None if beside is None else (beside[0][part], beside[1][part])
            self._advance(raw[part], drift[part], told)
            if stop in stops:
                recorder.take(self.filter)
            first = stop
        return drift

    def _advance(self, raw: Floats, drift: Floats, beside: Beside | None = None) -> None:
        # Only the processor's time of this thread counts.
        begin = time.thread_time()
        self.filter._replay(raw, drift, *(beside or ()))
        self._seconds += time.thread_time() - begin

    @property
    def speed(self) -> float:
        """Samples per second on one core, the axes counted one by one."""
        samples = self.filter.samples_seen * len(self.filter.ready)
        return samples / self._seconds if self._seconds > 0.0 else np.nan
