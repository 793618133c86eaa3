"""Spectrum of a record in bands, and the noise coefficients from it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Final, Self

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.noise.filter_fit import NarrowBands
from zerorate.noise.filter_search import find_filter, suspects_filter
from zerorate.noise.fit import (
    Component,
    FittedModel,
    Problem,
    coefficient_of_square,
    fit_components,
)
from zerorate.noise.least_squares import solve
from zerorate.noise.low_pass import Filtered, band_fields
from zerorate.noise.motion_check import find_doubts
from zerorate.noise.processes import TERMS, check_terms, strength
from zerorate.noise.quantities import Quantity, check_unit, si_unit
from zerorate.noise.records import check_record, longest_stretch, power_of_two
from zerorate.record.missing import floats
from zerorate.record.named import rate_of, unit_of
from zerorate.types import Floats

# More tapers average better, but smear the lowest frequencies, which contain the drift.
_TAPER_COUNT: Final = 5
_BANDS_PER_OCTAVE: Final = 8
# Number of lines in one computation, so that they stay in the cache.
_BLOCK_LINES: Final = 1 << 13
_MIN_SAMPLES: Final = 64
# Number of narrow bands up to the sampling rate, and points in each band for the model.
_NARROW_PARTS: Final = 256
_POINTS_OF_BAND: Final = (np.arange(12) + 0.5) / 12.0


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Mean densities of the bands of a record.

    Parameters
    ----------
    bands : Bands
        The bands.
    density : ndarray
        Two-sided density of the record divided by `scale`, with the sample as unit of time.
    scale : float
        Scale that keeps squares within floating-point range.
    record : ndarray
        Samples of the record, not scaled.
    """

    bands: Bands
    density: Floats
    scale: float
    record: Floats

    @classmethod
    def of(cls, z: npt.ArrayLike, rate: float) -> Self:
        """Return the spectrum of a record's longest stretch without a gap; the record is (n,)."""
        record = longest_stretch(check_record(z, rate))
        if record.size < _MIN_SAMPLES:
            raise ArgumentError(
                "z", f"must have at least {_MIN_SAMPLES} samples without a gap, has {record.size}"
            )
        record = record[: _fast_length(record.size)]
        if np.all(record == record[0]):
            raise ValueError("z is constant: there is no noise to fit")
        bands, scale = Bands.of(record.size), power_of_two(record)
        return cls(bands, bands.density(record / scale), scale, record)

    def narrow(self) -> NarrowBands:
        """Return the densities of narrower bands, because a low-pass affects the top octaves."""
        bands = Bands.of(self.bands.n, narrow=True)
        width = np.diff(bands.edges)[:, None]
        lines = bands.lines[0] + bands.edges[:-1, None] - 0.5 + width * _POINTS_OF_BAND
        ramp = bands.density(np.arange(bands.n, dtype=np.float64))
        density = bands.density(self.record / self.scale)
        return NarrowBands(lines / (bands.n + 1), bands.counts, ramp, density)


