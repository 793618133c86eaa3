"""The averaging times of a curve, as whole numbers of samples."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from zerorate.noise.kinds import Kind

__all__ = ["TauGrid", "factors", "seconds"]

Counts = npt.NDArray[np.int64]
TauGrid = Literal["octave", "decade", "all"]

_GRIDS = ("octave", "decade", "all")
_PER_DECADE = 10
# Thêo1 takes half of the factor, and is defined from here on.
_LEAST_THEO1 = 10


def factors(
    taus: TauGrid | Sequence[float] | npt.ArrayLike, kind: Kind, rate: float, longest: int
) -> tuple[Counts, tuple[str, ...]]:
    """Return averaging factors, rising, and what had to be said about them.

    Parameters
    ----------
    taus : {"octave", "decade", "all"} or array_like
        A grid (decade: ten to a decade) or averaging times in s.
    kind : Kind
        Which deviation.
    rate : float
        Samples per second, Hz.
    longest : int
        The largest factor that the record allows.

    Raises
    ------
    ValueError
        For an unknown grid, and for times that are not positive and finite or beyond the record.
    """
    if isinstance(taus, str):
        return _grid(taus, kind, longest), ()
    wanted = np.atleast_1d(np.asarray(taus, dtype=np.float64))
    if wanted.ndim != 1 or wanted.size == 0 or not np.all(np.isfinite(wanted) & (wanted > 0.0)):
        raise ValueError("taus must be positive and finite averaging times in s, at least one")
    exact = wanted * rate / _time_of_factor(kind)
    found = _whole(exact, kind)
    if found.max() > longest:
        limit = longest * _time_of_factor(kind) / rate
        raise ValueError(
            f"tau {wanted.max():g} s is beyond this record: its {kind.name} goes up to {limit:g} s"
        )
    return np.unique(found), tuple(_rounded(wanted, exact, found, kind, rate))


def seconds(m: Counts, kind: Kind, rate: float) -> npt.NDArray[np.float64]:
    """Return the averaging times of factors."""
    return m.astype(np.float64) * _time_of_factor(kind) / rate


def _time_of_factor(kind: Kind) -> float:
    """Return the averaging time of factor 1 in samples."""
    return 0.75 if kind.name == "theo1" else 1.0


def _whole(exact: npt.NDArray[np.float64], kind: Kind) -> Counts:
    if kind.name == "theo1":
        return np.maximum(2 * np.rint(exact / 2.0).astype(np.int64), _LEAST_THEO1)
    return np.maximum(np.rint(exact).astype(np.int64), 1)


def _rounded(
    wanted: npt.NDArray[np.float64],
    exact: npt.NDArray[np.float64],
    found: Counts,
    kind: Kind,
    rate: float,
) -> list[str]:
    off = np.abs(exact - found) > 1e-6 * found
    if not off.any():
        return []
    first = int(np.argmax(off))
    used = found[first] * _time_of_factor(kind) / rate
    return [
        f"{int(off.sum())} of {wanted.size} averaging times are no whole numbers of samples and "
        f"were rounded, {wanted[first]:g} s to {used:g} s"
    ]


def _grid(name: str, kind: Kind, longest: int) -> Counts:
    if name not in _GRIDS:
        raise ValueError(f"unknown grid of taus {name!r}; known: {', '.join(_GRIDS)}, or seconds")
    if name == "octave":
        first = _LEAST_THEO1 if kind.name == "theo1" else 1
        grid = first * 2 ** np.arange(int(longest // first).bit_length())
    elif name == "all":
        grid = np.arange(1, longest + 1)
    else:
        steps = np.arange(np.floor(_PER_DECADE * np.log10(longest) + 1e-9) + 1)
        grid = np.rint(10.0 ** (steps / _PER_DECADE))
    if kind.name == "theo1":
        grid = 2 * (grid // 2)
        grid = grid[grid >= _LEAST_THEO1]
    return np.unique(grid).astype(np.int64)
