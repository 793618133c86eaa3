"""Work spread over the cores; what runs there must release the interpreter lock to gain."""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Final

__all__ = ["Progress", "on_threads", "silent", "thread_count", "workers"]

Progress = Callable[[str, float], None]
"""Called with the step's name and the fraction of it that is done."""

_MOST: Final = 16
_asked: ContextVar[int | None] = ContextVar("threads of a replay", default=None)


def silent(step: str, fraction: float) -> None:
    """Report nothing."""


@contextmanager
def on_threads(count: int) -> Iterator[None]:
    """Let `workers` have this many threads instead, where many logs share the cores."""
    before = _asked.set(count)
    try:
        yield
    finally:
        _asked.reset(before)


def thread_count() -> int:
    """Return how many threads `workers` has."""
    return _asked.get() or min(os.cpu_count() or 1, _MOST)


@contextmanager
def workers() -> Iterator[ThreadPoolExecutor]:
    """Yield as many threads as there are cores; an interrupt drops what is not yet begun."""
    executor = ThreadPoolExecutor(thread_count())
    try:
        yield executor
    finally:
        executor.shutdown(cancel_futures=True)
