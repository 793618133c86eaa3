"""Deviation curve of a record."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.faults import ArgumentError, keyword_argument, make_sentence
from zerorate.noise.freedom import bounds, freedoms
from zerorate.noise.kinds import Kind, KindName, TauGrid, averaging_factors, averaging_times
from zerorate.noise.kinds import kind as find_kind
from zerorate.noise.motion_check import find_doubts
from zerorate.noise.quantities import check_unit
from zerorate.noise.records import is_constant
from zerorate.noise.result import AllanResult
from zerorate.record import Log
from zerorate.record.named import columns_of, names_of, rate_of, unit_of
from zerorate.types import Floats, Integers

_ONE_SIGMA: Final = 0.6826894921370859


def allan(
    z: npt.ArrayLike | Log,
    rate: float | None = None,
    kind: KindName = "oadev",
    taus: TauGrid | Sequence[float] | npt.ArrayLike = "octave",
    *,
    unit: str | None = None,
    names: Sequence[str] | None = None,
    bridge: int = 0,
    exponent: int | None = None,
    confidence: float = _ONE_SIGMA,
    threads: int | None = None,
) -> AllanResult:
    """Return the Allan deviation of a record, or a related deviation, with confidence bounds.

    Parameters
    ----------
    z : array_like, shape (n,) or (n, k), or Log
        Rates of one or k axes, in `unit`; values that are not finite count as missing. A `Log` has
        its own rate, unit and names. A data frame or series states the unit in its names.
    rate : float
        Samples per second, Hz.
    kind : str, default "oadev"
        Kind of deviation. Allan family: adev, oadev, mdev, tdev. Hadamard family, not affected by a
        rate ramp: hdev, ohdev. Less uncertain than both families at long averaging times: totdev,
        mtotdev, ttotdev, htotdev, theo1. Parabolic: pdev.
    taus : {"octave", "decade", "all"} or sequence of float
        Averaging times: one per octave, ten per decade, all possible times, or given times in s.
        Given times are rounded to whole samples; `notes` states the rounding.
    unit : str, optional
        Unit of `z`, an angular rate or an acceleration: "deg/s", "rad/s", "g", ... Without a unit
        the results are in the unit of the samples, and cannot be converted or exported.
    names : sequence of str, optional
        One name per axis.
    bridge : int, default 0
        Longest gap that is filled with a straight line, in samples. Terms of the deviation across
        longer gaps are left out.
    exponent : int, optional
        Noise type for the bounds: exponent alpha of the density f^alpha, -4 to 2. Default:
        estimated at each averaging time.
    confidence : float, default 0.683
        Probability that the true deviation is inside the bounds.
    threads : int, optional
        Number of threads. Default: all cores. It does not change the result.

    Returns
    -------
    AllanResult
        The curve, with `fit` and `plot`.

    Raises
    ------
    ValueError
        If the record is too short or has no sample. If an argument is not as described.

    Notes
    -----
    Sources: IEEE Std 952-1997, annex C; W. J. Riley, D. A. Howe, NIST Special Publication 1065
    (2008), section 5. The second source also describes the noise types (lag-1 autocorrelation, B1
    and R(n)), and the degrees of freedom of the total deviations. The mean is subtracted first, so
    a large offset does not reduce the precision. Computing time is O(n) for each tau, and O(n tau)
    for theo1, mtotdev, ttotdev and htotdev.

    Examples
    --------
    >>> import numpy as np
    >>> import zerorate as zr
    >>> z = 0.01 * np.random.default_rng(1).standard_normal(100_000)
    >>> r = zr.allan(z, rate=100.0, unit="deg/s", confidence=0.95)
    >>> bool(r.lower[4] < 0.01 / 4 < r.upper[4])  # white noise, 16 samples
    True
    """
    hertz, family, unit = rate_of(rate, z), find_kind(kind), check_unit(unit_of(unit, z))
    _check_arguments(confidence, exponent, bridge)
    record = _check_record(z)
    n, missing = len(record), _count_missing(record)
    m, grid_notes = averaging_factors(taus, family, hertz, _longest_factor(family, n, hertz))
    deviation, terms, exponents = _native.allan_deviations(record, m, kind, bridge, threads)
    if exponent is not None:
        exponents = np.full_like(exponents, exponent)
    edf = _edf_by_axis(family, m, terms, exponents, n)
    lower, upper = bounds(deviation, edf, confidence)
    time = 1.0 / hertz if family.time else 1.0
    labels = _label_axes(names_of(z) if names is None else names, deviation)
    return AllanResult(
        kind=kind,
        taus=averaging_times(m, family, hertz),
        deviation=deviation * time,
        lower=lower * time,
        upper=upper * time,
        edf=edf,
        exponent=exponents,
        term_count=terms,
        factors=m,
        rate=hertz,
        n=n,
        unit=unit,
        names=labels,
        confidence=confidence,
        doubts=find_doubts(record, hertz, unit, labels),
        notes=(
            *grid_notes,
            *_describe_record(record, missing, bridge, labels),
            *_describe_gaps(terms, averaging_times(m, family, hertz), labels),
        ),
    )


def _check_arguments(confidence: float, exponent: int | None, bridge: int) -> None:
    if not 0.0 < confidence < 1.0:
        raise ArgumentError("confidence", f"must lie between 0 and 1, got {confidence}")
    if exponent is not None and exponent not in range(-4, 3):
        raise ArgumentError("exponent", f"must be a whole number from -4 to 2, got {exponent}")
    if bridge < 0:
        raise ArgumentError("bridge", f"must not be negative, got {bridge}")


def _check_record(z: npt.ArrayLike | Log) -> npt.NDArray[np.generic]:
    """Return the record as an array, without a copy."""
    record = columns_of(z, "z")
    if record.ndim not in (1, 2) or 0 in record.shape:
        raise ArgumentError(
            "z", f"must have shape (n,) or (n, k) with a sample, got {record.shape}"
        )
    return record


def _count_missing(record: npt.NDArray[np.generic]) -> Integers:
    """Return the number of missing samples of each axis, shape (k,), if no axis is empty."""
    present = np.isfinite(record).reshape(len(record), -1)
    if present.all():
        return np.zeros(present.shape[1], dtype=np.int64)
    missing = len(present) - np.count_nonzero(present, axis=0)
    empty = np.flatnonzero(missing == len(present))
    if empty.size:
        where = "z" if record.ndim == 1 else f"column {empty[0]} of z"
        raise ValueError(f"{where} holds no finite sample")
    return np.asarray(missing, dtype=np.int64)


def _longest_factor(family: Kind, n: int, rate: float) -> int:
    """Return the largest averaging factor of a record of n samples."""
    longest = _native.longest_factor(family.name, n)
    least = 10 if family.name == "theo1" else 1
    if longest < least:
        longer = range(n, n + 64)
        needed = next(k for k in longer if _native.longest_factor(family.name, k) >= least)
        raise ValueError(
            f"z is too short for any averaging time: {family.name} needs {needed} samples "
            f"({needed / rate:g} s), got {n}"
        )
    return longest


def _edf_by_axis(family: Kind, m: Integers, terms: Integers, exponents: Integers, n: int) -> Floats:
    """Return the degrees of freedom, axis by axis."""
    if terms.ndim == 1:
        return freedoms(family, m, terms, exponents, n)
    columns = zip(terms.T, exponents.T, strict=True)
    return np.column_stack([freedoms(family, m, t, e, n) for t, e in columns])


def _label_axes(names: Sequence[str] | None, deviation: Floats) -> tuple[str, ...]:
    channels = 1 if deviation.ndim == 1 else deviation.shape[1]
    if names is None:
        return ("",) if channels == 1 else tuple(f"axis {i + 1}" for i in range(channels))
    listed = (names,) if isinstance(names, str) else tuple(names)
    if len(listed) != channels:
        raise ArgumentError("names", f"must have one entry an axis: {channels}, got {len(listed)}")
    return listed


def _describe_record(
    record: npt.NDArray[np.generic], missing: Integers, bridge: int, names: tuple[str, ...]
) -> Iterator[str]:
    """Yield notes on gaps and on axes without noise."""
    for name, lacking, z in zip(names, missing, record.reshape(len(record), -1).T, strict=True):
        label = f"{name}: " if name else ""
        if lacking:
            filled = f"; gaps of up to {bridge} are bridged" if bridge else ""
            yield f"{label}{lacking} of {z.size} samples are missing{filled}"
        if is_constant(z, z[int(np.argmax(np.isfinite(z)))]):
            yield f"{label}all samples are equal: the deviation is 0, and there is nothing to fit"


def _describe_gaps(terms: Integers, taus: Floats, names: tuple[str, ...]) -> Iterator[str]:
    """Yield notes on the averaging times without a term because of gaps."""
    for name, counts in zip(names, terms.reshape(taus.size, -1).T, strict=True):
        lost = np.flatnonzero(counts == 0)
        if lost.size:
            label = f"{name}: " if name else ""
            yield make_sentence(
                f"{label}gaps leave no term from {taus[lost[0]]:g} s on: ",
                keyword_argument("bridge"),
                " fills short ones",
            )
