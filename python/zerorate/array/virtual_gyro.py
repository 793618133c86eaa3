"""Weights that fuse several gyros into one, with the gain and its error."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.types import Floats
from zerorate.views import Result

WeightsName: TypeAlias = Literal["drift", "white", "mean"]
_WEIGHTS_NAMES: Final = ("drift", "white", "mean")

# Length of record per degree of freedom of the drift, s, if drift equals white noise at about
# 200 s.
_SECONDS_PER_FREEDOM: Final = 256.0
_MIN_SECONDS_PER_GYRO: Final = 900.0
"""Length of record that drift weights need for each gyro, s."""
# Gyros follow the model of white noise and random walk to some ten percent at best.
_MAX_FREEDOM: Final = 200.0
# With these degrees of freedom, deviations are accurate to a fifth.
_MIN_KNOWN_FREEDOM: Final = 12.0
_MAX_ITERATIONS: Final = 50
_CONVERGENCE_TOLERANCE: Final = 1e-10
_RIDGE: Final = 1e-13
_TOO_FEW_TAUS: Final = (
    "a virtual gyro needs two averaging times, an octave apart, that fit twice into an eighth of "
    "the record"
)


@dataclass(frozen=True, eq=False)
class VirtualGyro(Result):
    """Weights that fuse several gyros into one.

    Attributes
    ----------
    weights : ndarray, shape (N,)
        Weight of each gyro. The sum is 1. A gyro has a negative weight if its drift is correlated
        with the other gyros' drift and larger than theirs.
    gain : float
        Deviation of the plain mean divided by the deviation of the weighted mean, at the horizon.
        It is computed on parts of the record that did not determine the weights.
    gain_error : float
        Standard error of `gain`.
    shrinkage : float
        Shrinkage of the covariance towards its diagonal, 0 to 1. At 1 no correlation is used.
    horizon : float
        Averaging time of `gain`, s.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> z = np.random.default_rng(1).standard_normal((60_000, 2)) * [1.0, 2.0]  # one is noisier
    >>> gyro = zr.array.allan_covariance(z, rate=100.0).virtual_gyro(horizon=1.0, weights="white")
    >>> gyro.weights.round(2).tolist(), bool(gyro.gain > 1.0)
    ([0.79, 0.21], True)
    """

    weights: Floats
    gain: float
    gain_error: float
    shrinkage: float
    horizon: float


class Noise(NamedTuple):
    """White noise R and drift Q of several gyros; their Allan covariance is R/tau + Q tau/3.

    Attributes
    ----------
    white, drift : ndarray, shape (N, N)
    """

    white: Floats
    drift: Floats

    def at(self, horizon: float) -> Floats:
        """Return the scaled covariance at an averaging time; at infinity it is the drift."""
        white, drift = _noise_shares(horizon)
        return self.white * white + self.drift * drift


class Parts(NamedTuple):
    """Sums over the parts of a record, at t averaging times, one per octave.

    Attributes
    ----------
    tau, edf, terms : ndarray, shape (t,)
        Averaging times, s, degrees of freedom, and numbers of terms of the whole record.
    matrix : ndarray, shape (t, N, N)
        Covariances of the whole record.
    inside, outside : ndarray, shape (t, parts, N, N)
        Sums over the terms within each part, and sums over the terms outside each part.
    n_inside, n_outside : ndarray, shape (t, parts)
        Numbers of terms in these sums.
    """

    tau: Floats
    edf: Floats
    terms: Floats
    matrix: Floats
    inside: Floats
    outside: Floats
    n_inside: Floats
    n_outside: Floats


def weigh(
    parts: Parts, seconds: float, horizon: float, weights: WeightsName, names: Sequence[str]
) -> VirtualGyro:
    """Return the weights of gyros from the sums over a record.

    Parameters
    ----------
    parts : Parts
        Sums over a record and its parts.
    seconds : float
        Length of the record without missing samples, s.
    horizon, weights
        As in `AllanCovariance.virtual_gyro`.
    names : sequence of str, length N
        Names of the gyros in messages.
    """
    _check_arguments(parts, seconds, horizon, weights, names)
    n = len(names)
    if weights == "mean":
        return VirtualGyro(np.full(n, 1.0 / n), 1.0, 0.0, 1.0, horizon)
    rule: Callable[[Noise], Floats]
    if weights == "drift":
        shrinkage = time_shrinkage(n, seconds)
        rule = partial(drift_weights, shrinkage=shrinkage, horizon=horizon)
    else:
        shrinkage = n / (n + float(parts.edf[0]))
        rule = partial(_white_weights, shrinkage=shrinkage)
    gyro_weights = rule(fit_noise(parts.tau, parts.matrix, parts.edf))
    gain, error = _estimate_gain(parts, rule, horizon)
    return VirtualGyro(gyro_weights, gain, gain * error, shrinkage, horizon)


def time_shrinkage(n: int, seconds: float) -> float:
    """Return the shrinkage of the drift of n gyros, for a record of this length."""
    return n / (n + seconds / _SECONDS_PER_FREEDOM)


def drift_weights(noise: Noise, shrinkage: float, horizon: float = math.inf) -> Floats:
    """Return the weights with the smallest variance at a horizon, with shrunk drift, shape (N,)."""
    return _min_variance_weights(
        Noise(noise.white, shrink_covariance(noise.drift, shrinkage)).at(horizon)
    )


def _white_weights(noise: Noise, shrinkage: float) -> Floats:
    return _min_variance_weights(shrink_covariance(noise.white, shrinkage))


def shrink_covariance(covariance: Floats, shrinkage: float) -> Floats:
    """Return a covariance with off-diagonal elements reduced by the share `shrinkage`."""
    off = covariance * (1.0 - shrinkage)
    np.fill_diagonal(off, np.diag(covariance))
    return off


def drift_freedom(tau: Floats, matrix: Floats, edf: Floats) -> float:
    """Return the degrees of freedom of the drift, as the median over the gyros."""
    strengths = _fit_strengths(tau, np.einsum("tii->ti", matrix), edf)
    variances = _noise_basis(tau) @ strengths
    _, errors = _least_squares(tau, variances, _limit_freedom(edf)[:, None] / (2.0 * variances**2))
    return float(np.median(2.0 * (strengths[1] / errors[1]) ** 2))


def fit_noise(tau: Floats, matrix: Floats, edf: Floats) -> Noise:
    """Return the white noise and drift that fit Allan covariances best.

    Parameters
    ----------
    tau : ndarray, shape (t,)
        Averaging times, s. At least two.
    matrix : ndarray, shape (t, N, N)
        Allan covariances.
    edf : ndarray, shape (t,)
        Degrees of freedom of each covariance.

    Notes
    -----
    Each element is fitted on its own, by least squares weighted by the degrees of freedom. Both
    matrices are positive semidefinite. A strength that is too small to be seen is set to the
    smallest visible value. With zero, its gyro would get all the weight.
    """
    strengths = _fit_strengths(tau, np.einsum("tii->ti", matrix), edf)
    variances = _noise_basis(tau) @ strengths
    weights = _limit_freedom(edf)[:, None, None] / (variances[:, :, None] * variances[:, None, :])
    elements, _ = _least_squares(tau, matrix, weights)
    white, drift = (
        _make_semidefinite(element, strength)
        for element, strength in zip(elements, strengths, strict=True)
    )
    return Noise(white, drift)


def _check_arguments(
    parts: Parts, seconds: float, horizon: float, weights: str, names: Sequence[str]
) -> None:
    if not horizon > 0.0:
        raise ArgumentError("horizon", f"must be a positive time in s, or infinite, got {horizon}")
    if weights not in _WEIGHTS_NAMES:
        raise ValueError(f"unknown weights {weights!r}; known: {', '.join(_WEIGHTS_NAMES)}")
    min_seconds = _MIN_SECONDS_PER_GYRO * len(names)
    if weights == "drift" and seconds < min_seconds:
        raise ValueError(
            f"drift weights of {len(names)} gyros need {min_seconds / 3600.0:g} h at rest "
            f"({min_seconds:g} s), "
            f"this record holds {seconds:g} s: drift is slow, and weights from the chance "
            f"correlations of a shorter record are worse than none; use weights='mean' or "
            "'white', or record for longer"
        )
    if weights == "mean":
        return
    if parts.tau.size < 2:
        raise ValueError(_TOO_FEW_TAUS)
    constant = np.flatnonzero(~np.any(np.einsum("tii->ti", parts.matrix) > 0.0, axis=0))
    if constant.size:
        raise ValueError(
            f"{names[constant[0]]} does not vary compared with the others: leave it out of the "
            f"array"
        )


def _min_variance_weights(covariance: Floats) -> Floats:
    """Return the weights with sum 1 and the smallest variance, shape (N,)."""
    sizes = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sizes, sizes)
    # The correlation of identical gyros is singular.
    correlation[np.diag_indices_from(correlation)] += _RIDGE
    unnormalised = np.linalg.solve(correlation, sizes.min() / sizes) / sizes
    weights: Floats = unnormalised / unnormalised.sum()
    return weights


def _noise_shares(horizon: float) -> tuple[float, float]:
    """Return scaled shares of R and Q at an averaging time; neither exceeds 1."""
    return 1.0 / (1.0 + horizon * horizon / 3.0), 1.0 / (1.0 + 3.0 / horizon / horizon)


def _noise_basis(tau: Floats) -> Floats:
    return np.column_stack((1.0 / tau, tau / 3.0))


def _limit_freedom(edf: Floats) -> Floats:
    return np.minimum(edf, _MAX_FREEDOM)


def _fit_strengths(tau: Floats, variances: Floats, edf: Floats) -> Floats:
    """Return white noise and drift of single Allan variances (t, k), shape (2, k)."""
    basis, trust = _noise_basis(tau), _limit_freedom(edf)[:, None]
    # Start too large: then no variance that is small by chance has much weight.
    strengths = np.stack([np.max(variances / column[:, None], axis=0) for column in basis.T])
    for _ in range(_MAX_ITERATIONS):
        previous = strengths
        # Variance of a chi-squared variable: 2 mean² / edf.
        weights = trust / (2.0 * (basis @ strengths) ** 2)
        fitted, errors = _least_squares(tau, variances, weights)
        strengths = np.maximum(fitted, errors)
        if np.allclose(strengths, previous, rtol=_CONVERGENCE_TOLERANCE, atol=0.0):
            break
    return strengths


def _least_squares(tau: Floats, data: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Fit 1/tau and tau/3 to data (t, ...); return strengths and their errors, (2, ...) each."""
    first, second = (column.reshape(-1, *[1] * (data.ndim - 1)) for column in _noise_basis(tau).T)
    a, b, c = (
        np.sum(weights * x * y, axis=0)
        for x, y in ((first, first), (first, second), (second, second))
    )
    u, v = (np.sum(weights * x * data, axis=0) for x in (first, second))
    determinant = a * c - b * b
    strengths = np.stack((c * u - b * v, a * v - b * u)) / determinant
    return strengths, np.sqrt(np.stack((c, a)) / determinant)


