"""Reading in a separate process, for libraries that damaged files can crash or block.

The process starts with the first file and is used again. It is replaced after a damaged file, which
may have corrupted its memory. Computing time and memory are limited by the size of the file; beyond
the limit, the process ends and reading raises an error.
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

from zerorate.io.limits import max_bytes, max_seconds
from zerorate.io.table import Column
from zerorate.record.log import LogError

_PROGRAM: Final = Path(__file__).with_name("isolated_worker.py")
"""Module that the process runs; it is not imported here because it needs all readers."""
_CLOCK_S_PER_CPU_S: Final = 1.0 if sys.platform == "win32" else 10.0
"""Limit on elapsed time per second of computing time; a busy system needs more time."""
_CPU_LIMIT_CODE: Final = -int(getattr(signal, "SIGXCPU", 0))


def run_isolated(work: str, path: Path, *arguments: Any) -> tuple[Any, list[Column]]:  # noqa: ANN401
    """Return the result of a function in `isolated_worker` for a file, and its arrays.

    Raises
    ------
    LogError
        If the function raises a LogError itself, or no process can be started.
    ValueError, OSError, MemoryError
        If the file is damaged, or exceeds the limits.
    """
    seconds = max_seconds(path)
    request = {
        "work": work,
        "arguments": (os.fspath(path.absolute()), *arguments),
        "seconds": seconds,
        "bytes": max_bytes(path),
    }
    with _worker.lock:
        answer, arrays = _worker.answer(json.dumps(request).encode() + b"\n", seconds)
    if "error" in answer:
        raise _make_error(**answer)
    return answer["result"], arrays


class _WorkerProcess:
    """The process that is used again."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None

    def answer(self, request: bytes, seconds: float) -> tuple[dict[str, Any], list[Column]]:
        """Send a request and return the answer; ValueError if it ends the process."""
        process, new = self._get_process()
        try:
            with _kill_after(process, seconds * _CLOCK_S_PER_CPU_S) as late:
                answer, arrays = _exchange(process, request)
        except EOFError:
            code = process.wait()
            self.end()
        except BaseException:
            self.end()  # the answer is incomplete
            raise
        else:
            if answer.pop("harmed", False):
                self.end()
            return answer, arrays
        if late.is_set() or code == _CPU_LIMIT_CODE:
            raise ValueError(
                f"reading it would take more than {seconds:.0f} s, as in no sound file"
            )
        if not new:  # an earlier file may be the cause
            return self.answer(request, seconds)
        raise ValueError(f"it ended the process that read it, with code {code}")

    def _get_process(self) -> tuple[subprocess.Popen[bytes], bool]:
        """Return the process, and True if it is new."""
        if self._process is not None and self._process.poll() is None:
            return self._process, False
        self.end()
        self._process = _start_process()
        return self._process, True

    def end(self) -> None:
        """End the process if there is one."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            _close(process)

    def abandon(self) -> None:
        """Forget the process in a forked process; it belongs to the parent."""
        self.lock = threading.Lock()
        process, self._process = self._process, None
        if process is not None:
            process.returncode = 0  # the parent waits for it
            _close(process)


@contextlib.contextmanager
def _kill_after(process: subprocess.Popen[bytes], seconds: float) -> Iterator[threading.Event]:
    """Kill a process after a time limit; the yielded event is then set."""
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


def _start_process() -> subprocess.Popen[bytes]:
    if not sys.executable:
        raise LogError("it is read by another interpreter, but this one knows of none")
    module_path = os.pathsep.join(filter(None, sys.path))
    return subprocess.Popen(
        [sys.executable, "-P", os.fspath(_PROGRAM)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": module_path, "OPENBLAS_NUM_THREADS": "1"},
    )


def _exchange(
    process: subprocess.Popen[bytes], request: bytes
) -> tuple[dict[str, Any], list[Column]]:
    """Return the answer of a process; EOFError if it ends."""
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
    return answer, [_read_array(process.stdout, *about) for about in answer.get("arrays", ())]


def _read_array(file: BufferedReader, kind: str, shape: list[int]) -> Column:
    size = math.prod(shape) * np.dtype(kind).itemsize
    raw = bytearray(size)
    if file.readinto(raw) < size:
        raise EOFError
    return np.frombuffer(raw, kind).reshape(shape) if size else np.empty(shape, kind)


def _make_error(error: str, kind: str, errno: int | None) -> Exception:
    if kind == "Refused":
        return LogError(error)
    if kind == "memory":
        return MemoryError(error)
    return ValueError(error) if errno is None else OSError(errno, error)


_worker = _WorkerProcess()
atexit.register(_worker.end)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_worker.abandon)
