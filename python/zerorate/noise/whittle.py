"""Noise coefficients from the spectrum, the second opinion beside the deviation curve."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.noise.fit import Component, FittedModel, Problem, fitted
from zerorate.noise.processes import TERMS, check_terms, strength
from zerorate.noise.records import longest_stretch, samples, si_unit

__all__ = ["whittle"]

Floats = npt.NDArray[np.float64]

# The taper holds the lowest frequencies together: those below this one tell of the mean.
_FIRST: Final = 2
_SINGLE: Final = 8
_PER_OCTAVE: Final = 8
_LEAST_SAMPLES: Final = 64


def whittle(
    z: npt.ArrayLike, rate: float, *, unit: str = "rad/s", terms: Sequence[str] = TERMS
) -> FittedModel:
    """Estimate noise coefficients by the likelihood of a record's spectrum.

    Independent of every Allan deviation, so a second opinion on `AllanResult.fit`, and the sharper
    one for bias instability and random walk.

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
    periodogram is tapered by half a sine, whose leakage a random walk needs, and averaged over
    narrow bands; each band is gamma distributed about the model.

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
    if np.ptp(record) == 0.0:
        raise ValueError("z is constant: there is no noise to fit")
    bands, basis = _expected(record.size, wanted)
    density = bands.of(record)
    problem = Problem(basis, density, 2.0 * bands.counts, lambda c: _scatter(basis @ c, bands))
    factor, quantity = si_unit(unit)
    components = [Component(term, strength(term, rate) / factor**2) for term in wanted]
    return fitted(problem, components, "whittle", quantity=quantity)


@lru_cache(maxsize=4)
def _expected(n: int, terms: tuple[str, ...]) -> tuple["_Bands", Floats]:
    """Return the bands of n samples and what terms of unit strength give; axes share them."""
    bands = _Bands(n)
    return bands, np.column_stack([_density(term, bands) for term in terms])


class _Bands:
    """Bands of the spectrum of n samples, and how much each tells."""

    def __init__(self, n: int) -> None:
        self.n = n
        self.edges = _edges(n // 2 + 1)
        sizes = np.diff(self.edges)
        # The taper makes neighbours share half of their amplitude.
        self.counts = sizes / (1.0 + 0.5 * (sizes - 1) / sizes)

    def of(self, record: Floats) -> Floats:
        """Return the mean two-sided density of each band, with the sample as unit of time."""
        n = self.n
        taper = math.sqrt(2.0 / (n + 1)) * np.sin(np.arange(1, n + 1) * (math.pi / (n + 1)))
        spectrum = np.fft.rfft((record - record.mean()) * taper)
        return self.mean(spectrum.real**2 + spectrum.imag**2)

    def mean(self, ordinates: Floats) -> Floats:
        """Return the means over each band."""
        sums = np.add.reduceat(ordinates[: self.edges[-1]], self.edges[:-1])
        return sums / np.diff(self.edges)

    @property
    def half_angles(self) -> Floats:
        """2 sin(pi f) at every frequency, f in cycles a sample."""
        lines = np.arange(self.n // 2 + 1)
        return 2.0 * np.sin(np.maximum(lines, 1.0) * (math.pi / self.n))


def _edges(lines: int) -> npt.NDArray[np.intp]:
    last = lines - 1
    singles = np.arange(_FIRST, min(_FIRST + _SINGLE, last))
    start = int(singles[-1]) + 1
    octaves = max(math.log2(last / start), 0.0)
    rest = np.geomspace(start, last, max(int(octaves * _PER_OCTAVE), 1) + 1)
    return np.unique(np.concatenate((singles, np.rint(rest).astype(np.intp))))


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
    """Return the largest even number up to n without a prime factor above 5."""
    best = 1
    for fives in (5**i for i in range(20) if 5**i <= n):
        for threes in (3**i for i in range(30) if fives * 3**i <= n):
            best = max(best, fives * threes << ((n // (fives * threes)).bit_length() - 1))
    return best
