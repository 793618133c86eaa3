"""The line that answers a sample."""

from collections.abc import Iterable, Sequence
from enum import StrEnum
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from zerorate._native import DriftFilter

__all__ = ["Beside", "answer", "header", "no_answer"]


Column: TypeAlias = float | bool | npt.NDArray[Any]
"""One number a channel: alone, or as an array of shape (k,)."""


class Beside(StrEnum):
    """Columns that may stand beside the rate."""

    bias = "bias"
    bias_sigma = "bias_sigma"
    at_rest = "at_rest"


def answer(rate: Column, filter_: DriftFilter, beside: Sequence[Beside]) -> str:
    """Return the rate of every channel, then every further column of every channel."""
    if not beside:
        return ",".join(_texts(rate))
    columns = (rate, *(getattr(filter_, name) for name in beside))
    return ",".join(text for column in columns for text in _texts(column))


def no_answer(channels: int, beside: Sequence[Beside]) -> str:
    """Return the answer to a line that held no sample."""
    return ",".join(["nan"] * (channels * (1 + len(beside))))


def header(names: Iterable[str], beside: Sequence[Beside]) -> str:
    """Return the names of an answer's columns."""
    names = tuple(names)
    return ",".join([*names, *(f"{column}_{name}" for column in beside for name in names)])


def _texts(column: Column) -> list[str]:
    # The shortest text that gives the same float again; rest as 0 or 1.
    values = column.tolist() if isinstance(column, np.ndarray) else [column]
    return [repr(value) if type(value) is float else str(int(value)) for value in values]
