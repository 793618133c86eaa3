"""Sources that are no local file: bytes in memory, and addresses of stores."""

from __future__ import annotations

import io
import re
import shutil
import tempfile
import weakref
from pathlib import Path, PurePosixPath
from typing import Final, TypeGuard
from urllib.error import URLError

from zerorate.texts import describe_missing_extra

_ADDRESS: Final = re.compile(r"(s3|gs|gcs|abfss?|hdfs|file|https?):/{1,3}(?=[^/])")
_SECONDS: Final = 30.0


class Spooled:
    """A copy of bytes in a file of its own, which goes when nobody refers to it any more."""

    def __init__(self, content: bytes, name: str) -> None:
        folder = tempfile.mkdtemp(prefix="zerorate-")
        self.path = Path(folder) / name
        self.path.write_bytes(content)
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)


def is_address(source: object) -> TypeGuard[str]:
    """Return True if a source is the address of a store: ``s3://bucket/log.parquet``."""
    return isinstance(source, str) and _ADDRESS.match(source) is not None


def spooled(source: str | io.BytesIO, suffix: str = ".csv") -> Spooled:
    """Return a copy of the data at an address, or of bytes, with a suffix of their format.

    Raises
    ------
    ImportError
        If pyarrow is not installed; the message names the extra.
    OSError
        If it cannot be fetched.
    """
    if isinstance(source, io.BytesIO):
        return Spooled(source.getvalue(), f"bytes{suffix}")
    name = PurePosixPath(re.split(r"[?#]", source)[0]).name
    if source.startswith("http"):
        return Spooled(_fetched(source), name)
    try:
        from pyarrow import ArrowException
        from pyarrow.fs import FileSystem
    except ImportError:
        raise ImportError(describe_missing_extra("pyarrow", "io", source)) from None
    try:
        system, path = FileSystem.from_uri(source)
        with system.open_input_stream(path) as stream:
            return Spooled(stream.read(), name)
    except (ArrowException, NotImplementedError) as error:
        raise OSError(f"{source} cannot be read: {error}") from None


def _fetched(address: str) -> bytes:
    from urllib.request import urlopen

    try:
        with urlopen(address, timeout=_SECONDS) as answer:
            found: bytes = answer.read()
            return found
    except URLError as error:
        raise OSError(f"{address} cannot be read: {error.reason}") from None
