"""Fixes of a receiver: positions, velocities, and their standard deviations."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.geometry.earth import local_ned
from zerorate.record import Poses
from zerorate.record.missing import floats
from zerorate.types import Floats, Integers


@dataclass(frozen=True, eq=False, repr=False)
class Fixes:
    """n fixes of a receiver, as `read_fixes` and `simulate_drive` return them.

    Parameters
    ----------
    time : array_like, shape (n,)
        Times of the fixes, s, increasing.
    position : array_like, shape (n, 3)
        Latitude and longitude (deg) and height above the ellipsoid (m); the height may be NaN.
    velocity : array_like, shape (n, 3), optional
        Velocities north, east and down, m/s; NaN where unknown.
    position_sigma : array_like, shape (n, 3), optional
        Standard deviations north, east and down, m; NaN where unknown.
    velocity_sigma : array_like, shape (n, 3), optional
        Standard deviations of the velocity, m/s.
    quality : array_like of int, shape (n,), optional
        Fix type by the receiver's number; -1 where unknown. RTKLIB: 1 fixed, 2 float, 5 single.
        NMEA: 4 fixed, 5 float, 2 differential, 1 single.
    satellites : array_like of int, shape (n,), optional
        Number of satellites used.
    velocity_time : array_like, shape (n,), optional
        Times of the velocities, s, if they differ from `time`.
    epoch : float, optional
        Unix time (UTC) at which `time` is zero, s; None if unknown.
    source : str
        Name of the source in messages.
    notes : tuple of str
        Sentences on omissions and assumptions.

    Raises
    ------
    ValueError
        If a shape is wrong, or times do not increase. If a time or position is missing or
        impossible. If a standard deviation is not positive. If quality or satellites are not
        integers.

    Examples
    --------
    >>> import zerorate as zr
    >>> fixes = zr.Fixes([0.0, 1.0], [[45.0, 7.0, 200.0], [45.0, 7.001, 200.0]])
    >>> fixes, len(fixes.between(0.5, 2.0))
    (Fixes(2 in 1 s, positions), 1)
    """

    time: Floats
    position: Floats
    velocity: Floats | None = None
    position_sigma: Floats | None = None
    velocity_sigma: Floats | None = None
    quality: Integers | None = None
    satellites: Integers | None = None
    velocity_time: Floats | None = None
    epoch: float | None = None
    source: str = "the fixes"
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Convert all fields to arrays and check them."""
        time = _check_numbers("time", self.time, ())
        object.__setattr__(self, "time", time)
        if not np.isfinite(time).all() or not (np.diff(time) > 0.0).all():
            raise ArgumentError(
                "time", f"must be finite and rise from fix to fix{_describe_order_fault(time)}"
            )
        object.__setattr__(
            self,
            "position",
            _check_positions(_check_numbers("position", self.position, (3,), time)),
        )
        for name in ("velocity", "position_sigma", "velocity_sigma"):
            values = getattr(self, name)
            if values is not None:
                object.__setattr__(self, name, _check_numbers(name, values, (3,), time))
        for name in ("position_sigma", "velocity_sigma"):
            _check_sigma(name, getattr(self, name))
        for name in ("quality", "satellites"):
            values = getattr(self, name)
            if values is not None:
                object.__setattr__(self, name, _check_whole_numbers(name, values, time))
        if self.velocity_time is not None:
            velocity_time = _check_numbers("velocity_time", self.velocity_time, (), time)
            object.__setattr__(self, "velocity_time", velocity_time)
        if self.epoch is not None and not math.isfinite(self.epoch):
            raise ArgumentError("epoch", f"must be a finite number of seconds, got {self.epoch}")

    def __len__(self) -> int:
        """Return the number of fixes."""
        return len(self.time)

    def __repr__(self) -> str:
        """Return the number of fixes, their span, and their contents."""
        contents = ["positions"] + ["velocities"] * (self.velocity is not None)
        contents += ["sigmas"] * (self.position_sigma is not None)
        span = float(np.ptp(self.time)) if len(self) else 0.0
        return f"Fixes({len(self)} in {span:.6g} s, {', '.join(contents)})"

    def between(self, start: float = -math.inf, stop: float = math.inf) -> Self:
        """Return the fixes with times from `start` to before `stop`, s."""
        first, last = np.searchsorted(self.time, [start, stop])
        return self.chosen(slice(int(first), max(int(first), int(last))))

    def chosen(self, which: slice | npt.NDArray[np.bool_] | Integers) -> Self:
        """Return a selection of the fixes, by a slice, a mask or increasing indices."""
        arrays: dict[str, Any] = {
            name: None if array is None else array[which] for name, array in self.as_dict().items()
        }
        return replace(self, **arrays)

    def shifted(self, seconds: float) -> Self:
        """Return the fixes with an offset added to their times, s."""
        epoch = None if self.epoch is None else self.epoch - seconds
        velocity_time = None if self.velocity_time is None else self.velocity_time + seconds
        return replace(self, time=self.time + seconds, velocity_time=velocity_time, epoch=epoch)

    def poses(self, origin: npt.ArrayLike) -> Poses:
        """Return the positions (m east, north, up) relative to an origin (deg, deg, m)."""
        known = np.isfinite(self.position).all(axis=1)
        ned = local_ned(self.position[known], floats(origin, "origin"))
        unknown = np.full((len(ned), 4), np.nan)
        enu = ned[:, (1, 0, 2)] * (1.0, 1.0, -1.0)
        return Poses(self.time[known], enu, unknown, self.source)

    def as_dict(self) -> dict[str, npt.NDArray[np.float64 | np.int64] | None]:
        """Return the arrays by name; None for unknown quantities."""
        scalar_fields = ("epoch", "source", "notes")
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name not in scalar_fields}


