"""Measures of a drift filter, each of which hides something another one shows.

A deviation at rest is won by any strong low-pass filter, so `reduction` never stands alone:
`coasting_error` asks what a wrong bias costs, `delay` and `equal_delay_lowpass` what the filter
costs in motion, `regret` how far it is from the best possible, `nis` whether it knows how good it
is. All take one channel (n,) or several (n, k) and answer with a float or with k of them. A NaN
or infinite sample is a missing one and is left out, never filled in.
"""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

__all__ = [
    "coasting_error",
    "delay",
    "equal_delay_lowpass",
    "mean_shift",
    "nis",
    "reduction",
    "regret",
    "rmse",
]

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

_NEGLIGIBLE: Final = 1e-20
_NOTHING: Final = 1e-24
_BLOCK: Final = 8192


def reduction(raw: npt.ArrayLike, filtered: npt.ArrayLike) -> float | Floats:
    """Return the standard deviation after the filter over that before it.

    It says how quiet the output is, the figure most papers print. It hides delay, lost motion and
    whether the level is right: a constant scores 0.

    Parameters
    ----------
    raw, filtered : array_like, shape (n,) or (n, k)
        The same samples before and after, in any one unit.

    Returns
    -------
    float or ndarray, shape (k,)
        Ratio, 1 for an unchanged signal; samples missing in either are left out of both.

    Raises
    ------
    ValueError
        If the shapes differ, no sample is present in both, or `raw` is constant.

    Examples
    --------
    >>> reduction([1.0, -1.0, 1.0, -1.0], [0.5, -0.5, 0.5, -0.5])
    0.5
    """
    pairs = _pairs("raw", raw, "filtered", filtered)
    return _answer([y.std() / _spread(z) for z, y in pairs], raw)


def mean_shift(raw: npt.ArrayLike, filtered: npt.ArrayLike) -> float | Floats:
    """Return how far the filter moved the mean, in standard deviations of the raw signal.

    It catches a filter that is quiet at the wrong level. It hides errors that cancel over the
    record, and counts a filter's start-up as a shift: leave the start-up out.

    Parameters
    ----------
    raw, filtered : array_like, shape (n,) or (n, k)
        The same samples before and after, in any one unit.

    Returns
    -------
    float or ndarray, shape (k,)
        (mean filtered - mean raw) / deviation of raw, over the samples present in both.

    Raises
    ------
    ValueError
        If the shapes differ, no sample is present in both, or `raw` is constant.

    Examples
    --------
    >>> mean_shift([1.0, -1.0, 1.0, -1.0], [0.5, 0.5, 0.5, 0.5])
    0.5
    """
    pairs = _pairs("raw", raw, "filtered", filtered)
    return _answer([(y - z).mean() / _spread(z) for z, y in pairs], raw)


def rmse(reference: npt.ArrayLike, estimate: npt.ArrayLike) -> float | Floats:
    """Return the root mean square of estimate minus reference.

    It needs a reference, and counts noise, bias and delay as one; beside it belongs the same
    figure for `equal_delay_lowpass`.

    Parameters
    ----------
    reference, estimate : array_like, shape (n,) or (n, k)
        The same samples in any one unit.

    Returns
    -------
    float or ndarray, shape (k,)
        In the unit of the data, over the samples present in both.

    Raises
    ------
    ValueError
        If the shapes differ or no sample is present in both.

    Examples
    --------
    >>> rmse([0.0, 0.0], [3.0, -3.0])
    3.0
    """
    pairs = _pairs("reference", reference, "estimate", estimate)
    return _answer([_rms(y - x) for x, y in pairs], reference)


