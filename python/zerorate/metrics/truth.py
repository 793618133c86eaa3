"""Errors against a known truth, and check of a filter's stated variance."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.metrics.channels import (
    check_positive,
    check_same_shape,
    columns,
    is_single,
    per_channel,
    present_mask,
    present_pairs,
    rms,
)
from zerorate.record.missing import floats
from zerorate.record.named import rate_of
from zerorate.types import Floats


def rmse(reference: npt.ArrayLike, estimate: npt.ArrayLike) -> float | Floats:
    """Return the root mean square of estimate minus reference.

    The RMSE combines noise, bias and delay: compare it with the RMSE of `equal_delay_lowpass`.

    Parameters
    ----------
    reference, estimate : array_like, shape (n,) or (n, k)
        Reference and estimate at the same samples, in the same unit.

    Returns
    -------
    float or ndarray, shape (k,)
        RMSE in the unit of the data, over the samples present in both.

    Raises
    ------
    ValueError
        If the shapes differ or no sample is present in both.

    Examples
    --------
    >>> rmse([0.0, 0.0], [3.0, -3.0])
    3.0
    """
    both = present_pairs("reference", reference, "estimate", estimate)
    return per_channel([rms(y - x) for x, y in both], reference)


def regret(estimate: npt.ArrayLike, truth: npt.ArrayLike, optimal: npt.ArrayLike) -> float | Floats:
    """Return an estimate's RMSE divided by the RMSE of the best possible estimate.

    The best value is 1. The regret needs simulated data, so it does not show properties of real
    noise that the simulation lacks. For several seeds, concatenate their records and call `regret`
    once: small denominators would dominate a mean of separate ratios.

    Parameters
    ----------
    estimate, truth : array_like, shape (n,) or (n, k)
        Drift estimated by the filter, and true drift, the second result of `zerorate.simulate`.
    optimal : array_like, shape (n,) or (n, k)
        Estimate of the Kalman filter with the true model, from the same signal.

    Returns
    -------
    float or ndarray, shape (k,)
        RMSE of `estimate` over RMSE of `optimal`, over the samples present in all three.

    Raises
    ------
    ValueError
        If the shapes differ or no sample is present in all three. If `optimal` has no error.

    Examples
    --------
    >>> regret([2.0, -2.0], [0.0, 0.0], [1.0, -1.0])
    2.0
    """
    x, y, best = (
        columns("truth", truth),
        columns("estimate", estimate),
        columns("optimal", optimal),
    )
    check_same_shape("truth", x, "estimate", y)
    check_same_shape("truth", x, "optimal", best)
    ratios = []
    for i in range(len(x)):
        both = present_mask(x[i], y[i], best[i])
        least = rms(best[i][both] - x[i][both])
        if least == 0.0:
            raise ValueError("optimal equals truth, so there is no error to compare with")
        ratios.append(rms(y[i][both] - x[i][both]) / least)
    return per_channel(ratios, truth)


def settling_time(
    estimate: npt.ArrayLike, target: npt.ArrayLike, tolerance: float, rate: float | None = None
) -> float | Floats:
    """Return the first time from which an estimate stays within a tolerance of its target.

    This is the time to wait after power-on. The last sample outside the tolerance determines it. A
    noisy estimate that is right on average may never settle, so choose a tolerance above its noise.

    Parameters
    ----------
    estimate : array_like, shape (n,) or (n, k)
        Estimated bias or drift in any unit.
    target : float, or array_like of the shape of `estimate`
        Final value, or the true value at each time.
    tolerance : float
        Largest difference, in the unit of the data.
    rate : float
        Sampling rate, Hz. Default: the rate of a `Log`.

    Returns
    -------
    float or ndarray, shape (k,)
        Time after the first sample, s; infinity if the last present sample is outside the
        tolerance.

    Raises
    ------
    ValueError
        If the shapes do not fit or no sample is present in both. If `tolerance` or `rate` is not
        positive and finite.

    Examples
    --------
    >>> settling_time([5.0, 0.9, 2.0, 0.5, 0.2], 0.0, tolerance=1.0, rate=10.0)
    0.3
    """
    x = columns("estimate", estimate)
    try:
        targets = np.broadcast_to(floats(target, "target"), floats(estimate, "estimate").shape)
    except ValueError:
        raise ValueError(
            f"target of shape {np.shape(target)} does not fit estimate of shape "
            f"{np.shape(estimate)}"
        ) from None
    y = columns("target", targets)
    widest, hertz = check_positive("tolerance", tolerance), rate_of(rate, estimate, target)
    return per_channel(
        [_settling_samples(x[i], y[i], widest) / hertz for i in range(len(x))], estimate
    )


def _settling_samples(x: Floats, y: Floats, widest: float) -> float:
    """Return the index of the first present sample after the last one outside the tolerance."""
    indices = np.flatnonzero(present_mask(x, y))
    outside = np.flatnonzero(np.abs(x[indices] - y[indices]) > widest)
    if outside.size == 0:
        return float(indices[0])
    last = int(outside[-1])
    return math.inf if last + 1 == indices.size else float(indices[last + 1])


def nis(
    innovation: npt.ArrayLike,
    innovation_variance: npt.ArrayLike,
    where: npt.ArrayLike | None = None,
) -> float | Floats:
    """Return the mean normalised innovation squared, mean(e^2 / S).

    The mean is 1 if the stated covariance is right, above 1 if the covariance is too small, and
    below 1 if it is too large. The mean does not show the correlation of innovations. A value of 1
    at rest says nothing about motion: report it once at rest and once in motion.

    Parameters
    ----------
    innovation : array_like, shape (n,) or (n, k)
        Measurement minus predicted measurement.
    innovation_variance : array_like, the same shape, or a shape that broadcasts to it
        Variance S of the innovation as stated by the filter, in the squared unit of the data.
    where : array_like of bool, shape (n,) or the shape of `innovation`, optional
        Mask of the samples to include, such as samples at rest. Default: all.

    Returns
    -------
    float or ndarray, shape (k,)
        Mean over the samples present in both. For n independent innovations its standard deviation
        is sqrt(2/n).

    Raises
    ------
    ValueError
        If the shapes do not fit or no sample is present in both. If a variance is not positive.

    Examples
    --------
    >>> nis([1.0, -1.0, 3.0, -3.0], 5.0)
    1.0
    >>> nis([1.0, -1.0, 3.0, -3.0], 5.0, where=[False, False, True, True])
    1.8
    """
    variance = _broadcast_variance(innovation, innovation_variance)
    if np.any(variance <= 0.0):
        raise ArgumentError("innovation_variance", "must be positive")
    selected = innovation if where is None else _mask_innovations(innovation, where)
    both = present_pairs("innovation", selected, "innovation_variance", variance)
    return per_channel([float(np.mean(e * e / s)) for e, s in both], innovation)


def coverage(error: npt.ArrayLike, sigma: npt.ArrayLike) -> float | Floats:
    """Return the share of errors within one standard deviation as stated by the filter.

    The share is 0.683 for Gaussian errors and a right sigma, and less if sigma is too small. The
    share does not show the size of errors above sigma. Errors of a bias last long, so a record has
    few independent errors: use many records.

    Parameters
    ----------
    error : array_like, shape (n,) or (n, k)
        Estimate minus truth.
    sigma : array_like, the same shape
        Standard deviation of the estimate as stated by the filter.

    Returns
    -------
    float or ndarray, shape (k,)
        Share from 0 to 1, over the samples present in both.

    Raises
    ------
    ValueError
        If the shapes differ or no sample is present in both. If a sigma is negative.

    Examples
    --------
    >>> coverage([0.5, -0.5, 2.0, -0.1], [1.0, 1.0, 1.0, 1.0])
    0.75
    """
    both = present_pairs("error", error, "sigma", sigma)
    if any((s < 0.0).any() for _, s in both):
        raise ArgumentError("sigma", "must not be negative")
    return per_channel([float(np.mean(np.abs(e) <= s)) for e, s in both], error)


def _broadcast_variance(innovation: npt.ArrayLike, variance: npt.ArrayLike) -> Floats:
    try:
        return np.broadcast_to(
            floats(variance, "innovation_variance"), floats(innovation, "innovation").shape
        )
    except ValueError:
        raise ValueError(
            f"innovation_variance of shape {np.shape(variance)} does not fit innovation of shape "
            f"{np.shape(innovation)}"
        ) from None


def _mask_innovations(innovation: npt.ArrayLike, where: npt.ArrayLike) -> Floats:
    """Return the innovations, with NaN for excluded samples."""
    e, mask = columns("innovation", innovation), np.asanyarray(where)
    if mask.dtype != np.bool_:
        raise ArgumentError("where", f"must hold true and false, got dtype {mask.dtype}")
    flags = columns("where", where)
    if len(flags) == 1:
        flags = np.repeat(flags, len(e), axis=0)
    check_same_shape("innovation", e, "where", flags)
    selected = np.where(flags > 0.0, e, np.nan).T
    return selected[:, 0] if is_single(innovation) else selected
