"""Degrees of freedom of an estimate, its bounds, and the bias by reflection."""

from collections.abc import Callable
from typing import Final

import numpy as np

from zerorate._native import chi_squared_quantile
from zerorate.noise.covariance import degrees_of_freedom
from zerorate.noise.kinds import KINDS, Kind
from zerorate.noise.processes import BY_EXPONENT
from zerorate.types import Floats, Integers

# Number of averaging times above which values are interpolated; they change slowly.
_MAX_EXACT_FACTORS: Final = 256
# Lower limit: the published fits become too small if tau is close to the record's length.
_MIN_EDF: Final = 0.5

# SP 1065, section 5.4: edf = b T/tau - c, with b and c by exponent.
_TOTAL_EDF: Final = {0: (1.50, 0.0), -1: (1.17, 0.22), -2: (0.93, 0.36)}
_MODIFIED_TOTAL_EDF: Final = {
    2: (1.90, 2.10),
    1: (1.20, 1.40),
    0: (1.10, 1.20),
    -1: (0.85, 0.50),
    -2: (0.75, 0.31),
}
# edf = (T/tau) / (b + c tau/T).
_HADAMARD_TOTAL_EDF: Final = {
    0: (0.559, 1.004),
    -1: (0.868, 1.140),
    -2: (0.938, 1.696),
    -3: (0.974, 2.554),
    -4: (1.276, 3.149),
}
# Expected variance over the variance without reflection.
_MODIFIED_TOTAL_BIAS: Final = {2: 0.94, 1: 0.83, 0: 0.73, -1: 0.70, -2: 0.69}
_HADAMARD_TOTAL_BIAS: Final = {0: -0.005, -1: -0.149, -2: -0.229, -3: -0.283, -4: -0.321}
_TOTAL_BIAS: Final = {-1: 0.481, -2: 0.750}
# The ratio of the modified kinds is a + b / m² from 2 samples, by simulation, accurate to half a
# percent. The published 0.73 makes the deviation of white noise 3 % too large, and 21 % at one
# sample.
_MODIFIED_REFLECTION: Final = {
    2: (0.996, 0.0),
    1: (0.853, 0.29),
    0: (0.771, 0.18),
    -1: (0.717, 0.108),
    -2: (0.679, 0.034),
}


def _nearest_exponent(kind: Kind, exponents: Integers) -> Integers:
    """Return the exponents, moved into the range in which the deviation converges."""
    least = -4 if kind.order == 3 else -2
    most = 0 if kind.name in ("totdev", "htotdev") else 2
    return np.clip(exponents, least, most)


def freedoms(kind: Kind, m: Integers, terms: Integers, exponents: Integers, n: int) -> Floats:
    """Return equivalent degrees of freedom, shape (t,); NaN if unknown.

    Parameters
    ----------
    kind : Kind
        Kind of deviation.
    m : ndarray of int, shape (t,)
        Averaging factors.
    terms : ndarray of int, shape (t,)
        Number of terms of each estimate.
    exponents : ndarray of int, shape (t,)
        Noise type at each averaging time.
    n : int
        Number of samples of the record.

    Notes
    -----
    Kinds without reflection use the sum of Greenhall and Riley (2003). Kinds with reflection use
    the fits of NIST SP 1065, section 5.4. The result of the parabolic deviation is NaN, because no
    formula is published.
    """
    result: Floats = np.full(m.size, np.nan)
    for exponent in np.unique(_nearest_exponent(kind, exponents)):
        there = (_nearest_exponent(kind, exponents) == exponent) & (terms > 0)
        if there.any():
            result[there] = _freedoms_of_noise(kind, m[there], terms[there], int(exponent), n)
    return np.maximum(result, _MIN_EDF)


def bounds(deviation: Floats, edf: Floats, confidence: float) -> tuple[Floats, Floats]:
    """Return the bounds of the true deviation at a given probability."""
    tail = (1.0 - confidence) / 2.0
    lower, upper = (
        deviation * np.sqrt(edf / chi_squared_quantile(p, edf.ravel()).reshape(edf.shape))
        for p in (1.0 - tail, tail)
    )
    return lower, upper


