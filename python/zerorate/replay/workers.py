"""Work spread over the cores; what runs there must release the interpreter lock to gain."""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Final

__all__ = ["Progress", "silent", "workers"]

Progress = Callable[[str, float], None]
"""Called with the step's name and the fraction of it that is done."""

_MOST: Final = 16


def silent(step: str, fraction: float) -> None:
    """Report nothing."""


@contextmanager
def workers() -> Iterator[ThreadPoolExecutor]:
    """Yield as many threads as there are cores; an interrupt drops what is not yet begun."""
    executor = ThreadPoolExecutor(min(os.cpu_count() or 1, _MOST))
    try:
        yield executor
    finally:
        executor.shutdown(cancel_futures=True)
