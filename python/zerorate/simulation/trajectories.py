"""Motions in closed form: orientation, rate and velocity.

Each function draws a random motion and returns it as a `Trajectory`. The earth axes x, y, z are
east, north, up. They are forward, left, up of a level body that heads east.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np

from zerorate.geometry.rotations import from_rotation_vectors, inverse, product, rotate
from zerorate.simulation.hand import draw_hand_motion as turned_by_hand
from zerorate.types import Floats

Random: TypeAlias = np.random.Generator
Motion: TypeAlias = tuple[Floats, Floats, Floats]
"""Quaternions from body to earth, shape (n, 4), rates in the body's axes, rad/s, shape (n, 3), and
velocities in earth axes, m/s, shape (n, 3)."""
Angle: TypeAlias = Callable[[Floats], tuple[Floats, Floats]]
"""Function that returns an angle, rad, and its derivative at given times."""

_G: Final = 9.80665
_TURN: Final = 2.0 * math.pi
_DEG: Final = math.radians(1.0)
_X, _Y, _Z = np.eye(3)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A motion that can start at any time.

    Parameters
    ----------
    at
        Function that returns the motion at times, s, shape (n,), from -1 s.
    ease
        Time from rest to full speed, s.
    """

    at: Callable[[Floats], Motion]
    ease: float = 2.0


@dataclass(frozen=True, eq=False)
class _Waves:
    """A sum of sines about a mean, with its derivative."""

    amplitudes: Floats
    frequencies: Floats
    phases: Floats
    mean: float = 0.0

    @classmethod
    def draw(
        cls,
        random: Random,
        rms: float,
        band: tuple[float, float],
        mean: float = 0.0,
        lines: int = 4,
    ) -> _Waves:
        """Return waves of equal amplitude between two frequencies, Hz."""
        phases, frequencies = random.uniform(0.0, _TURN, lines), random.uniform(*band, lines)
        return cls(np.full(lines, rms * math.sqrt(2.0 / lines)), frequencies, phases, mean)

    @classmethod
    def single(cls, amplitude: float, frequency: float, phase: float, mean: float = 0.0) -> _Waves:
        return cls(np.array([amplitude]), np.array([frequency]), np.array([phase]), mean)

    def __call__(self, t: Floats) -> tuple[Floats, Floats]:
        pulses = _TURN * self.frequencies
        argument = pulses * t[:, None] + self.phases
        return (
            self.mean + np.sin(argument) @ self.amplitudes,
            np.cos(argument) @ (pulses * self.amplitudes),
        )


def pendulum(random: Random, duration: float) -> Trajectory:
    """Return the motion of a sensor on a pendulum that swings in one plane."""
    length = random.uniform(0.5, 1.2)
    heading, phase = random.uniform(0.0, _TURN, 2)
    amplitude = random.uniform(20.0, 60.0) * _DEG
    oscillation = _Waves.single(amplitude, math.sqrt(_G / length) / _TURN, phase)
    # As in a physical pendulum, the lever is shorter than a point pendulum of the same period.
    lever = np.array([0.0, 0.0, -random.uniform(0.4, 0.9) * length])
    return Trajectory(_lever_motion(((_Z, _steady_turn(heading, 0.0)), (_Y, oscillation)), lever))


def spinning_pendulum(random: Random, duration: float) -> Trajectory:
    """Return the motion of a sensor on a pendulum that swings in an ellipse and spins."""
    length = random.uniform(0.5, 1.2)
    frequency = math.sqrt(_G / length) / _TURN
    first, second = (
        _Waves.single(random.uniform(15.0, 45.0) * _DEG, frequency * detuned, phase)
        for detuned, phase in zip((1.0, 1.02), random.uniform(0.0, _TURN, 2), strict=True)
    )
    spin = _steady_turn(random.uniform(0.0, _TURN), _draw_signed(random, 30.0, 150.0) * _DEG)
    lever = np.array([0.0, 0.0, -random.uniform(0.4, 0.9) * length])
    return Trajectory(_lever_motion(((_Y, first), (_X, second), (_Z, spin)), lever))


def arm(random: Random, duration: float) -> Trajectory:
    """Return the motion of a wrist in walking: shoulder, elbow and forearm swing."""
    step = random.uniform(0.8, 1.1)
    phase = random.uniform(0.0, _TURN)
    way = _Waves.draw(random, 60.0 * _DEG, (0.01, 0.04), random.uniform(0.0, _TURN))
    shoulder = _Waves.single(random.uniform(20.0, 40.0) * _DEG, step, phase)
    elbow = _Waves.single(random.uniform(10.0, 25.0) * _DEG, step, phase - 0.5, -25.0 * _DEG)
    roll = _Waves.single(random.uniform(5.0, 20.0) * _DEG, step, phase + 0.7)
    speed, bob = random.uniform(1.0, 1.6), _Waves.single(0.02, 2.0 * step, 2.0 * phase)
    upper = ((_Z, way), (_Y, shoulder))
    at_elbow = _lever_motion(upper, np.array([0.0, 0.0, -0.3]))
    # Motion from the elbow to the wrist, for an elbow at rest.
    from_elbow = _lever_motion((*upper, (_Y, elbow), (_Z, roll)), np.array([0.0, 0.0, -0.25]))

    def at(t: Floats) -> Motion:
        q, rates, velocity = from_elbow(t)
        ahead = way(t)[0]
        body = np.column_stack((speed * np.cos(ahead), speed * np.sin(ahead), bob(t)[1]))
        return q, rates, velocity + at_elbow(t)[2] + body

    return Trajectory(at)


