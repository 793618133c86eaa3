"""How late an estimate is."""

from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.metrics.series import answer, columns, positive, same_shape

Floats = npt.NDArray[np.float64]


class UnseenDelay(ValueError):
    """The series show no delay, though the question was a fair one."""


_NOTHING: Final = 1e-24
_BLOCK: Final = 8192


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
    x, y = columns("reference", reference), columns("estimate", estimate)
    same_shape("reference", x, "estimate", y)
    most = round(positive("max_delay", max_delay) * positive("rate", rate))
    if not 1 <= most <= (x.shape[1] - 3) // 2:
        raise ValueError(
            f"a max_delay of {max_delay} s is {most} samples: it must be at least 1, and less "
            f"than half the record's {x.shape[1]}"
        )
    return answer([_best_lag(x[i], y[i], most) / rate for i in range(len(x))], reference)


def _best_lag(x: Floats, y: Floats, most: int) -> float:
    inner = _centred("reference", x[most:-most])
    y = _centred("estimate", y)
    best = int(np.argmax(_correlations(inner, y, most)))
    if best in (0, 2 * most):
        raise UnseenDelay("the best lag lies at the end of the range: raise max_delay")
    before, least, after = (_misfit(inner, y, lag) for lag in (best - 1, best, best + 1))
    curvature = before - 2.0 * least + after
    if not curvature > 0.0:
        raise UnseenDelay("no lag fits clearly better than its neighbours, so no delay can be seen")
    return best - most + 0.5 * (before - after) / curvature


def _centred(name: str, x: Floats) -> Floats:
    present = x[np.isfinite(x)]
    if present.size == 0:
        raise UnseenDelay(f"no sample is present in {name}")
    if present.max() == present.min():
        raise UnseenDelay(f"{name} is constant, so no delay can be seen")
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
