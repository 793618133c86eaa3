"""Simulated IMU in motion, with known orientation, rate and errors."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.geometry.rotations import inverse, rotate
from zerorate.record import Log, Recording
from zerorate.record.log import check_rate
from zerorate.simulation.field import (
    check_spans,
    draw_magnet_field,
    draw_room_field,
    earth_field,
    magnet_nearness,
)
from zerorate.simulation.gyro import check_not_negative, check_whole
from zerorate.simulation.hand import check_shape, take_or_draw
from zerorate.simulation.trajectories import TRAJECTORIES, Motion, Trajectory
from zerorate.types import Booleans, Floats
from zerorate.units import UNITS

Kind = Literal["pendulum", "spinning pendulum", "arm", "vehicle", "circle", "hand"]

_G: Final = UNITS["g"].amount
_DEG: Final = math.radians(1.0)
_REST_S: Final = 5.0
"""Duration of the rest at the start, s."""
_DIFFERENCE_STEP_S: Final = 1e-5
"""Step of the velocity difference, s."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)

# Append new streams: their position selects the random numbers, and old seeds must not change.
_STREAMS: Final = ("motion", "errors", "gyro", "accel", "mag", "lost")


@dataclass(frozen=True, kw_only=True)
class MotionErrors:
    """Errors of the sensors of a simulated motion.

    The defaults describe a consumer device. For the gyro's bias, matrix, walk and noise, and for
    the field's variation, they equal the priors of `zerorate.Attitude`.

    Parameters
    ----------
    gyro_bias : float or array_like, shape (3,)
        Bias at the start, rad/s. One number is the standard deviation of random biases. Three
        numbers are the biases. Default 0.5 deg/s.
    gyro_scale, gyro_misalignment : float
        Standard deviations of the elements of M in ``rate = M (gyro - bias)``. `gyro_scale` is for
        the diagonal, with mean 1. Its default is 0.008. `gyro_misalignment` is for the other
        elements. Its default is 0.005.
    gyro_matrix : array_like, shape (3, 3), optional
        Matrix M. Default: random.
    gyro_noise : float
        Density of the gyro's white noise, rad/s/sqrt(Hz). Default 0.01 deg/s/sqrt(Hz).
    gyro_walk : float
        Random walk of the gyro's bias, rad/s/sqrt(s). Default 0.01 deg/s/sqrt(s).
    accel_bias : float or array_like, shape (3,)
        Bias of the accelerometer, m/s^2. One number is the standard deviation of random biases.
        Three numbers are the biases. Default 0.05.
    accel_noise : float
        Density of the accelerometer's white noise, m/s^2/sqrt(Hz). Default 0.004.
    mag_noise : float
        Standard deviation of each magnetometer sample, uT. Default 0.5. Hard and soft iron are
        zero.
    field_wander : float
        Angle by which the field varies while the sensor moves in a room, rad. Each earth axis is a
        Gauss-Markov process with a correlation time of 15 s. Default 4.5 deg.
    lost : float
        Share of lost samples. Default 0.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> errors = zr.simulation.MotionErrors(gyro_bias=(0.01, 0.0, 0.0), gyro_walk=0.0)
    >>> zr.simulate_motion("hand", duration=10.0, errors=errors).bias[-1].tolist()
    [0.01, 0.0, 0.0]
    """

    gyro_bias: npt.ArrayLike = 0.5 * _DEG
    gyro_scale: float = 0.008
    gyro_misalignment: float = 0.005
    gyro_matrix: npt.ArrayLike | None = None
    gyro_noise: float = 0.01 * _DEG
    gyro_walk: float = 0.01 * _DEG
    accel_bias: npt.ArrayLike = 0.05
    accel_noise: float = 0.004
    mag_noise: float = 0.5
    field_wander: float = 4.5 * _DEG
    lost: float = 0.0

    @classmethod
    def none(cls) -> MotionErrors:
        """Return the errors of perfect sensors."""
        numbers = {name: 0.0 for name in cls.__dataclass_fields__ if name != "gyro_matrix"}
        return cls(**numbers)


