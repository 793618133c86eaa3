"""Simulated samples behind a low-pass: their spectrum, their variance, and refusals."""

import math

import numpy as np
import pytest
from scipy.signal import butter, freqz

import zerorate as zr
from zerorate.noise import LowPass, NoiseModel
from zerorate.simulation.low_pass import convolve, impulse_response

RATE = 200.0


@pytest.mark.parametrize("order", [1, 2, 4, 8])
@pytest.mark.parametrize("corner", [1.0, 20.0, 90.0])
def test_the_response_is_that_of_a_butterworth_filter(corner, order):
    response = impulse_response(LowPass(corner, float(order)), RATE)
    omega = np.linspace(0.0, 0.9 * math.pi, 100)
    expected = freqz(*butter(order, 2.0 * corner / RATE), omega)[1] if order < 8 else None
    got = np.exp(-1j * np.outer(omega, np.arange(response.size))) @ response
    gain = 1.0 / np.sqrt(1.0 + (np.tan(omega / 2) / np.tan(np.pi * corner / RATE)) ** (2 * order))
    # What is left of the impulse response beyond its end.
    np.testing.assert_allclose(np.abs(got), gain, atol=1e-6)
    if expected is not None:
        np.testing.assert_allclose(got, expected, atol=1e-5)


def test_a_moving_average_is_one():
    response = impulse_response(LowPass(22.145, math.inf), RATE)
    np.testing.assert_array_equal(response, np.full(4, 0.25))


def test_convolution_is_that_of_numpy():
    rng = np.random.default_rng(1)
    signal, response = rng.standard_normal(1000), rng.standard_normal(30)
    expected = np.convolve(signal, response, "valid")
    np.testing.assert_allclose(convolve(signal, response), expected, atol=1e-12)


@pytest.mark.parametrize("low_pass", [LowPass(5.0, 1.0), LowPass(20.0, 2.0)])
def test_noise_passes_and_the_bias_stays(low_pass):
    noise = NoiseModel(angle_random_walk=1e-4)
    z, truth = zr.simulate(noise, RATE, 600.0, 1, axes=2, turn_on_bias=1.0, low_pass=low_pass)
    expected = 1e-8 * RATE * low_pass.passed_share(RATE)
    # Of 600 s, in which such noise is new some 10 000 times.
    np.testing.assert_allclose((z - truth).var(axis=0), expected, rtol=0.06)
    np.testing.assert_allclose((z - truth).mean(axis=0), 0.0, atol=4e-4 / math.sqrt(600.0))
    alone, _ = zr.simulate(noise, RATE, 600.0, 1, turn_on_bias=1.0, low_pass=low_pass)
    np.testing.assert_array_equal(alone, z[:, 0])


def test_the_filter_of_a_model_is_the_default():
    model = NoiseModel(angle_random_walk=1e-4, low_pass=LowPass(5.0, 1.0))
    plain = NoiseModel(angle_random_walk=1e-4)
    found = zr.simulate(model, RATE, 10.0, 1)
    expected = zr.simulate(plain, RATE, 10.0, 1, low_pass=model.low_pass)
    np.testing.assert_array_equal(found, expected)


def test_a_corner_beyond_half_the_rate_is_refused():
    with pytest.raises(ValueError, match="low_pass must have its corner below 100 Hz"):
        zr.simulate(NoiseModel(angle_random_walk=1.0), RATE, 1.0, 1, low_pass=LowPass(100.0))
