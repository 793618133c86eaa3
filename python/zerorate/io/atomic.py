"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import re
import secrets
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

__all__ = ["atomic_path", "check_writable", "sweep"]


def check_writable(path: str | os.PathLike[str], force: bool = False) -> None:
    """Check that a file can be written, before the work that fills it is begun.

    Parameters
    ----------
    path
        The file to write.
    force
        Whether an existing file may be replaced; default no.

    Raises
    ------
    FileExistsError
        If the file exists and ``force`` is false.
    FileNotFoundError, NotADirectoryError, IsADirectoryError, PermissionError
        If the folder is missing, is no folder, the path is a folder, or writing is not allowed.
    """
    target = Path(path)
    folder = target.parent
    if not folder.exists():
        raise FileNotFoundError(f"cannot write {target}: the folder {folder} does not exist")
    if not folder.is_dir():
        raise NotADirectoryError(f"cannot write {target}: {folder} is not a folder")
    if target.is_dir():
        raise IsADirectoryError(f"cannot write {target}: it is a folder")
    _check_free(target, force)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(f"cannot write {target}: the folder {folder} is not writable")


@contextmanager
def atomic_path(path: str | os.PathLike[str], force: bool = False) -> Iterator[Path]:
    """Yield a temporary path that becomes ``path`` on success and vanishes on any exception.

    Parameters
    ----------
    path
        The file to write.
    force
        Whether an existing file may be replaced; default no.

    Yields
    ------
    Path
        A name in the same folder with the same suffix, for the body to create.

    Raises
    ------
    OSError
        As `check_writable` does, before the body runs.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from zerorate.io import atomic_path
    >>> target = Path(tempfile.mkdtemp()) / "table.txt"
    >>> with atomic_path(target) as temporary:
    ...     _ = temporary.write_text("whole")
    >>> target.read_text()
    'whole'
    """
    check_writable(path, force)
    # A link keeps pointing where it did: the file behind it is replaced.
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".{target.stem[:80]}.{_token()}{target.suffix}")
    try:
        yield temporary
        _flush(temporary)
        _check_free(target, force)
        os.replace(temporary, target)
    except BaseException as error:
        temporary.unlink(missing_ok=True)
        # A write that fails, for want of room for instance, does not say where.
        if isinstance(error, OSError) and error.filename is None:
            error.filename = os.fspath(target.parent)
        raise
    _flush_folder(target.parent)


def _check_free(target: Path, force: bool) -> None:
    if target.exists() and not force:
        raise FileExistsError(f"{target} exists already; pass force=True to replace it")


def _flush(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def _flush_folder(folder: Path) -> None:
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


_TEMPORARY: Final = re.compile(
    r"\.(?P<stem>.+)\.(?P<process>[0-9a-f]{6})[0-9a-f]{6}(?P<suffix>\.[^.]+|)"
)
_PROCESSES: Final = 1 << 24


def _token() -> str:
    """Return twelve digits of a temporary name: this process, and a random number."""
    return f"{os.getpid() % _PROCESSES:06x}{secrets.token_hex(3)}"


def sweep(targets: Iterable[Path]) -> None:
    """Remove what `atomic_path` began for these files and a kill left behind, and no others.

    What another process of this machine is writing stays, and what this one writes must not be
    among the targets. A file that cannot be removed stays as well: it harms nothing.
    """
    folders: dict[Path, set[tuple[str, str]]] = {}
    for target in targets:
        # A link's temporary file lies next to the file behind it.
        path = Path(os.path.realpath(target))
        folders.setdefault(path.parent, set()).add((path.stem[:80], path.suffix))
    for folder, known in folders.items():
        for path in folder.glob(".*.*"):
            found = _TEMPORARY.fullmatch(path.name)
            if found is None or (_own_stem(found["stem"]), found["suffix"]) not in known:
                continue
            if not _runs_elsewhere(int(found["process"], 16)):
                with suppress(OSError):
                    path.unlink()


def _own_stem(stem: str) -> str:
    """Return the stem of the file behind a temporary name, be that one's own target temporary."""
    inner = _TEMPORARY.fullmatch(stem)
    return stem if inner is None else inner["stem"]


def _runs_elsewhere(process: int) -> bool:
    """Return whether there is such a process, and it is not this one."""
    # There no signal can ask, and a file that is open cannot be removed anyway.
    if os.name != "posix" or process == os.getpid() % _PROCESSES:
        return False
    try:
        os.kill(process, 0)
    except OSError as error:
        return isinstance(error, PermissionError)
    return process > 0
