"""Simulated drive of a car: inertial sensors and fixes, with known path and errors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.geometry.earth import (
    SEMI_MAJOR_AXIS,
    earth_rate,
    normal_gravity,
    offset_position,
    radii,
    transport_rate,
    wrap_degrees,
)
from zerorate.geometry.rotations import (
    cumulative_product,
    from_rotation_vectors,
    inverse,
    product,
    rotate,
    unit,
)
from zerorate.geometry.scipy_rotation import RotationLike, as_matrices
from zerorate.noise import NoiseModel
from zerorate.record import Log, Recording
from zerorate.record.fixes import Fixes
from zerorate.record.log import check_rate
from zerorate.record.offset import TimeOffset
from zerorate.record.supplement import Supplement
from zerorate.simulation.devices import Device
from zerorate.simulation.gyro import check_not_negative, check_whole, simulate
from zerorate.simulation.hand import check_shape, take_or_draw
from zerorate.types import Floats, Integers

Noise: TypeAlias = NoiseModel | Device | Literal["consumer"] | None
Mount: TypeAlias = RotationLike | Literal["random"] | None
Kind: TypeAlias = Literal["drive", "rest"]

_CONSUMER: Final = {
    "gyro": NoiseModel(angle_random_walk=1e-4, rate_random_walk=2e-6),
    "accel": NoiseModel(angle_random_walk=1e-3, rate_random_walk=2e-5, quantity="acceleration"),
}
# Append new streams: their position selects the random numbers, and old seeds must not change.
_STREAMS: Final = ("way", "bias", "gyro", "accel", "fixes", "mount", "clock")
_MAX_DURATION_S: Final = 3600.0
"""Longest drive, s; later the unstable height of unaided navigation would leave the road."""
_MAX_ROUNDS: Final = 60
_POSITION_TOLERANCE_M: Final = 5e-9
"""Change of the path at which iteration stops, m: a few rounding steps of a longitude."""


@dataclass(frozen=True, eq=False)
class SimulatedDrive:
    """Simulated drive of n samples, with the truth.

    The earth axes are north, east, down. The body axes are forward, right, down.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times of the samples, s.
    rate : float
        Sampling rate, Hz.
    gyro, accel : ndarray, shape (n, 3)
        Samples of the gyro (rad/s) and the accelerometer (m/s^2).
    fixes : Fixes
        Fixes of the receiver. They are positions of the antenna.
    truth_position : ndarray, shape (n, 3)
        Position of the inertial sensors: latitude and longitude (deg), and height (m).
    truth_velocity : ndarray, shape (n, 3)
        Velocity north, east, down, m/s.
    truth_quaternion : ndarray, shape (n, 4)
        Quaternions w, x, y, z from the body's axes to the earth's axes.
    gyro_bias, accel_bias : ndarray, shape (n, 3)
        Constant bias plus drift of the gyro (rad/s) and the accelerometer (m/s^2). A sample minus
        its bias is the truth plus white noise.
    antenna : ndarray, shape (3,)
        Vector from the inertial sensors to the antenna, in the axes of the body, m.
    body_from_sensor : ndarray, shape (3, 3)
        Rotation from the sensors' axes to the body's axes. Samples and biases are in the sensors'
        axes.
    time_offset : TimeOffset
        Offset to add to the times of the fixes.
    source : str
        Kind of the drive and seed, as text.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=60.0, seed=1)
    >>> drive.rates().shape, drive.recording().names, drive.truth_position.shape
    ((6000, 3), ('gyro', 'accel'), (6000, 3))
    """

    time: Floats
    rate: float
    gyro: Floats
    accel: Floats
    fixes: Fixes
    truth_position: Floats
    truth_velocity: Floats
    truth_quaternion: Floats
    gyro_bias: Floats
    accel_bias: Floats
    antenna: Floats
    body_from_sensor: Floats = field(default_factory=lambda: np.eye(3))
    time_offset: TimeOffset = field(default_factory=lambda: TimeOffset(0.0, 0.0))
    source: str = "a simulated drive"

    def rates(self) -> Floats:
        """Return the angular rates in the body's axes, with noise but without bias."""
        true: Floats = (self.gyro - self.gyro_bias) @ self.body_from_sensor.T
        return true

    def recording(self) -> Recording:
        """Return a recording with the gyro, the accelerometer and the fixes."""

        def log(values: Floats, kind: str, suffix: str, unit: str) -> Log:
            names = tuple(f"{kind}_{axis}_{suffix}" for axis in "xyz")
            return Log.at(self.time, self.rate, values, names, unit, {"source": self.source})

        logs = {
            "gyro": log(self.gyro, "gyro", "radps", "rad/s"),
            "accel": log(self.accel, "accel", "mps2", "m/s^2"),
        }
        return Recording(logs, self.source, supplement=Supplement.of(fixes=self.fixes))


