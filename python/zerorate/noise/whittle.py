"""Noise coefficients from the spectrum, the second opinion beside the deviation curve."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.noise.fit import Component, FittedModel, Problem, fitted
from zerorate.noise.processes import TERMS, check_terms, strength
from zerorate.noise.records import si_unit
from zerorate.noise.spectrum import Bands, Spectrum

__all__ = ["fit_spectrum", "whittle"]

Floats = npt.NDArray[np.float64]

# Densities of the sampled noises over x = 2 sin(pi f), f in cycles a sample.
_SHAPES: Final[dict[str, Callable[[Floats], Floats]]] = {
    "quantization": lambda x: x * x,
    "angle_random_walk": lambda x: np.ones_like(x),
    "bias_instability": lambda x: 1.0 / x,
    "rate_random_walk": lambda x: 1.0 / (x * x),
}


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
    check_terms(terms)
    return fit_spectrum(Spectrum.of(z, rate), rate, unit, terms)


def fit_spectrum(
    spectrum: Spectrum, rate: float, unit: str, terms: Sequence[str] = TERMS
) -> FittedModel:
    """Estimate noise coefficients, as `whittle` does, from a spectrum that is there already."""
    wanted, bands = check_terms(terms), spectrum.bands
    factor, quantity = si_unit(unit)
    basis = _basis(bands, wanted)
    problem = Problem(
        basis, spectrum.density, 2.0 * bands.counts, lambda c: (basis @ c) ** 2 / bands.counts
    )
    components = [Component(term, strength(term, rate)) for term in wanted]
    return fitted(problem, components, "whittle", (factor * spectrum.scale, quantity))


@lru_cache(maxsize=4)
def _basis(bands: Bands, terms: tuple[str, ...]) -> Floats:
    """Return the mean density of each band for terms of unit strength; axes share them."""
    x, ramp = bands.half_angles, np.arange(bands.n, dtype=np.float64)
    columns = (
        bands.mean(_SHAPES[term](x)) if term in _SHAPES else bands.density(ramp) for term in terms
    )
    return np.column_stack(list(columns))
