"""Missing values of every kind as NaN: masked, None, the NA of pandas."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any, Final

import numpy as np
import numpy.typing as npt

__all__ = ["without_masks"]

_MISSING: Final[dict[str, Any]] = {
    "M": np.datetime64("NaT"),
    "m": np.timedelta64("NaT"),
    "O": None,
}


def without_masks(values: npt.ArrayLike) -> npt.NDArray[Any]:
    """Return an array in which masked values, None and the NA of pandas are NaN or NaT.

    An array without any of them is returned as it is, and so is one of other objects.
    """
    array = np.asanyarray(values)
    if isinstance(array, np.ma.MaskedArray):
        array = _unmasked(array)
    if array.dtype.kind == "O" and all(map(_is_number_or_missing, array.flat)):
        return _numbers(array)
    return np.asarray(array)


def _numbers(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    if array.size and all(isinstance(value, (int, np.integer)) for value in array.flat):
        # Nanoseconds of today's date do not fit a double.
        whole = np.array(array.tolist())
        if whole.dtype.kind in "iu":
            return whole
    return np.array([_double(value) for value in array.flat]).reshape(array.shape)


def _double(value: Any) -> float:  # noqa: ANN401
    if _is_missing(value):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _unmasked(array: np.ma.MaskedArray[Any, Any]) -> npt.NDArray[Any]:
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
    return isinstance(value, Real) or _is_missing(value)
