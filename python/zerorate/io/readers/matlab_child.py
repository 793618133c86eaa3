"""The program that reads a MAT file in a process of its own: ``matlab_child.py FILE TEXT...``.

On its output stand arrays as `numpy.save` writes them: the names, then the array of each, of
numbers or, where the name is one of those given, of texts. It imports nothing of the package, which
would take longer than most files.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterator
from typing import IO, Any

import numpy as np

_Array = np.ndarray[Any, Any]


def main(path: str, texts: Collection[str], out: IO[bytes]) -> None:
    """Write the arrays of a file."""
    from scipy.io import loadmat

    arrays: dict[str, _Array] = {}
    for name, value in loadmat(path).items():
        if not name.startswith("__"):
            arrays.update(_arrays(name, value, texts))
    np.save(out, np.array(list(arrays), dtype=np.str_))
    for array in arrays.values():
        np.save(out, array, allow_pickle=False)


def _arrays(name: str, value: _Array, texts: Collection[str]) -> Iterator[tuple[str, _Array]]:
    """Yield a variable, or the fields of a structure, by path."""
    if value.dtype.names is not None and value.size == 1:
        for field in value.dtype.names:
            inner = np.asarray(value[field].reshape(-1)[0])
            yield from _arrays(f"{name}/{field}", inner, texts)
    elif name.rpartition("/")[2] in texts:
        yield name, _of_cells(value) if value.dtype.kind == "O" else value
    elif value.dtype.kind in "fiub" and value.ndim == 2 and value.size > 1:
        yield name, value.reshape(-1) if 1 in value.shape else value


def _of_cells(value: _Array) -> _Array:
    """Return a cell array of strings as NumPy's strings."""
    return np.array(["".join(map(str, np.asarray(c).reshape(-1)[:1])) for c in value.reshape(-1)])


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:], sys.stdout.buffer)
