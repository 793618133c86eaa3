"""Simulated walk of a sensor on a foot, with known path and errors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.record import Log, Recording
from zerorate.record.log import check_rate
from zerorate.simulation.gyro import check_not_negative, check_whole
from zerorate.types import Booleans, Floats

_GRAVITY: Final = np.array([0.0, 0.0, 9.81])


@dataclass(frozen=True, eq=False)
class SimulatedWalk:
    """Simulated walk of n samples, as `simulate_walk` returns it.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times of the samples, s.
    gyro, accel : ndarray, shape (n, 3)
        Samples of the gyro (rad/s) and the accelerometer (m/s^2). The axes are forward, left, up.
    position : ndarray, shape (n, 3)
        Position of the sensor relative to the start, m: forward, left, up.
    standing : ndarray of bool, shape (n,)
        Mask of samples at which the foot is completely at rest.
    distance : float
        Horizontal path length from stance to stance, m.
    stride_count : int
        Number of strides.
    rate : float
        Sampling rate, Hz.

    Examples
    --------
    >>> import zerorate as zr
    >>> walk = zr.simulate_walk(strides=10, seed=1)
    >>> walk.stride_count, walk.recording().names, bool(walk.standing[0])
    (10, ('gyro', 'accel'), True)
    """

    time: Floats
    gyro: Floats
    accel: Floats
    position: Floats
    standing: Booleans
    distance: float
    stride_count: int
    rate: float

    def recording(self) -> Recording:
        """Return a recording with the gyro and the accelerometer."""

        def log(values: Floats, kind: str, suffix: str, unit: str) -> Log:
            names = tuple(f"{kind}_{axis}_{suffix}" for axis in "xyz")
            return Log.at(self.time, self.rate, values, names, unit, {"source": "simulated walk"})

        logs = {
            "gyro": log(self.gyro, "gyro", "radps", "rad/s"),
            "accel": log(self.accel, "accel", "mps2", "m/s^2"),
        }
        return Recording(logs, "simulated walk")


def simulate_walk(
    rate: float = 200.0,
    strides: int = 60,
    *,
    seed: int = 0,
    length: float = 1.3,
    stance: float = 0.45,
    swing: float = 0.6,
    turn: float = 0.0,
    step_height: float = 0.0,
    rest: float = 2.0,
    gyro_noise: float = 1e-4,
    accel_noise: float = 1e-3,
    gyro_bias: float = 3e-3,
    gyro_range: float = math.inf,
) -> SimulatedWalk:
    """Simulate the walk of a foot that stands and swings in turn.

    In a swing the foot follows polynomials that start and end at rest. It pitches up and down by
    0.7 rad, with a peak rate of about 9 rad/s for the default `swing`. In a stance the foot is
    exactly at rest.

    Parameters
    ----------
    rate : float
        Sampling rate, Hz.
    strides : int
        Number of strides.
    seed : int
        Seed of the noise and the biases.
    length : float
        Mean length of a stride, m. Each stride varies randomly by up to a tenth.
    stance, swing : float
        Duration of each stance and each swing, s.
    turn : float
        Change of heading to the left in each stride, rad.
    step_height : float
        Climb of each stride, m.
    rest : float
        Duration of the rest before the first stride and after the last stride, s.
    gyro_noise, accel_noise : float
        White noise of the gyro (rad/s/sqrt(Hz)) and the accelerometer (m/s^2/sqrt(Hz)).
    gyro_bias : float
        Standard deviation of the random constant biases, rad/s.
    gyro_range : float
        Range of the gyro, rad/s. The gyro clips there.

    Returns
    -------
    SimulatedWalk
        Samples of the sensor, with the truth.

    Raises
    ------
    ValueError
        If a parameter is out of range.

    Examples
    --------
    >>> import zerorate as zr
    >>> walk = zr.simulate_walk(strides=10, seed=1)
    >>> len(walk.time), round(walk.distance, 1)
    (2900, 13.0)
    """
    gait = _Gait(rate, stance, swing)
    sensor = _SensorErrors(gyro_noise, accel_noise, gyro_bias, gyro_range)
    check_whole("strides", strides, 1)
    _check_sizes(length, rest)
    draws = np.random.default_rng(seed)
    lengths = length * (1.0 + 0.1 * draws.uniform(-1.0, 1.0, strides))
    directions = turn * (np.arange(strides) + 0.5)
    moves = np.column_stack(
        [lengths * np.cos(directions), lengths * np.sin(directions), np.full(strides, step_height)]
    )
    headings: Floats = turn * np.arange(strides + 1.0)
    return _simulate_foot(gait, _Path(np.zeros(3), moves, headings), (rest, rest), sensor, draws)


def simulate_feet(
    rate: float = 200.0,
    strides: int = 60,
    *,
    seed: int = 0,
    length: float = 1.3,
    stance: float = 0.65,
    swing: float = 0.5,
    turn: float = 0.0,
    step_width: float = 0.2,
    rest: float = 2.0,
    gyro_noise: float = 1e-4,
    accel_noise: float = 1e-3,
    gyro_bias: float = 3e-3,
    gyro_range: float = math.inf,
) -> tuple[SimulatedWalk, SimulatedWalk]:
    """Simulate the walk of a left and a right foot, each with its own sensor.

    The left foot steps first, with half a stride. Then the feet alternate. The right foot ends next
    to the left foot with half a stride.

    Parameters
    ----------
    rate, strides, seed, length, stance, swing, turn, rest
        As in `simulate_walk`. `strides` counts the strides of each foot.
    step_width : float
        Distance between the feet when they stand next to each other, m.
    gyro_noise, accel_noise, gyro_bias, gyro_range
        As in `simulate_walk`, for both sensors.

    Returns
    -------
    tuple of SimulatedWalk
        Left foot and right foot, on one clock and in one frame. The left foot starts at (0, 0, 0),
        the right foot at (0, -`step_width`, 0).

    Raises
    ------
    ValueError
        If a parameter is out of range.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> left, right = zr.simulate_feet(strides=10, seed=1)
    >>> gap = np.hypot(*(left.position - right.position)[:, :2].T)
    >>> bool(gap.max() < 0.8)
    True
    """
    gait = _Gait(rate, stance, swing)
    sensor = _SensorErrors(gyro_noise, accel_noise, gyro_bias, gyro_range)
    check_whole("strides", strides, 2)
    _check_sizes(length, rest)
    check_not_negative("step_width", step_width)
    draws = np.random.default_rng(seed)
    later = 0.5 * (stance + swing)
    left = np.concatenate([[0.0], np.arange(strides) + 0.5])
    right = np.concatenate([np.arange(strides), [strides - 0.5]])
    feet = []
    for stations, side, rests in (
        (left, 0.5 * step_width, (rest, rest + later)),
        (right, -0.5 * step_width, (rest + later, rest)),
    ):
        uneven = 0.05 * draws.uniform(-1.0, 1.0, strides + 1)
        uneven[[0, -1]] = 0.0
        path = _Path.follow_arc(length * (stations + uneven), turn / length, side, 0.5 * step_width)
        feet.append(_simulate_foot(gait, path, rests, sensor, draws))
    return feet[0], feet[1]


def _check_sizes(length: float, rest: float) -> None:
    check_not_negative("rest", rest)
    _check_positive("length", length)


def _check_positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise ArgumentError(name, f"must be a positive number, got {value!r}")


@dataclass(frozen=True)
class _SensorErrors:
    """Errors of a foot's sensor."""

    gyro_noise: float
    accel_noise: float
    gyro_bias: float
    gyro_range: float

    def __post_init__(self) -> None:
        check_not_negative("gyro_noise", self.gyro_noise)
        check_not_negative("accel_noise", self.accel_noise)
        if not self.gyro_range > 0.0:
            raise ArgumentError("gyro_range", f"must be a positive number, got {self.gyro_range!r}")


