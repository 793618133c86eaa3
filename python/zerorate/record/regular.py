"""Reading of whole files, with errors for pipes, devices and very large files."""

import errno
import os
import stat
from typing import Final

__all__ = ["check_regular", "read_regular", "read_regular_text"]

_MAX_BYTES: Final = 1 << 30
"""Largest size of files read whole, such as calibrations, models and poses, bytes."""


def check_regular(path: str | os.PathLike[str], mode: int) -> None:
    """Raise OSError for a pipe, socket or device, because its content may never end.

    Parameters
    ----------
    path
        The file.
    mode
        ``st_mode`` of the file.
    """
    if not stat.S_ISREG(mode):
        raise OSError(
            f"{os.fspath(path)} is a pipe, a socket or a device, expected a file; copy it to one"
        )


def read_regular(path: str | os.PathLike[str]) -> bytes:
    """Return all bytes of a file.

    Raises
    ------
    OSError
        If the path is a folder, pipe, socket or device, is larger than 1 GB, or cannot be read. The
        function never waits for a pipe.
    """
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    try:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
        check_regular(path, mode)
        with os.fdopen(descriptor, "rb", closefd=False) as file:
            raw = file.read(_MAX_BYTES + 1)
    finally:
        os.close(descriptor)
    if len(raw) > _MAX_BYTES:
        raise OSError(f"{os.fspath(path)} has more than {_MAX_BYTES >> 30} GB, expected less")
    return raw


def read_regular_text(path: str | os.PathLike[str]) -> str:
    """Return the text of a UTF-8 file without its byte order mark; errors as in `read_regular`."""
    return read_regular(path).decode("utf-8-sig")
