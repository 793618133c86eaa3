"""Low-pass filters of simulated sensors, applied to noise and drift."""

import math
from typing import Final

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.noise import LowPass
from zerorate.types import Floats

_MAX_ORDER: Final = 8
_MEMORY_CORNERS: Final = 64.0
"""Length of the impulse response, samples, times the corner in cycles per sample."""
_MIN_LINES: Final = 256
_WIDTH_OF_MEAN: Final = 0.4429
"""Length of a moving average, samples, times its corner in cycles per sample."""


def impulse_response(low_pass: LowPass, rate: float) -> Floats:
    """Return the full impulse response of a filter at a sampling rate.

    The filter is a digital Butterworth filter of the nearest whole order, or a moving average. The
    frequency response comes from the bilinear transform. It has enough lines for the impulse
    response to end.
    """
    corner = float(low_pass.corner) / rate
    if not corner < 0.5:
        raise ArgumentError("low_pass", f"must have its corner below {0.5 * rate:g} Hz")
    if math.isinf(low_pass.order):
        width = max(round(_WIDTH_OF_MEAN / corner), 1)
        return np.full(width, 1.0 / width)
    order = 2 if math.isnan(low_pass.order) else min(max(round(low_pass.order), 1), _MAX_ORDER)
    lines = 1 << math.ceil(math.log2(max(_MEMORY_CORNERS / corner, _MIN_LINES)))
    omega = np.arange(lines) * (math.pi / lines)
    s = 1j * np.tan(0.5 * omega) / math.tan(math.pi * corner)
    angles = math.pi * (2.0 * np.arange(order) + order + 1.0) / (2.0 * order)
    poles = np.exp(1j * angles)
    # The gain at half the sampling rate is zero.
    response = np.append(np.prod(-poles[:, None] / (s - poles[:, None]), axis=0), 0.0)
    return np.fft.irfft(response)[:lines]


def convolve(signal: Floats, response: Floats) -> Floats:
    """Return the filtered signal, only where the full impulse response fits."""
    size = 1 << (signal.size + response.size - 1).bit_length()
    product = np.fft.rfft(signal, size) * np.fft.rfft(response, size)
    return np.fft.irfft(product, size)[response.size - 1 : signal.size]