def simulate_drive(
    rate: float = 100.0,
    duration: float = 400.0,
    *,
    seed: int = 0,
    latitude: float = 48.0,
    longitude: float = 11.0,
    height: float = 500.0,
    kind: Kind = "drive",
    rest: float = 30.0,
    gyro: Noise = "consumer",
    accel: Noise = "consumer",
    gyro_bias: npt.ArrayLike = 1e-3,
    accel_bias: npt.ArrayLike = 0.02,
    fixes_rate: float = 1.0,
    position_sigma: npt.ArrayLike = 2.0,
    velocity_sigma: npt.ArrayLike = 0.1,
    antenna: npt.ArrayLike = (0.0, 0.0, 0.0),
    body_from_sensor: Mount = None,
    time_offset: float | TimeOffset = 0.0,
    wander: float = 0.0,
) -> SimulatedDrive:
    """Simulate gyro, accelerometer and receiver of a car on a known path.

    Parameters
    ----------
    rate : float
        Sampling rate of gyro and accelerometer, Hz. Default 100.
    duration : float
        Length of the drive, s, up to 3600. Default 400.
    seed : int
        Seed, at least 0. The same arguments give the same samples. Path, biases, fixes and each
        noise have their own random streams. A change of the noise therefore does not change the
        path.
    latitude, longitude, height : float
        Start position: latitude within 85 deg, longitude within 180 deg, and height above the
        ellipsoid, m.
    kind : {"drive", "rest"}
        "drive" is a car in a town, with hills and cambered roads. It rests, accelerates to 8 to 18
        m/s, slows down for corners, follows bends, stops, and continues. "rest" is a car at rest.
    rest : float
        Duration of the rest at the start, s. Default 30.
    gyro, accel : NoiseModel, Device, "consumer" or None
        Noise of each axis, without its constant bias. None means no noise. The default has white
        noise and a random walk of the bias. Gyro: 1e-4 rad/s/sqrt(Hz) and 2e-6 rad/s/sqrt(s).
        Accelerometer: 1e-3 m/s^2/sqrt(Hz) and 2e-5 m/s^2/sqrt(s).
    gyro_bias, accel_bias : float or array_like, shape (3,)
        Constant biases of the gyro (rad/s) and the accelerometer (m/s^2). One number is the
        standard deviation of random biases. Three numbers are the biases.
    fixes_rate : float
        Rate of the fixes, Hz, up to `rate`. Each fix is at the time of a sample, the first at 0.
    position_sigma, velocity_sigma : float or array_like, shape (3,)
        Standard deviations of the fixes' white noise north, east, down: position (m) and velocity
        (m/s). The fixes state the same values. With 0 they state no standard deviation.
    antenna : float or array_like, shape (3,)
        Vector from the inertial sensors to the antenna, m forward, right, down. One number is the
        standard deviation of a random vector.
    body_from_sensor : array_like, shape (3, 3), scipy Rotation, "random" or None
        Rotation from the sensors' axes to forward, right, down. None means no rotation.
    time_offset : float or TimeOffset
        Offset to add to the times of the fixes, s. `find_time_offset` estimates it. A `TimeOffset`
        has offsets for positions and velocities, and their growth.
    wander : float
        RMS relative variation of the sampling interval over half a minute. The time stamps are
        exact.

    Returns
    -------
    SimulatedDrive
        Samples of the sensors, fixes of the receiver, and the truth.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Notes
    -----
    Heading and speed are closed formulas of time. Pitch and roll are closed formulas of the
    distance along the road. The angular rate and the specific force at the samples follow from
    these formulas, without numerical differences.

    The truth is the strapdown navigation of the exact samples:

    - coning and sculling corrections from two samples
    - velocity ``v + C delta + (g - (2 Omega + rho) x v - (Omega + rho) x C delta / 2) dt``
    - position from the mean of two velocities
    - radii and gravity computed again at each step

    C rotates from body to earth, delta is the velocity increment, Omega the earth's rate, and rho
    the transport rate. A filter with these steps and exact samples therefore returns the truth
    up to rounding. Samples from a given path would oscillate, because the path determines only
    means of the samples.

    The truth differs from the closed formulas by centimetres. Its sideways speed stays below 1 mm/s
    in 400 s and 2 mm/s in an hour. All steps are computed at once, by
    successive approximation.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=120.0, seed=3)
    >>> drive.gyro.shape, drive.fixes
    ((12000, 3), Fixes(120 in 119 s, positions, velocities, sigmas))
    >>> bool((drive.truth_velocity[:3000] ** 2).sum(axis=1).max() < 1e-12)
    True
    """
    hertz = check_rate(rate)
    n = _sample_count(hertz, duration)
    offset = TimeOffset.of(time_offset)
    start = _start_position(latitude, longitude, height)
    random = _streams(seed)
    seconds, hertzes = _draw_times(n, hertz, wander, random["clock"])
    road = _Road.draw(random["way"], _rest_duration(kind, rest), duration)
    rates, force, begin = _sample_road(road, seconds, hertzes, start)
    way = _navigate(rates, force, hertzes, start, begin)
    gyro_error = _SensorError.draw("gyro", gyro, gyro_bias, hertz, n, random)
    accel_error = _SensorError.draw("accel", accel, accel_bias, hertz, n, random)
    lever = take_or_draw("antenna", antenna, (3,), random["mount"])
    turn = _draw_mount(body_from_sensor, random["mount"])
    moments = _fix_samples(fixes_rate, hertz, n)
    sigmas = (
        _check_sigma("position_sigma", position_sigma),
        _check_sigma("velocity_sigma", velocity_sigma),
    )
    return SimulatedDrive(
        time=seconds,
        rate=hertz,
        gyro=gyro_error.add_to(_to_sensor_axes(rates, turn)),
        accel=accel_error.add_to(_to_sensor_axes(force, turn)),
        fixes=_make_fixes(way, rates, lever, seconds, moments, sigmas, random["fixes"], offset),
        truth_position=way.in_degrees(),
        truth_velocity=way.velocity,
        truth_quaternion=way.attitude,
        gyro_bias=gyro_error.bias,
        accel_bias=accel_error.bias,
        antenna=lever,
        body_from_sensor=np.eye(3) if turn is None else turn,
        time_offset=offset,
        source=f"simulated {kind}, seed {seed}",
    )


