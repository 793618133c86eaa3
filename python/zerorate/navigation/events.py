"""Fixes as filter input: position and velocity together, or each at its own time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zerorate.record.fixes import Fixes
from zerorate.types import Floats, Integers

DEFAULT_POSITION_SIGMA_M: Final = 2.0
DEFAULT_VELOCITY_SIGMA_M_S: Final = 0.1
"""Standard deviations of positions, m, and velocities, m/s, if the receiver reports none."""

_POSITION: Final = slice(1, 4)
_VELOCITY: Final = slice(4, 7)


def pack_fixes(fixes: Fixes | None) -> Floats:
    """Return fixes as rows for ``NavigationFilter.process_arrays``, shape (m, 13).

    If the receiver reports no standard deviations, they are 2 m and 0.1 m/s.
    """
    if fixes is None:
        return np.empty((0, 13))
    rows = np.full((len(fixes), 13), np.nan)
    rows[:, 0] = fixes.time
    rows[:, _POSITION] = fixes.position
    rows[:, 7:10] = _fill_sigma(fixes.position_sigma, DEFAULT_POSITION_SIGMA_M)
    rows[:, 10:13] = _fill_sigma(fixes.velocity_sigma, DEFAULT_VELOCITY_SIGMA_M_S)
    if fixes.velocity is not None:
        rows[:, _VELOCITY] = fixes.velocity
    return rows


def _fill_sigma(sigma: Floats | None, default: float) -> Floats | float:
    if sigma is None:
        return default
    filled: Floats = np.where(np.isnan(sigma), default, sigma)
    return filled


@dataclass(frozen=True, eq=False)
class Events:
    """Events of m fixes for a filter, in time order.

    Parameters
    ----------
    rows : ndarray, shape (k, 13)
        Rows for ``NavigationFilter.process_arrays``.
    position, velocity : ndarray of int, shape (m,)
        Index of the row with each fix's position, and index of the row with its velocity. Both are
        the same row, except if velocities have their own times.
    """

    rows: Floats
    position: Integers
    velocity: Integers

    @classmethod
    def of(cls, fixes: Fixes | None) -> Events:
        """Return the events of fixes."""
        rows = pack_fixes(fixes)
        each = np.arange(len(rows))
        if fixes is None or fixes.velocity is None or fixes.velocity_time is None:
            return cls(rows, each, each)
        return cls.apart(rows, fixes.time, fixes.velocity_time)

    @classmethod
    def apart(cls, rows: Floats, position: Floats, velocity: Floats) -> Events:
        """Return separate rows for positions and velocities, each at its own time."""
        m = len(rows)
        both = np.concatenate([rows, rows])
        both[:m, _VELOCITY], both[m:, _POSITION] = np.nan, np.nan
        both[:m, 0], both[m:, 0] = position, velocity
        order = np.argsort(both[:, 0], kind="stable")
        index = np.empty(2 * m, dtype=np.int64)
        index[order] = np.arange(2 * m)
        return cls(both[order], index[:m], index[m:])

    @property
    def is_joint(self) -> bool:
        """True if each fix is one event."""
        return self.position is self.velocity

    def to_rows(self) -> Floats:
        """Return one row per fix, at the time of its position."""
        rows = self.rows[self.position].copy()
        rows[:, _VELOCITY] = self.rows[self.velocity, _VELOCITY]
        return rows

    def merge(self, outputs: dict[str, Any]) -> dict[str, Any]:
        """Return the filter's output for each fix, from the event with its position."""
        if self.is_joint:
            return outputs
        own = {name: outputs[name][self.position] for name in ("verdict", "taken")}
        for name, width in (("nis", 1), ("innovation", 3), ("innovation_sigma", 3)):
            from_position, from_velocity = (
                outputs[name][self.position],
                outputs[name][self.velocity],
            )
            own[name] = np.hstack([from_position[:, :width], from_velocity[:, width:]])
        return {**outputs, **own}
