"""Strides of one foot: from stance to stance, in numbers."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.geometry.rotations import inverse, product

if TYPE_CHECKING:
    from zerorate.foot.foot import FootTrack
    from zerorate.types import Floats

_SHORTEST: Final = 0.15
"""Way of a stride at least, m: less is a foot that shifts."""
_STANDS: Final = 1.5
"""Seconds of a stance from which on a person stands."""
_BEGINS: Final = 0.05
"""Seconds after the first sample within which a stance is one that began before."""
_FEET: Final = 2.0


@dataclass(frozen=True, eq=False)
class Strides:
    """The m strides of a foot, as `FootTrack.strides` finds them.

    Names and definitions are those of gaitmap, whose strides also go from one moment of least
    velocity to the next (``min_vel``), and whose times count from the contact before to the
    contact at the end. Events are not the same: stances here are the valleys of the speed bound,
    which begin after the heel strikes and end before the toe leaves, so `stance_time` is shorter
    than between contacts, and `swing_time` longer.

    Parameters
    ----------
    start, end : ndarray of int, shape (m,)
        Samples of least motion in the stance before and after.
    stride_time : ndarray, shape (m,)
        From the begin of the stance before to that of the stance after, s; NaN where the person
        stood before: for 1.5 s or more, or since the recording began.
    swing_time : ndarray, shape (m,)
        Between both stances, s.
    stance_time : ndarray, shape (m,)
        Of the stance before, s; NaN as above.
    stride_length : ndarray, shape (m,)
        Level distance from stance to stance, m.
    height_change : ndarray, shape (m,)
        How much higher the foot stands, m.
    gait_velocity : ndarray, shape (m,)
        Length over time, m/s; NaN as above.
    turning_angle : ndarray, shape (m,)
        By how much the foot stands turned to the left, rad.
    arc_length : ndarray, shape (m,)
        Way through the air, m.
    max_sensor_lift : ndarray, shape (m,)
        Highest place of the sensor over the stance before, m.
    max_lateral_excursion : ndarray, shape (m,)
        Farthest level place from the line between both stances, m; of straight strides it tells
        how the leg swings outwards.

    Examples
    --------
    >>> import zerorate as zr
    >>> walk = zr.simulate_walk(strides=20, seed=1)
    >>> strides = zr.FootNavigation().process(walk.recording()).smooth().strides()
    >>> len(strides), round(float(strides.stride_length.mean()), 1)
    (20, 1.3)
    """

    start: np.ndarray
    end: np.ndarray
    stride_time: Floats
    swing_time: Floats
    stance_time: Floats
    stride_length: Floats
    height_change: Floats
    gait_velocity: Floats
    turning_angle: Floats
    arc_length: Floats
    max_sensor_lift: Floats
    max_lateral_excursion: Floats

    def __len__(self) -> int:
        """Return the number of strides."""
        return len(self.start)

    @property
    def cadence(self) -> float:
        """Steps of both feet a minute, of the median stride; NaN without one."""
        known = self.stride_time[np.isfinite(self.stride_time)]
        return 60.0 * _FEET / float(np.median(known)) if known.size else float("nan")


def strides_of(track: FootTrack) -> Strides:
    """Return the strides of a track."""
    rows = [_between(track, before, after) for before, after in pairwise(_with_lowest(track))]
    kept = np.array([row for row in rows if row[9] >= _SHORTEST], dtype=np.float64)
    kept = kept.reshape(-1, 12)
    start, end = kept[:, :2].astype(np.intp).T
    return Strides(start, end, *kept[:, 2:].T)


def _with_lowest(track: FootTrack) -> list[tuple[int, int, int]]:
    return [
        (int(first), int(end) - 1, int(lowest))
        for (first, end), lowest in zip(track.stances, track.lowest, strict=True)
    ]


def _between(
    track: FootTrack, before: tuple[int, int, int], after: tuple[int, int, int]
) -> tuple[float, ...]:
    time, place = track.time, track.position
    start, end = before[2], after[2]
    swing = float(time[after[0]] - time[before[1]])
    stance = float(time[before[1]] - time[before[0]])
    if stance >= _STANDS or time[before[0]] - time[0] < _BEGINS:
        stance = float("nan")
    way = place[start : end + 1]
    moved = way[-1] - way[0]
    length = float(np.hypot(moved[0], moved[1]))
    aside = (way[:, 1] - way[0, 1]) * moved[0] - (way[:, 0] - way[0, 0]) * moved[1]
    turn = product(track.quaternion[end], inverse(track.quaternion[start]))
    angle = 2.0 * np.arctan2(turn[..., 3], turn[..., 0])
    return (
        start,
        end,
        swing + stance,
        swing,
        stance,
        length,
        float(moved[2]),
        length / (swing + stance),
        float((angle + np.pi) % (2.0 * np.pi) - np.pi),
        float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum()),
        float((way[:, 2] - way[0, 2]).max()),
        float(np.abs(aside).max() / length) if length > 0.0 else 0.0,
    )
