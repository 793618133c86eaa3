"""Files that folders and patterns name.

Patterns are those of `glob`, but each folder is taken once, and brackets may be just that.
"""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatch
from glob import has_magic
from pathlib import Path
from typing import Final

from zerorate.io.formats import FORMATS, is_bag_folder

SUFFIXES: Final = tuple(dict.fromkeys(suffix for form in FORMATS for suffix in form.suffixes))
"""Of the files in a folder that are taken for logs."""


@dataclass
class Found:
    """What a pattern has led to.

    Attributes
    ----------
    root : Path
        The deepest folder that does not depend on what is there.
    files : set of Path
        Absolute; links are kept as they are. The folder of a ROS 2 bag is one.
    failed : dict of Path to str
        What matches but cannot be read, or not be looked into, and why.
    """

    root: Path
    files: set[Path] = field(default_factory=set)
    failed: dict[Path, str] = field(default_factory=dict)


def find(pattern: str) -> Found:
    """Return the files that a folder or a pattern names; the folder of a ROS 2 bag is one of them.

    A folder names all in it and below that has the suffix of a log. In a pattern ``**`` is any
    number of folders. It follows links, but takes each folder once, so that a link to a folder
    above leads nowhere. A part in brackets that is the name of something is that.
    """
    whole = Path(os.path.abspath(pattern))
    if whole.is_dir() and not _is_bag(whole):
        return _below(whole)
    first, *parts = whole.parts
    folder = Path(first)
    while len(parts) > 1 and _is_name(folder, parts[0]):
        folder /= parts.pop(0)
    found = Found(folder)
    for path in _matches(folder, parts, found) if parts else ():
        _sort(path, found)
    # What lies in the folder of a bag that matches is that bag's.
    found.files -= {path for path in found.files if path.parent in found.files}
    return found


def _below(top: Path) -> Found:
    """Return the logs of a folder."""
    found = Found(top)
    for folder in _folders(top, found):
        if _is_bag(folder):
            found.files.add(folder)
            continue
        for name in _names(folder, found):
            if not name.startswith(".") and Path(name).suffix.lower() in SUFFIXES:
                _sort(folder / name, found)
    return found


def _is_bag(folder: Path) -> bool:
    """Return whether a folder is a ROS 2 bag; logs may lie next to metadata of another kind."""
    return is_bag_folder(folder) and any(
        path.suffix in (".db3", ".mcap") for path in folder.iterdir()
    )


def _is_name(folder: Path, part: str) -> bool:
    """Return whether a part of a pattern is a name, and not itself a pattern."""
    wild = "*" in part or "?" in part
    return not has_magic(part) or (not wild and os.path.lexists(folder / part))


def _matches(folder: Path, parts: Sequence[str], found: Found) -> Iterator[Path]:
    part, rest = parts[0], parts[1:]
    if part == "**":
        for inner in _folders(folder, found):
            yield from _matches(inner, rest or ["*"], found)
        return
    if _is_name(folder, part):
        names = [part] if os.path.lexists(folder / part) else []
    else:
        names = [name for name in _names(folder, found) if _fits(name, part)]
    for name in names:
        if rest:
            yield from _matches(folder / name, rest, found)
        else:
            yield folder / name


def _fits(name: str, part: str) -> bool:
    return fnmatch(name, part) and (not name.startswith(".") or part.startswith("."))


def _folders(top: Path, found: Found) -> Iterator[Path]:
    """Yield a folder and all below, each once: by its own name rather than by a link's."""
    seen: set[tuple[int, int]] = set()
    own = [top]
    links: list[Path] = []
    while own or links:
        folder = own.pop() if own else links.pop(0)
        try:
            state = folder.stat()
            if (state.st_dev, state.st_ino) in seen:
                continue
            seen.add((state.st_dev, state.st_ino))
            inner = [folder / name for name in _names(folder, found) if not name.startswith(".")]
            own += [path for path in inner if not path.is_symlink() and path.is_dir()]
            links += [path for path in inner if path.is_symlink() and path.is_dir()]
        except OSError as error:
            found.failed[folder] = error.strerror or str(error)
            continue
        yield folder


def _names(folder: Path, found: Found) -> list[str]:
    try:
        return sorted(os.listdir(folder))
    except (FileNotFoundError, NotADirectoryError):
        return []
    except OSError as error:
        found.failed[folder] = error.strerror or str(error)
        return []


def _sort(path: Path, found: Found) -> None:
    try:
        if path.is_file() or (path.is_dir() and _is_bag(path)):
            found.files.add(path)
        elif not path.is_dir():
            found.failed[path] = "a link to nothing" if path.is_symlink() else "no regular file"
    except OSError as error:
        found.failed[path] = error.strerror or str(error)
