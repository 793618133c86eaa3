"""Sources other than local files: bytes in memory, and addresses of object stores."""

from __future__ import annotations

import io
import re
import shutil
import tempfile
import weakref
from pathlib import Path, PurePosixPath
from typing import BinaryIO, Final, TypeGuard, cast

from zerorate.texts import describe_missing_extra

_ADDRESS: Final = re.compile(r"(s3|gs|gcs|abfss?|hdfs|file|https?):/{1,3}(?=[^/])")
_SECONDS: Final = 30.0
_MAX_BYTES: Final = 1 << 34
"""Largest number of bytes copied from an address, because its data may never end."""
_PIECE_BYTES: Final = 1 << 20


class Spooled:
    """A copy of bytes in a temporary file, deleted when it is no longer used."""

    def __init__(self, content: bytes | BinaryIO, name: str) -> None:
        folder = tempfile.mkdtemp(prefix="zerorate-")
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        self.path = Path(folder) / (name or "log")
        stream = io.BytesIO(content) if isinstance(content, bytes) else content
        left = _MAX_BYTES
        with self.path.open("wb") as file:
            while piece := stream.read(min(_PIECE_BYTES, left)):
                file.write(piece)
                left -= len(piece)
        if left == 0:
            raise OSError(f"it has more than {_MAX_BYTES >> 30} GB; copy a part of it to a file")


def is_address(source: object) -> TypeGuard[str]:
    """Return True if a source is the address of an object store: ``s3://bucket/log.parquet``."""
    return isinstance(source, str) and _ADDRESS.match(source) is not None


def hide_secrets(address: str) -> str:
    """Return an address without the key and secret that it may contain."""
    return re.sub(r"//[^/@?]*@", "//", address)


def spooled(source: str | io.BytesIO, suffix: str = ".csv") -> Spooled:
    """Return a temporary file with the data of an address or of bytes, with a given suffix.

    Raises
    ------
    ImportError
        If pyarrow is not installed; the message names the extra.
    OSError
        If the data cannot be fetched.
    """
    if isinstance(source, io.BytesIO):
        return Spooled(source.getvalue(), f"bytes{suffix}")
    name = PurePosixPath(re.split(r"[?#]", source)[0]).name
    if source.startswith("http"):
        return _fetched(source, name)
    try:
        from pyarrow import ArrowException
        from pyarrow.fs import FileSystem
    except ImportError:
        raise ImportError(describe_missing_extra("pyarrow", "io", source)) from None
    try:
        system, path = FileSystem.from_uri(source)
        with system.open_input_stream(path) as stream:
            return Spooled(cast("BinaryIO", stream), name)
    except (ArrowException, NotImplementedError, OSError) as error:
        raise OSError(f"{hide_secrets(source)} cannot be read: {error}") from None


def _fetched(address: str, name: str) -> Spooled:
    from http.client import HTTPException
    from urllib.request import urlopen

    try:
        with urlopen(address, timeout=_SECONDS) as answer:
            length = answer.headers.get("Content-Length", "")
            copy = Spooled(answer, name)
    except (HTTPException, ValueError, OSError) as error:
        reason = getattr(error, "reason", None) or error
        raise OSError(f"{address} cannot be read: {reason}") from None
    got = copy.path.stat().st_size
    if length.isdecimal() and str(got) != length.lstrip("0") and got:
        raise OSError(f"{address} is cut: {got} of its {length} bytes came")
    return copy
