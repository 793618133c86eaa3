"""Files in object stores, listed by address with size and time of change."""

from __future__ import annotations

import re
from posixpath import dirname
from typing import TYPE_CHECKING, NamedTuple
from urllib.parse import quote

from zerorate.io.remote import hide_secrets
from zerorate.texts import describe_missing_extra

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pyarrow.fs import FileInfo


class StoredFile(NamedTuple):
    """A file in a store: path, address, size in bytes, time of change in ns."""

    path: str
    address: str
    size: int
    modified: int


class Listing(NamedTuple):
    """Files at an address, the folder above them, and True if the address is that folder."""

    folder: str
    files: tuple[StoredFile, ...]
    is_folder: bool


def list_store(address: str) -> Listing:
    """Return the file at an address, the files below it, or the files that match its wildcards.

    ``*`` matches any part of a name, ``**`` any number of folders. A query, as in
    ``s3://bucket/logs?region=eu-west-1``, is passed to `pyarrow.fs.FileSystem.from_uri`.

    Raises
    ------
    ImportError
        If pyarrow is not installed; the message names the extra.
    OSError
        If the store cannot be listed.
    """
    try:
        from pyarrow import ArrowException
        from pyarrow.fs import FileSelector, FileSystem, FileType
    except ImportError:
        raise ImportError(describe_missing_extra("pyarrow", "io", address)) from None
    if address.startswith("http"):
        raise OSError(
            f"{hide_secrets(address)} cannot be listed: expected a store such as s3://bucket/folder"
        )
    place, mark, query = address.partition("?")
    plain, wildcards = _split_wildcards(place)
    try:
        system, top = FileSystem.from_uri(plain + mark + query)
        info = system.get_file_info(top)
        if info.type == FileType.File:
            return Listing(dirname(top), (_stored(info, plain + mark + query),), False)
        below = system.get_file_info(FileSelector(top, recursive=True))
    except (ArrowException, NotImplementedError, OSError) as error:
        raise OSError(f"{hide_secrets(address)} cannot be listed: {error}") from None
    pattern = re.compile(_as_expression(wildcards or "**"))
    names = {one.path[len(top) :].lstrip("/"): one for one in below if one.type == FileType.File}
    files = tuple(
        _stored(names[name], f"{plain}/{quote(name)}{mark}{query}")
        for name in sorted(filter(pattern.fullmatch, names))
    )
    return Listing(top, files, not wildcards)


def _stored(info: FileInfo, address: str) -> StoredFile:
    return StoredFile(info.path, address, info.size or 0, info.mtime_ns or 0)


def _split_wildcards(place: str) -> tuple[str, str]:
    """Return the folder above the first wildcard of an address, and the pattern below it."""
    if "*" not in place:
        return place.rstrip("/"), ""
    above = place[: place.index("*")].rpartition("/")[0]
    return above, place[len(above) + 1 :]


def _as_expression(pattern: str) -> str:
    """Return a pattern of names and slashes as a regular expression."""
    *folders, name = pattern.split("/")
    if name == "**":
        folders, name = [*folders, name], "*"
    return "".join(_folder_expressions(folders)) + _name_expression(name)


def _folder_expressions(folders: Iterable[str]) -> Iterable[str]:
    return ("(?:[^/]+/)*" if one == "**" else f"{_name_expression(one)}/" for one in folders)


def _name_expression(name: str) -> str:
    return re.escape(name).replace(r"\*", "[^/]*")
