"""Ctrl-C reaches every process of a terminal; here it is for the one that leads."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker

__all__ = ["for_the_parent_alone"]


@contextmanager
def for_the_parent_alone() -> Iterator[None]:
    """Start processes here that never see an interrupt; one that comes meanwhile is kept.

    Threads that are started here pass it on to the processes that they start later.
    """
    if sys.platform == "win32":
        yield
        return
    # As it starts by itself, it lets interrupts through again.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
