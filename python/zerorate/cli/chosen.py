"""The filters that were chosen, and the faults of running them."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy.typing as npt

from zerorate.cli.faults import DataFault, UsageFault, as_usage, writing
from zerorate.io import Log, LogError, LogFile
from zerorate.io.log import Header
from zerorate.run.replay import FilterOptions, Replay, Summary, replay, replay_to_file
from zerorate.run.replay.result import Output
from zerorate.run.replay.workers import Progress

__all__ = ["Chosen"]


@dataclass(frozen=True)
class Chosen:
    """Methods, the last of which is written, what is written of it, and options of the filters."""

    methods: tuple[str, ...]
    output: Output | None
    options: FilterOptions

    def in_memory(
        self,
        log: Log,
        progress: Progress,
        truth: npt.ArrayLike | None = None,
    ) -> Replay:
        """Return the log after the filters, with all that a figure needs, or raise a fault."""
        with _of(Header.of(log)), as_usage():
            return replay(
                log,
                methods=self.methods,
                output=self.output,
                truth=truth,
                progress=progress,
                **self.options,
            )

    def into_file(self, recording: LogFile, path: Path, force: bool, progress: Progress) -> Summary:
        """Write the filtered log block by block and return the rest, or raise a fault."""
        with writing(), _of(recording.header), _values():
            return replay_to_file(
                recording,
                path,
                methods=self.methods,
                output=self.output,
                force=force,
                progress=progress,
                **self.options,
            )


@contextmanager
def _of(header: Header) -> Iterator[None]:
    """Say which log is at fault."""
    try:
        yield
    except LogError as error:
        source = str(header.meta.get("source", "the log"))
        told = str(error).startswith(source)
        raise DataFault(str(error) if told else f"{source}: {error}") from None


@contextmanager
def _values() -> Iterator[None]:
    """Turn an argument that is not valid into a usage fault."""
    try:
        yield
    except LogError:
        raise
    except ValueError as error:
        raise UsageFault(str(error)) from None
