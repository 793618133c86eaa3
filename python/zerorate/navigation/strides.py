"""Strides of one foot: from stance to stance, in numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.geometry.rotations import inverse, product

if TYPE_CHECKING:
    from zerorate.navigation.foot import FootTrack
    from zerorate.types import Floats

_SHORTEST: Final = 0.15
"""Way of a stride at least, m: less is a foot that shifts."""
_STANDS: Final = 1.5
"""Seconds of a stance from which on a person stands."""
_FEET: Final = 2.0


@dataclass(frozen=True, eq=False)
class Strides:
    """The m strides of a foot, as `FootTrack.strides` finds them.

    Names are those of gaitmap, whose strides also go from one moment of least velocity to the next
    (``min_vel``). Events are not the same: stances here are the valleys of the speed bound, which
    end before the toe leaves and begin after the heel strikes, so `stance_time` is shorter than
    between contacts, and `swing_time` longer.

    Parameters
    ----------
    start, end : ndarray of int, shape (m,)
        Samples of least motion in the stance before and after.
    stride_time : ndarray, shape (m,)
        From the end of a stance to the end of the next, s; NaN where the next is no step any more:
        it lasts for 1.5 s or the recording ends in it.
    swing_time : ndarray, shape (m,)
        Between both stances, s.
    stance_time : ndarray, shape (m,)
        Of the stance after, s; NaN as above.
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
    rows = [
        _between(track, before, after, last=k + 2 == len(track.stances))
        for k, (before, after) in enumerate(
            zip(
                _with_lowest(track)[:-1],
                _with_lowest(track)[1:],
                strict=True,
            )
        )
    ]
    kept = np.array([row for row in rows if row[9] >= _SHORTEST], dtype=np.float64)
    kept = kept.reshape(-1, 11)
    start, end = kept[:, :2].astype(np.intp).T
    return Strides(start, end, *kept[:, 2:].T)


def _with_lowest(track: FootTrack) -> list[tuple[int, int, int]]:
    return [
        (int(first), int(end) - 1, int(lowest))
        for (first, end), lowest in zip(track.stances, track.lowest, strict=True)
    ]


def _between(
    track: FootTrack, before: tuple[int, int, int], after: tuple[int, int, int], last: bool
) -> tuple[float, ...]:
    time, place = track.time, track.position
    start, end = before[2], after[2]
    swing = float(time[after[0]] - time[before[1]])
    stance = float(time[after[1]] - time[after[0]])
    if stance >= _STANDS or (last and after[1] >= track.n - 2):
        stance = float("nan")
    way = place[start : end + 1]
    moved = way[-1] - way[0]
    length = float(np.hypot(moved[0], moved[1]))
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
    )