@dataclass(frozen=True)
class _Gait:
    """Gait of a foot."""

    rate: float
    stance: float
    swing: float

    def __post_init__(self) -> None:
        check_rate(self.rate)
        _check_positive("stance", self.stance)
        _check_positive("swing", self.swing)


@dataclass(frozen=True, eq=False)
class _Path:
    """Start of a foot, m, its displacement in each stride, m, and its heading in stances, rad."""

    begin: Floats
    moves: Floats
    headings: Floats

    @classmethod
    def follow_arc(cls, way: Floats, curvature: float, side: float, left: float) -> _Path:
        """Return the path of a foot left of a curved line; the left foot starts at 0."""
        headings = curvature * way
        if curvature:
            middle = np.column_stack([np.sin(headings), 1.0 - np.cos(headings)]) / curvature
        else:
            middle = np.column_stack([way, np.zeros_like(way)])
        stands = np.zeros((len(way), 3))
        stands[:, :2] = middle + side * np.column_stack([-np.sin(headings), np.cos(headings)])
        stands[:, 1] -= left
        return cls(stands[0], np.diff(stands, axis=0), headings)


def _simulate_foot(
    gait: _Gait,
    path: _Path,
    rests: tuple[float, float],
    sensor: _SensorErrors,
    draws: np.random.Generator,
) -> SimulatedWalk:
    """Return the walk of a foot along a path."""
    rate, swing, moves = gait.rate, gait.swing, path.moves
    strides, cycle = len(moves), swing + gait.stance
    n = round((sum(rests) + strides * cycle) * rate)
    time = np.arange(n) / rate
    phase = time - rests[0]
    k = np.clip(np.floor(phase / cycle).astype(np.intp), 0, strides - 1)
    s = np.clip((phase - k * cycle) / swing, 0.0, 1.0)
    begins = path.begin + np.vstack([np.zeros(3), np.cumsum(moves, axis=0)])
    part, part2 = _ease(s), _ease_acceleration(s) / swing**2
    lift, lift2 = _bump(s), _bump_acceleration(s) / swing**2
    position = begins[k] + part[:, np.newaxis] * moves[k]
    acceleration = part2[:, np.newaxis] * moves[k]
    lift_height = 0.1 + 0.5 * np.abs(moves[k, 2])
    position[:, 2] += lift_height * lift
    acceleration[:, 2] += lift_height * lift2
    turn = np.diff(path.headings)[k]
    yaw, yaw_rate = path.headings[k] + turn * part, turn * _ease_rate(s) / swing
    pitch, pitch_rate = _pitch(s), _pitch_rate(s) / swing
    rotation = _rotations(yaw, pitch)
    true_rate = np.column_stack([-yaw_rate * np.sin(pitch), pitch_rate, yaw_rate * np.cos(pitch)])
    force = np.einsum("nji,nj->ni", rotation, acceleration + _GRAVITY)
    bias = sensor.gyro_bias * draws.standard_normal(3)
    noise = draws.standard_normal((2, n, 3)) * math.sqrt(rate)
    max_rate = sensor.gyro_range
    gyro = np.clip(true_rate + bias + sensor.gyro_noise * noise[0], -max_rate, max_rate)
    return SimulatedWalk(
        time,
        gyro,
        force + sensor.accel_noise * noise[1],
        position,
        (s <= 0.0) | (s >= 1.0),
        float(np.hypot(*moves[:, :2].T).sum()),
        strides,
        rate,
    )


