"""Errors in motion: delay, error without delay, and a low-pass filter of equal delay."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.metrics.channels import (
    check_positive,
    check_same_shape,
    columns,
    is_single,
    per_channel,
)
from zerorate.metrics.truth import rmse
from zerorate.record.named import rate_of
from zerorate.types import Floats
from zerorate.units import whole_samples


@dataclass(frozen=True, eq=False)
class MotionError:
    """Errors against a reference rate, as floats, or as arrays of shape (k,) for k channels.

    Attributes
    ----------
    rmse : float or ndarray
        RMS error in the unit of the data.
    delay : float or ndarray
        Delay of the estimate, s; NaN if it is not determined.
    rmse_undelayed : float or ndarray
        RMS error after removal of the delay; NaN if the delay is not determined.
    rmse_lowpass : float or ndarray
        RMS error of the raw signal after a one-pole low-pass filter with the same delay, or with no
        delay if the estimate leads. NaN if the raw signal or the delay is not known.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.metrics import motion_error
    >>> t = np.arange(0.0, 20.0, 0.01)
    >>> found = motion_error(np.sin(t), np.sin(t - 0.1), rate=100.0)
    >>> round(found.delay, 3), bool(found.rmse_undelayed < found.rmse)
    (0.1, True)
    """

    rmse: float | Floats
    delay: float | Floats
    rmse_undelayed: float | Floats
    rmse_lowpass: float | Floats


def motion_error(
    reference: npt.ArrayLike,
    estimate: npt.ArrayLike,
    rate: float | None = None,
    max_delay: float = 1.0,
    raw: npt.ArrayLike | None = None,
) -> MotionError:
    """Return the error of an estimate against a reference rate, with and without its delay.

    Any filter can reduce noise by delay. Compare its error with `rmse_lowpass`, the error of a
    low-pass filter with the same delay. `rmse_undelayed` is for users who can wait for the output.

    Parameters
    ----------
    reference, estimate : array_like, shape (n,) or (n, k)
        True or independently measured rate, and the filter's output, in the same unit.
    rate : float
        Sampling rate, Hz. Default: the rate of a `Log`.
    max_delay : float, default 1
        Longest delay to search, s (see `delay`).
    raw : array_like, the same shape, optional
        Output of the gyro, for `rmse_lowpass`.

    Returns
    -------
    MotionError
        Errors over the samples present in both.

    Raises
    ------
    ValueError
        If the shapes differ or no sample is present in both. If `rate` or `max_delay` is not
        positive and finite. If `max_delay` is less than a sample, or at least half of the record.

    Notes
    -----
    To remove the delay, the reference is shifted by cubic interpolation through four samples.
    Interpolation of the estimate would average its noise and reduce its error.

    Examples
    --------
    >>> t = np.arange(0.0, 20.0, 0.01)
    >>> found = motion_error(np.sin(t), np.sin(t - 0.125), rate=100.0)
    >>> round(found.delay, 4), found.rmse > 0.08, found.rmse_undelayed < 1e-5
    (0.125, True, True)
    """
    x, y = columns("reference", reference), columns("estimate", estimate)
    check_same_shape("reference", x, "estimate", y)
    z = None if raw is None else columns("raw", raw)
    if z is not None:
        check_same_shape("reference", x, "raw", z)
    hertz = rate_of(rate, reference, estimate, raw)
    rows = [
        _channel_errors(x[i], y[i], None if z is None else z[i], hertz, max_delay)
        for i in range(len(x))
    ]
    return MotionError(*(per_channel(values, reference) for values in zip(*rows, strict=True)))


def _channel_errors(
    x: Floats, y: Floats, z: Floats | None, rate: float, max_delay: float
) -> tuple[float, float, float, float]:
    total = float(rmse(x, y))
    try:
        lag = float(delay(x, y, rate, max_delay))
    except UndeterminedDelayError:
        return total, math.nan, math.nan, math.nan
    lowpass = math.nan
    if z is not None:
        smooth = equal_delay_lowpass(z, rate, max(lag, 0.0))
        # The output held through a gap does not count.
        lowpass = float(rmse(x, np.where(np.isfinite(z), smooth, np.nan)))
    return total, lag, float(rmse(shift_samples(x, lag * rate), y)), lowpass


class UndeterminedDelayError(ValueError):
    """Error for valid series with an undetermined delay."""


_VARIANCE_FLOOR: Final = 1e-24
_BLOCK_SAMPLES: Final = 8192


def delay(
    reference: npt.ArrayLike,
    estimate: npt.ArrayLike,
    rate: float | None = None,
    max_delay: float = 1.0,
) -> float | Floats:
    """Return the lag of an estimate behind a reference, in seconds.

    The result is the lag with the best correlation. A parabola through three values of the
    least-squares misfit refines it below one sample. Offset and gain of the estimate have no
    effect. If a filter's delay depends on frequency, the result is a mean weighted by the record's
    motion. For a record at rest the result is meaningless.

    Parameters
    ----------
    reference, estimate : array_like, shape (n,) or (n, k)
        True or independently measured rate, and the filter's output, in the same unit.
    rate : float
        Sampling rate, Hz. Default: the rate of a `Log`.
    max_delay : float
        Lags from -max_delay to max_delay are searched, s. Default 1. The first and last `max_delay`
        seconds of the reference are not used, so that all lags are compared on the same samples.

    Returns
    -------
    float or ndarray, shape (k,)
        Delay, s; negative if the estimate leads.

    Raises
    ------
    ValueError
        If the shapes differ. If `rate` or `max_delay` is not positive and finite. If `max_delay` is
        less than a sample, or at least half of the record. If a series is constant. If no lag
        inside the range is clearly the best.

    Examples
    --------
    >>> t = np.arange(0.0, 20.0, 0.01)
    >>> round(delay(np.sin(t), np.sin(t - 0.125), rate=100.0), 4)
    0.125
    """
    x, y = columns("reference", reference), columns("estimate", estimate)
    check_same_shape("reference", x, "estimate", y)
    hertz = rate_of(rate, reference, estimate)
    max_lag = whole_samples(check_positive("max_delay", max_delay), hertz)
    if not 1 <= max_lag <= (x.shape[1] - 3) // 2:
        raise ValueError(
            f"a max_delay of {max_delay} s is {max_lag} samples: it must be at least 1, and less "
            f"than half the record's {x.shape[1]}"
        )
    return per_channel([_find_lag(x[i], y[i], max_lag) / hertz for i in range(len(x))], reference)


def _find_lag(x: Floats, y: Floats, max_lag: int) -> float:
    inner = _normalise("reference", x[max_lag:-max_lag])
    y = _normalise("estimate", y)
    best = int(np.argmax(_lag_correlations(inner, y, max_lag)))
    if best in (0, 2 * max_lag):
        raise UndeterminedDelayError("the best lag lies at the end of the range: raise max_delay")
    before, least, after = (_misfit(inner, y, lag) for lag in (best - 1, best, best + 1))
    curvature = before - 2.0 * least + after
    if not curvature > 0.0:
        raise UndeterminedDelayError(
            "no lag fits clearly better than its neighbours, so no delay can be seen"
        )
    return best - max_lag + 0.5 * (before - after) / curvature


def _normalise(name: str, x: Floats) -> Floats:
    present = x[np.isfinite(x)]
    if present.size == 0:
        raise UndeterminedDelayError(f"no sample is present in {name}")
    if present.max() == present.min():
        raise UndeterminedDelayError(f"{name} is constant, so no delay can be seen")
    # Normalise: offset and gain have no effect, and squares of numbers near 1 are safe.
    mean = float(present.mean())
    scaled: Floats = (x - mean) / max(present.max() - mean, mean - present.min())
    return scaled


def _misfit(inner: Floats, y: Floats, start: int) -> float:
    """Return the share of the reference's variance that the shifted estimate does not explain."""
    shifted = y[start : start + inner.size]
    there = np.isfinite(inner) & np.isfinite(shifted)
    if not there.any():
        return 1.0
    x, z = inner[there], shifted[there]
    x, z = x - x.mean(), z - z.mean()
    total, power = float(np.dot(x, x)), float(np.dot(z, z))
    if total == 0.0 or power == 0.0:
        return 1.0
    rest = x - max(float(np.dot(x, z)), 0.0) / power * z
    return float(np.dot(rest, rest)) / total