class Bands:
    """Bands of the spectrum of n samples, and their numbers of independent lines."""

    def __init__(self, n: int, narrow: bool = False) -> None:
        self.n = n
        self.lines = range(_TAPER_COUNT, (n + 1 - _TAPER_COUNT) // 2)
        self.edges = _band_edges(len(self.lines))
        if narrow:
            self.edges = _split_edges(self.edges, max((n + 1) // _NARROW_PARTS, _TAPER_COUNT))
        # Tapers leave out the ends of the record, which increases the variance of sums over many
        # lines.
        self.counts = np.diff(self.edges) / (1.0 + 0.5 / _TAPER_COUNT)

    @classmethod
    @lru_cache(maxsize=4)
    def of(cls, n: int, narrow: bool = False) -> Bands:
        """Return the bands of n samples; they are cached, because axes share them."""
        return cls(n, narrow)

    def density(self, record: Floats) -> Floats:
        """Return the mean two-sided density of each band, with the sample as unit of time.

        Sine taper k shifts the spectrum up and down by k half lines. One transform of twice the
        length therefore contains the spectra of all tapers.
        """
        padded = np.zeros(2 * (self.n + 1))
        np.subtract(record, record.mean(), out=padded[1 : self.n + 1])
        spectrum = np.fft.rfft(padded)
        blocks = (self.lines[i : i + _BLOCK_LINES] for i in range(0, len(self.lines), _BLOCK_LINES))
        ordinates = np.concatenate(
            [_sum_tapers(spectrum, 2 * lines[0], len(lines)) for lines in blocks]
        )
        return self.mean(ordinates) / (2.0 * _TAPER_COUNT * (self.n + 1))

    def mean(self, ordinates: Floats) -> Floats:
        """Return the means over each band."""
        sums = np.add.reduceat(ordinates[: self.edges[-1]], self.edges[:-1])
        means: Floats = sums / np.diff(self.edges)
        return means

    @property
    def half_angles(self) -> Floats:
        """2 sin(pi f) of every line, f in cycles per sample."""
        angles: Floats = 2.0 * np.sin(np.array(self.lines) * (math.pi / (self.n + 1)))
        return angles


def _sum_tapers(spectrum: npt.NDArray[np.complex128], first: int, count: int) -> Floats:
    """Return the sum of the tapers' squares at every second line of the double spectrum."""
    total = np.zeros(count)
    last = first + 2 * count - 1
    for k in range(1, _TAPER_COUNT + 1):
        difference = spectrum[first + k : last + k : 2] - spectrum[first - k : last - k : 2]
        total += difference.real**2 + difference.imag**2
    return total


def _band_edges(lines: int) -> npt.NDArray[np.intp]:
    """Return the edges of bands that are at least as wide as the smearing of the tapers."""
    steps = int(_BANDS_PER_OCTAVE * math.log2(lines / _TAPER_COUNT + 1.0))
    grid = _TAPER_COUNT * (2.0 ** (np.arange(steps + 1) / _BANDS_PER_OCTAVE) - 1.0)
    edges = [0]
    for edge in np.append(np.rint(grid), lines).astype(np.intp):
        if edge - edges[-1] >= _TAPER_COUNT:
            edges.append(int(edge))
    return np.array(edges)


def _split_edges(edges: npt.NDArray[np.intp], widest: int) -> npt.NDArray[np.intp]:
    """Return edges with additional splits, so that no band has too many lines."""
    split = [edges[:1]]
    for first, last in pairwise(edges.tolist()):
        parts = -(-(last - first) // widest)
        split.append(np.rint(np.linspace(first, last, parts + 1))[1:].astype(np.intp))
    return np.concatenate(split)


def _fast_length(n: int) -> int:
    """Return the largest length up to n with a fast padded transform."""
    best = 1
    for fives in (5**i for i in range(20) if 5**i <= n + 1):
        for threes in (3**i for i in range(30) if fives * 3**i <= n + 1):
            odd = fives * threes
            best = max(best, odd << (((n + 1) // odd).bit_length() - 1))
    return best - 1


# Densities of the sampled noises as functions of x = 2 sin(pi f), f in cycles per sample.
_DENSITY_SHAPES: Final[dict[str, Callable[[Floats], Floats]]] = {
    "quantization": lambda x: x * x,
    "angle_random_walk": lambda x: np.ones_like(x),
    "bias_instability": lambda x: 1.0 / x,
    "rate_random_walk": lambda x: 1.0 / (x * x),
}


def whittle(
    z: npt.ArrayLike,
    rate: float | None = None,
    *,
    unit: str | None = None,
    terms: Sequence[str] = TERMS,
) -> FittedModel:
    """Estimate noise coefficients by the likelihood of a record's spectrum.

    The method uses no Allan deviation, so it checks `AllanResult.fit` independently.

    Parameters
    ----------
    z : array_like, shape (n,)
        Rates; values that are not finite count as missing. The longest part without a gap is used.
    rate : float
        Sampling rate, Hz. Default: the rate of a `Log`.
    unit : str, optional
        Unit of `z`, for instance "deg/s". Default: the unit of a `Log`. Without a unit the model is
        in the unit of the samples, and cannot be converted or exported.
    terms : sequence of str
        Names of the coefficients to estimate. Default: all five.

    Returns
    -------
    FittedModel
        Model, as from `AllanResult.fit`.

    Raises
    ------
    ValueError
        If the record has fewer than 64 samples without a gap or is constant. If an argument is not
        as described.

    Notes
    -----
    P. Whittle, "Estimation and information in stationary time series", Ark. Mat. 2, 1953. The
    spectrum is averaged over narrow bands and over five sine tapers (K. S. Riedel, A. Sidorenko,
    IEEE Trans. Signal Process. 43(1), 1995). The tapers suppress the leakage of a random walk. The
    mean of each band is assumed to have a gamma distribution about the model.

    Examples
    --------
    >>> import zerorate as zr
    >>> model = zr.NoiseModel(angle_random_walk=1e-4, bias_instability=3e-5)
    >>> signal, _ = zr.simulate(model, rate=100.0, duration=3600.0, seed=1)
    >>> fit = zr.noise.whittle(signal, rate=100.0, unit="rad/s")
    >>> abs(fit.angle_random_walk / 1e-4 - 1.0) < 0.01
    True
    """
    check_terms(terms)
    hertz, record_unit = rate_of(rate, z), check_unit(unit_of(unit, z))
    spectrum = Spectrum.of(z, hertz)
    (doubt,) = find_doubts(floats(z, "z"), hertz, record_unit, ("",))
    return replace(fit_spectrum(spectrum, hertz, record_unit, terms), doubt=doubt.why)


def fit_spectrum(
    spectrum: Spectrum, rate: float, unit: str, terms: Sequence[str] = TERMS
) -> FittedModel:
    """Estimate noise coefficients from a computed spectrum, as `whittle` does."""
    wanted, bands = check_terms(terms), spectrum.bands
    factor, quantity = si_unit(unit)
    filtered = find_low_pass(spectrum, rate) if wanted == TERMS else None
    if filtered is not None and filtered.holds:
        return filtered_model(filtered, rate, (factor * spectrum.scale, quantity))
    basis = _basis(bands, wanted)
    problem = Problem(
        basis, spectrum.density, 2.0 * bands.counts, lambda c: (basis @ c) ** 2 / bands.counts
    )
    components = [Component(term, strength(term, rate)) for term in wanted]
    return fit_components(problem, components, "whittle", (factor * spectrum.scale, quantity))


def filtered_model(filtered: Filtered, rate: float, unit: tuple[float, Quantity]) -> FittedModel:
    """Return the model of noise behind a filter; `unit` is the data's SI unit and quantity."""
    squares = {
        "angle_random_walk": filtered.white,
        "bias_instability": filtered.flicker,
        "rate_random_walk": filtered.walk,
        "rate_ramp": filtered.ramp,
    }
    coefficients = {
        term: coefficient_of_square(square.value / s, square.sigma / s).scaled(unit[0])
        for term, square in squares.items()
        if math.isfinite(square.sigma)
        for s in (strength(term, rate),)
    }
    return FittedModel(
        **coefficients,  # type: ignore[arg-type]
        quantity=unit[1],
        method="whittle",
        chi_squared=filtered.deviance,
        degrees_of_freedom=filtered.freedom,
        **band_fields(filtered, rate),
    )


@lru_cache(maxsize=8)
def find_low_pass(spectrum: Spectrum, rate: float) -> Filtered | None:
    """Return the noise behind a low-pass, None if a model without a low-pass is sufficient."""
    bands = spectrum.bands
    basis = _basis(bands, TERMS)
    start = spectrum.density**2 / bands.counts
    plain = solve(basis, spectrum.density, start, lambda c: (basis @ c) ** 2 / bands.counts)
    frequency = bands.mean(np.array(bands.lines) / (bands.n + 1))
    data = basis, plain.strengths, spectrum.density, bands.counts, frequency
    return find_filter(spectrum.narrow(), rate) if suspects_filter(*data) else None


@lru_cache(maxsize=4)
def _basis(bands: Bands, terms: tuple[str, ...]) -> Floats:
    """Return the mean density of each band for terms of unit strength; axes share them."""
    x, ramp = bands.half_angles, np.arange(bands.n, dtype=np.float64)
    columns = (
        bands.mean(_DENSITY_SHAPES[term](x)) if term in _DENSITY_SHAPES else bands.density(ramp)
        for term in terms
    )
    return np.column_stack(list(columns))
