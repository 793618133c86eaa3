"""Strides of one foot, from stance to stance: length, times and other quantities."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.geometry.rotations import inverse, product

if TYPE_CHECKING:
    from zerorate.foot.foot import FootTrack
    from zerorate.types import Floats

_MIN_STRIDE_M: Final = 0.15
"""Shortest stride, m; a shorter step is a shift of the foot."""
_MIN_STANDING_S: Final = 1.5
"""Shortest stance in which the person stands still, s."""
_START_MARGIN_S: Final = 0.05
"""A stance counts as started before the recording if it starts within this time, s."""
_STEPS_PER_STRIDE: Final = 2.0


@dataclass(frozen=True, eq=False)
class Strides:
    """Strides of a foot, as `FootTrack.strides` finds them; m strides.

    Names and definitions are from gaitmap. A stride goes from one moment of least velocity to the
    next (``min_vel``). The stride time goes from the contact before the stride to the contact at
    its end. Contacts differ from the contacts in gaitmap. Here stances are minima of the speed
    bound. They start after heel strike and end before toe-off, so `stance_time` is shorter and
    `swing_time` is longer than in gaitmap.

    Parameters
    ----------
    start, end : ndarray of int, shape (m,)
        Samples of least motion in the previous stance and in the next stance.
    stride_time : ndarray, shape (m,)
        Time from the start of the previous stance to the start of the next stance, s. NaN if the
        previous stance lasted 1.5 s or more, or started before the recording.
    swing_time : ndarray, shape (m,)
        Time between both stances, s.
    stance_time : ndarray, shape (m,)
        Duration of the previous stance, s. NaN in the same cases as `stride_time`.
    stride_length : ndarray, shape (m,)
        Horizontal distance between both stances, m.
    height_change : ndarray, shape (m,)
        Change of the foot's height, m.
    gait_velocity : ndarray, shape (m,)
        Stride length divided by stride time, m/s. NaN in the same cases as `stride_time`.
    turning_angle : ndarray, shape (m,)
        Change of the foot's heading, rad, positive to the left.
    arc_length : ndarray, shape (m,)
        Length of the path between both stances, m.
    max_sensor_lift : ndarray, shape (m,)
        Largest height of the sensor above the previous stance, m.
    max_lateral_excursion : ndarray, shape (m,)
        Largest horizontal distance from the line between both stances, m. In straight strides it is
        the outward swing of the leg.

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
        """Steps of both feet per minute, from the median stride; NaN without strides."""
        known = self.stride_time[np.isfinite(self.stride_time)]
        return 60.0 * _STEPS_PER_STRIDE / float(np.median(known)) if known.size else float("nan")


def measure_strides(track: FootTrack) -> Strides:
    """Return the strides of a track."""
    rows = [
        _measure_stride(track, before, after) for before, after in pairwise(_stance_samples(track))
    ]
    strides = np.array([row for row in rows if row[9] >= _MIN_STRIDE_M], dtype=np.float64)
    strides = strides.reshape(-1, 12)
    start, end = strides[:, :2].astype(np.intp).T
    return Strides(start, end, *strides[:, 2:].T)


def _stance_samples(track: FootTrack) -> list[tuple[int, int, int]]:
    return [
        (int(first), int(end) - 1, int(lowest))
        for (first, end), lowest in zip(track.stances, track.lowest, strict=True)
    ]


def _measure_stride(
    track: FootTrack, before: tuple[int, int, int], after: tuple[int, int, int]
) -> tuple[float, ...]:
    time, position = track.time, track.position
    start, end = before[2], after[2]
    swing = float(time[after[0]] - time[before[1]])
    stance = float(time[before[1]] - time[before[0]])
    if stance >= _MIN_STANDING_S or time[before[0]] - time[0] < _START_MARGIN_S:
        stance = float("nan")
    path = position[start : end + 1]
    displacement = path[-1] - path[0]
    length = float(np.hypot(displacement[0], displacement[1]))
    aside = (path[:, 1] - path[0, 1]) * displacement[0] - (path[:, 0] - path[0, 0]) * displacement[
        1
    ]
    turn = product(track.quaternion[end], inverse(track.quaternion[start]))
    angle = 2.0 * np.arctan2(turn[..., 3], turn[..., 0])
    return (
        start,
        end,
        swing + stance,
        swing,
        stance,
        length,
        float(displacement[2]),
        length / (swing + stance),
        float((angle + np.pi) % (2.0 * np.pi) - np.pi),
        float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum()),
        float((path[:, 2] - path[0, 2]).max()),
        float(np.abs(aside).max() / length) if length > 0.0 else 0.0,
    )
