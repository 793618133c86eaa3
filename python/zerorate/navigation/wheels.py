"""Wheel sensors with their own times: speeds or tick counts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError, keyword_argument, make_sentence
from zerorate.metrics.channels import check_positive
from zerorate.navigation.windows import Epochs
from zerorate.record import LogError
from zerorate.record.fixes import Fixes
from zerorate.record.missing import floats
from zerorate.types import Booleans, Floats

_COUNT_INTERVAL_S: Final = 0.1
"""Interval over which ticks are counted, s; a shorter interval rounds the speed too much."""
_MAX_INTERVAL_S: Final = 0.5
"""Longest interval, s, at the middle of which the mean speed is valid."""
_JUMP_FACTOR: Final = 10.0
"""Factor on a high quantile of the speed, above which a counter has jumped."""
_MIN_SPEED_M_S: Final = 3.0
_MIN_COUNTS: Final = 20
"""Conditions to estimate the tick length: receiver speed, m/s, and number of counts."""


@dataclass(frozen=True, eq=False, repr=False)
class Wheels:
    """Speeds of wheels, for ``NavigationFilter.process`` and `outages`.

    Parameters
    ----------
    time : array_like, shape (w,)
        Middle of the interval of each mean speed, s, in rising order.
    speed : array_like, shape (w,)
        Forward speed, m/s; NaN if missing.
    sigma : float or array_like, shape (w,), optional
        Standard deviation of the speeds, m/s. Default: the filter's ``speed_sigma``.
    tick : float, optional
        Length of a tick, m, if the speeds were computed from ticks.

    Raises
    ------
    ValueError
        If the shapes do not match, the times are not finite and rising, or a standard deviation is
        not positive.

    Examples
    --------
    >>> from zerorate.navigation import Wheels
    >>> wheels = Wheels([0.0, 0.1, 0.2], [5.0, float("nan"), 5.2], sigma=0.1)
    >>> wheels.rows.tolist()
    [[0.0, 5.0, 0.1], [0.1, nan, 0.1], [0.2, 5.2, 0.1]]
    """

    time: npt.ArrayLike
    speed: npt.ArrayLike
    sigma: float | npt.ArrayLike | None = None
    tick: float | None = None

    def __post_init__(self) -> None:
        """Check the arguments."""
        time, speed = floats(self.time, "time"), floats(self.speed, "speed")
        sigma = np.nan if self.sigma is None else self.sigma
        spread = np.broadcast_to(floats(sigma, "sigma"), np.shape(speed)).copy()
        if time.ndim != 1 or speed.shape != time.shape:
            shapes = f"{time.shape} and {speed.shape}"
            raise ArgumentError("speed", f"must have the shape of time, (w,), got {shapes}")
        if not (np.isfinite(time).all() and (np.diff(time) >= 0.0).all()):
            raise ArgumentError("time", "must be finite and in order")
        if (spread <= 0.0).any():
            raise ArgumentError("sigma", "must be positive")
        for name, value in (("time", time), ("speed", speed), ("sigma", spread)):
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        """Return the number of speeds, and the length of a tick."""
        ticks = "" if self.tick is None else f", of ticks of {self.tick:.4g} m"
        return f"Wheels({np.isfinite(self.speed).sum()} speeds{ticks})"

    @classmethod
    def of_ticks(
        cls,
        time: npt.ArrayLike,
        count: npt.ArrayLike,
        *,
        tick: float | None = None,
        fixes: Fixes | None = None,
        sigma: float = 0.1,
    ) -> Wheels:
        """Return wheel speeds from tick counts, ten per second.

        Parameters
        ----------
        time : array_like, shape (n,)
            Times of the counts, s, in rising order, on the clock of the sensors.
        count : array_like, shape (n,)
            Total number of ticks up to each time. NaN if no count is reported.
        tick : float, optional
            Length of a tick, m. The filter can correct it by a few percent.
        fixes : Fixes, optional
            Fixes of the receiver. If `tick` is missing, their speed gives the length of a tick.
        sigma : float
            Standard deviation of a speed, m/s, without the rounding to ticks.

        Returns
        -------
        Wheels
            Speeds with standard deviations that include the rounding: for a mean over dt, the root
            of ``sigma**2 + (tick / dt)**2 / 6``. There is no speed where the counter jumps, or
            where counts are missing for more than half a second.

        Raises
        ------
        ValueError
            If an argument does not fit its description, or `tick` and `fixes` are both missing.
        LogError
            If the receiver does not determine the length of a tick.

        Examples
        --------
        >>> import numpy as np, zerorate as zr
        >>> time = np.arange(0.0, 10.0, 0.01)
        >>> wheels = zr.navigation.Wheels.of_ticks(time, np.floor(time * 5.0 / 0.03), tick=0.03)
        >>> wheels, bool(abs(wheels.speed.mean() - 5.0) < 0.01)
        (Wheels(99 speeds, of ticks of 0.03 m), True)
        """
        t, ticks = floats(time, "time"), floats(count, "count")
        if t.ndim != 1 or ticks.shape != t.shape:
            raise ArgumentError("count", f"must have shape {t.shape}, got {ticks.shape}")
        if not (np.isfinite(t).all() and (np.diff(t) >= 0.0).all()):
            raise ArgumentError("time", "must be finite and in order")
        spread = check_positive("sigma", sigma)
        present = np.isfinite(ticks)
        middle, rate, dt = _tick_rates(t[present], ticks[present])
        if tick is None and fixes is None:
            raise ArgumentError("tick", "must be given, or fixes, whose speed determines it")
        length = (
            check_positive("tick", tick) if tick is not None else _learn_tick(middle, rate, fixes)
        )
        noise = np.sqrt(spread**2 + (length / dt) ** 2 / 6.0)
        return cls(middle, length * rate, noise, length)

    @property
    def rows(self) -> Floats:
        """Time, speed and standard deviation for ``process_arrays``, shape (w, 3)."""
        return np.column_stack([self.time, self.speed, self.sigma])  # type: ignore[list-item]


def _tick_rates(time: Floats, count: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the intervals' middles, s, their ticks per second, and their lengths, s."""
    if len(time) < 2:
        empty = np.empty(0)
        return empty, empty, empty
    # The 1e-3 of an interval keeps rounding from moving a 10 Hz sample to the next interval.
    steps = np.floor((time - time[0]) / _COUNT_INTERVAL_S + 1e-3)
    first = np.concatenate([[True], np.diff(steps) > 0.0])
    t, n = time[first], count[first]
    dt, ticks = np.diff(t), np.diff(n)
    with np.errstate(invalid="ignore", divide="ignore"):
        rate = ticks / dt
    valid: Booleans = (dt > 0.0) & (dt <= _MAX_INTERVAL_S)
    if valid.any():
        usual = float(np.quantile(np.abs(rate[valid]), 0.9))
        valid &= np.abs(rate) <= max(_JUMP_FACTOR * usual, 10.0 / _COUNT_INTERVAL_S)
    return 0.5 * (t[1:] + t[:-1])[valid], rate[valid], dt[valid]


def _learn_tick(middle: Floats, rate: Floats, fixes: Fixes | None) -> float:
    """Return the length of a tick, m, from the speed of a receiver."""
    assert fixes is not None
    epochs = Epochs.of(fixes)
    tick_lengths = np.empty(0)
    if len(epochs.time) > 1 and len(middle):
        speed = np.interp(middle, epochs.time, epochs.speed, left=np.nan, right=np.nan)
        moves = (speed > max(_MIN_SPEED_M_S, 5.0 * float(np.median(epochs.sigma)))) & (rate != 0.0)
        tick_lengths = speed[moves] / np.abs(rate[moves])
    if len(tick_lengths) < _MIN_COUNTS or not math.isfinite(float(np.median(tick_lengths))):
        raise LogError(
            make_sentence(
                f"{fixes.source}: the receiver does not give the length of a wheel's tick: the "
                f"vehicle is faster than {_MIN_SPEED_M_S:g} m/s at {len(tick_lengths)} counts "
                f"only; ",
                keyword_argument("tick"),
                " says it, in m",
            )
        )
    return float(np.median(tick_lengths))
