"""Noise coefficients from the spectrum, the second opinion beside the deviation curve."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.noise.fit import Component, FittedModel, Problem, fitted
from zerorate.noise.processes import TERMS, check_terms, strength
from zerorate.noise.records import longest_stretch, power_of_two, samples, si_unit

__all__ = ["whittle"]

Floats = npt.NDArray[np.float64]

# More average better but smear the lowest frequencies, where drift is.
_TAPERS: Final = 5
_PER_OCTAVE: Final = 8
# Lines at a time: what is worked on stays in the cache.
_BLOCK: Final = 1 << 13
_LEAST_SAMPLES: Final = 64


def whittle(
    z: npt.ArrayLike, rate: float, *, unit: str = "rad/s", terms: Sequence[str] = TERMS
) -> FittedModel:
    """Estimate noise coefficients by the likelihood of a record's spectrum.

    Made without any Allan deviation, so a second opinion on `AllanResult.fit`.

    Parameters
    ----------
    z : array_like, shape (n,)
        Rates. Samples that are not finite are missing; the longest stretch without them is used.
    rate : float
        Samples per second, Hz.
    unit : str
        Unit of `z`.
    terms : sequence of str
        Coefficients to look for; all five by default.

    Returns
    -------
    FittedModel
        In SI units, as of `AllanResult.fit`.

    Raises
    ------
    ValueError
        If the record has fewer than 64 samples without a gap, is constant, or an argument is not
        as described.

    Notes
    -----
    P. Whittle, "Estimation and information in stationary time series", Ark. Mat. 2, 1953. The
    spectrum is averaged over five sine tapers (K. S. Riedel, A. Sidorenko, IEEE Trans. Signal
    Process. 43(1), 1995), which keep a random walk from leaking, and over narrow bands; each band
    is gamma distributed about the model.

    Examples
    --------
    >>> import zerorate as zr
    >>> model = zr.NoiseModel(angle_random_walk=1e-4, bias_instability=3e-5)
    >>> signal, _ = zr.simulate(model, rate=100.0, duration=3600.0, seed=1)
    >>> fit = zr.whittle(signal, rate=100.0)
    >>> abs(fit.angle_random_walk / 1e-4 - 1.0) < 0.01
    True
    """
    wanted = check_terms(terms)
    record = longest_stretch(samples(z, rate))
    if record.size < _LEAST_SAMPLES:
        raise ValueError(
            f"z must have at least {_LEAST_SAMPLES} samples without a gap, has {record.size}"
        )
    record = record[: _smooth(record.size)]
    if np.all(record == record[0]):
        raise ValueError("z is constant: there is no noise to fit")
    unit_of_record, quantity = si_unit(unit)
    scale = power_of_two(record)
    bands, basis = _expected(record.size, wanted)
    density = bands.of(record / scale)
    problem = Problem(basis, density, 2.0 * bands.counts, lambda c: _scatter(basis @ c, bands))
    components = [Component(term, strength(term, rate)) for term in wanted]
    return fitted(problem, components, "whittle", (unit_of_record * scale, quantity))


@lru_cache(maxsize=4)
def _expected(n: int, terms: tuple[str, ...]) -> tuple["_Bands", Floats]:
    """Return the bands of n samples and what terms of unit strength give; axes share them."""
    bands = _Bands(n)
    return bands, np.column_stack([_density(term, bands) for term in terms])


class _Bands:
    """Bands of the spectrum of n samples, and how much each tells."""

    def __init__(self, n: int) -> None:
        self.n = n
        self.lines = np.arange(_TAPERS, (n + 1 - _TAPERS) // 2)
        self.edges = _edges(self.lines.size)
        # Sums over many lines vary more by the ends of the record that the tapers leave out.
        self.counts = np.diff(self.edges) / (1.0 + 0.5 / _TAPERS)

    def of(self, record: Floats) -> Floats:
        """Return the mean two-sided density of each band, with the sample as unit of time.

        A sine taper shifts the spectrum up and down by so many half lines, so that one transform
        of twice the length holds all of them.
        """
        padded = np.zeros(2 * (self.n + 1))
        np.subtract(record, record.mean(), out=padded[1 : self.n + 1])
        spectrum = np.fft.rfft(padded)
        blocks = [self.lines[i : i + _BLOCK] for i in range(0, self.lines.size, _BLOCK)]
        ordinates = np.concatenate(
            [_tapered(spectrum, 2 * lines[0], lines.size) for lines in blocks]
        )
        return self.mean(ordinates) / (2.0 * _TAPERS * (self.n + 1))

    def mean(self, ordinates: Floats) -> Floats:
        """Return the means over each band."""
        sums = np.add.reduceat(ordinates[: self.edges[-1]], self.edges[:-1])
        means: Floats = sums / np.diff(self.edges)
        return means

    @property
    def half_angles(self) -> Floats:
        """2 sin(pi f) of every line, f in cycles a sample."""
        angles: Floats = 2.0 * np.sin(self.lines * (math.pi / (self.n + 1)))
        return angles


def _tapered(spectrum: npt.NDArray[np.complex128], first: int, count: int) -> Floats:
    """Return the sum of the tapers' squares at every second line of the double spectrum."""
    total = np.zeros(count)
    last = first + 2 * count - 1
    for k in range(1, _TAPERS + 1):
        difference = spectrum[first + k : last + k : 2] - spectrum[first - k : last - k : 2]
        total += difference.real**2 + difference.imag**2
    return total


def _edges(lines: int) -> npt.NDArray[np.intp]:
    """Return where bands begin and the last ends: none narrower than what the tapers smear."""
    steps = int(_PER_OCTAVE * math.log2(lines / _TAPERS + 1.0))
    grid = _TAPERS * (2.0 ** (np.arange(steps + 1) / _PER_OCTAVE) - 1.0)
    edges = [0]
    for edge in np.append(np.rint(grid), lines).astype(np.intp):
        if edge - edges[-1] >= _TAPERS:
            edges.append(int(edge))
    return np.array(edges)


def _density(term: str, bands: _Bands) -> Floats:
    """Return the mean density of each band for a term of unit strength."""
    if term == "rate_ramp":
        return bands.of(np.arange(bands.n, dtype=np.float64))
    x = bands.half_angles
    power = {"quantization": 2, "angle_random_walk": 0, "bias_instability": -1}.get(term, -2)
    return bands.mean(x**power)


def _scatter(expected: Floats, bands: _Bands) -> Floats:
    return expected**2 / bands.counts


def _smooth(n: int) -> int:
    """Return the largest length up to n whose padded transform is quick."""
    best = 1
    for fives in (5**i for i in range(20) if 5**i <= n + 1):
        for threes in (3**i for i in range(30) if fives * 3**i <= n + 1):
            odd = fives * threes
            best = max(best, odd << (((n + 1) // odd).bit_length() - 1))
    return best - 1
