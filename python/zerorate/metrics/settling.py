"""How long an estimate takes to be right, and to stay so."""

import math

import numpy as np
import numpy.typing as npt

from zerorate.metrics.series import answer, columns, positive, present

Floats = npt.NDArray[np.float64]


def settling_time(
    estimate: npt.ArrayLike, target: npt.ArrayLike, tolerance: float, rate: float
) -> float | Floats:
    """Return the first time from which an estimate stays within a tolerance of its target.

    It says how long to wait after switching on. It is ruled by the single worst sample, so a noisy
    estimate that is right on average may never settle: choose the tolerance above its noise.

    Parameters
    ----------
    estimate : array_like, shape (n,) or (n, k)
        A bias or drift in any unit.
    target : float, or array_like of the shape of `estimate`
        What it should become, or the true value at each time.
    tolerance : float
        Largest difference, in the unit of the data.
    rate : float
        Samples per second, Hz.

    Returns
    -------
    float or ndarray, shape (k,)
        Seconds after the first sample; infinity if the last sample present is still outside.

    Raises
    ------
    ValueError
        If the shapes do not fit, no sample is present in both, or `tolerance` or `rate` is not
        positive and finite.

    Examples
    --------
    >>> settling_time([5.0, 0.9, 2.0, 0.5, 0.2], 0.0, tolerance=1.0, rate=10.0)
    0.3
    """
    x = columns("estimate", estimate)
    try:
        wanted = np.broadcast_to(np.asarray(target, dtype=np.float64), np.shape(estimate))
    except ValueError:
        raise ValueError(
            f"target of shape {np.shape(target)} does not fit estimate of shape "
            f"{np.shape(estimate)}"
        ) from None
    y = columns("target", wanted)
    widest, hertz = positive("tolerance", tolerance), positive("rate", rate)
    return answer([_settled(x[i], y[i], widest) / hertz for i in range(len(x))], estimate)


def _settled(x: Floats, y: Floats, widest: float) -> float:
    """Return the number of samples up to the first present one after the last one outside."""
    places = np.flatnonzero(present(x, y))
    outside = np.flatnonzero(np.abs(x[places] - y[places]) > widest)
    if outside.size == 0:
        return float(places[0])
    last = int(outside[-1])
    return math.inf if last + 1 == places.size else float(places[last + 1])
