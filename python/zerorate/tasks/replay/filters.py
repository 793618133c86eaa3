"""Filters of a replay; all process the same blocks."""

import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, Final, Literal, cast, get_args

import numpy as np

from zerorate._native import DriftFilter
from zerorate.faults import ArgumentError
from zerorate.options import FilterOptions, add_rest_limits, check_used, select_options
from zerorate.record.log import Header
from zerorate.tasks.replay.history import Recorder, moments
from zerorate.types import Booleans, Floats

Output = Literal["compensated", "estimate"]
_StateArrays = tuple[Floats, Booleans, Booleans]
"""Output arrays for the standard deviation of the bias, rest, and a stuck sensor."""


@dataclass(frozen=True, eq=False)
class Block:
    """Samples of k axes from the index `first` on, with the filters' outputs; arrays are (k, n).

    In `raw`, saturated samples are missing. `bias` has one array per method. `bias_sigma`,
    `at_rest` and `stuck` belong to the chosen method, if recorded. `saturated` is set if the
    sensor's range is known.
    """

    first: int
    raw: Floats
    bias: Mapping[str, Floats]
    bias_sigma: Floats | None = None
    at_rest: Booleans | None = None
    stuck: Booleans | None = None
    saturated: Booleans | None = None

    @property
    def end(self) -> int:
        """Index after the last sample."""
        return self.first + int(self.raw.shape[1])

    @property
    def rest(self) -> Booleans | None:
        """Mask of rest, without samples of a stuck sensor, because it may have moved."""
        if self.at_rest is None or self.stuck is None:
            return self.at_rest
        return self.at_rest & ~self.stuck


class Filters:
    """New filters of k axes by method. The last filter is chosen, and its state is recorded.

    Each filter receives the options that its method uses, and the limit of rest if the log's unit
    is known. Filters that hold the bias in motion receive the mask of known motion.
    """

    def __init__(
        self,
        header: Header,
        methods: Sequence[str],
        output: Output,
        options: FilterOptions,
        moving: Booleans | None = None,
    ) -> None:
        listed, channels = _check_methods(methods), header.channels
        filter_options = cast(dict[str, Any], options)
        limited_options = add_rest_limits(filter_options, listed, header.unit, ["rest_limit"])
        self.runs = {
            method: _Run(header.rate, channels, method, select_options(method, limited_options))
            for method in listed
        }
        check_used(filter_options, listed)
        self.output: Final = _check_output(output)
        self.recorder = Recorder()
        self.holds = self.chosen_filter.params["motion"] == "hold"
        self.records_state = (
            self.holds or self.chosen_filter.method == "auto" or self.output == "compensated"
        )
        self.limit: Final = self.chosen_filter.params["limit"]
        self.moving: Final = moving
        self._moments = moments(header.n)
        self._has_sample = np.zeros(channels, dtype=np.bool_)

    @property
    def chosen_filter(self) -> DriftFilter:
        """Filter with the output for the filtered log."""
        return list(self.runs.values())[-1].filter

    def process_blocks(self, raws: Iterator[Floats], executor: Executor) -> Iterator[Block]:
        """Yield the output of each block (k, n)."""
        for raw in raws:
            first = self.chosen_filter.samples_seen
            state = _allocate_state(raw) if self.records_state else None
            bias = self._estimate_bias(raw, first, executor, state)
            in_range, saturated = mask_saturated(raw, self.limit)
            self._blank_before_first(in_range, bias)
            sigma, at_rest, stuck = state or (None, None, None)
            yield Block(first, in_range, bias, sigma, at_rest, stuck, saturated)

    def _estimate_bias(
        self, raw: Floats, first: int, executor: Executor, state: _StateArrays | None
    ) -> dict[str, Floats]:
        *other_runs, (name, chosen_run) = self.runs.items()
        low, high = np.searchsorted(self._moments, (first, first + raw.shape[1]), side="right")
        stops = (self._moments[low:high] - first).tolist()
        # The chosen filter takes longest, because its state is recorded.
        moving = None if self.moving is None else self.moving[first : first + raw.shape[1]]
        job = executor.submit(chosen_run.process_recorded, raw, stops, self.recorder, state, moving)
        jobs = {method: executor.submit(run.process, raw, moving) for method, run in other_runs}
        return {method: other.result() for method, other in jobs.items()} | {name: job.result()}

    def _blank_before_first(self, raw: Floats, bias: dict[str, Floats]) -> None:
        """Set the bias to NaN before a filter's first prediction."""
        for i in np.flatnonzero(~self._has_sample):
            present = np.isfinite(raw[i])
            self._has_sample[i] = present.any()
            unknown = int(present.argmax()) if self._has_sample[i] else None
            for series in bias.values():
                series[i, :unknown] = np.nan


class _Run:
    """One filter with its computing time."""

    def __init__(self, rate: float, channels: int, method: str, options: dict[str, Any]) -> None:
        # The filter raises an error for an unknown method.
        arguments = {**options, "method": method, "output": "estimate"}
        self.filter = DriftFilter(rate, channels=channels, **arguments)
        self._holds = self.filter.params["motion"] == "hold"
        self._seconds = 0.0

    def process(self, raw: Floats, moving: Booleans | None) -> Floats:
        """Return the bias of a block (k, n)."""
        bias = np.empty_like(raw)
        self._advance(raw, bias, None, moving)
        return bias

    def process_recorded(
        self,
        raw: Floats,
        stops: Sequence[int],
        recorder: Recorder,
        state: _StateArrays | None,
        moving: Booleans | None,
    ) -> Floats:
        """Return the bias of a block, record the state at some samples, and fill `state`."""
        bias = np.empty_like(raw)
        first = 0
        for stop in dict.fromkeys((*stops, raw.shape[1])):
            part = np.s_[:, first:stop]
            piece = None if state is None else (state[0][part], state[1][part], state[2][part])
            moving_piece = None if moving is None else moving[first:stop]
            self._advance(raw[part], bias[part], piece, moving_piece)
            if stop in stops:
                recorder.take(self.filter)
            first = stop
        return bias

    def _advance(
        self, raw: Floats, bias: Floats, state: _StateArrays | None, moving: Booleans | None
    ) -> None:
        hold_mask = moving if self._holds else None
        if hold_mask is not None and state is None:
            state = _allocate_state(raw)
        # Count only the processor time of this thread.
        begin = time.thread_time()
        self.filter._replay(raw, bias, state, hold_mask)
        self._seconds += time.thread_time() - begin

    @property
    def speed(self) -> float:
        """Samples processed per second on one core, counting each axis."""
        samples = self.filter.samples_seen * len(self.filter.ready)
        return samples / self._seconds if self._seconds > 0.0 else np.nan


def mask_saturated(raw: Floats, limit: float | None) -> tuple[Floats, Booleans | None]:
    """Return samples with saturated samples missing, and the mask of saturated samples."""
    if limit is None:
        return raw, None
    saturated = (np.abs(raw) >= limit) & np.isfinite(raw)
    return np.where(saturated, np.nan, raw), saturated


def _allocate_state(raw: Floats) -> _StateArrays:
    return np.empty_like(raw), np.empty(raw.shape, np.bool_), np.empty(raw.shape, np.bool_)


def _check_output(output: Output) -> Output:
    if output not in get_args(Output):
        raise ArgumentError("output", f"must be 'compensated' or 'estimate', got {output!r}")
    return output


def _check_methods(methods: Sequence[str]) -> list[str]:
    listed = list(methods)
    if not listed or len(set(listed)) < len(listed):
        raise ArgumentError("methods", f"must be at least one and all different, got {listed}")
    return listed
