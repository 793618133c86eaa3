"""Steps of a pipeline in threads of their own, none of which can outlive or hang the others.

A step is a job of a pool, and whoever needs its result waits for that job alone: a fault of a step
is raised where its result is asked for, and there is no queue that could stay full or empty.
"""

from collections import deque
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import Final, Generic, Self, TypeVar

from zerorate.run.replay.workers import thread_count

__all__ = ["Behind", "ahead"]

T = TypeVar("T")

_WAITING: Final = 6
"""Items under way to a step: more than the blocks that are written together."""


def ahead(items: Iterator[T]) -> Generator[T]:
    """Yield the items, the next one being made by another thread in the meantime."""
    if thread_count() == 1:
        yield from items
        return
    end = object()
    with ThreadPoolExecutor(1) as executor:
        coming: Future[T | object] = executor.submit(next, items, end)
        while (item := coming.result()) is not end:
            coming = executor.submit(next, items, end)
            yield item  # type: ignore[misc]


class Behind(Generic[T]):
    """A step that takes items one after the other in another thread.

    Left without a fault, it has taken them all; left with one, it drops those not yet begun.
    """

    def __init__(self, take: Callable[[T], None]) -> None:
        self._take = take
        self._executor = None if thread_count() == 1 else ThreadPoolExecutor(1)
        self._jobs: deque[Future[None]] = deque()

    def __enter__(self) -> Self:
        """Return the step itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Wait for what is begun, and raise its fault unless there is one already."""
        try:
            while kind is None and self._jobs:
                self._jobs.popleft().result()
        finally:
            if self._executor is not None:
                self._executor.shutdown(cancel_futures=True)

    def put(self, item: T) -> None:
        """Hand over an item, after waiting while too many are on their way."""
        if self._executor is None:
            self._take(item)
            return
        while len(self._jobs) >= _WAITING:
            self._jobs.popleft().result()
        self._jobs.append(self._executor.submit(self._take, item))
