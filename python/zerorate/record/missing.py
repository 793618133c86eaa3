"""Conversion of missing values to NaN: masked values, None, NA of pandas, nulls of Arrow.

Every function and compiled class that takes an array of samples uses this module.
"""

from __future__ import annotations

import math
from decimal import Decimal
from numbers import Real
from typing import Any, Final

import numpy as np
import numpy.typing as npt

_MISSING: Final[dict[str, Any]] = {
    "M": np.datetime64("NaT", "ns"),
    "m": np.timedelta64("NaT", "ns"),
    "O": None,
}


def floats(values: npt.ArrayLike, name: str) -> npt.NDArray[np.float64]:
    """Return real numbers as float64 with NaN for missing values; errors as in `real_numbers`."""
    return np.asarray(real_numbers(values, name), dtype=np.float64)


def real_numbers(values: npt.ArrayLike, name: str) -> npt.NDArray[Any]:
    """Return an array of real numbers in their own type, with NaN for missing values.

    Raises
    ------
    TypeError
        If a value is no real number.
    ValueError
        If the rows differ in length, or an integer exceeds the range of doubles.
    """
    try:
        array = without_masks(values)
    except OverflowError:
        raise ValueError(f"{name} holds a number beyond the largest double, 1.8e308") from None
    if array.dtype.kind not in "fiub":
        raise TypeError(f"{name} must hold real numbers, got dtype {array.dtype}")
    return array


def without_masks(values: npt.ArrayLike) -> npt.NDArray[Any]:
    """Return an array with NaN or NaT for masked values, None and NA of pandas.

    Arrays without missing values and arrays of other objects are returned unchanged. A table of one
    column becomes an array of this column.

    Raises
    ------
    OverflowError
        If an object is an integer beyond the range of doubles.
    """
    array = np.asanyarray(values)
    if array.shape[1:] == (1,) and is_table(values):
        array = array[:, 0]
    if isinstance(array, np.ma.MaskedArray):
        array = _fill_masked(array)
    if array.dtype.kind == "O" and all(map(_is_number_or_missing, array.flat)):
        return _numbers(array)
    return np.asarray(array)


def is_table(values: object) -> bool:
    """Return True if samples have named columns, as in a log, a data frame or an Arrow table."""
    return hasattr(values, "columns") or hasattr(values, "with_data")


def _numbers(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    if array.size and all(isinstance(value, (int, np.integer)) for value in array.flat):
        # A date in nanoseconds is too large for an exact double.
        whole = np.array(array.tolist())
        if whole.dtype.kind in "iu":
            return whole
    doubles = [math.nan if _is_missing(value) else float(value) for value in array.flat]
    return np.array(doubles).reshape(array.shape)


def _fill_masked(array: np.ma.MaskedArray[Any, Any]) -> npt.NDArray[Any]:
    if not np.ma.is_masked(array):
        return np.asarray(array)
    kind = array.dtype.kind
    if kind not in "fiubMmO":
        return np.asarray(array)
    values = np.array(array.data, np.float64 if kind in "iub" else array.dtype)
    values[np.ma.getmaskarray(array)] = _MISSING.get(kind, np.nan)
    return values


def _is_missing(value: object) -> bool:
    return value is None or type(value).__name__ in ("NAType", "NaTType")


def _is_number_or_missing(value: object) -> bool:
    return isinstance(value, (Real, Decimal)) or _is_missing(value)