@dataclass(frozen=True, eq=False)
class SimulatedMotion:
    """Simulated motion of n samples, with the truth.

    Parameters
    ----------
    time
        Times of the samples, s, shape (n,). Lost samples are left out.
    rate
        Sampling rate, Hz.
    gyro, accel, mag
        Samples of the sensors, shape (n, 3): rad/s, m/s^2 and uT.
    quaternion
        Quaternions w, x, y, z from the sensor's axes to east, north, up, shape (n, 4).
    rates
        True angular rate in the sensor's axes, rad/s, shape (n, 3). Each value is the mean over the
        interval that ends at its sample, as integration needs it.
    force, velocity
        True specific force in the sensor's axes (m/s^2) and true velocity in earth axes (m/s),
        shape (n, 3).
    bias
        Bias of the gyro, rad/s, shape (n, 3).
    gyro_matrix
        Matrix M in ``rate = M (gyro - bias)``, shape (3, 3).
    accel_bias
        Bias of the accelerometer, m/s^2, shape (3,).
    at_rest, disturbed
        Masks of samples at rest, and of samples near a magnet, shape (n,).
    source
        Kind of the motion and seed, as text.

    Examples
    --------
    >>> import zerorate as zr
    >>> motion = zr.simulate_motion("hand", duration=20.0, seed=3)
    >>> motion.quaternion.shape, bool(motion.at_rest[0]), motion.recording().names
    ((2000, 4), True, ('gyro', 'accel', 'mag', 'reference'))
    """

    time: Floats
    rate: float
    gyro: Floats
    accel: Floats
    mag: Floats
    quaternion: Floats
    rates: Floats
    force: Floats
    velocity: Floats
    bias: Floats
    gyro_matrix: Floats
    accel_bias: Floats
    at_rest: Booleans
    disturbed: Booleans
    source: str = "a simulated motion"

    @property
    def dt(self) -> Floats:
        """Interval before each sample, s, shape (n,); 1/rate for the first sample."""
        return np.diff(self.time, prepend=self.time[0] - 1.0 / self.rate)

    def recording(self) -> Recording:
        """Return gyro, accelerometer, magnetometer and true orientation as a recording.

        Lost samples are NaN in the recording, because a log has one clock.
        """
        indices = np.rint((self.time - self.time[0]) * self.rate).astype(np.int64)
        n = int(indices[-1]) + 1
        seconds = self.time[0] + np.arange(n) / self.rate

        def log(values: Floats, names: list[str], unit: str) -> Log:
            rows = np.full((n, values.shape[1]), np.nan)
            rows[indices] = values
            return Log(seconds, self.rate, rows, tuple(names), unit, {"source": self.source})

        logs = {
            "gyro": log(self.gyro, [f"gyro_{a}_radps" for a in "xyz"], "rad/s"),
            "accel": log(self.accel, [f"accel_{a}_mps2" for a in "xyz"], "m/s^2"),
            "mag": log(self.mag, [f"mag_{a}_ut" for a in "xyz"], "uT"),
            "reference": log(self.quaternion, [f"ref_quat_{a}" for a in "wxyz"], "1"),
        }
        return Recording(logs, self.source)