def total_bias(kind: Kind, m: Integers, exponents: Integers, n: int) -> Floats:
    """Return the published ratio of the variance to the variance without reflection.

    Source: NIST SP 1065, section 5.
    """
    exponents = _nearest_exponent(kind, exponents)
    if kind.name == "totdev":
        return 1.0 - _look_up(_TOTAL_BIAS, exponents, 0.0) * m / n
    if kind.name == "htotdev":
        return 1.0 + _look_up(_HADAMARD_TOTAL_BIAS, exponents, 0.0) * (m > 1)
    if kind.name in ("mtotdev", "ttotdev"):
        return _look_up(_MODIFIED_TOTAL_BIAS, exponents, 1.0)
    return np.ones(m.size)


def reflection_bias(kind: Kind, m: Integers, exponents: Integers, n: int) -> Floats:
    """Return the same ratio; simulated values replace inaccurate published ones."""
    if not (kind.total and kind.modified):
        return total_bias(kind, m, exponents, n)
    limits = np.array([_MODIFIED_REFLECTION[int(e)] for e in _nearest_exponent(kind, exponents)])
    # At one sample it is a half for any noise.
    return np.where(m == 1, 0.5, limits[:, 0] + limits[:, 1] / m**2)


def _look_up(table: dict[int, float], exponents: Integers, other: float) -> Floats:
    return np.array([table.get(int(exponent), other) for exponent in exponents])


def _freedoms_of_noise(kind: Kind, m: Integers, terms: Integers, exponent: int, n: int) -> Floats:
    if kind.name == "pdev":
        return np.full(m.size, np.nan)
    if kind.total:
        reflected = _REFLECTED_EDF[kind.name](exponent, n / m.astype(np.float64), m)
        if kind.name != "htotdev":
            return reflected
        # At one sample nothing is reflected, so it equals the overlapping Hadamard deviation.
        plain = _freedoms_of_noise(KINDS["ohdev"], m, terms, exponent, n)
        reflected[m == 1] = plain[m == 1]
        return reflected
    if m.size <= _MAX_EXACT_FACTORS:
        return degrees_of_freedom(kind, m, terms, BY_EXPONENT[exponent])
    grid = np.unique(np.rint(np.geomspace(1, m.size, _MAX_EXACT_FACTORS)).astype(np.int64)) - 1
    known = degrees_of_freedom(kind, m[grid], terms[grid], BY_EXPONENT[exponent])
    filled: Floats = np.exp(np.interp(np.log(m), np.log(m[grid]), np.log(known)))
    return filled


def _total_edf(exponent: int, ratio: Floats, m: Integers) -> Floats:
    b, c = _TOTAL_EDF[exponent]
    return b * ratio - c


def _modified_total_edf(exponent: int, ratio: Floats, m: Integers) -> Floats:
    b, c = _MODIFIED_TOTAL_EDF[exponent]
    return b * ratio - c


def _hadamard_total_edf(exponent: int, ratio: Floats, m: Integers) -> Floats:
    b, c = _HADAMARD_TOTAL_EDF[exponent]
    return ratio / (b + c / ratio)


def _theo1_edf(exponent: int, ratio: Floats, m: Integers) -> Floats:
    samples = m.astype(np.float64)
    return _THEO1_EDF[exponent](ratio * samples + 1.0, 0.75 * samples)


# NIST SP 1065, table 8, for N phase points at averaging times of r samples.
_THEO1_EDF: Final[dict[int, Callable[[Floats, Floats], Floats]]] = {
    2: lambda n, r: 0.86 * (n + 1.0) * (n - 4.0 * r / 3.0) / (n - r) * r / (r + 1.14),
    1: lambda n, r: (
        (4.798 * n**2 - 6.374 * n * r + 12.387 * r)
        / (np.sqrt(r + 36.6) * (n - r))
        * (r / (r + 0.3))
    ),
    0: lambda n, r: ((4.1 * n + 0.8) / r - (3.1 * n + 6.5) / n) * r**1.5 / (r**1.5 + 5.2),
    -1: lambda n, r: (2.0 * n**2 - 1.3 * n * r - 3.5 * r) / (n * r) * r**3 / (r**3 + 2.3),
    -2: lambda n, r: (
        (4.4 * n - 2.0)
        / (2.9 * r)
        * ((4.4 * n - 1.0) ** 2 - 8.6 * r * (4.4 * n - 1.0) + 11.4 * r**2)
        / (4.4 * n - 3.0) ** 2
    ),
}


_REFLECTED_EDF: Final[dict[str, Callable[[int, Floats, Integers], Floats]]] = {
    "totdev": _total_edf,
    "mtotdev": _modified_total_edf,
    "ttotdev": _modified_total_edf,
    "htotdev": _hadamard_total_edf,
    "theo1": _theo1_edf,
}