def _streams(seed: int) -> dict[str, np.random.Generator]:
    children = np.random.SeedSequence(check_whole("seed", seed, 0)).spawn(len(_STREAMS))
    return dict(zip(_STREAMS, map(np.random.default_rng, children), strict=True))


def _sample_count(rate: float, duration: float) -> int:
    if not (2.0 / rate <= duration <= _MAX_DURATION_S):
        raise ArgumentError(
            "duration",
            f"must be two samples or longer, and {_MAX_DURATION_S:g} s at most, got {duration}",
        )
    return round(duration * rate)


def _draw_times(
    n: int, rate: float, wander: float, random: np.random.Generator
) -> tuple[Floats, float | Floats]:
    """Return the sample times, s, and the rate, Hz: one value, or one per interval, (n - 1, 1)."""
    if not 0.0 <= wander <= 0.2:
        raise ArgumentError("wander", f"must be from 0 to 0.2, got {wander}")
    even = np.arange(n) / rate
    if wander == 0.0:
        return even, rate
    phase, period = random.uniform(0.0, 2.0 * math.pi), random.uniform(20.0, 40.0)
    wave = np.sin(2.0 * math.pi * even[1:] / period + phase)
    steps = 1.0 / (1.0 + wander * math.sqrt(2.0) * wave)
    steps *= even[-1] / steps.sum()
    return np.concatenate([[0.0], np.cumsum(steps)]), 1.0 / steps[:, np.newaxis]


