"""Checkpoints written beside the stream, so that no answer waits for the disk."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from zerorate.io import atomic_path
from zerorate.io.atomic import sweep
from zerorate.run.live.stream import LineStream

__all__ = ["Saver"]


class Saver:
    """Saves a stream every so many samples, and once more at its end.

    Parameters
    ----------
    path : Path
        The file, replaced as a whole.
    every : int
        Samples between two checkpoints; one that is still being written delays the next.
    warn : callable
        Takes a sentence if a checkpoint cannot be written; the stream goes on.
    """

    def __init__(self, path: Path, every: int, warn: Callable[[str], None]) -> None:
        # The last run may have been killed while it wrote.
        sweep([path])
        self._path = path
        self._every = every
        self._warn = warn
        self._next: int | None = None
        self._failing = False
        self._thread = ThreadPoolExecutor(1)
        self._job: Future[None] | None = None

    def answered(self, stream: LineStream) -> None:
        """Save the stream if it is time to, counted from the first answer."""
        if self._next is None:
            self._next = stream.samples + self._every
        if stream.samples < self._next or (self._job is not None and not self._job.done()):
            return
        self._look_after_last()
        self._next = stream.samples + self._every
        self._job = self._thread.submit(self._write, stream.to_bytes())

    def finish(self, stream: LineStream | None) -> None:
        """Wait for the last checkpoint, and save once more; OSError if that cannot be done.

        Pass None if it is not known whether all was answered: the last checkpoint stands then.
        """
        self._thread.shutdown()
        if stream is not None and stream.open:
            self._write(stream.to_bytes())

    def _write(self, raw: bytes) -> None:
        with atomic_path(self._path, force=True) as temporary:
            temporary.write_bytes(raw)

    def _look_after_last(self) -> None:
        error = None if self._job is None else self._job.exception()
        if error is not None and not self._failing:
            self._warn(f"the checkpoint cannot be written: {error}")
        self._failing = error is not None