def _check_numbers(
    name: str, values: npt.ArrayLike, columns: tuple[int, ...], time: Floats | None = None
) -> Floats:
    try:
        # A copy, with NaN for masked values.
        array = np.array(floats(values, name))
    except (TypeError, ValueError):
        raise ArgumentError(name, "must be an array of numbers") from None
    n = None if time is None else len(time)
    if array.ndim != 1 + len(columns) or array.shape[1:] != columns or n not in (None, len(array)):
        wanted = ", ".join(map(str, ("n" if n is None else n, *columns)))
        comma = "" if columns else ","
        raise ArgumentError(name, f"must be of shape ({wanted}{comma}), got {array.shape}")
    if np.isinf(array).any():
        raise ArgumentError(name, "must not be infinite")
    array.flags.writeable = False
    return array


def _describe_order_fault(time: Floats) -> str:
    wrong = np.flatnonzero(~(np.diff(time) > 0.0))
    if not wrong.size:
        return ""
    i = int(wrong[0])
    return f": fix {i + 1} is at {time[i + 1]} s after {time[i]} s"


def _check_positions(position: Floats) -> Floats:
    latitude, longitude = position[:, 0], position[:, 1]
    wrong = ~((np.abs(latitude) <= 90.0) & (np.abs(longitude) <= 360.0))
    if wrong.any():
        i = int(np.flatnonzero(wrong)[0])
        raise ValueError(
            f"position of fix {i} is latitude {latitude[i]}, longitude {longitude[i]}: "
            "expected degrees, within 90 and 360"
        )
    return position


def _check_sigma(name: str, sigma: Floats | None) -> None:
    if sigma is not None and (sigma <= 0.0).any():
        i = int(np.flatnonzero((sigma <= 0.0).any(axis=1))[0])
        raise ArgumentError(name, f"must be positive, or NaN where it is not known; fix {i} is not")


def _check_whole_numbers(name: str, values: npt.ArrayLike, time: Floats) -> Integers:
    numbers = _check_numbers(name, values, (), time)
    if (numbers != np.round(numbers)).any():
        raise ArgumentError(name, "must be whole numbers")
    whole = numbers.astype(np.int64)
    whole.flags.writeable = False
    return whole
