"""Records of six kinds of gyro, twenty of each, and what both methods find in them."""

from functools import cache
from typing import NamedTuple

import numpy as np

import zerorate as zr

GYROS = {name: gyro.noise for name, gyro in zr.simulation.DEVICES.items()} | {
    "strong walk": zr.NoiseModel(1e-4, 2e-5, 1e-5),
    "quantised": zr.NoiseModel(2e-5, 1e-5, quantization=1e-5),
}
TERMS = (
    "quantization",
    "angle_random_walk",
    "bias_instability",
    "rate_random_walk",
    "rate_ramp",
)
RATE, DURATION, SEEDS = 100.0, 1000.0, 20


class Fits(NamedTuple):
    """The truth, the curve of a simulated record, and the models fitted to it."""

    truth: zr.NoiseModel
    result: zr.noise.AllanResult
    curve: zr.noise.FittedModel
    whittle: zr.noise.FittedModel


@cache
def simulated_fits():
    """Return all fits, made once for all tests."""
    return [
        _fits(model, 100 * i + seed)
        for i, model in enumerate(GYROS.values())
        for seed in range(SEEDS)
    ]


def _fits(truth, seed):
    z, _ = zr.simulate(truth, RATE, DURATION, seed)
    result = zr.allan(z, RATE)
    return Fits(truth, result, result.fit(), zr.noise.whittle(z, RATE))


def coefficients(method, terms=TERMS):
    """Return (true value, coefficient) of every simulated record and term."""
    return [
        (float(getattr(fits.truth, term)), getattr(getattr(fits, method), term))
        for fits in simulated_fits()
        for term in terms
    ]


def share_within(pairs):
    """Return the share of identified true terms within one standard error, and their number."""
    known = [(truth, found) for truth, found in pairs if truth > 0.0 and found.identifiable]
    within = [abs(found.value - truth) <= found.sigma for truth, found in known]
    return float(np.mean(within)), len(within)
