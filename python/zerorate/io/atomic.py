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
    temporary = target.with_name(f".{target.stem[:80]}.{secrets.token_hex(6)}{target.suffix}")
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


_TEMPORARY: Final = re.compile(r"\.(?P<stem>.+)\.[0-9a-f]{12}(?P<suffix>\.[^.]+|)")


def sweep(targets: Iterable[Path]) -> None:
    """Remove what `atomic_path` began for these files and a kill left behind, and no others.

    Nobody may be writing them. A file that cannot be removed stays: it harms nothing.
    """
    folders: dict[Path, set[tuple[str, str]]] = {}
    for target in targets:
        # A link's temporary file lies next to the file behind it.
        path = Path(os.path.realpath(target))
        folders.setdefault(path.parent, set()).add((path.stem[:80], path.suffix))
    for folder, known in folders.items():
        for path in folder.glob(".*.*"):
            found = _TEMPORARY.fullmatch(path.name)
            if found is not None and (found["stem"], found["suffix"]) in known:
                with suppress(OSError):
                    path.unlink()
