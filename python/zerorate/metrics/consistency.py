"""Whether a filter knows how good it is."""

import numpy as np
import numpy.typing as npt

from zerorate.metrics.series import answer, columns, pairs, same_shape

Floats = npt.NDArray[np.float64]


def nis(
    innovation: npt.ArrayLike,
    innovation_variance: npt.ArrayLike,
    where: npt.ArrayLike | None = None,
) -> float | Floats:
    """Return the mean normalised innovation squared, mean(e^2 / S).

    1 for a filter whose covariance is honest, more for one too sure of itself, less for one too
    careful. It hides correlation: a perfect 1 at rest says nothing of motion, nor that the
    innovations are white. So give it once at rest and once in motion.

    Parameters
    ----------
    innovation : array_like, shape (n,) or (n, k)
        Measurement minus prediction.
    innovation_variance : array_like, the same shape, or one that broadcasts to it
        The filter's own variance S of the innovation, in the unit of the data squared.
    where : array_like of bool, shape (n,) or that of `innovation`, optional
        The samples that count, such as those at rest; by default all.

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
    >>> nis([1.0, -1.0, 3.0, -3.0], 5.0, where=[False, False, True, True])
    1.8
    """
    variance = _spread_over(innovation, innovation_variance)
    if np.any(variance <= 0.0):
        raise ValueError("innovation_variance must be positive")
    chosen = innovation if where is None else _only(innovation, where)
    both = pairs("innovation", chosen, "innovation_variance", variance)
    return answer([float(np.mean(e * e / s)) for e, s in both], innovation)


def coverage(error: npt.ArrayLike, sigma: npt.ArrayLike) -> float | Floats:
    """Return the share of errors that are no larger than the filter's standard deviation.

    0.683 for Gaussian errors and an honest sigma, less for a filter too sure of itself. It hides by
    how much the others miss. Errors of a bias last long, so a record holds few independent ones:
    take many records.

    Parameters
    ----------
    error : array_like, shape (n,) or (n, k)
        Estimate minus truth.
    sigma : array_like, the same shape
        The filter's standard deviation of its estimate.

    Returns
    -------
    float or ndarray, shape (k,)
        Over the samples present in both, from 0 to 1.

    Raises
    ------
    ValueError
        If the shapes differ, no sample is present in both, or a sigma is negative.

    Examples
    --------
    >>> coverage([0.5, -0.5, 2.0, -0.1], [1.0, 1.0, 1.0, 1.0])
    0.75
    """
    both = pairs("error", error, "sigma", sigma)
    if any((s < 0.0).any() for _, s in both):
        raise ValueError("sigma must not be negative")
    return answer([float(np.mean(np.abs(e) <= s)) for e, s in both], error)


def _spread_over(innovation: npt.ArrayLike, variance: npt.ArrayLike) -> Floats:
    try:
        return np.broadcast_to(np.asarray(variance, dtype=np.float64), np.shape(innovation))
    except ValueError:
        raise ValueError(
            f"innovation_variance of shape {np.shape(variance)} does not fit innovation of shape "
            f"{np.shape(innovation)}"
        ) from None


def _only(innovation: npt.ArrayLike, where: npt.ArrayLike) -> Floats:
    """Return the innovations, missing where they do not count."""
    e, mask = columns("innovation", innovation), np.asarray(where)
    if mask.dtype != np.bool_:
        raise ValueError(f"where must hold true and false, got dtype {mask.dtype}")
    flags = columns("where", mask)
    if len(flags) == 1:
        flags = np.repeat(flags, len(e), axis=0)
    same_shape("innovation", e, "where", flags)
    chosen = np.where(flags > 0.0, e, np.nan).T
    return chosen[:, 0] if np.ndim(innovation) == 1 else chosen