def _make_semidefinite(covariance: Floats, variances: Floats) -> Floats:
    """Return the matrix with these variances and correlations that are possible."""
    sizes = np.sqrt(variances)
    correlation = covariance / np.outer(sizes, sizes)
    np.fill_diagonal(correlation, 1.0)
    values, vectors = np.linalg.eigh(correlation)
    if values[0] < 0.0:
        correlation = (vectors * np.maximum(values, 0.0)) @ vectors.T
        sizes = sizes / np.sqrt(np.diag(correlation))
    product: Floats = correlation * np.outer(sizes, sizes)
    return product


def _estimate_gain(
    parts: Parts, rule: Callable[[Noise], Floats], horizon: float
) -> tuple[float, float]:
    """Return the gain over the mean, and the standard error of the gain's logarithm.

    Each part of the record is fused with weights from the other parts. On its own record a set of
    weights looks better than it is, above all with many gyros. The error comes from a jackknife
    over the parts, which needs no model.
    """
    curves = _held_out_curves(parts, rule)
    all_parts = range(parts.n_inside.shape[1])
    gain = _log_gain(parts, curves, list(all_parts), horizon)
    leave_one_out = [
        _log_gain(parts, curves, [i for i in all_parts if i != omitted], horizon)
        for omitted in all_parts
    ]
    spread = np.sqrt((len(leave_one_out) - 1) * np.var(leave_one_out))
    return math.exp(gain), float(spread)


