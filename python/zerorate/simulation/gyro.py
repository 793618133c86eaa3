"""Sensor signals at rest, with known noise coefficients and known drift."""

import math
from numbers import Integral
from typing import Final

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.noise import LowPass, NoiseModel
from zerorate.simulation import sequences
from zerorate.simulation.devices import Device
from zerorate.simulation.low_pass import convolve, impulse_response
from zerorate.types import Floats

_MAX_SAMPLES: Final = 10**9
# Append new terms: their position selects the random stream, and old seeds must not change.
_STREAMS: Final = (
    "turn-on bias",
    "white",
    "flicker",
    "walk",
    "quantization",
    "markov",
    "sinusoid",
)


def simulate(
    model: NoiseModel | Device,
    rate: float,
    duration: float,
    seed: int,
    *,
    axes: int | None = None,
    resolution: float | None = None,
    turn_on_bias: float | None = None,
    low_pass: LowPass | None = None,
) -> tuple[Floats, Floats]:
    """Simulate a gyro at rest, and return its output and its true drift.

    Parameters
    ----------
    model : NoiseModel or Device
        Noise of every axis. A device also has a resolution and a turn-on bias.
    rate : float
        Sampling rate, Hz.
    duration : float
        Length of the signal, s. It has ``round(rate * duration)`` samples.
    seed : int
        Seed, at least 0. The same arguments give the same signal. Each axis and each noise term has
        its own random stream. Axis i therefore does not depend on the number of axes, and a term
        does not depend on other terms.
    axes : int, optional
        Number of axes. None (default) gives 1-D arrays. They equal axis 0 of a signal with several
        axes.
    resolution : float, optional
        Step to which the output is rounded, rad/s. 0 means no rounding. Default: the device's
        resolution, or 0.
    turn_on_bias : float, optional
        Standard deviation of the random constant bias of each axis, rad/s. Default: the device's
        value, or 0.
    low_pass : LowPass, optional
        Filter of the sensor, applied to noise and drift before rounding. It is a moving average, or
        a Butterworth filter of the nearest whole order up to 8. Default: the filter of the noise
        model.

    Returns
    -------
    signal : ndarray of float64, shape (n,) or (n, axes)
        Output, rad/s, or m/s^2 for a model of acceleration. It is the sum of drift, white noise and
        quantization noise, rounded.
    truth : ndarray of float64, the shape of `signal`
        True drift in the same unit, as a perfect drift filter would return it. It includes turn-on
        bias, flicker, random walk, ramp, Markov noise and sinusoids. It excludes white noise,
        quantization noise, the filter and rounding.

    Raises
    ------
    ValueError
        If the rate or the duration is not positive and finite, or the signal has no sample. If
        `seed`, `axes`, `resolution` or `turn_on_bias` is out of range. If the filter's corner
        frequency is half the rate or more.

    Notes
    -----
    White noise has the standard deviation N/sqrt(dt). The random walk starts at 0, and its steps
    have the standard deviation K sqrt(dt). Flicker noise is white noise of variance B^2 after the
    causal fractional integrator (1 - 1/z)^(-1/2). Far below the sampling rate its density is B^2/(2
    pi f) (N. J. Kasdin, "Discrete simulation of colored noise and stochastic processes and
    1/f^alpha power law noise generation", Proc. IEEE 83(5), 1995, section III.B, alpha = 1).
    Flicker noise starts at zero, so the drift grows from the turn-on bias.

    Quantization noise is the rate times the difference of successive angle errors. These errors are
    white with the standard deviation Q. Markov noise is stationary from the first sample, with
    variance q_c^2 T_c / 2. It decays by exp(-dt/T_c) per sample, without discretisation error.
    Sinusoids start at a random phase. They count as drift, because they do not average out like
    white noise.

    With a filter, the record starts after the filter's transient.

    A coefficient that is not identifiable is used with its value, not with its bound.

    Examples
    --------
    >>> model = NoiseModel(angle_random_walk=1e-4, rate_random_walk=1e-6)
    >>> signal, truth = simulate(model, rate=100.0, duration=60.0, seed=1)
    >>> signal.shape, round(1e3 * float((signal - truth).std()), 2)
    ((6000,), 1.0)
    """
    n = _sample_count(rate, duration)
    whole_seed = check_whole("seed", seed, 0)
    n_axes = 1 if axes is None else check_whole("axes", axes, 1)
    noise, step, bias_sigma = _resolve_model(model, resolution, turn_on_bias)
    signal, truth = np.empty((n, n_axes)), np.empty((n, n_axes))
    filter_ = noise.low_pass if low_pass is None else low_pass
    response = np.ones(1) if filter_ is None else impulse_response(filter_, rate)
    before = response.size - 1
    for i, axis_seed in enumerate(np.random.SeedSequence(whole_seed).spawn(n_axes)):
        samples, drift = _simulate_axis(noise, rate, before + n, bias_sigma, axis_seed)
        signal[:, i] = convolve(samples, response) if before else samples
        truth[:, i] = drift[before:]
    if step > 0.0:
        signal = np.round(signal / step) * step
    return (signal[:, 0], truth[:, 0]) if axes is None else (signal, truth)