def simulate_motion(
    kind: Kind,
    rate: float = 100.0,
    duration: float = 60.0,
    *,
    seed: int = 1,
    start: Literal["rest", "motion"] = "rest",
    errors: MotionErrors | None = None,
    magnet: npt.ArrayLike = (),
    field: float = 48.0,
    dip: float = 65.0 * _DEG,
) -> SimulatedMotion:
    """Simulate gyro, accelerometer and magnetometer in a motion with known orientation.

    Parameters
    ----------
    kind : str
        Kind of motion:

        - ``"pendulum"``: swings in one plane
        - ``"spinning pendulum"``: swings in an ellipse and spins about its rod
        - ``"arm"``: on the wrist of a walking person
        - ``"vehicle"``: a car in a town
        - ``"circle"``: carried round a circle
        - ``"hand"``: rotated and moved by hand
    rate : float
        Sampling rate, Hz. Default 100.
    duration : float
        Length of the motion, s. Default 60.
    seed : int
        Seed, at least 0. The same arguments give the same samples. Motion, errors and each noise
        have their own random streams. A change of the errors therefore does not change the motion.
    start : {"rest", "motion"}
        "rest" starts with 5 s at rest and then accelerates. "motion" starts in full motion.
    errors : MotionErrors, optional
        Errors of the sensors. Default: a consumer device. ``MotionErrors.none()`` gives perfect
        sensors.
    magnet : array_like, shape (m, 2)
        Start and end of the spans with a magnet or iron nearby, s. There the field differs in
        strength and dip from `field` and `dip`. Default: no spans.
    field, dip : float
        Earth's field: strength (uT) and angle below the horizontal (rad). Default 48 uT and 65 deg.

    Returns
    -------
    SimulatedMotion
        Samples of the sensors, and the truth.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Notes
    -----
    Orientation, angular rate and velocity are closed forms of time. A gyro sample is the mean rate
    over the interval that ends at the sample (Gauss-Legendre, four points). Accelerometer and
    magnetometer samples are values at the sample time. The acceleration is a central difference of
    the velocity over 20 us, accurate to 1e-6 m/s^2. The seed also selects the strength of the
    motion.

    Examples
    --------
    >>> motion = simulate_motion("pendulum", duration=20.0, seed=3, start="motion")
    >>> motion.gyro.shape, bool(motion.at_rest.any())
    ((2000, 3), False)
    >>> motion.recording()
    Recording(simulated pendulum, seed 3; gyro: 3 at 100 Hz, rad/s; accel: 3 at 100 Hz, m/s^2; \
mag: 3 at 100 Hz, uT; reference: 4 at 100 Hz, 1)
    """
    if kind not in TRAJECTORIES:
        raise ArgumentError("kind", f"must be one of {', '.join(TRAJECTORIES)}, got {kind!r}")
    if start not in ("rest", "motion"):
        raise ArgumentError("start", f"must be 'rest' or 'motion', got {start!r}")
    hertz = check_rate(rate)
    if not (math.isfinite(duration) and duration * hertz >= 2.0):
        raise ArgumentError(
            "duration", f"must be finite and two samples or longer, got {duration} s"
        )
    random = _streams(seed)
    motion = _TimedMotion(TRAJECTORIES[kind](random["motion"], duration), start == "rest")
    seconds = np.arange(round(duration * hertz)) / hertz
    earth, times = earth_field(field, dip), check_spans(magnet)
    simulated = _simulate(motion, seconds, hertz, errors or MotionErrors(), earth, times, random)
    return replace(simulated, source=f"simulated {kind}, seed {seed}")


@dataclass(frozen=True, eq=False)
class _TimedMotion:
    """A motion that is in progress at the start, or that follows a rest."""

    trajectory: Trajectory
    from_rest: bool

    def at(self, t: Floats) -> Motion:
        """Return orientations, rates and velocities at the given times."""
        own, pace = self._progress(t)
        q, rates, velocity = self.trajectory.at(own)
        return q, rates * pace[:, None], velocity * pace[:, None]

    def at_rest(self, t: Floats) -> Booleans:
        """Return the mask of rest at the given times."""
        still: Booleans = self._progress(t)[1] == 0.0
        return still

    def _progress(self, t: Floats) -> tuple[Floats, Floats]:
        """Return the trajectory's own time, s, and its rate, which rises smoothly from 0 to 1."""
        if not self.from_rest:
            return t, np.ones(t.size)
        ease = self.trajectory.ease
        part = np.clip((t - _REST_S) / ease, 0.0, 1.0)
        later = np.maximum(t - _REST_S - ease, 0.0)
        own = ease * part**4 * (2.5 - part * (3.0 - part)) + later
        return own, part**3 * (10.0 - part * (15.0 - 6.0 * part))


