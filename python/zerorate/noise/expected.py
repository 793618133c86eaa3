"""The deviation that a model expects at the averaging times of a curve, term by term."""

from collections.abc import Iterator
from functools import reduce
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.noise.covariance import variances
from zerorate.noise.kinds import KINDS
from zerorate.noise.model import NoiseModel
from zerorate.noise.power_laws import markov
from zerorate.noise.processes import COLOURED, ramp_variance, sinusoid_variance, strength
from zerorate.noise.quantities import TERMS

if TYPE_CHECKING:
    from zerorate.noise.result import AllanResult

__all__ = ["ExpectedTerm", "expected_deviation", "expected_terms"]

Floats = npt.NDArray[np.float64]


class ExpectedTerm(NamedTuple):
    """One term of a model: its field, and its deviation of the rate in SI, shape (t,)."""

    field: str
    deviation: Floats


def expected_terms(model: NoiseModel, curve: "AllanResult") -> tuple[ExpectedTerm, ...]:
    """Return the terms of a model that are not zero, at the averaging times of a curve.

    Parameters
    ----------
    model : NoiseModel
        In SI units.
    curve : AllanResult
        Of any kind: its averaging times, rate and kind are what counts.

    Returns
    -------
    tuple of ExpectedTerm
        Of a sampled record, as `AllanResult.fit` compares them, not of a continuous one.
    """
    return tuple(term for term in _terms(model, curve) if np.any(term.deviation > 0.0))


def expected_deviation(model: NoiseModel, curve: "AllanResult") -> Floats:
    """Return the deviation of the rate that a model expects, in SI, shape (t,)."""
    terms = (term.deviation for term in expected_terms(model, curve))
    return reduce(np.hypot, terms, np.zeros(curve.taus.size))


def _terms(model: NoiseModel, curve: "AllanResult") -> Iterator[ExpectedTerm]:
    kind, m, rate = KINDS[curve.kind], curve.factors, curve.rate
    for field in (term.field for term in TERMS[model.quantity]):
        if field in COLOURED:
            variance = variances(kind, m, COLOURED[field])
        else:
            variance = ramp_variance(kind, m.astype(np.float64))
        size = abs(getattr(model, field).value)
        yield ExpectedTerm(field, size * np.sqrt(strength(field, rate) * variance))
    for correlated in model.markov:
        scale = correlated.amplitude * np.sqrt(correlated.time / 2.0)
        variance = variances(kind, m, markov(correlated.time * rate))
        yield ExpectedTerm("markov", scale * np.sqrt(variance))
    for sine in model.sinusoid:
        variance = sinusoid_variance(kind, m.astype(np.float64), sine.frequency / rate)
        yield ExpectedTerm("sinusoid", sine.amplitude * np.sqrt(variance))
