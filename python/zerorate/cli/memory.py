"""How the process of a command keeps its memory."""

import ctypes
from typing import Final

_M_TRIM_THRESHOLD: Final = -1
_M_MMAP_THRESHOLD: Final = -3
_KEPT: Final = 1 << 27
_LARGEST: Final = 1 << 25
"""Bytes of a block that may come from the heap, glibc's own limit."""


def keep_freed() -> None:
    """Keep freed memory for the next blocks of a record, where glibc can be told so.

    By itself it hands blocks of a megabyte back, and the kernel clears as much anew: of a day's
    replay that takes a quarter of the processor's time. At most 128 MB are kept.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return  # another C library
    mallopt(_M_MMAP_THRESHOLD, _LARGEST)
    mallopt(_M_TRIM_THRESHOLD, _KEPT)
