"""The way of a recording: read ahead, filtered, and measured and kept or written behind."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from typing import Final

import numpy as np

from zerorate.io import LogError
from zerorate.io.logfile import LogFile
from zerorate.io.reading import notes_on_missing
from zerorate.run.replay.block import Block
from zerorate.run.replay.filters import Filters
from zerorate.run.replay.measure import Measures
from zerorate.run.replay.memory import memory
from zerorate.run.replay.result import Summary
from zerorate.run.replay.stages import Behind, ahead
from zerorate.run.replay.workers import Progress, workers

__all__ = ["ROWS", "drive", "summed_up"]

ROWS: Final = 1 << 15
"""Samples of a block: enough to hide what a block costs, few enough for the processor's caches."""


def drive(
    recording: LogFile,
    filters: Filters,
    sinks: Sequence[Callable[[Block], None]],
    progress: Progress,
    rows: int = ROWS,
) -> None:
    """Lead all blocks through the filters, and then to every sink in a thread of its own."""
    with ExitStack() as stack:
        executor = stack.enter_context(workers())
        raws = stack.enter_context(closing(ahead(recording.blocks(rows))))
        steps = [stack.enter_context(Behind(sink)) for sink in sinks]
        for block in filters.through(raws, executor):
            for step in steps:
                step.put(block)
            progress("filtering", block.end / recording.header.n)


def summed_up(
    recording: LogFile, filters: Filters, measures: Measures, horizons: Sequence[float]
) -> Summary:
    """Return what is said of a recording that is through."""
    scores, seen = measures.finish()
    if not seen.present.any():
        raise LogError("no axis holds a sample: all are missing")
    header = recording.header
    chosen, history = filters.chosen, filters.recorder.history()
    return Summary(
        header=header.noting(notes_on_missing(header.names, (seen.missing == header.n).tolist())),
        method=chosen.method,
        output=filters.output,
        params=chosen.params,
        scores=scores,
        horizons=tuple(horizons),
        speed={method: run.speed for method, run in filters.runs.items()},
        guard_count={
            method: np.asarray(run.filter.guard_count) for method, run in filters.runs.items()
        },
        ready=np.asarray(chosen.ready),
        status=tuple(chosen.status),
        history=history,
        memory=memory(history, chosen.order, header.rate),
        seen=seen,
    )