def _lag_correlations(inner: Floats, y: Floats, max_lag: int) -> Floats:
    """Return the correlation coefficient at each lag, from transforms of blocks."""
    span = 2 * max_lag
    size = max(_BLOCK_SAMPLES, 1 << (4 * span).bit_length())
    block = size - span
    spectra = np.zeros((6, size // 2 + 1), dtype=np.complex128)
    for start in range(0, inner.size, block):
        w, x, xx = _spectra(inner[start : start + block], size).conj()
        v, z, zz = _spectra(y[start : start + size], size)
        spectra += np.stack((w * v, x * v, w * z, x * z, xx * v, w * zz))
    count, x, z, xz, xx, zz = np.fft.irfft(spectra, size)[:, : span + 1]
    n = np.maximum(np.rint(count), 1.0)
    # If a series is constant at a lag, rounding errors must not look like correlation.
    floor = max(_VARIANCE_FLOOR * abs(xx).max() * abs(zz).max(), np.finfo(np.float64).tiny)
    variances = np.maximum((xx - x * x / n) * (zz - z * z / n), floor)
    correlations: Floats = (xz - x * z / n) / np.sqrt(variances)
    return correlations


def _spectra(x: Floats, size: int) -> npt.NDArray[np.complex128]:
    """Return the spectra of the mask, the values and the squares of one block."""
    there = np.isfinite(x)
    values = np.where(there, x, 0.0)
    return np.fft.rfft(np.stack((there, values, values * values)), size)


_MIN_WEIGHT: Final = 1e-20


def equal_delay_lowpass(raw: npt.ArrayLike, rate: float | None, delay: float) -> Floats:
    """Return the raw samples after the one-pole low-pass with a given delay.

    Use this output to compare filters in motion: it is the simplest smoothing with a given delay.
    The given delay applies to slow motion. Fast motion has less delay and is attenuated.

    Parameters
    ----------
    raw : array_like, shape (n,) or (n, k)
        Gyro output in any unit.
    rate : float or None
        Sampling rate, Hz. None: the rate of a `Log`.
    delay : float
        Delay, s, not negative; 0 changes nothing.

    Returns
    -------
    ndarray of float64, the shape of `raw`
        y = a y' + (1 - a) z with a/(1 - a) = delay * rate. y' is the previous output; the first
        output is the first sample. At a missing sample the output is held; before the first present
        sample it is NaN.

    Raises
    ------
    ValueError
        If `raw` is empty. If `rate` is not positive and finite. If `delay` is negative or not
        finite.

    Examples
    --------
    >>> ramp = np.arange(1000.0)
    >>> round(float((ramp - equal_delay_lowpass(ramp, rate=100.0, delay=0.05))[-1]), 9)
    5.0
    """
    z = columns("raw", raw)
    if not (math.isfinite(delay) and delay >= 0.0):
        raise ArgumentError("delay", f"must be finite and not negative, got {delay}")
    lag = delay * rate_of(rate, raw)
    y = np.stack([_lowpass_with_gaps(column, lag / (1.0 + lag)) for column in z])
    return y[0] if is_single(raw) else np.ascontiguousarray(y.T)


def _lowpass_with_gaps(z: Floats, a: float) -> Floats:
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
    while shift < z.size and weight > _MIN_WEIGHT:
        y[shift:] += weight * y[:-shift]
        shift, weight = 2 * shift, weight * weight
    y += z[0]
    return y


_CUBIC_NODES: Final = (-1.0, 0.0, 1.0, 2.0)


def shift_samples(x: Floats, samples: float) -> Floats:
    """Return one row shifted to later times by a number of samples, with cubic interpolation.

    The cubic uses four samples. The result is NaN if one of them is missing or outside the record.
    """
    offset = math.floor(-samples)
    weights = _cubic_weights(-samples - offset)
    first = np.arange(x.size) + offset - 1
    inside = (first >= 0) & (first + len(_CUBIC_NODES) <= x.size)
    start = first[inside]
    known = np.where(np.isfinite(x), x, np.nan)
    shifted = np.full(x.size, np.nan)
    shifted[inside] = sum(w * known[start + i] for i, w in enumerate(weights))
    return shifted


def _cubic_weights(part: float) -> list[float]:
    return [
        math.prod((part - other) / (node - other) for other in _CUBIC_NODES if other != node)
        for node in _CUBIC_NODES
    ]