def _draw_mount(mount: Mount, random: np.random.Generator) -> Floats | None:
    """Return a rotation from the sensors' axes to the body's axes; None without rotation."""
    if mount is None:
        return None
    if isinstance(mount, str):
        if mount != "random":
            raise ArgumentError(
                "body_from_sensor", f"must be a rotation, 'random' or None, got {mount!r}"
            )
        q = unit(random.standard_normal((1, 4)))
        return rotate(q[0], np.eye(3)).T.copy()
    matrix = check_shape("body_from_sensor", as_matrices(mount), (3, 3))
    if not (np.abs(matrix @ matrix.T - np.eye(3)).max() < 1e-6 and np.linalg.det(matrix) > 0.0):
        raise ArgumentError("body_from_sensor", f"must be a rotation, got {matrix.tolist()}")
    return matrix


class _SensorError(NamedTuple):
    """Errors of a sensor in its axes, (n, 3): white noise, and constant bias plus drift."""

    noise: Floats
    bias: Floats

    @classmethod
    def draw(
        cls,
        name: str,
        noise: Noise,
        bias: npt.ArrayLike,
        rate: float,
        n: int,
        random: Mapping[str, np.random.Generator],
    ) -> _SensorError:
        white, drift = _draw_noise(noise, name, rate, n, random[name])
        return cls(white, take_or_draw(f"{name}_bias", bias, (3,), random["bias"]) + drift)

    def add_to(self, true: Floats) -> Floats:
        """Return the true values plus the errors."""
        return true + self.bias + self.noise


def _rest_duration(kind: Kind, rest: float) -> float:
    """Return the duration of the car's rest at the start, s."""
    if kind not in ("drive", "rest"):
        raise ArgumentError("kind", f"must be 'drive' or 'rest', got {kind!r}")
    return check_not_negative("rest", rest) if kind == "drive" else math.inf


def _to_sensor_axes(vectors: Floats, body_from_sensor: Floats | None) -> Floats:
    rotated: Floats = vectors if body_from_sensor is None else vectors @ body_from_sensor
    return rotated


def _start_position(latitude: float, longitude: float, height: float) -> Floats:
    """Return the start position, rad, rad and m."""
    if not (abs(latitude) <= 85.0 and abs(longitude) <= 180.0 and -1e4 <= height <= 1e5):
        raise ArgumentError(
            "latitude",
            "must be within 85 deg, longitude within 180 deg and height from -1e4 to 1e5 "
            f"m, got {latitude}, {longitude} and {height}",
        )
    return np.array([math.radians(latitude), math.radians(longitude), height])


def _check_sigma(name: str, value: npt.ArrayLike) -> Floats:
    sigma = np.full(3, float(value)) if np.ndim(value) == 0 else value  # type: ignore[arg-type]
    numbers = check_shape(name, sigma, (3,))
    if (numbers < 0.0).any():
        raise ArgumentError(name, f"must not be negative, got {numbers}")
    return numbers


def _fix_samples(fixes_rate: float, rate: float, n: int) -> Integers:
    """Return the indices of the samples with a fix."""
    if not 0.0 < fixes_rate <= rate:
        raise ArgumentError(
            "fixes_rate", f"must be above 0 and {rate:g} Hz at most, got {fixes_rate}"
        )
    count = math.ceil(n * fixes_rate / rate)
    samples = np.rint(np.arange(count) * (rate / fixes_rate)).astype(np.int64)
    inside: Integers = samples[samples < n]
    return inside


def _draw_noise(
    noise: Noise, name: str, rate: float, n: int, random: np.random.Generator
) -> tuple[Floats, Floats]:
    """Return white noise and drift of three axes."""
    seed = int(random.integers(2**63))
    if noise is None:
        return np.zeros((n, 3)), np.zeros((n, 3))
    if isinstance(noise, str) and noise != "consumer":
        raise ArgumentError(
            name, f"must be a NoiseModel, a Device, 'consumer' or None, got {noise!r}"
        )
    model = _CONSUMER[name] if isinstance(noise, str) else noise
    signal, drift = simulate(model, rate, n / rate, seed, axes=3, resolution=0.0, turn_on_bias=0.0)
    return signal - drift, drift


