"""Work on several cores: threads of a replay, and single-thread processes."""

import os
from collections import deque
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Final, Generic, Self, TypeVar

T = TypeVar("T")

_MAX_THREADS: Final = 16
_MAX_PENDING_ITEMS: Final = 6
"""Largest number of items waiting for a step; more than the blocks written together."""
_THREAD_VARIABLES: Final = (
    "RAYON_NUM_THREADS",
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
_thread_limit: ContextVar[int | None] = ContextVar("threads of a replay", default=None)


@contextmanager
def limit_threads(count: int) -> Iterator[None]:
    """Limit the threads of `thread_pool`, if many logs share the cores."""
    before = _thread_limit.set(count)
    try:
        yield
    finally:
        _thread_limit.reset(before)


def thread_count() -> int:
    """Return the number of threads of `thread_pool`."""
    return _thread_limit.get() or min(os.cpu_count() or 1, _MAX_THREADS)


@contextmanager
def thread_pool() -> Iterator[ThreadPoolExecutor]:
    """Yield a pool with one thread per core; an interrupt drops jobs that have not started.

    Only code that releases the interpreter lock runs faster.
    """
    executor = ThreadPoolExecutor(thread_count())
    try:
        yield executor
    finally:
        executor.shutdown(cancel_futures=True)


# Each step of a pipeline is a job in a pool, and its consumer waits only for this job. Errors of a
# step are raised where its result is read, and no queue can stay full or empty.


def prefetch(items: Iterator[T]) -> Generator[T]:
    """Yield the items while another thread makes the next item."""
    if thread_count() == 1:
        yield from items
        return
    end = object()
    with ThreadPoolExecutor(1) as executor:
        next_item: Future[T | object] = executor.submit(next, items, end)
        while (item := next_item.result()) is not end:
            next_item = executor.submit(next, items, end)
            yield item  # type: ignore[misc]


class BackgroundStep(Generic[T]):
    """Step that processes items one after the other in another thread.

    On normal exit all items have been processed. On an error, items that have not started are
    dropped.
    """

    def __init__(self, take: Callable[[T], None]) -> None:
        self._take = take
        self._executor = None if thread_count() == 1 else ThreadPoolExecutor(1)
        self._jobs: deque[Future[None]] = deque()

    def __enter__(self) -> Self:
        """Return the step itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *fault: object) -> None:
        """Wait for the running job; raise its error unless another error is active."""
        try:
            while kind is None and self._jobs:
                self._jobs.popleft().result()
        finally:
            if self._executor is not None:
                self._executor.shutdown(cancel_futures=True)

    def put(self, item: T) -> None:
        """Pass an item to the thread; wait if too many items are waiting."""
        if self._executor is None:
            self._take(item)
            return
        while len(self._jobs) >= _MAX_PENDING_ITEMS:
            self._jobs.popleft().result()
        self._jobs.append(self._executor.submit(self._take, item))


@contextmanager
def force_single_thread() -> Iterator[None]:
    """Start worker processes with one thread each, to leave cores for other logs.

    Libraries read the size of their thread pools from the environment when they are loaded.
    """
    before = {name: os.environ.get(name) for name in _THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(_THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
