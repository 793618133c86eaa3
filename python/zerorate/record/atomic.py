"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Final

from zerorate.faults import keyword_argument, make_sentence


def check_writable(
    path: str | os.PathLike[str], force: bool = False, make_folders: bool = False
) -> None:
    """Check that a file can be written, before the work on its content begins.

    Parameters
    ----------
    path
        The file to write.
    force
        Allow replacing an existing file; default no.
    make_folders
        Missing folders will be made; default no.

    Raises
    ------
    FileExistsError
        If the file exists and ``force`` is false.
    FileNotFoundError, NotADirectoryError, IsADirectoryError, PermissionError
        If the folder is missing, is no folder, the path is a folder, or writing is not allowed.
    OSError
        If the path is a device or a pipe: it would be replaced by a file, not written to.

    Examples
    --------
    >>> from zerorate.record import check_writable
    >>> check_writable("no such folder/log.csv")
    Traceback (most recent call last):
    FileNotFoundError: cannot write no such folder/log.csv: the folder no such folder does not exist
    """
    target = Path(path)
    folder = target.parent
    if make_folders:
        folder = next(parent for parent in target.absolute().parents if parent.exists())
    if not folder.exists():
        raise FileNotFoundError(f"cannot write {target}: the folder {folder} does not exist")
    if not folder.is_dir():
        raise NotADirectoryError(f"cannot write {target}: {folder} is not a folder")
    if target.is_dir():
        raise IsADirectoryError(f"cannot write {target}: it is a folder")
    _check_free(target, force)
    if target.exists() and not target.is_file():
        raise OSError(f"cannot write {target}: it is no file, and would be replaced by one")
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
        Allow replacing an existing file; default no.

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
    >>> from zerorate.record import atomic_path
    >>> target = Path(tempfile.mkdtemp()) / "table.txt"
    >>> with atomic_path(target) as temporary:
    ...     _ = temporary.write_text("whole")
    >>> target.read_text()
    'whole'
    """
    check_writable(path, force)
    # A link keeps pointing where it did: the file behind it is replaced.
    target = Path(os.path.realpath(path))
    temporary = target.with_name(_temporary_name(target))
    _ACTIVE_NAMES.add(temporary.name)
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
    finally:
        _ACTIVE_NAMES.discard(temporary.name)
    _flush_folder(target.parent)


def _check_free(target: Path, force: bool) -> None:
    if target.exists() and not force:
        python = "force=True"
        raise FileExistsError(
            make_sentence(
                f"{target} exists already; pass ",
                keyword_argument("force", "", python),
                " to replace it",
            )
        )


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


_TEMPORARY_PATTERN: Final = re.compile(
    r"\.zerorate-(?P<target>[0-9a-f]{8})-(?P<machine>[0-9a-f]{8})-(?P<process>[0-9a-f]{1,8})-.*"
)
_MAX_SUFFIX_LENGTH: Final = 16
_ACTIVE_NAMES: Final[set[str]] = set()


def _temporary_name(target: Path) -> str:
    """Return a name with its owner: file, machine and process.

    It is short and plain whatever the file is called, for libraries that take no other names.
    """
    suffix = target.suffix if target.suffix.isascii() else ""
    process, chance = f"{os.getpid():x}", os.urandom(4).hex()
    return (
        f".zerorate-{_digest(target.name)}-{_machine_id()}-{process}-{chance}"
        f"{suffix if len(suffix) <= _MAX_SUFFIX_LENGTH else ''}"
    )


def _digest(text: str) -> str:
    # Libraries of a cipher come with it, which take longer to load than many a command.
    import hashlib

    return hashlib.blake2b(text.encode("utf-8", "backslashreplace"), digest_size=4).hexdigest()


@cache
def _machine_id() -> str:
    """Return an identifier of the machine, different for machines that share a folder.

    A process is known by its number only where the same numbers are given.
    """
    try:
        numbers = os.readlink("/proc/self/ns/pid")
    except OSError:
        numbers = ""
    return _digest(f"{platform.node()} {numbers}")


def remove_leftovers(targets: Iterable[Path]) -> None:
    """Remove files that `atomic_path` began in these files' folders and that a kill left behind.

    That is what a process of this machine began that is no more, and what one of another machine
    began for these very files, which nobody else may be writing. A file that cannot be removed
    stays: it harms nothing.
    """
    folders: dict[Path, set[str]] = {}
    for target in targets:
        # A link's temporary file lies next to the file behind it.
        path = Path(os.path.realpath(target))
        folders.setdefault(path.parent, set()).add(_digest(path.name))
    for folder, digests in folders.items():
        with suppress(OSError):
            for name in os.listdir(folder):
                if _is_leftover(name, digests):
                    with suppress(OSError):
                        (folder / name).unlink()


def _is_leftover(name: str, digests: set[str]) -> bool:
    """Return True if a name is that of a file which nobody will finish."""
    match = _TEMPORARY_PATTERN.fullmatch(name)
    if match is None or name in _ACTIVE_NAMES:
        return False
    if match["machine"] != _machine_id():
        return match["target"] in digests
    return not _is_running_elsewhere(int(match["process"], 16))


def _is_running_elsewhere(process: int) -> bool:
    """Return True if there is such a process, and it is not this one."""
    # There no signal arrives, and a file that is open cannot be removed anyway.
    if os.name != "posix" or process in (0, os.getpid()):
        return False
    try:
        os.kill(process, 0)
    except (OSError, OverflowError) as error:
        return isinstance(error, PermissionError)
    return True
