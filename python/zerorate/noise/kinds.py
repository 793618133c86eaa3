"""Kinds of deviations, and averaging times of a curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.types import Floats, Integers

KindName = Literal[
    "adev",
    "oadev",
    "mdev",
    "tdev",
    "hdev",
    "ohdev",
    "totdev",
    "mtotdev",
    "ttotdev",
    "htotdev",
    "theo1",
    "pdev",
]

TauGrid = Literal["octave", "decade", "all"]
_GRIDS = ("octave", "decade", "all")
_FACTORS_PER_DECADE = 10

# Thêo1 uses half of the factor and is defined from this factor.
_MIN_THEO1_FACTOR = 10


@dataclass(frozen=True)
class Kind:
    """Kind of deviation.

    Parameters
    ----------
    name : str
        Name that users write.
    title : str
        Name in tables and figures.
    order : int
        Order of the phase difference: 2 in the Allan family, 3 in the Hadamard family.
    modified : bool
        True if the phase is averaged over tau before it is differenced.
    overlapping : bool
        True if every sample starts a term, not only every tau-th.
    total : bool
        True if the record is extended by reflection.
    time : bool
        True if the result is a time deviation: tau / sqrt(3) times the rate deviation.
    """

    name: KindName
    title: str
    order: int = 2
    modified: bool = False
    overlapping: bool = True
    total: bool = False
    time: bool = False


KINDS: Final[dict[str, Kind]] = {
    kind.name: kind
    for kind in (
        Kind("adev", "Allan deviation", overlapping=False),
        Kind("oadev", "overlapping Allan deviation"),
        Kind("mdev", "modified Allan deviation", modified=True),
        Kind("tdev", "time deviation", modified=True, time=True),
        Kind("hdev", "Hadamard deviation", order=3, overlapping=False),
        Kind("ohdev", "overlapping Hadamard deviation", order=3),
        Kind("totdev", "total deviation", total=True),
        Kind("mtotdev", "modified total deviation", modified=True, total=True),
        Kind("ttotdev", "time total deviation", modified=True, total=True, time=True),
        Kind("htotdev", "Hadamard total deviation", order=3, total=True),
        Kind("theo1", "Thêo1 deviation", total=True),
        Kind("pdev", "parabolic deviation", modified=True),
    )
}


def kind(name: str) -> Kind:
    """Return the kind of deviation with this name; an unknown name raises ValueError."""
    if name not in KINDS:
        raise ValueError(f"unknown kind {name!r}; known: {', '.join(KINDS)}")
    return KINDS[name]


def averaging_factors(
    taus: TauGrid | Sequence[float] | npt.ArrayLike, kind: Kind, rate: float, longest: int
) -> tuple[Integers, tuple[str, ...]]:
    """Return averaging factors in rising order, and notes on their rounding.

    Parameters
    ----------
    taus : {"octave", "decade", "all"} or array_like
        A grid ("decade": ten per decade), or averaging times in s.
    kind : Kind
        Kind of deviation.
    rate : float
        Samples per second, Hz.
    longest : int
        Largest factor that the record allows.

    Raises
    ------
    ValueError
        For an unknown grid, and for times that are not positive and finite or too long for the
        record.
    """
    if isinstance(taus, str):
        return _make_grid(taus, kind, longest), ()
    wanted = np.atleast_1d(np.asarray(taus, dtype=np.float64))
    if wanted.ndim != 1 or wanted.size == 0 or not np.all(np.isfinite(wanted) & (wanted > 0.0)):
        raise ArgumentError(
            "taus", "must be positive and finite averaging times in s, at least one"
        )
    with np.errstate(over="ignore"):
        exact = wanted * rate / _time_of_factor(kind)
    rounded = _round_factors(exact, kind)
    # Compare as floats: a huge factor would overflow as an integer.
    if rounded.max() > longest:
        limit = longest * _time_of_factor(kind) / rate
        raise ValueError(
            f"tau {wanted.max():g} s is beyond this record: its {kind.name} goes up to {limit:g} s"
        )
    factors = rounded.astype(np.int64)
    return _unique_sorted(factors), tuple(_describe_rounding(wanted, exact, factors, kind, rate))


def averaging_times(m: Integers, kind: Kind, rate: float) -> Floats:
    """Return the averaging times of averaging factors."""
    return m.astype(np.float64) * _time_of_factor(kind) / rate


def _time_of_factor(kind: Kind) -> float:
    """Return the averaging time of factor 1 in samples."""
    return 0.75 if kind.name == "theo1" else 1.0


def _round_factors(exact: Floats, kind: Kind) -> Floats:
    if kind.name == "theo1":
        return np.maximum(2.0 * np.rint(exact / 2.0), _MIN_THEO1_FACTOR)
    return np.maximum(np.rint(exact), 1.0)


def _describe_rounding(
    wanted: Floats,
    exact: Floats,
    rounded: Integers,
    kind: Kind,
    rate: float,
) -> list[str]:
    off = np.abs(exact - rounded) > 1e-6 * rounded
    if not off.any():
        return []
    first = int(np.argmax(off))
    used = rounded[first] * _time_of_factor(kind) / rate
    return [
        f"{int(off.sum())} of {wanted.size} averaging times are no whole numbers of samples and "
        f"were rounded, {wanted[first]:g} s to {used:g} s"
    ]


def _make_grid(name: str, kind: Kind, longest: int) -> Integers:
    if name not in _GRIDS:
        raise ValueError(f"unknown grid of taus {name!r}; known: {', '.join(_GRIDS)}, or seconds")
    if name == "octave":
        first = _MIN_THEO1_FACTOR if kind.name == "theo1" else 1
        grid = first * 2 ** np.arange(int(longest // first).bit_length())
    elif name == "all":
        grid = np.arange(1, longest + 1)
    else:
        steps = np.arange(np.floor(_FACTORS_PER_DECADE * np.log10(longest) + 1e-9) + 1)
        grid = np.rint(10.0 ** (steps / _FACTORS_PER_DECADE))
    if kind.name == "theo1":
        grid = 2 * (grid // 2)
        grid = grid[grid >= _MIN_THEO1_FACTOR]
    return _unique_sorted(grid)


def _unique_sorted(values: Floats | Integers) -> Integers:
    """Return the different factors in rising order, much faster than np.unique."""
    factors: Integers = np.sort(values).astype(np.int64)
    return factors[np.diff(factors, prepend=0) > 0]
