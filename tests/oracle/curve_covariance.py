"""Covariance of two squared deviations, summed over all pairs of their terms."""

import math

import numpy as np

__all__ = ["covariance", "weights"]


def weights(kind, m):
    """Weights of the phase in one term, so that the mean of its square is the squared deviation."""
    difference = np.zeros(kind.order * m + 1)
    difference[::m] = [(-1) ** i * math.comb(kind.order, i) for i in range(kind.order + 1)]
    if kind.modified:
        difference = np.convolve(difference, np.ones(m) / m)
    return difference / (m * math.sqrt(math.factorial(kind.order)))


def covariance(kind, factors, terms, phase):
    """Covariance of the squared deviations at two factors, of Gaussian noise.

    `phase` is the generalised autocovariance s(k) of the noise's phase. The product of two
    squares of Gaussian variables of covariance C varies together by 2 C^2.
    """
    (a, b), strides = factors, [1 if kind.overlapping else m for m in factors]
    first, second = (np.arange(n) * stride for n, stride in zip(terms, strides, strict=True))
    products = np.convolve(weights(kind, b), weights(kind, a)[::-1])
    least, most = -first[-1], second[-1]
    start = least - weights(kind, a).size + 1
    s = phase(np.arange(start, most + weights(kind, b).size, dtype=float))
    by_distance = np.correlate(s, products)
    distances = second - first[:, np.newaxis]
    return 2.0 * np.mean(by_distance[distances - least] ** 2)
