"""Errors of a track: of its absolute position (ATE), and of its steps (RPE)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.geometry import rotations
from zerorate.metrics.channels import check_positive
from zerorate.record.poses import Poses
from zerorate.types import Floats

Alignment: TypeAlias = Literal["rigid", "yaw", "similar", "origin", "none"]
_ALIGNMENTS: Final = ("rigid", "yaw", "similar", "origin", "none")
_Indices: TypeAlias = npt.NDArray[np.intp]


class Statistics(NamedTuple):
    """Statistics of errors with the names of evo, except `deviation` for evo's ``std``.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> time, still = np.arange(3.0), np.tile([1.0, 0.0, 0.0, 0.0], (3, 1))
    >>> line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    >>> true = zr.record.Poses(time, line, still)
    >>> found = zr.metrics.rpe(zr.record.Poses(time, 1.1 * line, still), true)
    >>> round(found.metres.rmse, 6), round(found.metres.largest, 6)
    (0.1, 0.1)
    """

    rmse: float
    mean: float
    median: float
    deviation: float
    least: float
    largest: float
    of: int


@dataclass(frozen=True, eq=False)
class TrackErrors:
    """Errors of poses, or of steps between poses.

    Attributes
    ----------
    time : ndarray, shape (m,)
        Time of the pose in the reference, or of the end of a step, s.
    translation : ndarray, shape (m,)
        Translation errors, m.
    rotation : ndarray, shape (m,)
        Rotation errors, rad; NaN if an orientation is unknown.
    turn : ndarray, shape (4,)
        Rotation that aligns the estimate with the reference, quaternion w, x, y, z.
    shift : ndarray, shape (3,)
        Shift of the estimate after the rotation, m.
    scale : float
        Scale of the estimate before the rotation; 1 unless the alignment is ``"similar"``.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> time, still = np.arange(3.0), np.tile([1.0, 0.0, 0.0, 0.0], (3, 1))
    >>> line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 1, 0]])
    >>> true = zr.record.Poses(time, line, still)
    >>> high = zr.record.Poses(time, line + [0.0, 0, 2.0], still)
    >>> found = zr.metrics.ate(high, true, align="none")
    >>> found.translation.tolist(), found.scale
    ([2.0, 2.0, 2.0], 1.0)
    """

    time: Floats
    translation: Floats
    rotation: Floats
    turn: Floats
    shift: Floats
    scale: float

    @property
    def metres(self) -> Statistics:
        """Statistics of the translations, m."""
        return _statistics(self.translation)

    @property
    def degrees(self) -> Statistics:
        """Statistics of the known rotations, deg."""
        return _statistics(np.degrees(self.rotation[np.isfinite(self.rotation)]))

    def __repr__(self) -> str:
        """Return the number of errors, and their RMS values."""
        rotation = self.degrees
        angle = f", {rotation.rmse:.4g} deg" if rotation.of else ""
        return f"TrackErrors({len(self.time)}: RMS {self.metres.rmse:.4g} m{angle})"


def ate(
    estimate: Poses,
    reference: Poses,
    *,
    align: Alignment = "rigid",
    max_time_difference: float = 0.01,
) -> TrackErrors:
    """Return the absolute trajectory error: the distance of each pose from the true pose.

    Poses are matched by their times, and the estimate is aligned with the reference.

    Parameters
    ----------
    estimate, reference : Poses
        Estimated and true poses, with times from the same clock.
    align : {"rigid", "yaw", "similar", "origin", "none"}
        Alignment of the positions:

        - "rigid": rotation and shift (``-a`` in evo).
        - "yaw": rotation about the vertical and shift, for a track with known vertical (not in
          evo).
        - "similar": rotation, shift and scale, for a single camera (``-as`` in evo).
        - "origin": the first poses coincide (``--align_origin`` in evo).
        - "none": no alignment (evo's default).
    max_time_difference : float
        Largest time between matched poses, s. Default 0.01, as evo's ``--t_max_diff``.

    Returns
    -------
    TrackErrors
        One error per pair of poses; `metres` and `degrees` are the statistics.

    Raises
    ------
    ValueError
        If no poses match in time. If an argument is not valid. If the rotation is not determined,
        because all positions are on a line or in a point.

    References
    ----------
    J. Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012. S. Umeyama,
    IEEE Trans. Pattern Anal. Mach. Intell. 13(4), 1991, equations 34 to 43. Pairs, alignment and
    errors are as in ``evo_ape`` of evo 1.38.

    Examples
    --------
    >>> import zerorate as zr
    >>> time, still = np.arange(4.0), np.tile([1.0, 0.0, 0.0, 0.0], (4, 1))
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> true = zr.record.Poses(time, corners, still)
    >>> moved = zr.metrics.ate(zr.record.Poses(time, corners + 5.0, still), true)
    >>> round(moved.metres.rmse, 9), moved.shift.round(9).tolist()
    (0.0, [-5.0, -5.0, -5.0])
    """
    if align not in _ALIGNMENTS:
        known = ", ".join(map(repr, _ALIGNMENTS))
        raise ArgumentError("align", f"must be one of {known}, got {align!r}")
    first, second = _match_poses(
        estimate, reference, check_positive("max_time_difference", max_time_difference)
    )
    track, true = _select_poses(estimate, first), _select_poses(reference, second)
    turn, shift, scale = _fit_alignment(track, true, align)
    position = rotations.rotate(turn, scale * track.position) + shift
    orientation = rotations.product(turn, track.quaternion)
    angle = rotations.angle(rotations.product(rotations.inverse(true.quaternion), orientation))
    distance = np.linalg.norm(position - true.position, axis=1)
    return TrackErrors(true.time, distance, angle, turn, shift, scale)


def rpe(
    estimate: Poses,
    reference: Poses,
    *,
    delta: float = 1.0,
    unit: Literal["poses", "m", "s"] = "poses",
    every: bool = False,
    max_time_difference: float = 0.01,
) -> TrackErrors:
    """Return the relative pose error: the difference between steps of a track and true steps.

    These errors do not depend on the start of the track, so there is no alignment.

    Parameters
    ----------
    estimate, reference : Poses
        Estimated and true poses with orientations, with times from the same clock.
    delta : float
        Length of a step in `unit`. Default 1.
    unit : {"poses", "m", "s"}
        Unit of `delta`: "poses" for a number of poses, "m" for metres along the estimated path, or
        "s" for seconds.
    every : bool
        True: a step begins at every pose (evo's ``--all_pairs``). With `unit` "m", its length is
        then the nearest to `delta`, within a tenth of `delta`. False: a step begins at the end of
        the previous step.
    max_time_difference : float
        As in `ate`.

    Returns
    -------
    TrackErrors
        One error per step.

    Raises
    ------
    ValueError
        If the track has no step of this length. If an argument is not as described.

    References
    ----------
    J. Sturm et al., as for `ate`. Pairs and errors are as in ``evo_rpe`` of evo 1.38, which has no
    unit of seconds.

    Examples
    --------
    >>> import zerorate as zr
    >>> time, still = np.arange(4.0), np.tile([1.0, 0.0, 0.0, 0.0], (4, 1))
    >>> line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]])
    >>> true = zr.record.Poses(time, line, still)
    >>> found = zr.metrics.rpe(zr.record.Poses(time, 1.1 * line, still), true)
    >>> found.translation.round(9).tolist()
    [0.1, 0.1, 0.1]
    """
    first, second = _match_poses(
        estimate, reference, check_positive("max_time_difference", max_time_difference)
    )
    track, true = _select_poses(estimate, first), _select_poses(reference, second)
    begin, end = _find_steps(track, check_positive("delta", delta), unit, every)
    if not begin.size:
        raise ValueError(f"the track has no step of {delta:g} {unit}")
    shift, rotation = _relative_poses(track, begin, end)
    true_shift, true_rotation = _relative_poses(true, begin, end)
    # E = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j): a rotation of its translation keeps the length.
    distance = np.linalg.norm(shift - true_shift, axis=1)
    angle = rotations.angle(rotations.product(rotations.inverse(true_rotation), rotation))
    identity = np.array([1.0, 0.0, 0.0, 0.0])
    return TrackErrors(true.time[end], distance, angle, identity, np.zeros(3), 1.0)


def _statistics(values: Floats) -> Statistics:
    if not values.size:
        nan = float("nan")
        return Statistics(nan, nan, nan, nan, nan, nan, 0)
    return Statistics(
        float(np.sqrt(np.mean(values**2))),
        float(values.mean()),
        float(np.median(values)),
        float(values.std()),
        float(values.min()),
        float(values.max()),
        values.size,
    )


def _match_poses(
    estimate: Poses, reference: Poses, max_difference: float
) -> tuple[_Indices, _Indices]:
    """Return the pairs of poses: each pose of the shorter track, with the nearest other pose."""
    more = len(estimate) > len(reference)
    few, many = (reference, estimate) if more else (estimate, reference)
    after = np.clip(np.searchsorted(many.time, few.time), 1, max(len(many) - 1, 1))
    if len(many) == 1:
        after = np.zeros(len(few), dtype=np.intp)
    before = np.maximum(after - 1, 0)
    earlier = np.abs(many.time[before] - few.time) <= np.abs(many.time[after] - few.time)
    nearest = np.where(earlier, before, after)
    is_near = np.abs(many.time[nearest] - few.time) <= max_difference
    own, matches = np.flatnonzero(is_near), nearest[is_near]
    if not own.size:
        spans = [
            f"{poses.time[0]:.3f} to {poses.time[-1]:.3f} s" for poses in (estimate, reference)
        ]
        raise ValueError(
            f"no poses are within {max_difference:g} s of each other: the track's are of "
            f"{spans[0]}, the "
            f"reference's of {spans[1]}"
        )
    return (matches, own) if more else (own, matches)


def _select_poses(poses: Poses, indices: _Indices) -> Poses:
    # A pose may be the nearest of several poses, so times need not increase and are not checked.
    selected = object.__new__(Poses)
    for name in ("time", "position", "quaternion"):
        object.__setattr__(selected, name, getattr(poses, name)[indices])
    object.__setattr__(selected, "source", poses.source)
    return selected


def _fit_alignment(track: Poses, true: Poses, align: Alignment) -> tuple[Floats, Floats, float]:
    """Return the rotation, shift and scale of the best alignment of positions."""
    identity = np.array([1.0, 0.0, 0.0, 0.0])
    if align == "none":
        return identity, np.zeros(3), 1.0
    if align == "origin":
        turn = rotations.product(true.quaternion[0], rotations.inverse(track.quaternion[0]))
        return turn, true.position[0] - rotations.rotate(turn, track.position[0]), 1.0
    present = np.isfinite(track.position).all(axis=1) & np.isfinite(true.position).all(axis=1)
    x, y = track.position[present], true.position[present]
    if not len(x):
        raise ValueError("no pair of poses has both positions")
    a, b = x - x.mean(axis=0), y - y.mean(axis=0)
    if align == "yaw":
        angle = np.arctan2(
            np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a[:, :2] * b[:, :2])
        )
        turn, scale = rotations.about_z(angle), 1.0
    else:
        u, d, vt = np.linalg.svd(b.T @ a / len(x))
        if np.count_nonzero(d > np.finfo(float).eps) < 2:
            raise ValueError(
                "the positions lie on a line or in a point, so that no rotation fits best: give "
                "align='yaw' or 'none'"
            )
        sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
        turn = rotations.from_matrices((u * sign @ vt)[np.newaxis])[0]
        scale = float(d @ sign / np.mean(np.sum(a**2, axis=1))) if align == "similar" else 1.0
    return turn, y.mean(axis=0) - rotations.rotate(turn, scale * x.mean(axis=0)), scale


def _find_steps(track: Poses, delta: float, unit: str, every: bool) -> tuple[_Indices, _Indices]:
    """Return the beginnings and ends of steps."""
    n = len(track.time)
    if unit == "poses":
        step = int(delta)
        if step != delta:
            raise ArgumentError("delta", f"must be a whole number of poses, got {delta}")
        begin = np.arange(0, n - step, 1 if every else step)
        return begin, begin + step
    if unit not in ("m", "s"):
        raise ArgumentError("unit", f"must be 'poses', 'm' or 's', got {unit!r}")
    moved = np.linalg.norm(np.diff(track.position, axis=0), axis=1) if unit == "m" else None
    course = track.time - track.time[0] if moved is None else np.concatenate(([0], moved.cumsum()))
    return _nearest_steps(course, delta) if every else _consecutive_steps(course, delta)


def _consecutive_steps(course: Floats, delta: float) -> tuple[_Indices, _Indices]:
    """Return steps that begin at the end of the step before, as evo does for paths."""
    ends = [0]
    last = course[0]
    for i, value in enumerate(course.tolist()):
        if value - last >= delta:
            ends.append(i)
            last = value
    indices = np.array(ends, dtype=np.intp)
    return indices[:-1], indices[1:]


def _nearest_steps(course: Floats, delta: float) -> tuple[_Indices, _Indices]:
    """Return from each pose the step with the nearest length, within a tenth."""
    begin = np.arange(len(course) - 1)
    after = np.clip(np.searchsorted(course, course[:-1] + delta), begin + 1, len(course) - 1)
    before = np.maximum(after - 1, begin + 1)
    miss = [np.abs(course[candidate] - course[:-1] - delta) for candidate in (before, after)]
    end = np.where(miss[0] <= miss[1], before, after)
    near = np.minimum(*miss) <= 0.1 * delta
    return begin[near], end[near]


def _relative_poses(poses: Poses, begin: _Indices, end: _Indices) -> tuple[Floats, Floats]:
    """Return the translation and rotation of steps, in the axes of the body at their start."""
    back = rotations.inverse(poses.quaternion[begin])
    translation = rotations.rotate(back, poses.position[end] - poses.position[begin])
    return translation, rotations.product(back, poses.quaternion[end])
