"""Rotations by hand between poses, in closed form: orientation and derivative."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.geometry.rotations import (
    from_matrices,
    from_rotation_vectors,
    inverse,
    product,
    rotate,
    to_rotation_vectors,
    unit,
)
from zerorate.simulation.gyro import check_not_negative, check_whole
from zerorate.types import Floats, Integers

Poses: TypeAlias = int | Literal["six"] | npt.ArrayLike

_TREMOR_BAND_HZ: Final = (1.0, 8.0)
"""Frequency band of the hand's tremor, Hz."""
_TREMOR_LINES: Final = 8
_SIX_UP_AXES: Final = np.array(
    [[0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, -1], [-1, 0, 0], [0, -1, 0]]
)
"""Body axes that point up in the six poses; each is perpendicular to the next."""


@dataclass(frozen=True, eq=False)
class Hand:
    """Orientations ``starts[i] Exp(vectors[i] s) Exp(aside)``; s goes from 0 to 1 in a rotation.

    Parameters
    ----------
    starts
        Quaternions of the poses, from the body to the world, shape (m, 4).
    vectors
        Rotation vector from each pose to the next, rad, shape (m, 3). It is zero for the last pose.
    wobbles
        Deviation of the hand from the axis of the rotation, rad, shape (m, 2, 3). It has an even
        and an odd part about the middle of the rotation.
    rest, turn
        Duration of each rest, and duration of each rotation, s.
    amplitudes, frequencies, phases
        Tremor: amplitudes, rad/s, shape (k, 3), frequencies, Hz, (k,), and phases, rad, (k, 3).
    """

    starts: Floats
    vectors: Floats
    wobbles: Floats
    rest: float
    turn: float
    amplitudes: Floats
    frequencies: Floats
    phases: Floats

    @property
    def duration(self) -> float:
        """Time from the start of the first rest to the end of the last rest, s."""
        return len(self.starts) * (self.rest + self.turn) - self.turn

    def at(self, t: Floats) -> tuple[Floats, Floats]:
        """Return orientations, shape (n, 4), and rates in the body's axes, rad/s, (n, 3)."""
        index, part = self.progress(t)
        along, speed = _least_jerk(part)
        vector = self.vectors[index]
        wobble, drift = self._wobble(t, index, part)
        step = from_rotation_vectors(wobble)
        main = product(self.starts[index], from_rotation_vectors(vector * along[:, None]))
        rates = rotate(inverse(step), vector * (speed / self.turn)[:, None])
        return product(main, step), rates + _rate_of_vector(wobble, drift)

    def interpolate(self, t: Floats, of_poses: Floats) -> Floats:
        """Return values of the poses, shape (m, k), with a smooth change during rotations."""
        index, part = self.progress(t)
        along = _least_jerk(part)[0][:, None]
        following = np.minimum(index + 1, len(of_poses) - 1)
        changed: Floats = of_poses[index] * (1.0 - along) + of_poses[following] * along
        return changed

    def progress(self, t: Floats) -> tuple[Integers, Floats]:
        """Return the last pose before each time, and the finished part of its rotation, 0 to 1."""
        length = self.rest + self.turn
        # Rounding must not assign the first sample of a rest to the rotation before it.
        index = np.clip(np.floor(t / length + 1e-9), 0, len(self.starts) - 1).astype(np.int64)
        return index, np.clip((t - index * length - self.rest) / self.turn, 0.0, 1.0)

    def spans(self, rate: float, n: int) -> tuple[Integers, Integers]:
        """Return the samples of the rests, shape (m, 2), and of the rotations, (m - 1, 2)."""
        begin = np.arange(len(self.starts)) * (self.rest + self.turn)
        first = np.ceil(begin * rate - 1e-6).astype(np.int64)
        stop = np.floor((begin + self.rest) * rate + 1e-6).astype(np.int64) + 1
        rests = np.column_stack((first, np.minimum(stop, n)))
        return rests, np.column_stack((rests[:-1, 1] - 1, rests[1:, 0] + 1))

    def _wobble(self, t: Floats, index: Integers, part: Floats) -> tuple[Floats, Floats]:
        """Return the hand's deviation from the rotation axis, rad, and its derivative."""
        angle, rate = np.zeros((t.size, 3)), np.zeros((t.size, 3))
        for side, (bump, slope) in zip((0, 1), _bumps(part), strict=True):
            angle += self.wobbles[index, side] * bump[:, None]
            rate += self.wobbles[index, side] * (slope / self.turn)[:, None]
        lines = zip(self.amplitudes, self.frequencies, self.phases, strict=True)
        for amplitude, frequency, phase in lines:
            pulse = 2.0 * math.pi * frequency
            angle += amplitude / pulse * np.sin(pulse * t[:, None] + phase)
            rate += amplitude * np.cos(pulse * t[:, None] + phase)
        return angle, rate


def draw_hand_motion(
    poses: Poses,
    rest: float,
    turn: float,
    *,
    angles: tuple[float, float],
    axis: npt.ArrayLike | None,
    turns: npt.ArrayLike | None,
    wobble: float,
    tremor: float,
    random: np.random.Generator,
    tremor_random: np.random.Generator,
) -> Hand:
    """Return the motion of a session. For arguments see `zerorate.simulation.simulate_session`."""
    if turns is not None:
        vectors = check_shape("turns", turns, (None, 3))
        starts = _chain_poses(vectors)
    elif isinstance(poses, int):
        vectors = _draw_turns(check_whole("poses", poses, 1) - 1, angles, axis, random)
        starts = _chain_poses(vectors)
    else:
        starts = _check_poses(poses)
        vectors = to_rotation_vectors(product(inverse(starts[:-1]), starts[1:]))
    wobbles = check_not_negative("wobble", wobble) * random.standard_normal((len(starts), 2, 3))
    # A given axis has no wobble, and after the last pose there is no rotation.
    wobbles[slice(-1, None) if axis is None else slice(None)] = 0.0
    vectors = np.concatenate((vectors, np.zeros((1, 3))))
    return Hand(starts, vectors, wobbles, rest, turn, *_draw_tremor(tremor, tremor_random))