def _make_fixes(
    way: _Trajectory,
    rates: Floats,
    antenna: Floats,
    seconds: Floats,
    moments: Integers,
    sigmas: tuple[Floats, Floats],
    random: np.random.Generator,
    offset: TimeOffset,
) -> Fixes:
    """Return the fixes at some samples, with the times that the receiver reports."""
    attitude = way.attitude[moments]
    # The antenna moves with the rate relative to the earth.
    spin = rates - rotate(inverse(way.attitude), earth_rate(way.position[:, 0]))
    noise = random.standard_normal((2, moments.size, 3))
    lever = rotate(attitude, np.tile(antenna, (moments.size, 1)))
    lever_velocity = rotate(attitude, np.cross(spin[moments], antenna))
    stated = [np.tile(s, (moments.size, 1)) if s.all() else None for s in sigmas]
    velocity = way.velocity[moments] + lever_velocity
    time = (seconds[moments] - offset.seconds + offset.rate * offset.middle) / (1.0 + offset.rate)
    later = offset.velocity_seconds - offset.seconds
    if math.isfinite(later) and later != 0.0:
        # The velocity belongs to another time than the position, between two samples.
        lever_velocities = rotate(way.attitude, np.cross(spin, antenna))
        at = seconds[moments] + later
        velocity = np.column_stack(
            [np.interp(at, seconds, axis) for axis in (way.velocity + lever_velocities).T]
        )
    return Fixes(
        time,
        offset_position(way.in_degrees()[moments], lever + sigmas[0] * noise[0]),
        velocity + sigmas[1] * noise[1],
        position_sigma=stated[0],
        velocity_sigma=stated[1],
        source="simulated fixes",
    )


_Leg: TypeAlias = tuple[float, float, float, float]
"""Duration, s, speed at the start and at the end, m/s, and rotation to the right, rad."""