def _held_out_curves(parts: Parts, rule: Callable[[Noise], Floats]) -> Floats:
    """Return sums of squares of the weighted mean and of the plain mean, shape (t, parts, 2)."""
    n = parts.matrix.shape[-1]
    curves = np.empty((*parts.n_inside.shape, 2))
    for i in range(parts.n_inside.shape[1]):
        counts = parts.n_outside[:, i]
        nonempty = counts > 0
        if np.count_nonzero(nonempty) < 2:
            raise ValueError(_TOO_FEW_TAUS)
        matrix = parts.outside[nonempty, i] / counts[nonempty, None, None]
        edf = (parts.edf * counts / parts.terms)[nonempty]
        weightings = np.column_stack(
            (rule(fit_noise(parts.tau[nonempty], matrix, edf)), np.full(n, 1.0 / n))
        )
        curves[:, i] = np.einsum("ik,tij,jk->tk", weightings, parts.inside[:, i], weightings)
    return curves


def _log_gain(parts: Parts, curves: Floats, which: list[int], horizon: float) -> float:
    """Return the logarithm of the gain on these parts of the record."""
    counts = parts.n_inside[:, which].sum(axis=1)
    nonempty = counts > 0
    if np.count_nonzero(nonempty) < 2:
        raise ValueError(_TOO_FEW_TAUS)
    variances = curves[:, which].sum(axis=1)[nonempty] / counts[nonempty, None]
    if not np.all(np.any(variances > 0.0, axis=0)):
        raise ValueError(
            "the mean of the gyros does not vary: some gyros are copies of others with the "
            "opposite sign"
        )
    edf = (parts.edf * counts / parts.terms)[nonempty]
    weighted, mean = _variances_at(horizon, parts.tau[nonempty], variances, edf)
    return 0.5 * math.log(mean / weighted)


def _variances_at(horizon: float, tau: Floats, variances: Floats, edf: Floats) -> Floats:
    """Return scaled Allan variances at a horizon, from curves of shape (t, k).

    Between well known averaging times the curves are interpolated. Beyond them, the model of white
    noise and random walk is used.
    """
    known = tau[edf >= _MIN_KNOWN_FREEDOM]
    if known.size and known[0] <= horizon <= known[-1] and np.all(variances > 0.0):
        log_horizon = math.log(horizon)
        interpolated = [np.interp(log_horizon, np.log(tau), np.log(curve)) for curve in variances.T]
        return np.exp(interpolated)
    variances_at: Floats = np.array(_noise_shares(horizon)) @ _fit_strengths(tau, variances, edf)
    return variances_at
