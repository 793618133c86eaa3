"""How far apart two series are."""

import numpy as np
import numpy.typing as npt

from zerorate.metrics.series import answer, columns, pairs, present, rms, same_shape, spread

Floats = npt.NDArray[np.float64]


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
    both = pairs("raw", raw, "filtered", filtered)
    return answer([y.std() / spread(z) for z, y in both], raw)


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
    both = pairs("raw", raw, "filtered", filtered)
    return answer([(y - z).mean() / spread(z) for z, y in both], raw)


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
    both = pairs("reference", reference, "estimate", estimate)
    return answer([rms(y - x) for x, y in both], reference)


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
        columns("truth", truth),
        columns("estimate", estimate),
        columns("optimal", optimal),
    )
    same_shape("truth", x, "estimate", y)
    same_shape("truth", x, "optimal", best)
    ratios = []
    for i in range(len(x)):
        both = present(x[i], y[i], best[i])
        least = rms(best[i][both] - x[i][both])
        if least == 0.0:
            raise ValueError("optimal equals truth, so there is no error to compare with")
        ratios.append(rms(y[i][both] - x[i][both]) / least)
    return answer(ratios, truth)