def regret(estimate: npt.ArrayLike, truth: npt.ArrayLike, optimal: npt.ArrayLike) -> float | Floats:
    """Return the error of an estimate over that of the best estimate possible.

    1 is perfect. It needs simulated data, so it hides whatever real noise has and the simulation
    has not. For several seeds, put their records one after another and call this once: a mean of
    single ratios is ruled by lucky denominators.

    Parameters
    ----------
    estimate, truth : array_like, shape (n,) or (n, k)
        The filter's drift and the true one, `zerorate.simulate`'s second result.
    optimal : array_like, shape (n,) or (n, k)
        What the Kalman filter that knows the true model makes of the same signal.

    Returns
    -------
    float or ndarray, shape (k,)
        RMSE of `estimate` over RMSE of `optimal`, over the samples present in all three.

    Raises
    ------
    ValueError
        If the shapes differ, no sample is present in all, or `optimal` is without error.

    Examples
    --------
    >>> regret([2.0, -2.0], [0.0, 0.0], [1.0, -1.0])
    2.0
    """
    x, y, best = (
        _columns("truth", truth),
        _columns("estimate", estimate),
        _columns("optimal", optimal),
    )
    _same_shape("truth", x, "estimate", y)
    _same_shape("truth", x, "optimal", best)
    ratios = []
    for i in range(len(x)):
        both = _present(x[i], y[i], best[i])
        least = _rms(best[i][both] - x[i][both])
        if least == 0.0:
            raise ValueError("optimal equals truth, so there is no error to compare with")
        ratios.append(_rms(y[i][both] - x[i][both]) / least)
    return _answer(ratios, truth)


def nis(innovation: npt.ArrayLike, innovation_variance: npt.ArrayLike) -> float | Floats:
    """Return the mean normalised innovation squared, mean(e^2 / S).

    1 for a filter whose covariance is honest, more for one too sure of itself, less for one too
    careful. It hides correlation: a perfect 1 at rest says nothing of motion, nor that the
    innovations are white.

    Parameters
    ----------
    innovation : array_like, shape (n,) or (n, k)
        Measurement minus prediction.
    innovation_variance : array_like, the same shape, or one that broadcasts to it
        The filter's own variance S of the innovation, in the unit of the data squared.

    Returns
    -------
    float or ndarray, shape (k,)
        Over the samples present in both; of n independent innovations the standard deviation is
        sqrt(2/n).

    Raises
    ------
    ValueError
        If the shapes do not fit, no sample is present in both, or a variance is not positive.

    Examples
    --------
    >>> nis([1.0, -1.0, 3.0, -3.0], 5.0)
    1.0
    """
    shape = np.shape(innovation)
    try:
        variance = np.broadcast_to(np.asarray(innovation_variance, dtype=np.float64), shape)
    except ValueError:
        raise ValueError(
            f"innovation_variance of shape {np.shape(innovation_variance)} does not fit "
            f"innovation of shape {shape}"
        ) from None
    if np.any(variance <= 0.0):
        raise ValueError("innovation_variance must be positive")
    pairs = _pairs("innovation", innovation, "innovation_variance", variance)
    return _answer([float(np.mean(e * e / s)) for e, s in pairs], innovation)


def coasting_error(
    raw: npt.ArrayLike, estimate: npt.ArrayLike, rate: float, horizon: float
) -> float | Floats:
    """Return the angle error of holding each estimate through the next `horizon` seconds.

    The estimate of time t is held, raw minus it integrated over the samples after t up to
    t + horizon, and the RMS of that angle taken over all t. It is what a wrong bias costs a user,
    and needs no truth, but a sensor at rest: turning counts as error. White noise of density N
    alone leaves N sqrt(horizon), so for short horizons every filter looks alike.

    Parameters
    ----------
    raw, estimate : array_like, shape (n,) or (n, k)
        Gyro output at rest and the estimate of its bias or drift, in any one unit.
    rate : float
        Samples per second, Hz.
    horizon : float
        Seconds to coast, rounded to whole samples.

    Returns
    -------
    float or ndarray, shape (k,)
        In the unit of the data times seconds. Times whose window holds a missing raw sample, or
        whose estimate is missing, are left out.

    Raises
    ------
    ValueError
        If the shapes differ, `rate` or `horizon` is not positive and finite, the horizon is less
        than half a sample or not shorter than the record, or no window is complete.

    Examples
    --------
    >>> coasting_error([1.0] * 5, [1.5] * 5, rate=1.0, horizon=2.0)
    1.0
    """
    z, x = _columns("raw", raw), _columns("estimate", estimate)
    _same_shape("raw", z, "estimate", x)
    m = round(_positive("horizon", horizon) * _positive("rate", rate))
    if not 1 <= m < z.shape[1]:
        raise ValueError(
            f"a horizon of {horizon} s is {m} samples: it must be at least 1 and less than the "
            f"record's {z.shape[1]}"
        )
    return _answer([_coast(z[i], x[i], m) / rate for i in range(len(z))], raw)


