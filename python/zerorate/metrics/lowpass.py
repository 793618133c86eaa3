"""The low-pass filter of the same delay."""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.metrics.series import columns, positive

Floats = npt.NDArray[np.float64]

_NEGLIGIBLE: Final = 1e-20


def equal_delay_lowpass(raw: npt.ArrayLike, rate: float, delay: float) -> Floats:
    """Return raw through the one-pole low-pass that has the given delay.

    What a filter is to be compared with in motion: nearly any smoothing can be bought with delay,
    and this is the cheapest that buys it. Its delay is that of slow motion; fast motion is late
    by less and made smaller.

    Parameters
    ----------
    raw : array_like, shape (n,) or (n, k)
        Gyro output in any unit.
    rate : float
        Samples per second, Hz.
    delay : float
        Seconds, 0 or more; 0 changes nothing.

    Returns
    -------
    ndarray of float64, the shape of `raw`
        y = a y' + (1 - a) z with a/(1 - a) = delay * rate, begun at the first sample. At a missing
        sample the output is held; before the first present one it is NaN.

    Raises
    ------
    ValueError
        If `raw` is empty, `rate` not positive and finite, or `delay` negative or not finite.

    Examples
    --------
    >>> ramp = np.arange(1000.0)
    >>> round(float((ramp - equal_delay_lowpass(ramp, rate=100.0, delay=0.05))[-1]), 9)
    5.0
    """
    z = columns("raw", raw)
    if not (math.isfinite(delay) and delay >= 0.0):
        raise ValueError(f"delay must be finite and not negative, got {delay}")
    lag = delay * positive("rate", rate)
    y = np.stack([_lowpass_present(column, lag / (1.0 + lag)) for column in z])
    return y[0] if np.ndim(raw) == 1 else np.ascontiguousarray(y.T)


def _lowpass_present(z: Floats, a: float) -> Floats:
    there = np.isfinite(z)
    if there.all():
        return _lowpass(z, a)
    filtered = np.concatenate(([np.nan], _lowpass(z[there], a)))
    held: Floats = filtered[np.cumsum(there)]
    return held


def _lowpass(z: Floats, a: float) -> Floats:
    """Filter without a loop over samples: 1/(1 - a/z) = (1 + a/z)(1 + a^2/z^2)(1 + a^4/z^4)..."""
    if z.size == 0:
        return z
    y: Floats = (1.0 - a) * (z - z[0])
    shift, weight = 1, a
    while shift < z.size and weight > _NEGLIGIBLE:
        y[shift:] += weight * y[:-shift]
        shift, weight = 2 * shift, weight * weight
    y += z[0]
    return y
