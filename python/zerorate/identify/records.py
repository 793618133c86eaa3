"""Records as the identification takes them: one axis, NaN where a sample is missing."""

from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.noise.records import unmasked

__all__ = ["as_record"]

Floats = npt.NDArray[np.float64]

_GLANCE: Final = 1000


def as_record(z: npt.ArrayLike, least: int = 1, purpose: str = "this") -> Floats:
    """Return one axis as contiguous float64, NaN where missing, once it can be worked on.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; those that are not finite or masked are missing.
    least : int
        How many samples must be there.
    purpose : str
        What needs them, for the message.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, has too few samples, or only equal ones.
    """
    record = _floats(z)
    if record.ndim != 1:
        raise ValueError(f"z must be one axis of shape (n,), got shape {record.shape}")
    present = np.isfinite(record)
    count = int(np.count_nonzero(present))
    if count == 0:
        raise ValueError("z holds no finite sample")
    if count < least:
        raise ValueError(f"{purpose} needs at least {least} samples, got {count}")
    first = float(record[int(np.argmax(present))])
    if least > 1 and _is_constant(record, first):
        raise ValueError(f"{purpose} needs samples that differ, all {count} are {first:g}")
    return record


def _is_constant(record: Floats, value: float) -> bool:
    # A glance at the beginning nearly always tells.
    parts = (record[:_GLANCE], record[_GLANCE:])
    return all(bool(np.all((part == value) | ~np.isfinite(part))) for part in parts)


def _floats(z: npt.ArrayLike) -> Floats:
    array = np.asarray(unmasked(z))
    if array.dtype.kind == "O":
        array = array.astype(np.float64)
    if array.dtype.kind not in "fiub":
        raise TypeError(f"z must hold real numbers, got dtype {array.dtype}")
    return np.ascontiguousarray(array, dtype=np.float64)
