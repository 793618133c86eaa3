"""Two feet of one person: both tracks in one frame with a bound, and their differences."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.foot.foot import FootTrack
from zerorate.geometry.rotations import from_rotation_vectors, product
from zerorate.numerals import shorten
from zerorate.views import Result

if TYPE_CHECKING:
    from zerorate.types import Floats

_ALIGNMENT_M: Final = 20.0
"""Length of the path by which the frames of both feet are aligned, m."""
_PRIOR_SIGMAS: Final = (0.5, 0.1)
"""Standard deviations of the aligned right foot: position, m, and heading, rad."""
_BOUND_SIGMA_M: Final = 0.1
"""Standard deviation of the bound on the distance, m."""
_STEP_SIGMAS: Final = (0.005, 0.005)
"""Standard deviation of a step without the heading error: m, and relative to its length."""
_MIN_HEADING_SIGMA_RAD: Final = 1e-4
"""Smallest standard deviation of the heading drift between two stances, rad."""
_MIN_COMMON_S: Final = 5.0
"""Shortest common time of both tracks, s."""
_COMPARED_QUANTITIES: Final = (
    "stride_length",
    "stride_time",
    "gait_velocity",
    "swing_time",
    "stance_time",
    "max_sensor_lift",
)


_STANCE_QUANTITIES: Final = ("swing_time", "stance_time")
"""Times with the core's resolution; in a regular walk all have the same rounding error."""
_INSTANT_SIGMA_S: Final = 0.02 / math.sqrt(12.0)
"""Standard deviation of a time by the core's step of 0.02 s, s."""


@dataclass(frozen=True)
class Asymmetry:
    """Difference of a quantity between the feet.

    Parameters
    ----------
    left, right : float
        Mean of the quantity over the strides of each foot.
    percent : float
        Left minus right, divided by the mean of both, in percent (Robinson's symmetry index).
    percent_sigma : float
        Standard error of `percent`, from the scatter of the strides. For swing and stance times it
        includes the time resolution of 0.02 s.

    Examples
    --------
    >>> from zerorate.foot import Asymmetry
    >>> step = Asymmetry(left=1.40, right=1.30, percent=7.4, percent_sigma=0.9)
    >>> step.percent > 3 * step.percent_sigma
    True
    """

    left: float
    right: float
    percent: float
    percent_sigma: float


@dataclass(frozen=True, eq=False, repr=False)
class Feet(Result):
    """Tracks of two feet in one frame, as `join_feet` returns them.

    Parameters
    ----------
    left, right : FootTrack
        Tracks in the frame of the left foot.
    distance : float
        Bound on the distance between the feet, m.
    bound_count : int
        Number of times at which the feet were farther apart than `distance`. The tracks were
        corrected there.

    Examples
    --------
    >>> import zerorate as zr
    >>> walks = zr.simulate_feet(strides=20, seed=1)
    >>> tracks = [zr.FootNavigation().process(walk.recording()).smooth() for walk in walks]
    >>> feet = zr.join_feet(*tracks)
    >>> feet.distance, abs(feet.asymmetry()["stride_length"].percent) < 1.0
    (1.2, True)
    """

    left: FootTrack
    right: FootTrack
    distance: float
    bound_count: int

    def __repr__(self) -> str:
        """Return the distance walked by each foot, and the number of corrections."""
        return (
            f"Feet({shorten(self.left.distance, 4)} m left, {shorten(self.right.distance, 4)} "
            "m right, "
            f"{self.bound_count} times at the bound of {self.distance:g} m)"
        )

    def asymmetry(self) -> dict[str, Asymmetry]:
        """Return the `Asymmetry` of each quantity of `Strides`, by its name.

        A quantity is left out if it is known for fewer than two strides of a foot. Definition: R.
        O. Robinson, W. Herzog, B. M. Nigg, *J. Manipulative and Physiological Therapeutics* 10(4),
        1987.
        """
        strides_by_side = {"left": self.left.strides(), "right": self.right.strides()}
        asymmetries = {}
        for name in _COMPARED_QUANTITIES:
            values = [getattr(strides, name) for strides in strides_by_side.values()]
            known = [values_known[np.isfinite(values_known)] for values_known in values]
            if min(map(len, known)) < 2:
                continue
            left, right = (float(values_known.mean()) for values_known in known)
            errors = [
                values_known.std(ddof=1) / math.sqrt(len(values_known)) for values_known in known
            ]
            errors += [_INSTANT_SIGMA_S] * len(known) if name in _STANCE_QUANTITIES else []
            mean = 0.5 * (left + right)
            sigma = 100.0 * math.hypot(*errors) / mean
            asymmetries[name] = Asymmetry(left, right, 100.0 * (left - right) / mean, sigma)
        return asymmetries


