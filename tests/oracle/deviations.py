"""Deviations of the Allan family by their printed sums, term by term (NIST SP 1065, section 5)."""

import math

import numpy as np

__all__ = ["KINDS", "deviation"]


def deviation(z, m, kind):
    """Deviation and number of terms of a record with gaps; NaN and 0 without a term."""
    squares, scale = KINDS[kind]
    mean = np.nanmean(np.where(np.isfinite(z), z, np.nan)) if np.isfinite(z).any() else 0.0
    terms = [t for rates in stretches(z) for t in squares(rates - mean, m)]
    if not terms:
        return math.nan, 0
    return scale(m) * math.sqrt(sum(terms) / len(terms)), len(terms)


def stretches(z):
    """Pieces of a record without a missing sample."""
    missing = np.flatnonzero(~np.isfinite(z))
    return [piece[np.isfinite(piece)] for piece in np.split(z, missing)]


def phase(rates):
    return np.concatenate(([0.0], np.cumsum(rates)))


def adev(rates, m, step=None):
    x = phase(rates)
    return [(x[i + 2 * m] - 2 * x[i + m] + x[i]) ** 2 for i in range(0, len(x) - 2 * m, step or m)]


def oadev(rates, m):
    return adev(rates, m, 1)


def hdev(rates, m, step=None):
    x = phase(rates)
    return [
        (x[i + 3 * m] - 3 * x[i + 2 * m] + 3 * x[i + m] - x[i]) ** 2
        for i in range(0, len(x) - 3 * m, step or m)
    ]


def ohdev(rates, m):
    return hdev(rates, m, 1)


def mdev(rates, m):
    x = phase(rates)
    return [
        sum(x[i + 2 * m] - 2 * x[i + m] + x[i] for i in range(j, j + m)) ** 2
        for j in range(len(x) - 3 * m + 1)
    ]


def totdev(rates, m):
    x = phase(rates)
    last = len(x) - 1
    if m > last:
        return []
    before = [2 * x[0] - x[j] for j in range(last, 0, -1)]
    after = [2 * x[last] - x[last - j] for j in range(1, last + 1)]
    y = [*before, *x, *after]
    return [(y[i - m] - 2 * y[i] + y[i + m]) ** 2 for i in range(last + 1, 2 * last)]


def windowed(values, m):
    """Mean square, over the positions in each reflected window, of differences of averages."""
    return [mean_square(values[i : i + 3 * m], m) for i in range(len(values) - 3 * m + 1)]


def mean_square(window, m):
    n = len(window)
    half = n // 2
    slope = (window[n - half :].mean() - window[:half].mean()) / (n - half)
    window = window - slope * np.arange(n)
    y = np.concatenate((window[::-1], window, window[::-1]))
    third = [
        y[p + 2 * m : p + 3 * m].mean() - 2 * y[p + m : p + 2 * m].mean() + y[p : p + m].mean()
        for p in range(6 * m)
    ]
    return np.mean(np.square(third))


def mtotdev(rates, m):
    return windowed(phase(rates), m)


def htotdev(rates, m):
    return ohdev(rates, 1) if m == 1 else windowed(rates, m)


def theo1(rates, m):
    x = phase(rates)
    if m < 10 or m % 2:
        return []
    return [
        sum(
            ((x[i] - x[i - d + m // 2]) + (x[i + m] - x[i + d + m // 2])) ** 2 / (m // 2 - d)
            for d in range(m // 2)
        )
        for i in range(len(x) - m)
    ]


def pdev(rates, m):
    x = phase(rates)
    if m == 1:
        return oadev(rates, 1)
    return [
        sum(((m - 1) / 2 - k) * (x[i + k] - x[i + k + m]) for k in range(m)) ** 2
        for i in range(len(x) - 2 * m)
    ]


KINDS = {
    "adev": (adev, lambda m: math.sqrt(1 / 2) / m),
    "oadev": (oadev, lambda m: math.sqrt(1 / 2) / m),
    "mdev": (mdev, lambda m: math.sqrt(1 / 2) / m**2),
    "tdev": (mdev, lambda m: math.sqrt(1 / 6) / m),
    "hdev": (hdev, lambda m: math.sqrt(1 / 6) / m),
    "ohdev": (ohdev, lambda m: math.sqrt(1 / 6) / m),
    "totdev": (totdev, lambda m: math.sqrt(1 / 2) / m),
    "mtotdev": (mtotdev, lambda m: math.sqrt(1 / 2) / m),
    "ttotdev": (mtotdev, lambda m: math.sqrt(1 / 6)),
    "htotdev": (htotdev, lambda m: math.sqrt(1 / 6)),
    "theo1": (theo1, lambda m: math.sqrt(4 / 3) / m),
    "pdev": (pdev, lambda m: math.sqrt(1 / 2) if m == 1 else math.sqrt(72) / m**3),
}
