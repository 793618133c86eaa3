"""What a filter costs in motion."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from zerorate.metrics.delays import UnseenDelay, delay
from zerorate.metrics.lowpass import equal_delay_lowpass
from zerorate.metrics.series import answer, columns, same_shape
from zerorate.metrics.shift import moved
from zerorate.metrics.statistics import rmse

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MotionError:
    """Errors to a reference rate; each a float, or one a channel of shape (k,).

    Attributes
    ----------
    rmse : float or ndarray
        In the unit of the data.
    delay : float or ndarray
        How far the estimate lags, s; NaN where none can be seen.
    rmse_undelayed : float or ndarray
        The same error with that delay removed; NaN where none can be seen.
    rmse_lowpass : float or ndarray
        Error of the raw signal through the one-pole low-pass filter of that delay, of delay 0 for
        an estimate that leads; NaN without the raw signal or without a delay.
    """

    rmse: float | Floats
    delay: float | Floats
    rmse_undelayed: float | Floats
    rmse_lowpass: float | Floats


def motion_error(
    reference: npt.ArrayLike,
    estimate: npt.ArrayLike,
    rate: float,
    max_delay: float = 1.0,
    raw: npt.ArrayLike | None = None,
) -> MotionError:
    """Return the error of an estimate to a reference rate, and how much of it is delay.

    Delay buys a quiet output, so a filter is worth what it gains over the low-pass filter of the
    same delay. With the delay removed it shows what a user gains who can wait.

    Parameters
    ----------
    reference, estimate : array_like, shape (n,) or (n, k)
        A true or independently measured rate, and the filter's output, in one unit.
    rate : float
        Samples per second, Hz.
    max_delay : float, default 1
        Longest delay that is looked for, s: see `delay`.
    raw : array_like, the same shape, optional
        The gyro's output.

    Returns
    -------
    MotionError
        Over the samples present in both.

    Raises
    ------
    ValueError
        If the shapes differ, no sample is present in both, `rate` or `max_delay` is not positive
        and finite or less than a sample, or the record is not longer than twice `max_delay`.

    Notes
    -----
    The delay is removed from the smooth side: the reference is moved, by a cubic through four
    samples. Between samples of the estimate its noise would be averaged away, a gain that no
    filter earned.

    Examples
    --------
    >>> t = np.arange(0.0, 20.0, 0.01)
    >>> found = motion_error(np.sin(t), np.sin(t - 0.125), rate=100.0)
    >>> round(found.delay, 4), found.rmse > 0.08, found.rmse_undelayed < 1e-5
    (0.125, True, True)
    """
    x, y = columns("reference", reference), columns("estimate", estimate)
    same_shape("reference", x, "estimate", y)
    z = None if raw is None else columns("raw", raw)
    if z is not None:
        same_shape("reference", x, "raw", z)
    rows = [_one(x[i], y[i], None if z is None else z[i], rate, max_delay) for i in range(len(x))]
    return MotionError(*(answer(values, reference) for values in zip(*rows, strict=True)))


def _one(
    x: Floats, y: Floats, z: Floats | None, rate: float, max_delay: float
) -> tuple[float, float, float, float]:
    whole = float(rmse(x, y))
    try:
        late = float(delay(x, y, rate, max_delay))
    except UnseenDelay:
        return whole, math.nan, math.nan, math.nan
    lowpass = math.nan
    if z is not None:
        smooth = equal_delay_lowpass(z, rate, max(late, 0.0))
        # What it holds through a gap is no measurement.
        lowpass = float(rmse(x, np.where(np.isfinite(z), smooth, np.nan)))
    return whole, late, float(rmse(moved(x, late * rate), y)), lowpass