def join_feet(left: FootTrack, right: FootTrack, *, distance: float = 1.2) -> Feet:
    """Return the tracks of both feet of a person in one frame, with a bound on their distance.

    The feet are never farther apart than one step. If the tracks exceed this distance, their
    headings have drifted apart. A Kalman smoother over the steps of both feet then corrects the
    headings within their standard deviations. A drift that is equal in both headings cannot be
    detected.

    Parameters
    ----------
    left, right : FootTrack
        Tracks on one clock, preferably smoothed. The sensors may be mounted in any direction: the
        first 20 m align the right track with the left track.
    distance : float, default 1.2
        Largest distance between the feet, m. 1.2 m suits walking. Running needs a larger value.

    Returns
    -------
    Feet
        Both tracks with new positions, orientations, and standard deviations of horizontal position
        and heading.

    Raises
    ------
    ValueError
        If the tracks have less than 5 s in common, or a track has fewer than four stances. If the
        distance is not positive.

    Notes
    -----
    Standard deviations of the position are relative to the left foot's start.

    I. Skog, J.-O. Nilsson, D. Zachariah, P. Händel, *IPIN*, 2012.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> walks = zr.simulate_feet(strides=30, seed=1)
    >>> tracks = [zr.FootNavigation().process(walk.recording()).smooth() for walk in walks]
    >>> feet = zr.join_feet(*tracks)
    >>> gap = np.hypot(*(feet.left.position - feet.right.position)[:, :2].T)
    >>> bool(np.nanmax(gap) < 1.3), sorted(feet.asymmetry())[:2]
    (True, ['gait_velocity', 'max_sensor_lift'])
    """
    if not (math.isfinite(distance) and distance > 0.0):
        raise ArgumentError("distance", f"must be a positive number of m, got {distance!r}")
    feet = (_Foot(left), _Foot(right))
    first = max(foot.time[0] for foot in feet)
    last = min(foot.time[-1] for foot in feet)
    marks = [foot.stances(first, last) for foot in feet]
    if last - first < _MIN_COMMON_S or min(map(len, marks)) < 4:
        raise ArgumentError(
            "right",
            f"must have {_MIN_COMMON_S:g} s and four stances in common with left on one clock, got "
            f"{shorten(max(last - first, 0.0), 3)} s with {len(marks[0])} and {len(marks[1])}",
        )
    times = np.unique(np.concatenate([[first], *marks, [last]]))
    positions = np.array([foot.position_at(times) for foot in feet])
    turn, shift = _align_tracks(*positions)
    positions[1] = positions[1] * turn + shift
    wander = [np.diff(foot.variance(times)) for foot in feet]
    states, covariances, count = _smooth_feet(positions, np.array(wander), distance)
    tracks = []
    for i, foot in enumerate(feet):
        foot_states, p = (
            states[:, 3 * i : 3 * i + 3],
            covariances[:, 3 * i : 3 * i + 3, 3 * i : 3 * i + 3],
        )
        alignment = (turn, shift) if i else (1.0 + 0.0j, 0.0j)
        tracks.append(foot.apply_states(times, positions[i], foot_states, p, alignment))
    return Feet(tracks[0], replace(tracks[1], origin=left.origin), distance, count)


class _Foot:
    """A track as steps, with level positions as complex numbers."""

    def __init__(self, track: FootTrack) -> None:
        known = track.navigating
        if not known.any():
            raise ArgumentError("right", "must be tracks of which some place is known")
        self.track = track
        self.known = known
        self.time = track.time[known]
        self.position = track.position[known, :2] @ np.array([1.0, 1.0j])

    def stances(self, first: float, last: float) -> Floats:
        times = self.track.time[self.track.lowest]
        inside: Floats = times[(times >= first) & (times <= last)]
        return inside

    def position_at(self, times: Floats) -> npt.NDArray[np.complex128]:
        x, y = (
            np.interp(times, self.time, part) for part in (self.position.real, self.position.imag)
        )
        position: npt.NDArray[np.complex128] = x + 1j * y
        return position

    def variance(self, times: Floats) -> Floats:
        sigma = self.track.sigma[self.known, 8]
        known: Floats = np.interp(times, self.time, sigma * sigma)
        return known

    def apply_states(
        self,
        times: Floats,
        positions: np.ndarray,
        states: Floats,
        covariances: Floats,
        alignment: tuple[complex, complex],
    ) -> FootTrack:
        """Return the track, corrected to the given states at the given times."""
        track, (turn, shift) = self.track, alignment
        own = (track.position[:, :2] @ np.array([1.0, 1.0j])) * turn + shift
        heading_change = np.interp(track.time, times, states[:, 2])
        # Between two stances the path is rotated, and the remaining difference is spread over it.
        k = np.clip(np.searchsorted(times, track.time, side="right") - 1, 0, len(times) - 2)
        positions_smoothed = states[:, 0] + 1j * states[:, 1]
        steps = np.diff(positions) * np.exp(1j * states[:-1, 2])
        rest = np.diff(positions_smoothed) - steps
        part = np.clip((track.time - times[k]) / np.diff(times)[k], 0.0, 1.0)
        z = (
            positions_smoothed[k]
            + (own - positions[k]) * np.exp(1j * states[k, 2])
            + part * rest[k]
        )
        position, sigma = track.position.copy(), track.sigma.copy()
        position[:, 0], position[:, 1] = z.real, z.imag
        rotation_vectors = np.zeros((track.n, 3))
        rotation_vectors[:, 2] = heading_change + np.angle(turn)
        rotation = from_rotation_vectors(rotation_vectors)
        for column, i in ((0, 0), (1, 1), (8, 2)):
            sigmas = np.sqrt(np.maximum(np.interp(track.time, times, covariances[:, i, i]), 0.0))
            sigma[:, column] = np.where(self.known, sigmas, sigma[:, column])
        c, s = np.cos(rotation_vectors[:, 2]), np.sin(rotation_vectors[:, 2])
        velocity = track.velocity.copy()
        velocity[:, 0] = c * track.velocity[:, 0] - s * track.velocity[:, 1]
        velocity[:, 1] = s * track.velocity[:, 0] + c * track.velocity[:, 1]
        known = self.known[:, np.newaxis]
        return replace(
            track,
            position=np.where(known, position, np.nan),
            velocity=velocity,
            quaternion=np.where(known, product(rotation, track.quaternion), track.quaternion),
            sigma=sigma,
            smoothed=True,
            _steps=None,
        )


