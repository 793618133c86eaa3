"""Work beside the main thread, which stays free for an interrupt."""

from collections.abc import Callable
from concurrent.futures import Future
from threading import Thread
from typing import TypeVar

__all__ = ["in_background", "preloaded"]

T = TypeVar("T")


def in_background(work: Callable[[], T]) -> T:
    """Return what work returns or raise what it raises; an interrupt leaves it behind.

    Native code cannot be interrupted, and some of it takes minutes.
    """
    future: Future[T] = Future()

    def run() -> None:
        try:
            future.set_result(work())
        except BaseException as error:
            future.set_exception(error)

    Thread(target=run, daemon=True).start()
    return future.result()


def preloaded(load: Callable[[], object]) -> None:
    """Begin to import what is needed later; if that fails, the later import says so."""
    Thread(target=_quietly, args=(load,), daemon=True).start()


def _quietly(load: Callable[[], object]) -> None:
    try:
        load()
    except ImportError:
        return
