"""Engines that run tasks on workers that may die: interface, and local processes."""

import os
import signal
import sys
from collections import deque
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from typing import Any, Final, Generic, Protocol, TypeVar

from zerorate.faults import ArgumentError
from zerorate.tasks.interrupts import block_child_interrupts
from zerorate.tasks.workers import force_single_thread

T = TypeVar("T")
R = TypeVar("R")

# A forked process would copy locks held by other threads.
_SPAWN: Final = get_context("spawn")


@dataclass(frozen=True)
class TaskResult(Generic[T, R]):
    """A task with its result."""

    task: T
    answer: R


@dataclass(frozen=True)
class WorkerDeath(Generic[T]):
    """A task with a dead worker, and the cause of death."""

    task: T
    reason: str


class Engine(Protocol):
    """Engine that runs a function on tasks, on workers that may die."""

    def run(
        self, work: Callable[[T], R], tasks: Sequence[T], max_running: int | None = None
    ) -> Generator[TaskResult[T, R] | WorkerDeath[T]]:
        """Yield the result of each finished task; at most `max_running` tasks run at a time."""
        ...


def run_with_retry(
    engine: Engine, work: Callable[[T], R], tasks: Sequence[T]
) -> Generator[TaskResult[T, R] | WorkerDeath[T]]:
    """Yield each task's result; if its worker died, run the task once more, alone, at the end.

    A task that ran out of memory next to others, or was killed from outside, succeeds alone. If the
    worker dies again, the task is the cause.
    """
    suspects: list[T] = []
    # Close it here: on an interrupt, the workers must end first.
    with closing(engine.run(work, tasks)) as ends:
        for end in ends:
            if isinstance(end, WorkerDeath):
                suspects.append(end.task)
            else:
                yield end
    if suspects:
        yield from engine.run(work, suspects, max_running=1)


class Processes:
    """Worker processes, by default one per core, each identified by its task.

    A process pool of the standard library breaks completely if one worker is killed, and does not
    know the task. Here each worker has its own pipe: if the pipe closes, the task is known.
    """

    def __init__(self, count: int | None = None) -> None:
        if count is not None and count < 1:
            raise ArgumentError("workers", f"must be at least 1, got {count}")
        self._count = count or _count_cores()

    def run(
        self, work: Callable[[T], R], tasks: Sequence[T], max_running: int | None = None
    ) -> Generator[TaskResult[T, R] | WorkerDeath[T]]:
        """Yield the result of each finished task; an early exit ends the workers."""
        waiting = deque(tasks)
        count = min(max_running or self._count, len(waiting))
        busy: dict[Connection, _Worker[T, R]] = {}
        try:
            for _ in range(count):
                _assign_task(_Worker(work), waiting, busy)
            while busy:
                for pipe in wait(list(busy)):
                    worker = busy.pop(pipe)  # type: ignore[call-overload]
                    end = worker.end()
                    fresh = _Worker(work) if isinstance(end, WorkerDeath) and waiting else worker
                    _assign_task(fresh, waiting, busy)
                    yield end
        finally:
            for worker in busy.values():
                worker.stop()


def _assign_task(
    worker: "_Worker[T, R]", waiting: deque[T], busy: dict[Connection, "_Worker[T, R]"]
) -> None:
    """Give the next task to a worker; without tasks, end it."""
    if waiting:
        worker.begin(waiting.popleft())
        busy[worker.pipe] = worker
    else:
        worker.stop()


def _count_cores() -> int:
    """Return the number of cores that this process may use; a batch system may limit them."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class _Worker(Generic[T, R]):
    """A process with its current task."""

    def __init__(self, work: Callable[[T], R]) -> None:
        self.pipe, child_pipe = _SPAWN.Pipe()
        self._task: T
        self._process = _SPAWN.Process(target=_serve, args=(work, child_pipe), daemon=True)
        with force_single_thread(), block_child_interrupts():
            self._process.start()
        # The pipe must close with the process, so no other process may have its other end.
        child_pipe.close()

    def begin(self, task: T) -> None:
        """Send a task; if the process is dead, `end` reports it."""
        self._task = task
        try:
            self.pipe.send(task)
        except OSError:
            return

    def end(self) -> TaskResult[T, R] | WorkerDeath[T]:
        """Return the answer, or the cause of the process's death."""
        try:
            return TaskResult(self._task, self.pipe.recv())
        except (EOFError, OSError):
            self._process.join()
            return WorkerDeath(self._task, _describe_exit(self._process.exitcode or 0))

    def stop(self) -> None:
        """End the process now; an incomplete output never replaces a file."""
        self._process.kill()
        self._process.join()
        self.pipe.close()


def _serve(work: Callable[[Any], Any], pipe: Connection) -> None:
    """Answer tasks until the other side closes the pipe."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        while True:
            pipe.send(work(pipe.recv()))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return


def _describe_exit(code: int) -> str:
    if code < 0:
        return f"its worker process was ended by {signal.Signals(-code).name}"
    return f"its worker process ended with exit code {code}"
