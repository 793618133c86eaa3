"""One filter's way through a log, and what is noted beside it."""

import time
from collections.abc import Sequence
from typing import Literal, TypedDict, cast

import numpy as np
import numpy.typing as npt

from zerorate._native import DriftFilter
from zerorate.io import Log
from zerorate.replay.history import Recorder
from zerorate.replay.readings import Reader, Readings
from zerorate.replay.result import Output

__all__ = ["FilterOptions", "Run", "Watch"]


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


class Watch:
    """What is noted of the chosen filter while it runs."""

    def __init__(self, log: Log, filter_: DriftFilter, output: Output) -> None:
        self.recorder = Recorder()
        self._rate = log.rate
        self._holds = filter_.params["motion"] == "hold"
        needed = self._holds or filter_.method == "auto" or output == "compensated"
        self._reader = Reader(log.data, filter_) if needed else None

    def take(self, filter_: DriftFilter) -> None:
        """Note what the filter knows now."""
        self.recorder.take(filter_)
        if self._reader is not None:
            self._reader.take(filter_)

    @property
    def readings(self) -> Readings | None:
        """What it said at every sample, where that is asked for."""
        return None if self._reader is None else self._reader.readings()

    def certain_rest(self) -> npt.NDArray[np.bool_] | None:
        """Return where the sensor rested, None for a filter that does not mind."""
        readings = self.readings
        if readings is None or not self._holds:
            return None
        return readings.certain_rest(self._rate)


class Run:
    """One filter, its output so far, and the time that it took."""

    def __init__(self, log: Log, method: str, options: FilterOptions) -> None:
        known = cast(Literal["kf", "akf", "fading", "auto"], method)  # the filter refuses any other
        self.filter = DriftFilter(log.rate, method=known, channels=log.channels, **options)
        self.filtered = np.empty_like(log.data)
        self._data = log.data
        self._seconds = 0.0

    def advance(self, stops: Sequence[int], watch: Watch | None = None) -> None:
        """Filter up to each stop; only the processor's time of this thread counts."""
        for stop in stops:
            block = slice(self.filter.samples_seen, stop)
            z, out = self._data[block], self.filtered[block]
            begin = time.thread_time()
            self.filter.process(z, out=out, threads=1)
            self._seconds += time.thread_time() - begin
            if watch is not None:
                watch.take(self.filter)

    @property
    def speed(self) -> float:
        """Samples per second on one core, the axes counted one by one."""
        return self.filtered.size / self._seconds if self._seconds > 0.0 else np.nan
