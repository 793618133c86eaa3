"""Fewer samples a second, without what would fold back into them."""

import math
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.identify.preparation.centring import with_gaps
from zerorate.identify.preparation.smoothing import checked_width
from zerorate.identify.records import as_record

__all__ = ["decimate"]

Floats = npt.NDArray[np.float64]

_STOP_BAND: Final = 80.0
"""Attenuation in dB; the ripple of the pass band is the same 1e-4."""

_PASS: Final = 0.8
"""End of the pass band, in the new Nyquist frequency, which is where the stop band begins."""

_BLOCK: Final = 1 << 17
"""Samples that are gathered at a time, so that they stay in the cache."""


def decimate(z: npt.ArrayLike, factor: int) -> Floats:
    """Return every so manieth sample of a record after a low-pass against aliasing.

    The low-pass is a windowed sinc (Kaiser's window) of no delay: gain 1 within 1e-4 up to 0.8 of
    the new Nyquist frequency, and 80 dB down from that frequency on.

    Parameters
    ----------
    z : array_like, shape (n,)
        Samples; those not finite are missing.
    factor : int
        Samples for each that is returned, at least 1; 1 changes nothing.

    Returns
    -------
    ndarray of float64, shape (ceil(n / factor),)
        Sample k stands at the time of z[k factor]. It is missing where the filter, which reaches
        just over 25 `factor` samples to each side, meets a missing sample or an end of the record.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers.
    ValueError
        If `z` is not one axis, the factor not a whole number from 1 on, or the record nowhere as
        long as the filter without a gap.

    Notes
    -----
    A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing, section 7.6: Kaiser's design.

    Examples
    --------
    >>> slow = decimate(np.full(1000, 2.0), 10)
    >>> slow.shape, round(float(slow[50]), 12)
    ((100,), 2.0)
    """
    record = with_gaps(as_record(z))
    if checked_width(factor, "factor") == 1:
        return record.copy()
    taps = _low_pass(factor)
    origin = record[int(np.argmax(np.isfinite(record)))]
    slow = origin + _filtered(record - origin, taps, factor)
    if not np.isfinite(slow).any():
        raise ValueError(
            f"decimation by {factor} needs {taps.size} samples in a row, and z nowhere has them"
        )
    return np.asarray(slow)


@lru_cache(maxsize=16)
def _low_pass(factor: int) -> Floats:
    """Return a symmetric filter of gain 1 with its 6 dB point amid the transition."""
    transition = math.pi * (1.0 - _PASS) / factor
    half = math.ceil((_STOP_BAND - 7.95) / (2.285 * transition) / 2.0)
    beta = 0.1102 * (_STOP_BAND - 8.7)
    cutoff = 0.5 * (1.0 + _PASS) / factor
    taps = np.sinc(cutoff * np.arange(-half, half + 1)) * np.kaiser(2 * half + 1, beta)
    taps /= taps.sum()
    taps.flags.writeable = False
    return np.asarray(taps)


def _filtered(record: Floats, taps: Floats, factor: int) -> Floats:
    """Convolve where a sample is kept only; beyond its ends the record is missing."""
    half = taps.size // 2
    padded = np.pad(record, half, constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(padded, taps.size)[::factor]
    rows = max(_BLOCK // taps.size, 1)
    parts = [windows[i : i + rows].copy() @ taps for i in range(0, len(windows), rows)]
    return np.concatenate(parts)
