"""Sequences of unit size with the spectra of the noise terms, made from white noise."""

import math

import numpy as np

from zerorate.types import Floats


def walk(steps: Floats) -> Floats:
    """Return the cumulative sum of the steps, starting at 0 without the first step."""
    steps[0] = 0.0
    return np.cumsum(steps)


def flicker(white: Floats) -> Floats:
    """Convolve with h_k = h_(k-1) (k - 1/2)/k, the impulse response of (1 - 1/z)^(-1/2)."""
    n = white.size
    lags = np.arange(1.0, n)
    response = np.concatenate(([1.0], np.cumprod((lags - 0.5) / lags)))
    # Padding to twice the length prevents the circular convolution from wrapping round.
    size = 1 << (2 * n - 1).bit_length()
    product = np.fft.rfft(white, size) * np.fft.rfft(response, size)
    return np.fft.irfft(product, size)[:n]


def quantization(errors: Floats) -> Floats:
    """Return the differences of the angle errors; the result has one value less."""
    return np.diff(errors)


def markov(white: Floats, step: float) -> Floats:
    """Return a stationary first-order Markov sequence of variance 1.

    The recursion x_k = a x_(k-1) + sqrt(1 - a^2) w_k with a = exp(-step) is exact. `step` is the
    sample interval in correlation times. It is solved by doubling: after m passes x_k has the last
    2^m terms of sum_j a^j w_(k-j).
    """
    x = white * math.sqrt(-math.expm1(-2.0 * step))
    x[0] = white[0]
    lag, decay = 1, math.exp(-step)
    # Terms below a tenth of the rounding error are left out.
    while lag < x.size and decay > 1e-17:
        x[lag:] += decay * x[:-lag]
        lag, decay = 2 * lag, decay * decay
    return x


def sinusoid(n: int, cycles: float, phase: float) -> Floats:
    """Return n samples of a sine with `cycles` per sample and a start phase in cycles."""
    sine: Floats = np.sin(2.0 * math.pi * (cycles * np.arange(n) + phase))
    return sine
