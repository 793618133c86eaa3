"""Reading in a process of its own, for libraries that damaged bytes can crash or hold for ever.

The process is begun with the first file and kept for the next ones, but not behind a damaged one,
which may have spoilt its memory. It may compute and take memory as the size of a file allows;
beyond, it ends and the file is refused.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import math
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from io import BufferedReader
from pathlib import Path
from typing import Any, Final

import numpy as np

from zerorate.io.limits import most_bytes, most_seconds
from zerorate.io.table import Column
from zerorate.record.log import LogError

_PROGRAM: Final = Path(__file__).with_name("apart_child.py")
"""What the process runs; it knows the readers, so it is not imported here."""
_PATIENCE: Final = 1.0 if sys.platform == "win32" else 10.0
"""Seconds on the clock for one of computing, which most systems count: they may be busy."""
_OUT_OF_TIME: Final = -int(getattr(signal, "SIGXCPU", 0))


def asked(work: str, path: Path, *arguments: Any) -> tuple[Any, list[Column]]:  # noqa: ANN401
    """Return what a function of `apart_child` tells of a file, and its arrays.

    Raises
    ------
    LogError
        If the function refuses the file in its own words, or no process can be begun.
    ValueError, OSError, MemoryError
        If the file is damaged, or cannot be read within the limits.
    """
    seconds = most_seconds(path)
    request = {
        "work": work,
        "arguments": (os.fspath(path.absolute()), *arguments),
        "seconds": seconds,
        "bytes": most_bytes(path),
    }
    with _kept.lock:
        answer, arrays = _kept.answer(json.dumps(request).encode() + b"\n", seconds)
    if "error" in answer:
        raise _fault(**answer)
    return answer["told"], arrays


class _Kept:
    """The process that is kept."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None

    def answer(self, request: bytes, seconds: float) -> tuple[dict[str, Any], list[Column]]:
        """Send a request and return its answer; ValueError if the process does not survive it."""
        process, new = self._running()
        try:
            with _killed_after(process, seconds * _PATIENCE) as late:
                answer, arrays = _exchanged(process, request)
        except EOFError:
            code = process.wait()
            self.end()
        except BaseException:
            self.end()  # in the midst of an answer
            raise
        else:
            if answer.pop("harmed", False):
                self.end()
            return answer, arrays
        if late.is_set() or code == _OUT_OF_TIME:
            raise ValueError(
                f"reading it would take more than {seconds:.0f} s, as in no sound file"
            )
        if not new:  # an earlier file may have done the harm
            return self.answer(request, seconds)
        raise ValueError(f"it ended the process that read it, with code {code}")

    def _running(self) -> tuple[subprocess.Popen[bytes], bool]:
        """Return the process, and whether it is a new one."""
        if self._process is not None and self._process.poll() is None:
            return self._process, False
        self.end()
        self._process = _begun()
        return self._process, True

    def end(self) -> None:
        """End the process, if there is one."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            _close(process)

    def forget(self) -> None:
        """Leave the process to the parent, in a process that was forked."""
        self.lock = threading.Lock()
        process, self._process = self._process, None
        if process is not None:
            process.returncode = 0  # it is none of ours to wait for
            _close(process)


@contextlib.contextmanager
def _killed_after(process: subprocess.Popen[bytes], seconds: float) -> Iterator[threading.Event]:
    """Kill a process that is not done in time; the event says so."""
    late = threading.Event()

    def stop() -> None:
        late.set()
        process.kill()

    timer = threading.Timer(seconds, stop)
    timer.daemon = True
    timer.start()
    try:
        yield late
    finally:
        timer.cancel()


def _close(process: subprocess.Popen[bytes]) -> None:
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()


def _begun() -> subprocess.Popen[bytes]:
    if not sys.executable:
        raise LogError("it is read by another interpreter, but this one knows of none")
    found = os.pathsep.join(filter(None, sys.path))
    return subprocess.Popen(
        [sys.executable, "-P", os.fspath(_PROGRAM)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": found, "OPENBLAS_NUM_THREADS": "1"},
    )


def _exchanged(
    process: subprocess.Popen[bytes], request: bytes
) -> tuple[dict[str, Any], list[Column]]:
    """Return what a process answers; EOFError if it ends."""
    assert process.stdin is not None
    assert isinstance(process.stdout, BufferedReader)
    try:
        process.stdin.write(request)
        process.stdin.flush()
    except OSError:
        raise EOFError from None
    line = process.stdout.readline()
    if not line.endswith(b"\n"):
        raise EOFError
    answer = json.loads(line)
    return answer, [_array(process.stdout, *about) for about in answer.get("arrays", ())]


def _array(file: BufferedReader, kind: str, shape: list[int]) -> Column:
    size = math.prod(shape) * np.dtype(kind).itemsize
    raw = bytearray(size)
    if file.readinto(raw) < size:
        raise EOFError
    return np.frombuffer(raw, kind).reshape(shape) if size else np.empty(shape, kind)


def _fault(error: str, kind: str, errno: int | None) -> Exception:
    if kind == "Refused":
        return LogError(error)
    if kind == "memory":
        return MemoryError(error)
    return ValueError(error) if errno is None else OSError(errno, error)


_kept = _Kept()
atexit.register(_kept.end)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_kept.forget)