def _simulate_axis(
    noise: NoiseModel, rate: float, n: int, bias_sigma: float, seed: np.random.SeedSequence
) -> tuple[Floats, Floats]:
    seeds = dict(zip(_STREAMS, seed.spawn(len(_STREAMS)), strict=True))

    def random(stream: str) -> np.random.Generator:
        return np.random.default_rng(seeds[stream])

    truth = np.full(n, bias_sigma * random("turn-on bias").standard_normal())
    if noise.bias_instability > 0.0:
        truth += noise.bias_instability * sequences.flicker(random("flicker").standard_normal(n))
    if noise.rate_random_walk > 0.0:
        step = noise.rate_random_walk / math.sqrt(rate)
        truth += step * sequences.walk(random("walk").standard_normal(n))
    if noise.rate_ramp != 0.0:
        truth += noise.rate_ramp / rate * np.arange(n)
    if noise.markov:
        _add_markov(truth, noise, rate, seeds["markov"])
    if noise.sinusoid:
        _add_sinusoids(truth, noise, rate, random("sinusoid"))
    sigma = noise.angle_random_walk * math.sqrt(rate)
    signal = truth + sigma * random("white").standard_normal(n)
    if noise.quantization > 0.0:
        errors = random("quantization").standard_normal(n + 1)
        signal += noise.quantization * rate * sequences.quantization(errors)
    return signal, truth


def _add_markov(
    truth: Floats, noise: NoiseModel, rate: float, seed: np.random.SeedSequence
) -> None:
    """Add each term from its own random stream, so that it does not depend on other terms."""
    for term, child in zip(noise.markov, seed.spawn(len(noise.markov)), strict=True):
        white = np.random.default_rng(child).standard_normal(truth.size)
        sigma = term.amplitude * math.sqrt(term.time / 2.0)
        truth += sigma * sequences.markov(white, 1.0 / (rate * term.time))


def _add_sinusoids(
    truth: Floats, noise: NoiseModel, rate: float, random: np.random.Generator
) -> None:
    for term, phase in zip(noise.sinusoid, random.random(len(noise.sinusoid)), strict=True):
        truth += term.amplitude * sequences.sinusoid(truth.size, term.frequency / rate, phase)


def _resolve_model(
    model: NoiseModel | Device, resolution: float | None, turn_on_bias: float | None
) -> tuple[NoiseModel, float, float]:
    if isinstance(model, Device):
        noise, step, sigma = model.noise, model.resolution, model.turn_on_bias
    elif isinstance(model, NoiseModel):
        noise, step, sigma = model, 0.0, 0.0
    else:
        raise ArgumentError(
            "model", f"must be a NoiseModel or a Device, got {type(model).__name__}"
        )
    step = step if resolution is None else check_not_negative("resolution", resolution)
    sigma = sigma if turn_on_bias is None else check_not_negative("turn_on_bias", turn_on_bias)
    return noise, step, sigma


def _sample_count(rate: float, duration: float) -> int:
    for name, value in (("rate", rate), ("duration", duration)):
        if not (math.isfinite(value) and value > 0.0):
            raise ArgumentError(name, f"must be positive and finite, got {value}")
    n = rate * duration
    if not 0.5 < n <= _MAX_SAMPLES:
        raise ValueError(
            f"{duration} s at {rate} Hz is {n:.3g} samples: it must be 1 to {_MAX_SAMPLES:.0e}"
        )
    return round(n)


def check_whole(name: str, value: int, minimum: int) -> int:
    """Return a value; raises an error if it is not a whole number of at least `minimum`."""
    if not isinstance(value, Integral) or isinstance(value, bool) or value < minimum:
        raise ArgumentError(name, f"must be a whole number from {minimum}, got {value!r}")
    return int(value)


def check_not_negative(name: str, value: float) -> float:
    """Return a value; raises an error if it is not finite or negative."""
    if not (math.isfinite(value) and value >= 0.0):
        raise ArgumentError(name, f"must be finite and not negative, got {value}")
    return float(value)