def _coast(z: Floats, x: Floats, m: int) -> float:
    """Return the RMS over t of sum(z[t+1..t+m]) - m x[t], through one cumulative sum."""
    sums = np.array(z)
    missing = ~np.isfinite(sums)
    gaps = np.cumsum(missing) if missing.any() else None
    sums[missing] = 0.0
    # Sums stay small, and so exact, when the level is taken out first.
    level = float(sums.mean())
    sums -= level
    sums[missing] = 0.0
    np.cumsum(sums, out=sums)
    square, count = 0.0, 0
    for start in range(0, z.size - m, _BLOCK):
        now = slice(start, min(start + _BLOCK, z.size - m))
        then = slice(now.start + m, now.stop + m)
        angle = sums[then] - sums[now] - m * (x[now] - level)
        usable = np.isfinite(angle)
        if gaps is not None:
            usable &= gaps[then] == gaps[now]
        angle = angle[usable]
        square, count = square + float(np.dot(angle, angle)), count + angle.size
    if count == 0:
        raise ValueError("no window of the horizon's length is free of missing samples")
    return math.sqrt(square / count)


def delay(
    reference: npt.ArrayLike, estimate: npt.ArrayLike, rate: float, max_delay: float = 1.0
) -> float | Floats:
    """Return how far an estimate lags behind a reference, in seconds.

    The lag at which the two correlate best, and there a parabola through three values of the
    least-squares misfit for the part below a sample. Offset and gain do not count. It is one
    number for a filter whose delay depends on frequency, weighted as the record's motion is, and
    means nothing for a record at rest.

    Parameters
    ----------
    reference, estimate : array_like, shape (n,) or (n, k)
        A true or independently measured rate, and the filter's output, in one unit.
    rate : float
        Samples per second, Hz.
    max_delay : float
        Lags from -max_delay to max_delay seconds are searched, default 1. The reference's first
        and last `max_delay` seconds are not used, so that every lag is judged on the same samples.

    Returns
    -------
    float or ndarray, shape (k,)
        Seconds, negative if the estimate leads.

    Raises
    ------
    ValueError
        If the shapes differ, `rate` or `max_delay` is not positive and finite or less than a
        sample, the record is not longer than twice `max_delay`, a series is constant, or the best
        lag is not a clear one inside the range.

    Examples
    --------
    >>> t = np.arange(0.0, 20.0, 0.01)
    >>> round(delay(np.sin(t), np.sin(t - 0.125), rate=100.0), 4)
    0.125
    """
    x, y = _columns("reference", reference), _columns("estimate", estimate)
    _same_shape("reference", x, "estimate", y)
    most = round(_positive("max_delay", max_delay) * _positive("rate", rate))
    if not 1 <= most <= (x.shape[1] - 3) // 2:
        raise ValueError(
            f"a max_delay of {max_delay} s is {most} samples: it must be at least 1, and less "
            f"than half the record's {x.shape[1]}"
        )
    return _answer([_best_lag(x[i], y[i], most) / rate for i in range(len(x))], reference)


def _best_lag(x: Floats, y: Floats, most: int) -> float:
    inner = _centred("reference", x[most:-most])
    y = _centred("estimate", y)
    best = int(np.argmax(_correlations(inner, y, most)))
    if best in (0, 2 * most):
        raise ValueError("the best lag lies at the end of the range: raise max_delay")
    before, least, after = (_misfit(inner, y, lag) for lag in (best - 1, best, best + 1))
    curvature = before - 2.0 * least + after
    if not curvature > 0.0:
        raise ValueError("no lag fits clearly better than its neighbours, so no delay can be seen")
    return best - most + 0.5 * (before - after) / curvature


