"""Signals that end a stream between two samples, never within one."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final, TypeVar

__all__ = ["Interrupted", "Interrupts"]

T = TypeVar("T")

_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM)


class Interrupted(Exception):
    """A signal came; its number is the argument."""


class Interrupts:
    """Lets signals raise only while a stream waits for its next sample.

    A sample is thus taken and answered, or not taken at all, and the state can be saved.
    """

    def __init__(self) -> None:
        self._waiting = False
        self._pending: int | None = None

    @contextmanager
    def caught(self) -> Iterator[None]:
        """Catch signals in the body; only the main thread gets any."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        # What a shell has told to be ignored, in the background for instance, stays ignored.
        before = {
            number: signal.signal(number, self._note)
            for number in _SIGNALS
            if signal.getsignal(number) is not signal.SIG_IGN
        }
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def wait(self, read: Callable[[], T]) -> T:
        """Return what a function returns, or raise `Interrupted` if a signal comes before."""
        self._waiting = True
        try:
            if self._pending is not None:
                raise Interrupted(self._pending)
            return read()
        finally:
            self._waiting = False

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self._waiting:
            raise Interrupted(number)
        if self._pending is not None:
            # Asked twice: the reader of the answers hangs, so the sample cannot be finished.
            raise KeyboardInterrupt
        self._pending = number