def _ease(s: Floats) -> Floats:
    moved: Floats = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    return moved


def _ease_rate(s: Floats) -> Floats:
    moved: Floats = 30.0 * s**2 * (1.0 - s) ** 2
    return moved


def _ease_acceleration(s: Floats) -> Floats:
    moved: Floats = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    return moved


def _bump(s: Floats) -> Floats:
    lifted: Floats = 64.0 * (s * (1.0 - s)) ** 3
    return lifted


def _bump_acceleration(s: Floats) -> Floats:
    p, dp = s * (1.0 - s), 1.0 - 2.0 * s
    lifted: Floats = 64.0 * (6.0 * p * dp**2 - 6.0 * p**2)
    return lifted


_PITCH_SCALE: Final = 0.7 * 64.0
"""Scale for a pitch of 0.7 rad in both directions."""


def _pitch(s: Floats) -> Floats:
    pitched: Floats = _PITCH_SCALE * 2.0 * (s * (1.0 - s)) ** 3 * np.sin(2.0 * np.pi * s)
    return pitched


def _pitch_rate(s: Floats) -> Floats:
    p, dp = s * (1.0 - s), 1.0 - 2.0 * s
    sine, cosine = np.sin(2.0 * np.pi * s), np.cos(2.0 * np.pi * s)
    pitched: Floats = _PITCH_SCALE * 2.0 * (3.0 * p**2 * dp * sine + p**3 * 2.0 * np.pi * cosine)
    return pitched


def _rotations(yaw: Floats, pitch: Floats) -> npt.NDArray[np.float64]:
    """Return the rotation matrices from sensor to earth, shape (n, 3, 3)."""
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    zero = np.zeros_like(yaw)
    rows = [[cy * cp, -sy, cy * sp], [sy * cp, cy, sy * sp], [-sp, zero, cp]]
    return np.moveaxis(np.array(rows), 2, 0)
