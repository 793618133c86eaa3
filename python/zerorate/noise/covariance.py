"""Variances and covariances of the estimates of one curve.

An estimate at m samples is the mean of squares of a difference D_m of the phase. C(k) is the
covariance of two such differences at a distance of k samples. For Gaussian noise, the covariance of
two estimates is the mean of 2 C(k)² over all pairs of terms. This extends Greenhall and Riley,
"Uncertainty of stability variances based on finite differences" (PTTI 2003), to two averaging
times.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from zerorate.noise.kinds import Kind
from zerorate.noise.processes import Process
from zerorate.types import Floats, Integers

# C(k) bends where a point of the shorter difference meets a point of the longer one. Number of lags
# on each side of a bend, a sixteenth of the shorter averaging time apart, and number of lags over
# the whole range.
_NEAR_LAGS: Final = 40
_FAR_LAGS: Final = 128


class CurveStatistics:
    """Means and covariances of the squared deviations of one curve.

    Parameters
    ----------
    kind : Kind
        Kind of deviation.
    m : ndarray of int, shape (t,)
        Averaging times in samples, in rising order.
    terms : ndarray of int, shape (t,)
        Number of terms in the mean of each estimate.
    processes : sequence of Process
        Noise processes that the record may contain, p processes.

    Attributes
    ----------
    variances : ndarray, shape (t, p)
        Expected squared deviation of each process at unit strength.
    """

    variances: Floats

    def __init__(
        self, kind: Kind, m: Integers, terms: Integers, processes: Sequence[Process]
    ) -> None:
        first, second = self._pairs = np.triu_indices(m.size)
        taus = m.astype(np.float64)
        a, b = taus[first, None], taus[second, None]
        spans = terms * _stride(kind, m)
        step = _step(kind, a, spans[first, None])
        lags, widths = _lag_grid(_reach(kind), a, b, step)
        pairs = _count_overlap(spans[first, None], spans[second, None], lags)
        weights = pairs * widths / (spans[first] * spans[second])[:, None]
        cross = np.stack(
            [_cross_covariance(kind, process, a, b, lags, step) for process in processes], axis=1
        )
        weighted = cross * weights[:, None, :]
        self._squares = weighted @ np.swapaxes(cross, 1, 2)
        self._sums = weighted.sum(axis=-1)
        self.variances = np.column_stack([variances(kind, m, process) for process in processes])
        self._ramp = taus / math.sqrt(2.0) if kind.order == 2 else np.zeros_like(taus)

    def covariance(self, strengths: Floats, ramp: float = 0.0) -> Floats:
        """Return the covariance of the squared deviations, shape (t, t).

        Parameters
        ----------
        strengths : ndarray, shape (p,)
            Variances of the processes.
        ramp : float
            Slope of the rate per sample. It is not random, but its products with the noise are
            random.
        """
        first, second = self._pairs
        products = (ramp * self._ramp)[first] * (ramp * self._ramp)[second]
        noise = 2.0 * (self._squares @ strengths) @ strengths
        matrix = np.zeros((len(self.variances),) * 2)
        matrix[first, second] = noise + 4.0 * products * (self._sums @ strengths)
        return matrix + np.triu(matrix, 1).T


def variances(kind: Kind, m: Integers, process: Process) -> Floats:
    """Return the expected squared deviation of a process of unit strength, shape (t,)."""
    taus = m.astype(np.float64)[:, None]
    variances: Floats = _cross_covariance(kind, process, taus, taus, np.zeros_like(taus), 1.0)[:, 0]
    return variances


def degrees_of_freedom(kind: Kind, m: Integers, terms: Integers, process: Process) -> Floats:
    """Return the degrees of freedom of estimates with one dominant process, shape (t,).

    A chi-squared variable with these degrees of freedom has the same ratio of mean to standard
    deviation.
    """
    taus = m.astype(np.float64)[:, None]
    span = (terms * _stride(kind, m))[:, None]
    step = _step(kind, taus, span)
    lags, widths = _lag_grid(_reach(kind), taus, taus, step)
    shares = _count_overlap(span, span, lags) * widths / span**2
    squares = _cross_covariance(kind, process, taus, taus, lags, step) ** 2
    freedoms: Floats = variances(kind, m, process) ** 2 / np.sum(squares * shares, axis=-1)
    return freedoms


def _stride(kind: Kind, m: Integers) -> Floats:
    """Return the distance between the terms of an estimate."""
    return np.ones(m.size) if kind.overlapping else m.astype(np.float64)


def _step(kind: Kind, shorter: Floats, span: Floats) -> Floats:
    """Return the distance of the dense lags: within an averaging time, or within few terms."""
    if not kind.overlapping:
        return shorter
    return np.maximum(np.floor(np.minimum(shorter, span) / 16.0), 1.0)


def _reach(kind: Kind) -> int:
    """Return the length of a difference in averaging times."""
    return kind.order + int(kind.modified)


def _lag_grid(reach: int, a: Floats, b: Floats, step: Floats) -> tuple[Floats, Floats]:
    """Return lags k and the share of the axis for each, shape (pairs, lags)."""
    near = step * np.arange(-_NEAR_LAGS, _NEAR_LAGS + 16 * reach + 1.0)
    kinks = [near - i * b for i in range(reach + 1)]
    margin = 2.0 * (a + b)
    left, right = -reach * b - margin, reach * a + margin
    far = step * np.round((left + (right - left) * np.linspace(0.0, 1.0, _FAR_LAGS)) / step)
    lags = np.sort(np.concatenate([*kinks, far], axis=1), axis=1)
    gaps = np.diff(lags, axis=1) / 2.0
    nothing = np.zeros_like(a)
    return lags, np.hstack((nothing, gaps)) + np.hstack((gaps, nothing))


def _count_overlap(first: Floats, second: Floats, lags: Floats) -> Floats:
    """Return the number of positions t with t in the first span and t + k in the second."""
    pairs: Floats = np.minimum(first, second - lags) - np.maximum(0.0, -lags)
    return np.maximum(pairs, 0.0)


def _cross_covariance(
    kind: Kind, process: Process, a: Floats, b: Floats, lags: Floats, step: Floats | float
) -> Floats:
    """Return C(k) of the differences at `a` and `b` samples."""
    orders = range(kind.order + 1)
    signs = [(-1) ** i * math.comb(kind.order, i) for i in orders]
    total = np.zeros(np.broadcast_shapes(lags.shape, b.shape))
    for i in orders:
        for j in orders:
            distance = lags + j * b - i * a
            total += signs[i] * signs[j] * _average_phase(kind, process, a, b, distance)
    total /= math.factorial(kind.order) * a * b
    # A covariance at a single point would get the weight of the distance to its neighbours.
    alone = process.is_point and kind.overlapping and not kind.modified
    return total / np.sqrt(step) if alone else total


def _average_phase(kind: Kind, process: Process, a: Floats, b: Floats, k: Floats) -> Floats:
    """Return s(k) of the phase, averaged over `a` and `b` samples for modified kinds."""
    if not kind.modified:
        return process.phase(k)
    s = process.summed
    return (s(k) - s(k - a) - s(k + b) + s(k + b - a)) / (a * b)
