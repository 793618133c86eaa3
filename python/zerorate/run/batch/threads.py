"""One thread a worker process: more would only take the cores from other logs."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

__all__ = ["single_threaded"]

_POOLS: Final = (
    "RAYON_NUM_THREADS",
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


@contextmanager
def single_threaded() -> Iterator[None]:
    """Start processes here: their pools are sized from the environment as they are loaded."""
    before = {name: os.environ.get(name) for name in _POOLS}
    os.environ.update(dict.fromkeys(_POOLS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