def check_shape(name: str, values: npt.ArrayLike, shape: tuple[int | None, ...]) -> Floats:
    """Return finite numbers of a shape (None: any length). Raises ValueError for other values."""
    numbers = np.array(values, dtype=np.float64)
    fits = numbers.ndim == len(shape) and all(
        wanted in (None, length_found)
        for wanted, length_found in zip(shape, numbers.shape, strict=True)
    )
    if not fits or not np.isfinite(numbers).all():
        text = ", ".join("m" if length is None else str(length) for length in shape)
        raise ArgumentError(name, f"must be finite, of shape ({text}), got {numbers.shape}")
    return numbers


def take_or_draw(
    name: str, value: npt.ArrayLike, shape: tuple[int, ...], random: np.random.Generator
) -> Floats:
    """Return the given numbers; if it is one number, return it times normal random numbers."""
    drawn = random.standard_normal(shape)
    if np.ndim(value) > 0:
        return check_shape(name, value, shape)
    scaled: Floats = check_not_negative(name, float(value)) * drawn  # type: ignore[arg-type]
    return scaled


def _least_jerk(part: Floats) -> tuple[Floats, Floats]:
    along = part**3 * (10.0 - part * (15.0 - 6.0 * part))
    return along, 30.0 * (part * (1.0 - part)) ** 2


def _bumps(part: Floats) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Return an even and an odd bump with their slopes; their ends are as smooth as a rotation."""
    even = 64.0 * (part * (1.0 - part)) ** 3
    middle = 1.0 - 2.0 * part
    slope = 192.0 * (part * (1.0 - part)) ** 2 * middle
    return (even, slope), (even * middle, slope * middle - 2.0 * even)


def _rate_of_vector(vector: Floats, derivative: Floats) -> Floats:
    """Return the rate, in the rotated axes, of Exp(vector) for a changing vector."""
    angle = np.linalg.norm(vector, axis=1, keepdims=True)
    half = 0.5 * np.sinc(angle / (2.0 * math.pi)) ** 2
    # For small x, 1 - sin(x)/x loses precision, so a series is used.
    square = np.maximum(angle**2, 1e-4)
    exact = (1.0 - np.sinc(angle / math.pi)) / square
    sixth = np.where(angle < 1e-2, (1.0 - angle**2 / 20.0) / 6.0, exact)
    across = np.cross(vector, derivative)
    rate: Floats = derivative - half * across + sixth * np.cross(vector, across)
    return rate


def _chain_poses(vectors: Floats) -> Floats:
    """Return the poses that these rotations connect; the first pose is level."""
    starts = [np.array([1.0, 0.0, 0.0, 0.0])]
    for step in from_rotation_vectors(vectors):
        starts.append(unit(product(starts[-1], step)))
    return np.array(starts)


def _draw_turns(
    count: int,
    angles: tuple[float, float],
    axis: npt.ArrayLike | None,
    random: np.random.Generator,
) -> Floats:
    low, high = angles
    if not 0.0 < low <= high < math.inf:
        raise ArgumentError("angles", f"must rise from above 0 rad, got {low:g} and {high:g}")
    about, size = random.standard_normal((count, 3)), random.uniform(low, high, count)
    if axis is not None:
        about = np.sign(about[:, :1]) * check_shape("axis", axis, (3,))
    length = np.linalg.norm(about, axis=1, keepdims=True)
    if not (length > 0.0).all():
        raise ArgumentError("axis", "must have a length above 0")
    vectors: Floats = about / length * size[:, None]
    return vectors


def _check_poses(poses: npt.ArrayLike) -> Floats:
    if isinstance(poses, str):
        if poses != "six":
            raise ArgumentError("poses", f"must be a number, 'six' or orientations, got {poses!r}")
        return _chain_poses(np.cross(_SIX_UP_AXES[1:], _SIX_UP_AXES[:-1]) * (math.pi / 2.0))
    array = np.array(poses, dtype=np.float64)
    if array.ndim == 3:
        return _from_matrices(check_shape("poses", array, (None, 3, 3)))
    quaternions = unit(check_shape("poses", array, (None, 4)))
    if not (len(array) and np.isfinite(quaternions).all()):
        raise ArgumentError("poses", "must be one quaternion or more, each with a length above 0")
    return quaternions


def _from_matrices(matrices: Floats) -> Floats:
    """Return quaternions from rotation matrices. Raises ValueError for other matrices."""
    across = matrices.transpose(0, 2, 1)
    proper = np.linalg.det(matrices) > 0.0
    if not len(matrices) or not (
        proper.all() and np.allclose(matrices @ across, np.eye(3), atol=1e-6)
    ):
        raise ArgumentError("poses", "must be rotation matrices: orthogonal, of determinant 1")
    return from_matrices(matrices)


def _draw_tremor(tremor: float, random: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """Return amplitudes, frequencies and phases; `tremor` is the RMS of the total rate, rad/s."""
    count = _TREMOR_LINES if check_not_negative("tremor", tremor) else 0
    amplitude = tremor * math.sqrt(2.0 / (3.0 * _TREMOR_LINES))
    phases = random.uniform(0.0, 2.0 * math.pi, (count, 3))
    return np.full((count, 3), amplitude), random.uniform(*_TREMOR_BAND_HZ, count), phases