def _simulate(
    motion: _TimedMotion,
    seconds: Floats,
    rate: float,
    errors: MotionErrors,
    earth: Floats,
    magnet: Floats,
    random: dict[str, np.random.Generator],
) -> SimulatedMotion:
    n = seconds.size
    q, _, velocity = motion.at(seconds)
    rates, force = _mean_rates(motion, seconds, rate), _force(motion, seconds, q)
    M = _draw_gyro_matrix(errors, random["errors"])
    bias = _draw_bias(errors, rate, n, random)
    gyro = rates @ np.linalg.inv(M).T + bias
    gyro += _draw_white("gyro_noise", errors.gyro_noise * math.sqrt(rate), n, random["gyro"])
    accel_bias = take_or_draw("accel_bias", errors.accel_bias, (3,), random["errors"])
    accel = force + accel_bias
    accel += _draw_white("accel_noise", errors.accel_noise * math.sqrt(rate), n, random["accel"])
    at_rest = motion.at_rest(seconds)
    near = magnet_nearness(seconds, magnet)
    # The field of a room changes with the position, not with time.
    wandering = draw_room_field(errors.field_wander, earth, rate, n, random["mag"])
    ambient = earth + wandering[np.cumsum(~at_rest) - 1]
    ambient += near[:, None] * draw_magnet_field(earth, random["mag"])
    mag = rotate(inverse(q), ambient)
    mag += _draw_white("mag_noise", errors.mag_noise, n, random["mag"])
    received = _draw_received(errors.lost, n, random["lost"])
    return SimulatedMotion(
        time=seconds[received],
        rate=rate,
        gyro=gyro[received],
        accel=accel[received],
        mag=mag[received],
        quaternion=q[received],
        rates=rates[received],
        force=force[received],
        velocity=velocity[received],
        bias=bias[received],
        gyro_matrix=M,
        accel_bias=accel_bias,
        at_rest=at_rest[received],
        disturbed=near[received] > 0.0,
    )


def _mean_rates(motion: _TimedMotion, seconds: Floats, rate: float) -> Floats:
    """Return the mean rate over the sample interval before each time, rad/s."""
    total = np.zeros((seconds.size, 3))
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        total += 0.5 * weight * motion.at(seconds - 0.5 * (1.0 - node) / rate)[1]
    return total


def _force(motion: _TimedMotion, seconds: Floats, q: Floats) -> Floats:
    """Return the specific force in the sensor's axes, m/s^2."""
    before, after = (motion.at(seconds + h)[2] for h in (-_DIFFERENCE_STEP_S, _DIFFERENCE_STEP_S))
    acceleration = (after - before) / (2.0 * _DIFFERENCE_STEP_S)
    return rotate(inverse(q), acceleration + np.array([0.0, 0.0, _G]))


def _draw_gyro_matrix(errors: MotionErrors, random: np.random.Generator) -> Floats:
    size = np.full((3, 3), check_not_negative("gyro_misalignment", errors.gyro_misalignment))
    np.fill_diagonal(size, check_not_negative("gyro_scale", errors.gyro_scale))
    drawn: Floats = np.eye(3) + size * random.standard_normal((3, 3))
    if errors.gyro_matrix is None:
        return drawn
    matrix = check_shape("gyro_matrix", errors.gyro_matrix, (3, 3))
    if abs(np.linalg.det(matrix)) < 1e-6:
        raise ArgumentError("gyro_matrix", "must have an inverse")
    return matrix


def _draw_bias(
    errors: MotionErrors, rate: float, n: int, random: dict[str, np.random.Generator]
) -> Floats:
    start = take_or_draw("gyro_bias", errors.gyro_bias, (3,), random["errors"])
    steps = _draw_white("gyro_walk", errors.gyro_walk / math.sqrt(rate), n, random["gyro"])
    steps[0] = 0.0
    return start + np.cumsum(steps, axis=0)


def _draw_received(lost: float, n: int, random: np.random.Generator) -> Booleans:
    """Return the mask of received samples; the first sample is always received."""
    if not 0.0 <= lost < 1.0:
        raise ArgumentError("lost", f"must be from 0 to below 1, got {lost}")
    received = random.random(n) >= lost
    received[0] = True
    return received


def _draw_white(name: str, size: float, n: int, random: np.random.Generator) -> Floats:
    return check_not_negative(name, size) * random.standard_normal((n, 3))


def _streams(seed: int) -> dict[str, np.random.Generator]:
    children = np.random.SeedSequence(check_whole("seed", seed, 0)).spawn(len(_STREAMS))
    return dict(zip(_STREAMS, map(np.random.default_rng, children), strict=True))
