"""Files that are written completely or not at all."""

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
    """Check that a file can be written, before its content is computed.

    Parameters
    ----------
    path
        File to write.
    force
        Allow replacing an existing file; default False.
    make_folders
        Accept missing folders, which will be made; default False.

    Raises
    ------
    FileExistsError
        If the file exists and ``force`` is false.
    FileNotFoundError
        If the folder does not exist.
    NotADirectoryError
        If the folder is a file.
    IsADirectoryError
        If the path is a folder.
    PermissionError
        If writing is not allowed.
    OSError
        If the path is a device or a pipe, because a file would replace it.

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
        raise OSError(f"cannot write {target}: it is no file but a device or a pipe")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(f"cannot write {target}: the folder {folder} is not writable")


@contextmanager
def atomic_path(path: str | os.PathLike[str], force: bool = False) -> Iterator[Path]:
    """Yield a temporary path; on success it becomes ``path``, on an exception it is removed.

    Parameters
    ----------
    path
        File to write.
    force
        Allow replacing an existing file; default False.

    Yields
    ------
    Path
        Name of a file to create, in the same folder and with the same suffix.

    Raises
    ------
    OSError
        If `check_writable` fails, before the body of ``with`` runs.

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
    # Keep a link, and replace its target.
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
        # Errors of a write, such as a full disk, have no file name.
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
    """Return a temporary name that identifies its file, machine and process.

    It is short and ASCII, because some libraries accept no other names.
    """
    suffix = target.suffix if target.suffix.isascii() else ""
    process, chance = f"{os.getpid():x}", os.urandom(4).hex()
    return (
        f".zerorate-{_digest(target.name)}-{_machine_id()}-{process}-{chance}"
        f"{suffix if len(suffix) <= _MAX_SUFFIX_LENGTH else ''}"
    )


def _digest(text: str) -> str:
    # Imported here because its cipher libraries load slowly.
    import hashlib

    return hashlib.blake2b(text.encode("utf-8", "backslashreplace"), digest_size=4).hexdigest()


@cache
def _machine_id() -> str:
    """Return an identifier of the machine.

    Machines that share a folder may have processes with the same number.
    """
    try:
        numbers = os.readlink("/proc/self/ns/pid")
    except OSError:
        numbers = ""
    return _digest(f"{platform.node()} {numbers}")


def remove_leftovers(targets: Iterable[Path]) -> None:
    """Remove unfinished files of killed runs of `atomic_path` from these files' folders.

    These are files of ended processes of this machine, and files of other machines for the same
    paths. A file that cannot be removed stays.
    """
    folders: dict[Path, set[str]] = {}
    for target in targets:
        # A link's temporary file is next to the link's target.
        path = Path(os.path.realpath(target))
        folders.setdefault(path.parent, set()).add(_digest(path.name))
    for folder, digests in folders.items():
        with suppress(OSError):
            for name in os.listdir(folder):
                if _is_leftover(name, digests):
                    with suppress(OSError):
                        (folder / name).unlink()


def _is_leftover(name: str, digests: set[str]) -> bool:
    """Return True if a name belongs to an abandoned temporary file."""
    match = _TEMPORARY_PATTERN.fullmatch(name)
    if match is None or name in _ACTIVE_NAMES:
        return False
    if match["machine"] != _machine_id():
        return match["target"] in digests
    return not _is_running_elsewhere(int(match["process"], 16))


def _is_running_elsewhere(process: int) -> bool:
    """Return True if a process with this number exists and is not this process."""
    # Windows has no such signal, and cannot remove open files.
    if os.name != "posix" or process in (0, os.getpid()):
        return False
    try:
        os.kill(process, 0)
    except (OSError, OverflowError) as error:
        return isinstance(error, PermissionError)
    return True
