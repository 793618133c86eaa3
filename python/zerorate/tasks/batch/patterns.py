"""Files that match folders and patterns.

Patterns are as in `glob`, but each folder is visited once, and brackets may be literal.
"""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatch
from glob import has_magic
from pathlib import Path

from zerorate.io.formats import is_bag_folder, known_suffixes


@dataclass
class MatchedFiles:
    """Files that match a pattern.

    Attributes
    ----------
    root : Path
        Deepest folder in the pattern without a wildcard.
    files : set of Path
        Absolute paths, with links not resolved. The folder of a ROS 2 bag counts as a file.
    failed : dict of Path to str
        Unreadable matching files and folders, with the reasons.
    """

    root: Path
    files: set[Path] = field(default_factory=set)
    failed: dict[Path, str] = field(default_factory=dict)


def find_files(pattern: str) -> MatchedFiles:
    """Return the files of a folder or pattern; the folder of a ROS 2 bag counts as a file.

    A folder includes all files below it with a suffix of logs. In a pattern, ``**`` is any number
    of folders. Links are followed, but each folder is visited once, so a link to a parent folder
    adds nothing. Brackets are literal if a file or folder with exactly this name exists.
    """
    whole = Path(os.path.abspath(pattern))
    if whole.is_dir() and not _is_bag(whole):
        return _find_in_folder(whole)
    first, *parts = whole.parts
    folder = Path(first)
    while len(parts) > 1 and _is_name(folder, parts[0]):
        folder /= parts.pop(0)
    matched = MatchedFiles(folder)
    for path in _match_parts(folder, parts, matched) if parts else ():
        _add_path(path, matched)
    # Files in the folder of a matching bag belong to the bag.
    matched.files -= {path for path in matched.files if path.parent in matched.files}
    return matched


def _find_in_folder(top: Path) -> MatchedFiles:
    """Return the logs of a folder."""
    matched, suffixes = MatchedFiles(top), known_suffixes()
    for folder in _walk_folders(top, matched):
        if _is_bag(folder):
            matched.files.add(folder)
            continue
        for name in _list_names(folder, matched):
            if not name.startswith(".") and Path(name).suffix.lower() in suffixes:
                _add_path(folder / name, matched)
    return matched


def _is_bag(folder: Path) -> bool:
    """Return True if a folder is a ROS 2 bag; other metadata may be next to logs."""
    return is_bag_folder(folder) and any(
        path.suffix in (".db3", ".mcap") for path in folder.iterdir()
    )


def _is_name(folder: Path, part: str) -> bool:
    """Return True if a part of a pattern is a plain name."""
    has_wildcard = "*" in part or "?" in part
    return not has_magic(part) or (not has_wildcard and os.path.lexists(folder / part))


def _match_parts(folder: Path, parts: Sequence[str], matched: MatchedFiles) -> Iterator[Path]:
    part, rest = parts[0], parts[1:]
    if part == "**":
        for inner in _walk_folders(folder, matched):
            yield from _match_parts(inner, rest or ["*"], matched)
        return
    if _is_name(folder, part):
        names = [part] if os.path.lexists(folder / part) else []
    else:
        names = [name for name in _list_names(folder, matched) if _is_match(name, part)]
    for name in names:
        if rest:
            yield from _match_parts(folder / name, rest, matched)
        else:
            yield folder / name


def _is_match(name: str, part: str) -> bool:
    return fnmatch(name, part) and (not name.startswith(".") or part.startswith("."))


def _walk_folders(top: Path, matched: MatchedFiles) -> Iterator[Path]:
    """Yield a folder and all folders below it, each once, by its own name if possible."""
    visited: set[tuple[int, int]] = set()
    own = [top]
    links: list[Path] = []
    while own or links:
        folder = own.pop() if own else links.pop(0)
        try:
            state = folder.stat()
            if (state.st_dev, state.st_ino) in visited:
                continue
            visited.add((state.st_dev, state.st_ino))
            inner = [
                folder / name for name in _list_names(folder, matched) if not name.startswith(".")
            ]
            own += [path for path in inner if not path.is_symlink() and path.is_dir()]
            links += [path for path in inner if path.is_symlink() and path.is_dir()]
        except OSError as error:
            matched.failed[folder] = error.strerror or str(error)
            continue
        yield folder


def _list_names(folder: Path, matched: MatchedFiles) -> list[str]:
    try:
        return sorted(os.listdir(folder))
    except (FileNotFoundError, NotADirectoryError):
        return []
    except OSError as error:
        matched.failed[folder] = error.strerror or str(error)
        return []


def _add_path(path: Path, matched: MatchedFiles) -> None:
    try:
        if path.is_file() or (path.is_dir() and _is_bag(path)):
            matched.files.add(path)
        elif not path.is_dir():
            matched.failed[path] = "no regular file" if path.exists() else "a link to nothing"
    except OSError as error:
        matched.failed[path] = error.strerror or str(error)
