"""The format of a file: by its suffix, and by its first bytes."""

from __future__ import annotations

from pathlib import Path

from zerorate.io.errors import LogError

_SUFFIXES = {
    ".csv": "text",
    ".tsv": "text",
    ".txt": "text",
    ".dat": "text",
    ".npy": "npy",
    ".npz": "npz",
    ".parquet": "parquet",
    ".pq": "parquet",
}
_MAGIC = {"parquet": b"PAR1", "npy": b"\x93NUMPY", "npz": b"PK\x03\x04"}
_CALLED = {"text": "a text table", "parquet": "Parquet", "npy": "an .npy array", "npz": "an .npz"}


def format_of(file: Path) -> str:
    """Return "text", "npy", "npz" or "parquet"; LogError if suffix and content disagree."""
    kind = _SUFFIXES.get(file.suffix.lower())
    if kind is None:
        raise LogError(f"unknown suffix '{file.suffix}'; known: {', '.join(_SUFFIXES)}")
    with file.open("rb") as opened:
        head = opened.read(8)
    if not head:
        raise LogError(f"the file is empty, expected {_CALLED[kind]}")
    content = next((name for name, magic in _MAGIC.items() if head.startswith(magic)), "text")
    if content != kind:
        found = "something else" if content == "text" else _CALLED[content]
        raise LogError(
            f"by its suffix {_CALLED[kind]}, by its content {found}; rename or convert it"
        )
    return kind
