"""Interrupts: blocked in worker processes, delayed during a sample, handled in native code."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import copy_context
from types import FrameType
from typing import Any, Final, Self, TypeVar

T = TypeVar("T")

INTERRUPT: Final = int(signal.SIGINT)
# Windows has no terminal that hangs up.
_END_SIGNALS: Final = (
    (signal.SIGTERM,) if sys.platform == "win32" else (signal.SIGTERM, signal.SIGHUP)
)
_SIGNALS: Final = (signal.SIGINT, *_END_SIGNALS)


@contextmanager
def block_child_interrupts() -> Iterator[None]:
    """Start processes that never receive an interrupt; delay interrupts meanwhile.

    Ctrl-C reaches every process of a terminal, but only the main process may react. Processes that
    threads started here later create do not receive it either.
    """
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker

    # A new process would unblock interrupts itself.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def run_in_background(work: Callable[[], T]) -> T:
    """Run work in a thread and return its result or raise its error; an interrupt abandons it.

    Native code cannot be interrupted, and can take minutes.
    """
    from concurrent.futures import Future

    future: Future[T] = Future()
    # The thread gets a copy of the caller's context variables, such as argument names.
    context = copy_context()

    def run() -> None:
        try:
            future.set_result(context.run(work))
        except BaseException as error:
            future.set_exception(error)

    threading.Thread(target=run, daemon=True).start()
    return future.result()


class TerminationHandler:
    """Turns signals that end a process into interrupts, so that unfinished files are removed."""

    def __init__(self) -> None:
        self.number = INTERRUPT
        """Number of the received signal."""
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        """Install the handlers; only the main thread receives signals."""
        if threading.current_thread() is threading.main_thread():
            for number in _SIGNALS:
                # Keep signals that a shell or nohup ignores, and signals that the caller handles.
                if signal.getsignal(number) in _DEFAULT_HANDLERS:
                    self._before[number] = signal.signal(number, self._end)
        return self

    def __exit__(self, *_: object) -> None:
        """Restore the previous handlers of the signals."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _end(self, number: int, frame: FrameType | None) -> None:
        if _is_importing(frame):
            later = threading.Timer(_RETRY_DELAY_S, _resend_signal, (number,))
            later.daemon = True
            later.start()
            return
        self.number = number
        # Only once: a second signal must not stop the cleanup.
        for other_number in self._before:
            signal.signal(other_number, signal.SIG_IGN)
        raise KeyboardInterrupt


_DEFAULT_HANDLERS: Final = (signal.SIG_DFL, signal.default_int_handler)
_RETRY_DELAY_S: Final = 0.01
"""Delay before a signal is sent again, s."""


def _resend_signal(number: int) -> None:
    """Send a signal to the main thread to end its wait."""
    if sys.platform == "win32":
        signal.raise_signal(number)
    else:
        main = threading.main_thread().ident
        assert main is not None
        signal.pthread_kill(main, number)


def _is_importing(frame: FrameType | None) -> bool:
    """Return True if a signal arrived during the import of a module.

    An exception raised there is lost and the import lock stays locked: threads that import would
    wait for ever.
    """
    return frame is not None and frame.f_code.co_filename.startswith("<frozen importlib")


class SignalInterrupt(Exception):
    """Error for a received signal; its argument is the signal's number."""


class Interrupts:
    """Handler that raises an error for a signal only while a stream waits for its next sample.

    Each sample is then either answered or not read, so the state can be saved.
    """

    def __init__(self) -> None:
        self._waiting = False
        self._pending: int | None = None

    @contextmanager
    def catch_signals(self) -> Iterator[None]:
        """Catch signals in the body of ``with``; only the main thread receives any."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        # Signals that a shell ignores, as for background jobs, stay ignored.
        before = {
            number: signal.signal(number, self._handle_signal)
            for number in _SIGNALS
            if signal.getsignal(number) is not signal.SIG_IGN
        }
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def wait(self, read: Callable[[], T]) -> T:
        """Return the result of a function; raise `SignalInterrupt` if a signal arrives before."""
        self._waiting = True
        try:
            if self._pending is not None:
                raise SignalInterrupt(self._pending)
            return read()
        finally:
            self._waiting = False

    def _handle_signal(self, number: int, frame: FrameType | None) -> None:
        if self._waiting:
            raise SignalInterrupt(number)
        if self._pending is not None:
            # A second signal while the answer's reader blocks: the sample cannot be finished.
            raise KeyboardInterrupt
        self._pending = number
