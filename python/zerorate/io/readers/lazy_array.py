"""Arrays in files with known shape and type, read on request."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from zerorate.io.table import Column


@dataclass(frozen=True)
class LazyArray:
    """An array that is read on request."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    read: Callable[[], Column]

    @classmethod
    def of(cls, array: Column) -> LazyArray:
        """Return an array in memory as a `LazyArray`."""
        return cls(array.shape, array.dtype, lambda: array)

    @property
    def ndim(self) -> int:
        """Number of dimensions."""
        return len(self.shape)

    def flatten_vector(self) -> LazyArray:
        """Return a row or column vector of MATLAB with one dimension."""
        if self.ndim != 2 or 1 not in self.shape:
            return self
        rows = max(self.shape) if 0 not in self.shape else 0
        return LazyArray((rows,), self.dtype, lambda: self.read().reshape(-1))


class Axis(NamedTuple):
    """An array (n,), or one column of an array (n, k)."""

    array: LazyArray
    at: int | None = None


def load_axes(axes: Sequence[Axis]) -> list[Column]:
    """Return the columns; columns of the same array are read together."""
    arrays = {array: array.read() for array in {axis.array for axis in axes}}
    return [a if axis.at is None else a[:, axis.at] for axis in axes for a in [arrays[axis.array]]]