def vehicle(random: Random, duration: float) -> Trajectory:
    """Return the motion of a car in a town: corners and straights, varying speed, uneven road."""
    way = _Corners.draw(random, duration, speed=8.0)
    speed = _Waves.draw(random, 2.0, (0.02, 0.1), 8.0)
    pitch, roll = (_Waves.draw(random, 0.7 * _DEG, (0.2, 1.5)) for _ in range(2))
    heave = _Waves.draw(random, 0.02, (1.0, 8.0))

    def at(t: Floats) -> Motion:
        q, rates = _chain_joints(((_Z, way), (_Y, pitch), (_X, roll)), t)
        ahead, forward_speed = way(t)[0], speed(t)[0]
        return (
            q,
            rates,
            np.column_stack(
                (forward_speed * np.cos(ahead), forward_speed * np.sin(ahead), heave(t)[0])
            ),
        )

    return Trajectory(at, ease=8.0)


def circle(random: Random, duration: float) -> Trajectory:
    """Return an endless motion round a circle, with a small varying tilt."""
    turning = _draw_signed(random, 30.0, 90.0) * _DEG
    radius = random.uniform(0.5, 1.5)
    way = _steady_turn(random.uniform(0.0, _TURN), turning)
    pitch, roll = (_Waves.draw(random, 10.0 * _DEG, (0.05, 0.3)) for _ in range(2))
    speed = abs(turning) * radius

    def at(t: Floats) -> Motion:
        q, rates = _chain_joints(((_Z, way), (_Y, pitch), (_X, roll)), t)
        ahead = way(t)[0]
        return q, rates, speed * np.column_stack((np.cos(ahead), np.sin(ahead), 0.0 * t))

    return Trajectory(at)


def hand(random: Random, duration: float) -> Trajectory:
    """Return the motion of a hand that rotates from pose to pose almost without stops."""
    rest, turn = 0.3, 1.5
    poses = math.ceil((duration + 2.0) / (rest + turn)) + 1
    turns = turned_by_hand(
        poses,
        rest,
        turn,
        angles=(30.0 * _DEG, 150.0 * _DEG),
        axis=None,
        turns=None,
        wobble=0.06,
        tremor=0.02,
        random=random,
        tremor_random=random,
    )
    translations = [_Waves.draw(random, 0.2, (0.1, 1.0)) for _ in range(3)]
    lever = np.array([0.1, 0.0, 0.05])

    def at(t: Floats) -> Motion:
        q, rates = turns.at(t + rest + 0.5 * turn)
        about = rotate(q, np.cross(rates, lever))
        return q, rates, about + np.column_stack([wave(t)[0] for wave in translations])

    return Trajectory(at)


TRAJECTORIES: Final[dict[str, Callable[[Random, float], Trajectory]]] = {
    "pendulum": pendulum,
    "spinning pendulum": spinning_pendulum,
    "arm": arm,
    "vehicle": vehicle,
    "circle": circle,
    "hand": hand,
}


@dataclass(frozen=True, eq=False)
class _Corners:
    """A heading that changes in corners; in each corner the rate is a raised cosine."""

    start: float
    begins: Floats
    lengths: Floats
    angles: Floats

    @classmethod
    def draw(cls, random: Random, duration: float, speed: float) -> _Corners:
        """Return random corners of 30 to 100 deg, with at most 3 m/s^2 of lateral acceleration."""
        start, begin = random.uniform(0.0, _TURN), random.uniform(3.0, 10.0)
        corners = []
        while begin < duration:
            angle = _draw_signed(random, 30.0, 100.0) * _DEG
            length = 2.0 * abs(angle) * speed / random.uniform(1.5, 3.0)
            corners.append((begin, length, angle))
            begin += length + random.uniform(3.0, 15.0)
        rows = np.array(corners).reshape(-1, 3)
        return cls(start, rows[:, 0], rows[:, 1], rows[:, 2])

    def __call__(self, t: Floats) -> tuple[Floats, Floats]:
        heading, rate = np.full(t.size, self.start), np.zeros(t.size)
        for begin, length, angle in zip(self.begins, self.lengths, self.angles, strict=True):
            part = np.clip((t - begin) / length, 0.0, 1.0)
            heading += angle * (part - np.sin(_TURN * part) / _TURN)
            rate += angle / length * (1.0 - np.cos(_TURN * part))
        return heading, rate


def _steady_turn(start: float, rate: float) -> Angle:
    return lambda t: (start + rate * t, np.full(t.size, rate))


def _draw_signed(random: Random, low: float, high: float) -> float:
    return float(random.choice((-1.0, 1.0)) * random.uniform(low, high))


def _lever_motion(
    joints: Sequence[tuple[Floats, Angle]], lever: Floats
) -> Callable[[Floats], Motion]:
    """Return the motion of a lever's end behind joints; the first joint does not move."""

    def at(t: Floats) -> Motion:
        q, rates = _chain_joints(joints, t)
        return q, rates, rotate(q, np.cross(rates, lever))

    return at


def _chain_joints(joints: Sequence[tuple[Floats, Angle]], t: Floats) -> tuple[Floats, Floats]:
    """Return orientation and rate behind joints; each axis belongs to the previous joint."""
    q, rates = np.tile([1.0, 0.0, 0.0, 0.0], (t.size, 1)), np.zeros((t.size, 3))
    for axis, joint in joints:
        angle, rate = joint(t)
        step = from_rotation_vectors(axis * angle[:, None])
        q, rates = product(q, step), rotate(inverse(step), rates) + axis * rate[:, None]
    return q, rates
