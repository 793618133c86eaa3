"""Allan covariances of gyros recorded at the same time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.array.virtual_gyro import Parts, VirtualGyro, WeightsName, weigh
from zerorate.faults import ArgumentError, keyword_argument, make_sentence
from zerorate.noise.freedom import freedoms
from zerorate.noise.kinds import KINDS, TauGrid, averaging_factors, averaging_times
from zerorate.noise.quantities import check_unit
from zerorate.noise.records import size_of
from zerorate.record import Log
from zerorate.record.named import columns_of, names_of, rate_of, unit_of
from zerorate.types import Booleans, Floats, Integers
from zerorate.views import Result

_KIND: Final = KINDS["oadev"]
_PART_COUNT: Final = 8
# Number of terms processed at once; they fit into the cache.
_CHUNK_TERMS: Final = 1 << 13


@dataclass(frozen=True, eq=False)
class AllanCovariance(Result):
    """Overlapping Allan covariances of N gyros, recorded at the same time.

    Attributes
    ----------
    tau : ndarray, shape (t,)
        Averaging times, s.
    matrix : ndarray, shape (t, N, N)
        Covariances, in `unit` squared. The diagonal has the squared Allan deviations. NaN if every
        term contains a gap.
    edf : ndarray, shape (t,)
        Equivalent degrees of freedom, as the median over the gyros.
    term_count : ndarray of int, shape (t,)
        Number of terms in each covariance.
    seconds : float
        Total duration of the samples that all gyros have, s.
    rate : float
        Sampling rate, Hz.
    unit : str
        Unit of the record; ``"unit"`` if it is unknown.
    names : tuple of str
        Names of the gyros.
    notes : tuple of str
        Sentences on changes to the input, and warnings.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> z = np.random.default_rng(1).standard_normal((20_000, 3))
    >>> r = zr.array.allan_covariance(z, rate=100.0)
    >>> r.names, r.matrix.shape == (len(r.tau), 3, 3)
    (('gyro 1', 'gyro 2', 'gyro 3'), True)
    >>> bool(abs(r.correlation[0, 0, 1]) < 0.05)  # they have nothing in common
    True
    """

    tau: Floats
    matrix: Floats
    edf: Floats
    term_count: Integers
    seconds: float
    rate: float
    unit: str
    names: tuple[str, ...]
    notes: tuple[str, ...]
    _parts: Parts = field(repr=False)

    def __repr__(self) -> str:
        """Return the numbers of gyros and averaging times, and the unit."""
        return (
            f"AllanCovariance({len(self.names)} gyros at {self.tau.size} averaging times, "
            f"{self.tau[0]:g} to {self.tau[-1]:g} s, {self.seconds:g} s of record)"
        )

    @property
    def correlation(self) -> Floats:
        """Correlations, shape (t, N, N); NaN for a constant gyro."""
        sizes = np.sqrt(np.einsum("tii->ti", self.matrix))
        with np.errstate(divide="ignore", invalid="ignore"):
            correlation: Floats = self.matrix / sizes[:, :, None] / sizes[:, None, :]
        return np.clip(correlation, -1.0, 1.0)

    def virtual_gyro(self, horizon: float = 60.0, weights: WeightsName = "drift") -> VirtualGyro:
        """Return weights that fuse all gyros into one, and the gain over the plain mean.

        Parameters
        ----------
        horizon : float, default 60.0
            Averaging time at which the deviation is minimised and the gain is computed, s. With a
            long horizon drift dominates, with a short horizon white noise dominates. Infinity is
            allowed.
        weights : {"drift", "white", "mean"}, default "drift"
            "drift" uses the correlation of the gyros' drifts. "white" uses white noise alone, for
            any horizon. "mean" is the plain mean.

        Returns
        -------
        VirtualGyro

        Raises
        ------
        ValueError
            If `weights` is "drift" and the record is shorter than 900 s times the number of gyros.
            If a gyro is constant, or there are fewer than two averaging times. If an argument is
            out of range.

        Notes
        -----
        White noise R and drift Q are fitted to the covariances R/tau + Q tau/3. The weights w =
        C⁻¹1 / (1ᵀC⁻¹1) have the smallest variance of all weights with sum 1. C is the covariance at
        the horizon (R. J. Vaccaro, A. S. Zaki, "Reduced-drift virtual gyro from an array of
        low-cost gyros", Sensors 17(2):352, 2017).

        Chance correlations look like true correlations. The off-diagonal elements of Q are
        therefore reduced by the share N / (N + T/(256 s)), for N gyros and a record of length T.

        The gain is found on each eighth of the record, with weights from the other seven eighths.
        Its standard error comes from leaving out each eighth in turn. The gain is the Allan
        deviation of the plain mean divided by the deviation of the weighted mean. If the horizon is
        outside the well known averaging times, the deviations come from the fitted noise.

        Examples
        --------
        >>> import numpy as np
        >>> import zerorate as zr
        >>> rng = np.random.default_rng(1)
        >>> walks = np.cumsum(rng.standard_normal((7200, 3)) * [1.0, 1.0, 3.0], axis=0)
        >>> r = zr.array.allan_covariance(walks + rng.standard_normal((7200, 3)), rate=1.0)
        >>> found = r.virtual_gyro()
        >>> print(f"{found.weights[2]:.2f} of the poor one; gain {found.gain:.1f}")
        0.04 of the poor one; gain 1.8
        """
        return weigh(self._parts, self.seconds, horizon, weights, self.names)


def allan_covariance(
    z: npt.ArrayLike | Log,
    rate: float | None = None,
    taus: TauGrid | Sequence[float] | npt.ArrayLike = "octave",
    *,
    unit: str | None = None,
    names: Sequence[str] | None = None,
    bridge: int = 0,
) -> AllanCovariance:
    """Return the overlapping Allan covariances of gyros recorded at the same time, at rest.

    The covariances show the averaging times at which the gyros' noise is correlated. At short
    averaging times the noise is white and hardly correlated. At long averaging times, temperature
    or the supply voltage may affect all gyros.

    Parameters
    ----------
    z : array_like, shape (n, N), or Log
        Rates of N gyros about one common axis, in `unit`. Values that are not finite are missing. A
        `Log` has its own rate, unit and names.
    rate : float
        Sampling rate, Hz.
    taus : {"octave", "decade", "all"} or sequence of float
        Averaging times: "octave" doubles them, "decade" has ten per decade, "all" has every time.
        Numbers are times in s. They are rounded to whole samples, with a sentence in `notes`.
    unit : str, optional
        Unit of `z`: "deg/s", "rad/s", ...
    names : sequence of str, optional
        Names of the gyros.
    bridge : int, default 0
        Longest gap of a gyro, in samples, that is filled with a straight line. A term that spans a
        longer gap is left out for all gyros. This keeps the matrices positive semidefinite, with
        correlations from -1 to 1.

    Returns
    -------
    AllanCovariance
        Covariances. The method `virtual_gyro` computes weights from them.

    Raises
    ------
    ValueError
        If `z` does not have two dimensions, or the record is too short. Also if the gyros never
        have a sample at the same time, or an argument is out of range.

    Notes
    -----
    For two gyros, take the differences between neighbouring means over tau. The matrix element is
    half the mean of the products of these differences. The computing time is O(n N²) for each tau.

    Examples
    --------
    >>> import numpy as np
    >>> import zerorate as zr
    >>> rng = np.random.default_rng(1)
    >>> own = rng.standard_normal((20_000, 2))
    >>> common = np.cumsum(0.1 * rng.standard_normal((20_000, 1)), axis=0)
    >>> r = zr.array.allan_covariance(own + common, rate=100.0)
    >>> print(f"{r.correlation[3, 0, 1]:.2f} at {r.tau[3]:g} s")
    0.18 at 0.08 s
    >>> print(f"{r.correlation[10, 0, 1]:.2f} at {r.tau[10]:g} s")
    1.00 at 10.24 s
    """
    hertz, unit, record = rate_of(rate, z), check_unit(unit_of(unit, z)), _parse_record(z, bridge)
    n, gyros = record.shape
    labels = _gyro_names(names_of(z) if names is None else names, gyros)
    m, factor_notes = averaging_factors(taus, _KIND, hertz, _longest_factor(n, hertz))
    missing = n - np.count_nonzero(np.isfinite(record), axis=0)
    _bridge_gaps(record, bridge)
    complete = _find_complete(record, labels)
    edf = _median_edf(record, m)
    phase, size = _integrate_phase(record, complete)
    sums = _sum_products(phase, complete, m)
    matrix, tau = _mean_products(sums.products, sums.terms), averaging_times(m, _KIND, hertz)
    missing_count = n - int(np.count_nonzero(complete))
    with np.errstate(over="ignore"):
        scaled = matrix * size * size
    return AllanCovariance(
        tau=tau,
        matrix=scaled,
        edf=edf,
        term_count=sums.terms,
        seconds=(n - missing_count) / hertz,
        rate=hertz,
        unit=unit,
        names=labels,
        notes=(
            *factor_notes,
            *_gap_notes(n, missing_count, missing, bridge, labels),
            *_term_notes(sums.terms, tau),
        ),
        _parts=_make_parts(sums, matrix, tau, edf),
    )


def _parse_record(z: npt.ArrayLike | Log, bridge: int) -> Floats:
    """Return a copy of the record, with NaN for values that are not finite."""
    record = np.asarray(columns_of(z, "z"), dtype=np.float64)
    if record.ndim == 3:
        raise ArgumentError(
            "z",
            "must have shape (n, N), the rates of N gyros about one axis, "
            f"got {record.shape}: take one axis at a time, z[:, :, 0]",
        )
    if record.ndim != 2 or 0 in record.shape:
        raise ArgumentError(
            "z", f"must have shape (n, N), a column for each of N gyros, got {record.shape}"
        )
    if bridge < 0:
        raise ArgumentError("bridge", f"must not be negative, got {bridge}")
    return np.where(np.isfinite(record), record, np.nan)


def _longest_factor(n: int, rate: float) -> int:
    """Return the largest averaging factor for a record of n samples."""
    if n < 2:
        raise ValueError(
            f"z is too short for any averaging time: it needs 2 samples ({2 / rate:g} s), got {n}"
        )
    return _native.longest_factor(_KIND.name, n)


def _gyro_names(names: Sequence[str] | None, gyros: int) -> tuple[str, ...]:
    if names is None:
        return tuple(f"gyro {i + 1}" for i in range(gyros))
    listed = (names,) if isinstance(names, str) else tuple(names)
    if len(listed) != gyros:
        raise ArgumentError("names", f"must have one entry a gyro: {gyros}, got {len(listed)}")
    return listed


def _bridge_gaps(record: Floats, max_gap: int) -> None:
    """Fill each gyro's gaps of at most `max_gap` samples with a straight line, in place."""
    if max_gap == 0:
        return
    for z in record.T:
        present = np.flatnonzero(np.isfinite(z))
        gaps = np.diff(present) - 1
        for gap in np.flatnonzero((gaps > 0) & (gaps <= max_gap)):
            first, last = present[gap], present[gap + 1]
            z[first : last + 1] = np.linspace(z[first], z[last], last - first + 1)


def _find_complete(record: Floats, names: tuple[str, ...]) -> Booleans:
    """Return the mask of samples that every gyro has, (n,); set all other samples to NaN."""
    finite = np.isfinite(record)
    empty = np.flatnonzero(~finite.any(axis=0))
    if empty.size:
        raise ValueError(f"{names[empty[0]]} holds no finite sample: leave it out of the array")
    complete = np.asarray(finite.all(axis=1))
    if not complete.any():
        raise ValueError("no sample time has data of every gyro")
    record[~complete] = np.nan
    return complete


def _median_edf(record: Floats, m: Integers) -> Floats:
    """Return the degrees of freedom at each averaging time, as the median over the gyros."""
    _, terms, sample_edf = _native.allan_deviations(record, m, _KIND.name, 0, None)
    columns = zip(terms.reshape(m.size, -1).T, sample_edf.reshape(m.size, -1).T, strict=True)
    each = [freedoms(_KIND, m, t, e, len(record)) for t, e in columns]
    edf: Floats = np.median(each, axis=0)
    return edf


def _integrate_phase(record: Floats, complete: Booleans) -> tuple[Floats, float]:
    """Return running sums about the mean, shape (n + 1, N), and their unit.

    Missing samples become zero. The mean is computed relative to one sample, so that an offset
    loses no precision. The unit is a power of two, so that scaling causes no rounding.
    """
    record -= record[np.argmax(complete)]
    record[~complete] = 0.0
    size = size_of(record)
    record /= size
    record -= record.sum(axis=0) / np.count_nonzero(complete)
    record[~complete] = 0.0
    phase = np.zeros((len(record) + 1, record.shape[1]))
    np.cumsum(record, axis=0, out=phase[1:])
    return phase, size


class _Sums(NamedTuple):
    """Sums of products of terms, of the whole record, and of its parts for some averaging times."""

    products: Floats
    terms: Integers
    octaves: Integers
    inside: Floats
    outside: Floats
    n_inside: Floats
    n_outside: Floats


def _sum_products(phase: Floats, complete: Booleans, m: Integers) -> _Sums:
    gaps = np.zeros(len(phase), dtype=np.int64)
    np.cumsum(~complete, out=gaps[1:])
    edges = np.linspace(0, complete.size, _PART_COUNT + 1).astype(np.int64)
    gyros = phase.shape[1]
    products, terms = np.empty((m.size, gyros, gyros)), np.empty(m.size, dtype=np.int64)
    # One averaging time per octave: denser ones share nearly all information.
    octaves = np.unique(np.frexp(m)[1], return_index=True)[1]
    by_part = []
    for i, factor in enumerate(m):
        cuts, each, counts = _sum_between_cuts(phase, gaps, int(factor), edges)
        products[i], terms[i] = each.sum(axis=0), counts.sum()
        if i in octaves:
            by_part.append(_sum_by_part(cuts, each, counts, edges, int(factor)))
    return _Sums(
        products, terms, octaves, *(np.stack(arrays) for arrays in zip(*by_part, strict=True))
    )


def _sum_between_cuts(
    phase: Floats, gaps: Integers, m: int, edges: Integers
) -> tuple[Integers, Floats, Integers]:
    """Return cuts among the terms, and sums and numbers of the terms between the cuts.

    A term starts at its index and ends 2 m samples later. The cuts are the indices at which terms
    start to reach into a part of the record, or leave a part.
    """
    last = len(phase) - 2 * m
    cuts = np.unique(np.clip(np.concatenate((edges, edges - 2 * m + 1)), 0, last))
    each = np.zeros((cuts.size - 1, phase.shape[1], phase.shape[1]))
    counts = np.zeros(cuts.size - 1, dtype=np.int64)
    for k, (start, stop) in enumerate(pairwise(cuts)):
        for first in range(start, stop, _CHUNK_TERMS):
            end = min(first + _CHUNK_TERMS, stop)
            terms = _difference_terms(phase, gaps, m, first, end)
            each[k] += terms.T @ terms
            counts[k] += len(terms)
    return cuts, each, counts


def _difference_terms(phase: Floats, gaps: Integers, m: int, first: int, end: int) -> Floats:
    """Return the differences of neighbouring means over sqrt(2), for terms without a gap."""
    terms = phase[first + m : end + m] * -2.0
    terms += phase[first:end]
    terms += phase[first + 2 * m : end + 2 * m]
    terms /= m * np.sqrt(2.0)
    whole = gaps[first + 2 * m : end + 2 * m] == gaps[first:end]
    return terms if whole.all() else terms[whole]


def _sum_by_part(
    cuts: Integers, each: Floats, counts: Integers, edges: Integers, m: int
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return sums over the terms within each part, and sums over the terms outside each part."""
    starts, stops = cuts[:-1], cuts[1:]
    left, right = edges[:-1, None], edges[1:, None]
    inside = ((starts >= left) & (stops <= right - 2 * m + 1)).astype(np.float64)
    outside = ((stops <= left - 2 * m + 1) | (starts >= right)).astype(np.float64)
    inside_sums, outside_sums = (np.tensordot(which, each, axes=1) for which in (inside, outside))
    return inside_sums, outside_sums, inside @ counts, outside @ counts


def _mean_products(products: Floats, terms: Integers) -> Floats:
    """Return the means of products; NaN without terms."""
    with np.errstate(invalid="ignore"):
        mean: Floats = products / terms[:, None, None]
    return mean


def _make_parts(sums: _Sums, matrix: Floats, tau: Floats, edf: Floats) -> Parts:
    """Return the averaging times with terms, as input for a virtual gyro."""
    nonempty = sums.terms[sums.octaves] > 0
    which = sums.octaves[nonempty]
    return Parts(
        tau[which],
        edf[which],
        sums.terms[which].astype(np.float64),
        matrix[which],
        sums.inside[nonempty],
        sums.outside[nonempty],
        sums.n_inside[nonempty],
        sums.n_outside[nonempty],
    )


def _gap_notes(
    n: int, missing_count: int, missing: Integers, bridge: int, names: tuple[str, ...]
) -> Iterator[str]:
    """Yield notes on missing samples."""
    filled = f"; gaps of up to {bridge} are bridged" if bridge else ""
    for name, lacking in zip(names, missing, strict=True):
        if lacking:
            yield f"{name}: {lacking} of {n} samples are missing{filled}"
    if missing_count > missing.max():
        yield f"at {missing_count} of {n} samples a gyro is missing"


def _term_notes(terms: Integers, tau: Floats) -> Iterator[str]:
    """Yield a note on averaging times for which the gaps leave no term."""
    empty = np.flatnonzero(terms == 0)
    if empty.size:
        yield make_sentence(
            f"gaps leave no term from {tau[empty[0]]:g} s on: ",
            keyword_argument("bridge"),
            " fills short ones",
        )