def _align_tracks(left: np.ndarray, right: np.ndarray) -> tuple[complex, complex]:
    """Return the rotation and the shift that align the start of the right track with the left."""
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(left)))])
    count = max(int(np.searchsorted(way, _ALIGNMENT_M)), 4)
    z, w = right[:count], left[:count]
    fit = np.vdot(z - z.mean(), w - w.mean())
    turn = fit / abs(fit) if abs(fit) > 0.0 else 1.0 + 0.0j
    return complex(turn), complex(w.mean() - turn * z.mean())


def _smooth_feet(
    positions: np.ndarray, wander: Floats, distance: float
) -> tuple[Floats, Floats, int]:
    """Return smoothed positions and rotations of both feet, and the number of corrections.

    The state is x, y and rotation of each foot.
    """
    n = positions.shape[1]
    x = np.array(
        [
            positions[0, 0].real,
            positions[0, 0].imag,
            0.0,
            *_real_and_imaginary(positions[1, 0]),
            0.0,
        ]
    )
    p = np.diag(
        [1e-10, 1e-10, 1e-12, _PRIOR_SIGMAS[0] ** 2, _PRIOR_SIGMAS[0] ** 2, _PRIOR_SIGMAS[1] ** 2]
    )
    before, after, moves = [], [], []
    count = 0
    x, p, at_bound = _apply_bound(x, p, distance)
    count += at_bound
    after.append((x, p))
    for k in range(n - 1):
        x, p, f = _predict_step(x, p, positions[:, k + 1] - positions[:, k], wander[:, k])
        before.append((x, p))
        moves.append(f)
        x, p, at_bound = _apply_bound(x, p, distance)
        count += at_bound
        after.append((x, p))
    states, covariances = [after[-1][0]], [after[-1][1]]
    for k in range(n - 2, -1, -1):
        (x, p), (predicted, predicted_covariance) = after[k], before[k]
        gain = np.linalg.solve(predicted_covariance, moves[k] @ p).T
        states.append(x + gain @ (states[-1] - predicted))
        covariances.append(p + gain @ (covariances[-1] - predicted_covariance) @ gain.T)
    return np.array(states[::-1]), np.array(covariances[::-1]), count


def _real_and_imaginary(z: complex) -> tuple[float, float]:
    return z.real, z.imag


def _predict_step(
    x: Floats, p: Floats, steps: np.ndarray, wander: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return the state and its covariance after a step of one foot, and the Jacobian."""
    x, f, q = x.copy(), np.eye(6), np.zeros((6, 6))
    for i, step in enumerate(steps):
        offset = 3 * i
        rotated_step = step * np.exp(1j * x[offset + 2])
        x[offset : offset + 2] += rotated_step.real, rotated_step.imag
        f[offset : offset + 2, offset + 2] = -rotated_step.imag, rotated_step.real
        slips = _STEP_SIGMAS[0] ** 2 + (_STEP_SIGMAS[1] * abs(step)) ** 2
        q[offset, offset] = q[offset + 1, offset + 1] = slips
        q[offset + 2, offset + 2] = max(float(wander[i]), _MIN_HEADING_SIGMA_RAD**2)
    return x, f @ p @ f.T + q, f


def _apply_bound(x: Floats, p: Floats, distance: float) -> tuple[Floats, Floats, bool]:
    """Return the state with the bound applied, and True if the bound changed it."""
    separation = x[:2] - x[3:5]
    size = float(np.hypot(*separation))
    if size <= distance:
        return x, p, False
    h = np.zeros(6)
    h[:2], h[3:5] = separation / size, -separation / size
    spread = h @ p @ h + _BOUND_SIGMA_M**2
    gain = p @ h / spread
    p = p - np.outer(gain, gain) * spread
    return x + gain * (distance - size), 0.5 * (p + p.T), True
