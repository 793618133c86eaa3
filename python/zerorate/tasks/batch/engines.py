"""Engines that run tasks on workers that may die: the interface, and local processes."""

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

# A fork would copy locks that threads of this process hold at that moment.
_SPAWN: Final = get_context("spawn")


@dataclass(frozen=True)
class TaskResult(Generic[T, R]):
    """A task and its return value."""

    task: T
    answer: R


@dataclass(frozen=True)
class WorkerDeath(Generic[T]):
    """A task whose worker died, and the cause of death."""

    task: T
    reason: str


class Engine(Protocol):
    """Runs a function over tasks on workers that may die."""

    def run(
        self, work: Callable[[T], R], tasks: Sequence[T], max_running: int | None = None
    ) -> Generator[TaskResult[T, R] | WorkerDeath[T]]:
        """Yield each task's result when it ends; at most `max_running` tasks run at a time."""
        ...


def run_with_retry(
    engine: Engine, work: Callable[[T], R], tasks: Sequence[T]
) -> Generator[TaskResult[T, R] | WorkerDeath[T]]:
    """Yield each task's result; run a task whose worker died once more, alone, at the end.

    A task that ran out of memory next to others, or was killed from outside, succeeds alone. A task
    whose worker dies twice is itself at fault.
    """
    suspects: list[T] = []
    # Closed here: an interrupt must have ended the workers before it goes on.
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

    A process pool of the standard library breaks as a whole when one worker is killed, and cannot
    tell by which task. Here each worker has its own pipe: when the pipe closes, the task is known.
    """

    def __init__(self, count: int | None = None) -> None:
        if count is not None and count < 1:
            raise ArgumentError("workers", f"must be at least 1, got {count}")
        self._count = count or _count_cores()

    def run(
        self, work: Callable[[T], R], tasks: Sequence[T], max_running: int | None = None
    ) -> Generator[TaskResult[T, R] | WorkerDeath[T]]:
        """Yield each task's result when it ends; leaving early ends the workers."""
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
    """Give a worker the next task, or send it home."""
    if waiting:
        worker.begin(waiting.popleft())
        busy[worker.pipe] = worker
    else:
        worker.stop()


def _count_cores() -> int:
    """Return the cores that this process may use, which a batch system may have limited."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class _Worker(Generic[T, R]):
    """One process, and the task that it holds."""

    def __init__(self, work: Callable[[T], R]) -> None:
        self.pipe, child_pipe = _SPAWN.Pipe()
        self._task: T
        self._process = _SPAWN.Process(target=_serve, args=(work, child_pipe), daemon=True)
        with force_single_thread(), block_child_interrupts():
            self._process.start()
        # The pipe must end with the process, so nobody else may hold its other side.
        child_pipe.close()

    def begin(self, task: T) -> None:
        """Hand over a task; that the process is dead by now shows in `end`."""
        self._task = task
        try:
            self.pipe.send(task)
        except OSError:
            return

    def end(self) -> TaskResult[T, R] | WorkerDeath[T]:
        """Return the answer, or the cause of the process's death; one of them is there."""
        try:
            return TaskResult(self._task, self.pipe.recv())
        except (EOFError, OSError):
            self._process.join()
            return WorkerDeath(self._task, _describe_exit(self._process.exitcode or 0))

    def stop(self) -> None:
        """End the process now; a log that it is writing stays what it was."""
        self._process.kill()
        self._process.join()
        self.pipe.close()


def _serve(work: Callable[[Any], Any], pipe: Connection) -> None:
    """Answer tasks until the other side is gone."""
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
