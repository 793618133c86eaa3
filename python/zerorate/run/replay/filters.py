"""All filters of a replay side by side."""

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from typing import get_args

import numpy as np
import numpy.typing as npt

from zerorate._native import DriftFilter
from zerorate.run.replay.block import Block
from zerorate.run.replay.history import Recorder, moments
from zerorate.run.replay.passes import Beside, FilterOptions, Run
from zerorate.run.replay.result import Output

__all__ = ["Filters"]

Floats = npt.NDArray[np.float64]


class Filters:
    """New filters of k axes by method, the last of which is the chosen one and is watched."""

    def __init__(
        self,
        n: int,
        rate: float,
        channels: int,
        methods: Sequence[str],
        output: Output | None,
        options: FilterOptions,
    ) -> None:
        listed = _checked(methods)
        self.runs = {method: Run(rate, channels, method, options) for method in listed}
        self.output = _output(output, self.chosen)
        self.recorder = Recorder()
        self.holds = self.chosen.params["motion"] == "hold"
        self.notes = self.holds or self.chosen.method == "auto" or self.output == "compensated"
        self._moments = moments(n)
        self._known = np.zeros(channels, dtype=np.bool_)

    @property
    def chosen(self) -> DriftFilter:
        """The filter that the filtered log is of."""
        return list(self.runs.values())[-1].filter

    def through(self, raws: Iterator[Floats], executor: Executor) -> Iterator[Block]:
        """Yield what becomes of each block (k, n)."""
        for raw in raws:
            first = self.chosen.samples_seen
            beside = (np.empty_like(raw), np.empty(raw.shape, dtype=np.bool_))
            drift = self._drift(raw, first, executor, beside if self.notes else None)
            self._blank_before_first(raw, drift)
            yield Block(first, raw, drift, *(beside if self.notes else (None, None)))

    def _drift(
        self, raw: Floats, first: int, executor: Executor, beside: Beside | None
    ) -> dict[str, Floats]:
        *others, (name, chosen) = self.runs.items()
        low, high = np.searchsorted(self._moments, (first, first + raw.shape[1]), side="right")
        stops = (self._moments[low:high] - first).tolist()
        # The chosen one, which is noted meanwhile, takes longest.
        job = executor.submit(chosen.watched, raw, stops, self.recorder, beside)
        jobs = {method: executor.submit(run.through, raw) for method, run in others}
        return {method: other.result() for method, other in jobs.items()} | {name: job.result()}

    def _blank_before_first(self, raw: Floats, drift: dict[str, Floats]) -> None:
        """Put NaN where a filter had nothing yet to predict from."""
        for i in np.flatnonzero(~self._known):
            there = np.isfinite(raw[i])
            self._known[i] = there.any()
            unknown = int(there.argmax()) if self._known[i] else None
            for series in drift.values():
                series[i, :unknown] = np.nan


def _output(asked: Output | None, filter_: DriftFilter) -> Output:
    """Return what is asked for, or what the method is for."""
    if asked is None:
        return "compensated" if filter_.method == "auto" else "estimate"
    if asked not in get_args(Output):
        raise ValueError(f"output must be 'estimate' or 'compensated', got {asked!r}")
    return asked


def _checked(methods: Sequence[str]) -> list[str]:
    listed = list(methods)
    if not listed or len(set(listed)) < len(listed):
        raise ValueError(f"methods must be at least one and all different, got {listed}")
    return listed
