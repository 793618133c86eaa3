"""Wheels as sensors with separate times: speeds, or counts of ticks."""

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
"""Seconds over which ticks are counted: over less they round the speed too much."""
_MAX_INTERVAL_S: Final = 0.5
"""Seconds above which the mean speed is not that of the middle."""
_JUMP_FACTOR: Final = 10.0
"""Times a speed that is hardly exceeded, beyond which a counter has jumped."""
_MIN_SPEED_M_S: Final = 3.0
_MIN_COUNTS: Final = 20
"""Least speed of the receiver, m/s, and counts at such speeds, for the length of a tick."""


@dataclass(frozen=True, eq=False, repr=False)
class Wheels:
    """Speeds of wheels, for ``NavigationFilter.process`` and `outages`.

    Parameters
    ----------
    time : array_like, shape (w,)
        Middle of the interval of each mean speed, s, rising.
    speed : array_like, shape (w,)
        Forward speed, m/s; NaN if missing.
    sigma : float or array_like, shape (w,), optional
        Standard deviation, m/s; by default the filter's ``speed_sigma``.
    tick : float, optional
        Metres per tick, if the speeds were computed from ticks.

    Raises
    ------
    ValueError
        If shapes do not fit, times are not finite and rising, or a standard deviation is not
        positive.

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
        """Return the number of speeds, and the size of a tick."""
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
        """Return speeds from counted ticks, ten per second.

        Parameters
        ----------
        time : array_like, shape (n,)
            Times of the counts, s, rising, on the clock of the sensors.
        count : array_like, shape (n,)
            Total number of ticks up to each time; NaN where none is reported.
        tick : float, optional
            Metres per tick. The filter can correct it by some per cent.
        fixes : Fixes, optional
            Fixes of the receiver. Their speed gives the metres per tick if `tick` is not given.
        sigma : float
            Standard deviation of a speed without rounding to ticks, m/s.

        Returns
        -------
        Wheels
            Speeds, with standard deviations that include rounding: the root of ``sigma**2 + (tick *
            rate)**2 / 6``. A counter that jumps, or that is silent for half a second, gives no
            speed.

        Raises
        ------
        ValueError
            If an argument is not as described, or neither `tick` nor `fixes` is given.
        LogError
            If the receiver does not determine the metres per tick.

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
    """Return the middles of intervals, ticks per second in each, and the intervals' lengths, s."""
    if len(time) < 2:
        empty = np.empty(0)
        return empty, empty, empty
    # Half an interval of a thousandth less, so that the tenth at 10 Hz is not the next.
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
    """Return the metres per tick from the speed of a receiver."""
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
