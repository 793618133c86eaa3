"""What is written of a replay: the filtered columns, and those beside them."""

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from zerorate.io.names import split_unit, with_suffix

__all__ = ["beside", "beside_names", "compensated"]

Floats = npt.NDArray[np.float64]
Columns = dict[str, npt.NDArray[np.float64 | np.bool_]]


def compensated(raw: Floats, drift: Floats) -> Floats:
    """Return raw minus drift, NaN where a sample is missing."""
    # Numbers near the largest double overflow: a filter answers with its limit then.
    with np.errstate(over="ignore", invalid="ignore"):
        there = np.isfinite(raw)
        return raw - drift if there.all() else np.where(there, raw - drift, np.nan)


def beside_names(names: Sequence[str], unit: str) -> Iterator[tuple[str, str, str]]:
    """Yield the columns beside a compensated log: each axis' drift, its deviation, and rest."""
    for name in names:
        dimensional = with_suffix(name, unit)
        yield f"bias_{dimensional}", f"bias_sigma_{dimensional}", f"at_rest_{split_unit(name)[0]}"


def beside(
    names: Sequence[str],
    unit: str,
    drift: Floats,
    sigma: Floats,
    at_rest: npt.NDArray[np.bool_],
) -> Columns:
    """Return those columns by name, of arrays (k, n)."""
    columns: Columns = {}
    for i, listed in enumerate(beside_names(names, unit)):
        known = np.where(np.isnan(drift[i]), np.nan, sigma[i])
        columns |= zip(listed, (drift[i], known, at_rest[i]), strict=True)
    return columns
