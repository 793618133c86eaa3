"""What runs tasks, and how those whose worker died are told from those beside them."""

from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

__all__ = ["Died", "Engine", "Finished", "outlived"]

T = TypeVar("T")
R = TypeVar("R")


@dataclass(frozen=True)
class Finished(Generic[T, R]):
    """A task and what it returned."""

    task: T
    answer: R


@dataclass(frozen=True)
class Died(Generic[T]):
    """A task whose worker died, and how."""

    task: T
    reason: str


class Engine(Protocol):
    """Runs a function over tasks on workers that may die."""

    def run(
        self, work: Callable[[T], R], tasks: Sequence[T], at_once: int | None = None
    ) -> Generator[Finished[T, R] | Died[T]]:
        """Yield each task's end as it comes, `at_once` at most running at a time."""
        ...


def outlived(
    engine: Engine, work: Callable[[T], R], tasks: Sequence[T]
) -> Generator[Finished[T, R] | Died[T]]:
    """Yield each task's end; one whose worker died gets another try, alone, after all others.

    What died for want of memory beside others, or was killed from outside, then succeeds; what
    dies again is at fault itself.
    """
    suspects: list[T] = []
    # Closed here: an interrupt must have ended the workers before it goes on.
    with closing(engine.run(work, tasks)) as ends:
        for end in ends:
            if isinstance(end, Died):
                suspects.append(end.task)
            else:
                yield end
    if suspects:
        yield from engine.run(work, suspects, at_once=1)