def _centred(name: str, x: Floats) -> Floats:
    present = x[np.isfinite(x)]
    if present.size == 0:
        raise ValueError(f"no sample is present in {name}")
    if present.max() == present.min():
        raise ValueError(f"{name} is constant, so no delay can be seen")
    # Offset and gain do not count, and numbers of order 1 neither overflow nor vanish when squared.
    mean = float(present.mean())
    scaled: Floats = (x - mean) / max(present.max() - mean, mean - present.min())
    return scaled


def _misfit(inner: Floats, y: Floats, start: int) -> float:
    """Return the share of the reference's variance that the shifted estimate leaves unexplained."""
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


def _correlations(inner: Floats, y: Floats, most: int) -> Floats:
    """Return the correlation coefficient at each lag, its sums made by transforms of blocks."""
    span = 2 * most
    size = max(_BLOCK, 1 << (4 * span).bit_length())
    block = size - span
    spectra = np.zeros((6, size // 2 + 1), dtype=np.complex128)
    for start in range(0, inner.size, block):
        w, x, xx = _spectra(inner[start : start + block], size).conj()
        v, z, zz = _spectra(y[start : start + size], size)
        spectra += np.stack((w * v, x * v, w * z, x * z, xx * v, w * zz))
    count, x, z, xz, xx, zz = np.fft.irfft(spectra, size)[:, : span + 1]
    n = np.maximum(np.rint(count), 1.0)
    # Where one series does not vary at a lag, rounding must not look like correlation.
    floor = max(_NOTHING * abs(xx).max() * abs(zz).max(), np.finfo(np.float64).tiny)
    variances = np.maximum((xx - x * x / n) * (zz - z * z / n), floor)
    correlations: Floats = (xz - x * z / n) / np.sqrt(variances)
    return correlations


def _spectra(x: Floats, size: int) -> npt.NDArray[np.complex128]:
    """Return spectra of the presence, the values and the squares of one block."""
    there = np.isfinite(x)
    values = np.where(there, x, 0.0)
    return np.fft.rfft(np.stack((there, values, values * values)), size)


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
    z = _columns("raw", raw)
    if not (math.isfinite(delay) and delay >= 0.0):
        raise ValueError(f"delay must be finite and not negative, got {delay}")
    lag = delay * _positive("rate", rate)
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


def _columns(name: str, data: npt.ArrayLike) -> Floats:
    """Return the channels as rows, without copying."""
    array = np.asarray(data, dtype=np.float64)
    if array.ndim not in (1, 2):
        raise ValueError(f"{name} must have shape (n,) or (n, k), got {array.shape}")
    if array.size == 0:
        raise ValueError(f"{name} is empty")
    return array.reshape(len(array), -1).T


def _same_shape(first: str, x: Floats, second: str, y: Floats) -> None:
    if x.shape != y.shape:
        raise ValueError(
            f"{first} and {second} must have the same shape, got {x.shape[::-1]} and "
            f"{y.shape[::-1]} (samples, channels)"
        )


def _pairs(
    first: str, a: npt.ArrayLike, second: str, b: npt.ArrayLike
) -> list[tuple[Floats, Floats]]:
    """Return the samples present in both, channel by channel."""
    x, y = _columns(first, a), _columns(second, b)
    _same_shape(first, x, second, y)
    return [_common(u, v) for u, v in zip(x, y, strict=True)]


def _common(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    there = _present(x, y)
    return (x, y) if there.all() else (x[there], y[there])


def _present(*series: Floats) -> Flags:
    there = np.isfinite(series[0])
    for other in series[1:]:
        there &= np.isfinite(other)
    if not there.any():
        raise ValueError("no sample is present in every series")
    return there


def _spread(z: Floats) -> float:
    # The deviation of equal samples may come out as a rounding error instead of 0.
    if z.max() == z.min():
        raise ValueError("raw is constant, so it has no deviation to compare with")
    return float(z.std())


def _rms(x: Floats) -> float:
    return math.sqrt(float(np.dot(x, x)) / x.size)


def _positive(name: str, value: float) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{name} must be positive and finite, got {value}")
    return float(value)


def _answer(values: list[float], like: npt.ArrayLike) -> float | Floats:
    return float(values[0]) if np.ndim(like) == 1 else np.array(values, dtype=np.float64)