@dataclass(frozen=True)
class _Road:
    """Legs of a drive with their start times, and the waves of slope and camber."""

    starts: Floats
    legs: Floats
    heading: float
    slope: Floats
    camber: Floats

    @classmethod
    def draw(cls, random: np.random.Generator, rest: float, duration: float) -> _Road:
        """Return a random road for the duration of the drive."""
        heading = random.uniform(0.0, 2.0 * math.pi)
        slope, camber = _draw_waves(random, 0.02), _draw_waves(random, 0.015)
        # Limit the rest: fractions of an infinite leg are undefined.
        legs: list[_Leg] = [(min(rest, duration) + 1e-9, 0.0, 0.0, 0.0)]
        while sum(leg[0] for leg in legs) < duration:
            legs += _draw_drive(random)
        table = np.array(legs)
        starts = np.concatenate([[0.0], np.cumsum(table[:-1, 0])])
        return cls(starts, table, heading, slope, camber)

    def at(self, t: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return roll, pitch and yaw with derivatives, (n, 3), and speed with derivative."""
        leg = np.searchsorted(self.starts, t, side="right") - 1
        length, before, after, turn = self.legs[leg].T
        part = np.clip((t - self.starts[leg]) / length, 0.0, 1.0)
        eased, pace, passed = _ease(part)
        speed = before + (after - before) * eased
        distance = self._distances()[leg] + length * (before * part + (after - before) * passed)
        previous_turn = np.concatenate([[0.0], np.cumsum(self.legs[:-1, 3])])[leg]
        yaw = self.heading + previous_turn + turn * eased
        roll, tilting = _sum_waves(self.camber, distance)
        pitch, climbing = _sum_waves(self.slope, distance)
        angles = np.column_stack([roll, pitch, yaw])
        rates = np.column_stack([speed * tilting, speed * climbing, turn * pace / length])
        return angles, rates, speed, (after - before) * pace / length

    def _distances(self) -> Floats:
        """Return the distance before each leg, m."""
        lengths, before, after, _ = self.legs.T
        distances: Floats = np.concatenate(
            [[0.0], np.cumsum(0.5 * (before + after) * lengths)[:-1]]
        )
        return distances


def _ease(part: Floats) -> tuple[Floats, Floats, Floats]:
    """Return a minimum-jerk step from 0 to 1, its derivative and its integral."""
    eased = part**3 * (10.0 - part * (15.0 - 6.0 * part))
    return eased, 30.0 * (part * (1.0 - part)) ** 2, part**4 * (2.5 - part * (3.0 - part))


def _draw_waves(random: np.random.Generator, rms: float) -> Floats:
    """Return amplitudes, rad, wave numbers, rad/m, and phases of four waves, shape (3, 4)."""
    lengths, phases = random.uniform(120.0, 600.0, 4), random.uniform(0.0, 2.0 * math.pi, 4)
    return np.array([np.full(4, rms * math.sqrt(0.5)), 2.0 * math.pi / lengths, phases])


def _sum_waves(waves: Floats, distance: Floats) -> tuple[Floats, Floats]:
    amplitudes, numbers, phases = waves
    argument = numbers * distance[:, None] + phases
    return np.sin(argument) @ amplitudes, np.cos(argument) @ (numbers * amplitudes)


def _draw_drive(random: np.random.Generator) -> list[_Leg]:
    """Return the legs from one stop to the next, including the rest at the end."""
    speeds, turns = [0.0], [0.0]
    for _ in range(int(random.integers(1, 4))):
        speeds += [random.uniform(8.0, 18.0)] * 2
        # A bend or a straight road.
        turns += [0.0, random.choice([0.0, -1.0, 1.0]) * random.uniform(0.1, 0.7)]
        if random.random() < 0.7:
            corner = random.choice([-1.0, 1.0]) * random.uniform(1.0, 1.9)
            speeds += [random.uniform(4.0, 8.0)] * 2
            turns += [0.0, corner]
    speeds.append(0.0)
    turns.append(0.0)
    legs = [
        _draw_leg(random, before, after, turn)
        for (before, after), turn in zip(pairwise(speeds), turns[1:], strict=True)
    ]
    return [*legs, (random.uniform(4.0, 12.0), 0.0, 0.0, 0.0)]


def _draw_leg(random: np.random.Generator, before: float, after: float, turn: float) -> _Leg:
    if before != after:
        return abs(after - before) / random.uniform(0.8, 1.6), before, after, 0.0
    straight = random.uniform(5.0, 15.0)
    # The peak rate is 1.9 times the mean, so speed times rate stays below 3 m/s^2.
    return straight if turn == 0.0 else abs(turn) * before / 1.6, before, after, turn


def _sample_road(
    road: _Road, seconds: Floats, rate: float | Floats, start: Floats
) -> tuple[Floats, Floats, _Trajectory]:
    """Return rates and specific forces at the samples, and the trajectory in closed form."""
    angles, derivatives, speed, gained = road.at(seconds)
    attitude = _attitudes(angles)
    turning = _body_rates(angles, derivatives)
    ahead = np.tile([1.0, 0.0, 0.0], (len(seconds), 1))
    velocity = rotate(attitude, ahead * speed[:, None])
    position = _integrate_position(velocity, rate, start, np.tile(start, (len(seconds), 1)))
    for _ in range(2):
        position = _integrate_position(velocity, rate, start, position)
    latitude, _, height = position.T
    earth, way = earth_rate(latitude), transport_rate(latitude, height, velocity)
    down = np.zeros_like(velocity)
    down[:, 2] = normal_gravity(latitude, height)
    to_body = inverse(attitude)
    rates = turning + rotate(to_body, earth + way)
    force = ahead * gained[:, None] + speed[:, None] * np.cross(turning, ahead)
    force += rotate(to_body, np.cross(2.0 * earth + way, velocity) - down)
    return rates, force, _Trajectory(position, velocity, attitude)


def _attitudes(angles: Floats) -> Floats:
    """Return quaternions from roll, pitch and yaw; yaw comes first."""
    whole = np.zeros((3, len(angles), 3))
    for axis in range(3):
        whole[axis, :, axis] = angles[:, axis]
    roll, pitch, yaw = (from_rotation_vectors(vectors) for vectors in whole)
    return product(yaw, product(pitch, roll))


def _body_rates(angles: Floats, derivatives: Floats) -> Floats:
    """Return the rate in the body's axes from the derivatives of roll, pitch and yaw."""
    roll, pitch, _ = angles.T
    rolling, pitching, yawing = derivatives.T
    level = yawing * np.cos(pitch)
    return np.column_stack(
        [
            rolling - yawing * np.sin(pitch),
            pitching * np.cos(roll) + level * np.sin(roll),
            level * np.cos(roll) - pitching * np.sin(roll),
        ]
    )


@dataclass(frozen=True)
class _Trajectory:
    """Positions, rad, rad and m, velocities, m/s, and attitudes at the samples."""

    position: Floats
    velocity: Floats
    attitude: Floats

    def in_degrees(self) -> Floats:
        degrees = np.degrees(self.position[:, :2])
        return np.column_stack([degrees[:, 0], wrap_degrees(degrees[:, 1]), self.position[:, 2]])


def _navigate(
    rates: Floats, force: Floats, rate: float | Floats, start: Floats, guess: _Trajectory
) -> _Trajectory:
    """Return the strapdown navigation of samples, from the start of a guess.

    Each iteration takes the rates of the local axes, gravity and radii from the previous
    trajectory. They depend on it so weakly that a few iterations converge.
    """
    dt = 1.0 / rate
    theta, delta = _increments(rates, force, dt)
    steps = cumulative_product(from_rotation_vectors(theta))
    way = guess
    for _ in range(_MAX_ROUNDS):
        after = _approximate(way, steps, delta, dt, start)
        change = np.abs(after.position - way.position) * [SEMI_MAJOR_AXIS, SEMI_MAJOR_AXIS, 1.0]
        way = after
        if change.max() < _POSITION_TOLERANCE_M:
            return way
    raise AssertionError("the way does not settle")


def _approximate(
    way: _Trajectory, steps: Floats, delta: Floats, dt: float | Floats, start: Floats
) -> _Trajectory:
    latitude, height, velocity = way.position[:-1, 0], way.position[:-1, 2], way.velocity[:-1]
    earth, transport = earth_rate(latitude), transport_rate(latitude, height, velocity)
    local = inverse(cumulative_product(from_rotation_vectors((earth + transport) * dt)))
    first = way.attitude[:1]
    attitude = np.concatenate([first, unit(product(product(local, first), steps))])
    specific_gain = rotate(attitude[:-1], delta)
    slow = -np.cross(2.0 * earth + transport, velocity)
    slow -= 0.5 * np.cross(earth + transport, specific_gain)
    slow[:, 2] += normal_gravity(latitude, height)
    gained = np.cumsum(specific_gain + slow * dt, axis=0)
    velocities = np.concatenate([way.velocity[:1], way.velocity[:1] + gained])
    return _Trajectory(
        _integrate_position(velocities, 1.0 / dt, start, way.position), velocities, attitude
    )


def _integrate_position(
    velocity: Floats, rate: float | Floats, start: Floats, near: Floats
) -> Floats:
    """Return the positions at the samples, with the radii at the nearby positions `near`."""
    latitude, _, height = near[:-1].T
    meridian, normal = radii(latitude)
    mean = 0.5 * (velocity[:-1] + velocity[1:]) / rate
    change = np.column_stack(
        [
            mean[:, 0] / (meridian + height),
            mean[:, 1] / ((normal + height) * np.cos(latitude)),
            -mean[:, 2],
        ]
    )
    return np.concatenate([start[None], start + np.cumsum(change, axis=0)])


def _increments(rates: Floats, force: Floats, dt: float | Floats) -> tuple[Floats, Floats]:
    """Return the rotation vectors and velocity changes between samples."""
    w0, w1, f0, f1 = rates[:-1], rates[1:], force[:-1], force[1:]
    theta = 0.5 * (w0 + w1) * dt + np.cross(w0, w1) * (dt * dt / 12.0)
    delta = 0.5 * (f0 + f1) * dt + np.cross(w0 + w1, f0 + f1) * (dt * dt / 8.0)
    delta += (np.cross(w0, f1 - f0) + np.cross(f0, w1 - w0)) * (dt * dt / 12.0)
    return theta, delta
