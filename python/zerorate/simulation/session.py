"""Simulated calibration: an IMU at rest in many poses, rotated by hand between them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from zerorate.calibration.calibration import Calibration
from zerorate.calibration.parameters import (
    ACCEL_BIAS,
    ACCEL_MATRIX,
    G_SENSITIVITY,
    GYRO_BIAS,
    GYRO_MATRIX,
    PARAMETERS,
)
from zerorate.faults import ArgumentError
from zerorate.geometry.rotations import inverse, rotate
from zerorate.noise import NoiseModel
from zerorate.noise.coefficient import check_positive
from zerorate.record import Log, Recording
from zerorate.record.log import check_rate
from zerorate.record.names import UNKNOWN_UNIT, add_unit_suffix
from zerorate.simulation.devices import Device, device
from zerorate.simulation.gyro import check_not_negative, check_whole, simulate
from zerorate.simulation.hand import Hand, Poses, check_shape, draw_hand_motion, take_or_draw
from zerorate.types import Floats, Integers
from zerorate.units import UNITS

Noise: TypeAlias = NoiseModel | Device | None
Course: TypeAlias = tuple[float, float] | Callable[[Floats], npt.ArrayLike]

_G: Final = UNITS["g"].amount
_DEG: Final = math.radians(1.0)
_ACCEL_NOISE: Final = NoiseModel(
    angle_random_walk=400e-6 * _G, bias_instability=40e-6 * _G, quantity="acceleration"
)
"""Noise of the MPU-6050: the density is from its data sheet, the bias instability is chosen."""
_LEVER_M: Final = 0.1
"""Distance from the centre of rotation to the accelerometer, m."""
_REFERENCE_DEGC: Final = 25.0

# Append new streams: their position selects the random numbers, and old seeds must not change.
_STREAMS: Final = ("motion", "errors", "disturbance", "gyro noise", "accel noise", "tremor")


@dataclass(frozen=True, kw_only=True)
class GyroErrors:
    """Errors of a simulated gyroscope, in SI units.

    Parameters
    ----------
    matrix : array_like, shape (3, 3), optional
        Matrix W in ``raw = W w + bias + G f``, with rate w and specific force f. Default: random,
        with `scale` and `misalignment`.
    scale : float
        Standard deviation of a random matrix's diagonal, with mean 1. Default 0.02.
    misalignment : float
        Standard deviation of the other elements of a random matrix, rad. Default 0.01.
    bias : float or array_like, shape (3,)
        Biases, rad/s. One number is the standard deviation of random biases. Three numbers are the
        biases. Default: a standard deviation of 0.5 deg/s.
    g_sensitivity : float or array_like, shape (3, 3)
        Matrix G, rad/s per g. One number is the standard deviation of random elements. Default: a
        standard deviation of 0.05 deg/s/g.
    noise : NoiseModel, Device or None
        Noise of each axis. A device also sets the resolution, but its turn-on bias is not used.
        Default: the MPU-6050.
    resolution : float, optional
        Step to which the output is rounded, rad/s. 0 means no rounding. Default: the device's
        resolution.
    range : float, optional
        Largest output, rad/s; the gyro saturates there. Default: no limit.
    temperature : array_like, shape (k,) or (k, 3)
        Coefficients c_1 to c_k of the bias ``sum c_j ((T - 25)/10)^j``, rad/s, with T in degC.
        Default: no coefficients.
    unit : {"deg/s", "rad/s", "unit"}
        Unit of the samples. "unit" means counts of the resolution; the log then states no unit.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> gyro = zr.simulation.GyroErrors(matrix=np.diag([1.02, 1.0, 1.0]))
    >>> zr.simulation.simulate_session(6, seed=2, gyro=gyro).truth.gyro.scale[0]
    Coefficient(1.02)
    """

    matrix: npt.ArrayLike | None = None
    scale: float = 0.02
    misalignment: float = 0.01
    bias: npt.ArrayLike = 0.5 * _DEG
    g_sensitivity: npt.ArrayLike = 0.05 * _DEG
    noise: Noise = field(default_factory=lambda: device("MPU-6050"))
    resolution: float | None = None
    range: float | None = None
    temperature: npt.ArrayLike = ()
    unit: str = "deg/s"


@dataclass(frozen=True, kw_only=True)
class AccelErrors:
    """Errors of a simulated accelerometer, in SI units.

    Parameters
    ----------
    matrix : array_like, shape (3, 3), optional
        Matrix A in ``raw = A f + bias``, with specific force f. It is lower triangular, because the
        accelerometer defines the body's axes. Default: random, with `scale` and `misalignment`.
    scale : float
        Standard deviation of a random matrix's diagonal, with mean 1. Default 0.02.
    misalignment : float
        Standard deviation of the elements below the diagonal of a random matrix, rad. Default 0.01.
    bias : float or array_like, shape (3,)
        Biases, m/s^2. One number is the standard deviation of random biases. Three numbers are the
        biases. Default: a standard deviation of 20 mg.
    disturbance : float
        Standard deviation of a random offset on each axis in each pose, m/s^2. It limits the
        repeatability of a pose. Default 0.3 mg.
    noise : NoiseModel, Device or None
        Noise of each axis. Default: white noise of 400 ug/sqrt(Hz) and a bias instability of 40 ug.
    resolution : float
        Step to which the output is rounded, m/s^2. 0 means no rounding. Default 1/16384 g.
    range : float, optional
        Largest output, m/s^2; the accelerometer saturates there. Default: no limit.
    unit : {"g", "m/s^2", "unit"}
        Unit of the samples. "unit" means counts of the resolution; the log then states no unit.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> perfect = zr.simulation.AccelErrors(matrix=np.eye(3), bias=(0.0, 0.0, 0.0))
    >>> zr.simulation.simulate_session(6, seed=2, accel=perfect).truth.accel.scale
    (Coefficient(1), Coefficient(1), Coefficient(1))
    """

    matrix: npt.ArrayLike | None = None
    scale: float = 0.02
    misalignment: float = 0.01
    bias: npt.ArrayLike = 0.02 * _G
    disturbance: float = 0.3e-3 * _G
    noise: Noise = _ACCEL_NOISE
    resolution: float = _G / 16384.0
    range: float | None = None
    unit: str = "g"


@dataclass(frozen=True, eq=False)
class SimulatedSession:
    """Simulated calibration, with the truth.

    Parameters
    ----------
    recording
        Samples of the sensors: ``gyro``, ``accel`` and, if requested, ``temperature``.
    truth
        True parameters with zero covariance, in the units of the samples. The gyro's bias is the
        mean of ``bias``.
    rates
        True angular rate in the body's axes, rad/s, shape (n, 3).
    orientation
        Unit quaternions w, x, y, z from the body's axes to the world's axes (z up), shape (n, 4).
        ``rates`` are their exact derivative.
    force
        True specific force in the body's axes, m/s^2, shape (n, 3).
    bias
        Bias of the gyro at each sample, including drift and temperature, in the samples' unit,
        shape (n, 3).
    rests, turns
        First sample and end (exclusive) of each rest, shape (poses, 2), and of each rotation, shape
        (poses - 1, 2). A rotation goes from the last sample of a rest to the first sample of the
        next rest.

    Examples
    --------
    >>> import zerorate as zr
    >>> session = zr.simulation.simulate_session(6, seed=2)
    >>> session.rests.shape, session.turns.shape, session.recording.names
    ((6, 2), (5, 2), ('gyro', 'accel'))
    """

    recording: Recording
    truth: Calibration
    rates: Floats
    quaternion: Floats
    force: Floats
    bias: Floats
    rests: Integers
    turns: Integers


def simulate_session(
    poses: Poses = 20,
    *,
    seed: int = 1,
    rate: float = 100.0,
    rest: float = 6.0,
    turn: float = 2.0,
    angles: tuple[float, float] = (60.0 * _DEG, 170.0 * _DEG),
    axis: npt.ArrayLike | None = None,
    turns: npt.ArrayLike | None = None,
    wobble: float = 0.06,
    tremor: float = 0.0,
    gyro: GyroErrors | None = None,
    accel: AccelErrors | None = None,
    temperature: Course | None = None,
    gravity: float = _G,
) -> SimulatedSession:
    """Simulate an IMU that rests in several poses and is rotated by hand between them.

    Parameters
    ----------
    poses : int, "six" or array_like, shape (m, 4) or (m, 3, 3)
        Poses of the IMU. A number is the number of poses; random rotations connect them. "six"
        points each axis exactly up once and down once. An array gives the poses as quaternions or
        rotation matrices from the body to the world (z up). The rotations between given poses are
        the shortest possible. Default 20.
    seed : int
        Seed, at least 0. The same arguments give the same session. Motion, errors and each noise
        have their own random streams.
    rate : float
        Sampling rate, Hz. Default 100.
    rest, turn : float
        Duration of each rest, s, default 6. Duration of each rotation, s, default 2.
    angles : tuple of float
        Smallest and largest angle of a random rotation, rad. Default 60 to 170 deg.
    axis : array_like, shape (3,), optional
        Axis of all random rotations, in the body's axes in the first pose. This pose is level, so
        ``(0, 0, 1)`` is the vertical. Default: a random axis for each rotation.
    turns : array_like, shape (m, 3), optional
        Rotation vectors in the body's axes, rad, instead of `poses`. A rotation may then exceed
        half a revolution.
    wobble : float
        Deviation of the hand from the rotation axis, as a standard deviation about each axis, rad.
        Default 0.06. It is not used with a given axis.
    tremor : float
        RMS angular rate of the hand's tremor from 1 to 8 Hz, at rest and in rotations, rad/s.
        Default 0, for a sensor that lies on a support.
    gyro, accel : GyroErrors, AccelErrors, optional
        Errors of the sensors. Default: errors of a typical consumer device.
    temperature : tuple of float or callable, optional
        Temperature, degC. Two numbers are the first and the last value; the change is exponential
        over three time constants. A function returns the temperature for times in s, shape (n,).
        Default: no temperature.
    gravity : float
        Local gravity, m/s^2. Default 9.80665.

    Returns
    -------
    SimulatedSession
        The recording and the truth.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Notes
    -----
    A rotation follows its rotation vector with the minimum-jerk profile 10 u^3 - 15 u^4 + 6 u^5,
    where u grows from 0 to 1.
    Source: T. Flash and N. Hogan, "The coordination of arm movements", J. Neurosci. 5(7), 1985,
    equation 4. The accelerometer is 0.1 m from the centre of rotation.

    The orientation is a closed form of time. The rate is its derivative at the samples, as from a
    gyro with large bandwidth. Both are exact up to rounding. An integral of the samples has only
    the error of the integrator.

    Examples
    --------
    >>> session = simulate_session(6, seed=2)
    >>> session.recording
    Recording(a simulated session; gyro: 3 at 100 Hz, deg/s; accel: 3 at 100 Hz, g)
    >>> session.truth.gyro.scale[0]
    Coefficient(0.9828)
    """
    hertz = check_rate(rate)
    for name, value in (("rest", rest), ("turn", turn), ("gravity", gravity)):
        check_positive(name, value)
    if min(rest, turn) * hertz < 2.0:
        raise ValueError(f"rest and turn must be two samples or longer, got {rest} and {turn} s")
    random = _streams(seed)
    motion = draw_hand_motion(
        poses,
        rest,
        turn,
        angles=angles,
        axis=axis,
        turns=turns,
        wobble=wobble,
        tremor=tremor,
        random=random["motion"],
        tremor_random=random["tremor"],
    )
    seconds = np.arange(round(motion.duration * hertz)) / hertz
    return _Imu(motion, seconds, hertz, gravity, random).session(
        gyro or GyroErrors(), accel or AccelErrors(), temperature
    )


def _streams(seed: int) -> dict[str, np.random.Generator]:
    children = np.random.SeedSequence(check_whole("seed", seed, 0)).spawn(len(_STREAMS))
    return dict(zip(_STREAMS, map(np.random.default_rng, children), strict=True))


@dataclass(frozen=True, eq=False)
class _Imu:
    """Motion at the samples, with the settings for the sensors' errors."""

    motion: Hand
    seconds: Floats
    rate: float
    gravity: float
    random: dict[str, np.random.Generator]

    def session(
        self, gyro: GyroErrors, accel: AccelErrors, temperature: Course | None
    ) -> SimulatedSession:
        """Return the session of a gyro and an accelerometer."""
        orientation, rates = self.motion.at(self.seconds)
        force = self._force(orientation, rates)
        A, b_a = _draw_accel_parameters(accel, self.random["errors"])
        W, b_g, G = _draw_gyro_parameters(gyro, self.random["errors"])
        degrees = None if temperature is None else _sample_temperature(temperature, self.seconds)
        white, drift = self._noise(gyro.noise, "gyro noise")
        bias = b_g + _temperature_bias(gyro, degrees) + drift
        raw_gyro = rates @ W.T + force @ G.T / _G + bias + white
        raw_accel = force @ A.T + b_a + self._disturbance(accel)
        raw_accel += sum(self._noise(accel.noise, "accel noise"))
        outputs = _Output.of_accel(accel), _Output.of_gyro(gyro)
        logs = {
            "gyro": outputs[1].log(raw_gyro, self.seconds, self.rate),
            "accel": outputs[0].log(raw_accel, self.seconds, self.rate),
        }
        if degrees is not None:
            logs["temperature"] = Log(self.seconds, self.rate, degrees, ("temp_degc",), "degC")
        rests, turns = self.motion.spans(self.rate, self.seconds.size)
        return SimulatedSession(
            recording=Recording(logs, "a simulated session"),
            truth=self._truth(outputs, (A, b_a, W, bias.mean(axis=0), G), degrees),
            rates=rates,
            quaternion=orientation,
            force=force,
            bias=bias / outputs[1].offset,
            rests=rests,
            turns=turns,
        )

    def _force(self, orientation: Floats, rates: Floats) -> Floats:
        """Return the specific force at the accelerometer, m/s^2, from gravity and rotation."""
        up = rotate(inverse(orientation), np.tile([0.0, 0.0, 1.0], (len(orientation), 1)))
        lever = self.random["motion"].standard_normal(3)
        lever *= _LEVER_M / np.linalg.norm(lever)
        # The derivative of the rate is a difference of the closed form, accurate to 1e-8 rad/s^2.
        step = 1e-6
        before, after = (self.motion.at(self.seconds + h)[1] for h in (-step, step))
        turning = np.cross((after - before) / (2.0 * step), lever)
        return self.gravity * up + turning + np.cross(rates, np.cross(rates, lever))

    def _noise(self, noise: Noise, stream: str) -> tuple[Floats, Floats]:
        """Return white noise and drift of three axes, SI units."""
        n = self.seconds.size
        if noise is None:
            return np.zeros((n, 3)), np.zeros((n, 3))
        seed = int(self.random[stream].integers(2**63))
        signal, drift = simulate(
            noise, self.rate, n / self.rate, seed, axes=3, resolution=0.0, turn_on_bias=0.0
        )
        return signal - drift, drift

    def _disturbance(self, accel: AccelErrors) -> Floats:
        size = check_not_negative("disturbance", accel.disturbance)
        count = len(self.motion.starts)
        of_poses = size * self.random["disturbance"].standard_normal((count, 3))
        return self.motion.interpolate(self.seconds, of_poses)

    def _truth(
        self,
        outputs: tuple[_Output, _Output],
        parameters: tuple[Floats, Floats, Floats, Floats, Floats],
        degrees: Floats | None,
    ) -> Calibration:
        accel, gyro = outputs
        A, b_a, W, b_g, G = parameters
        values = np.empty(len(PARAMETERS))
        values[ACCEL_MATRIX], values[ACCEL_BIAS] = A.ravel() / accel.gain, b_a / accel.offset
        values[GYRO_MATRIX], values[GYRO_BIAS] = W.ravel() / gyro.gain, b_g / gyro.offset
        values[G_SENSITIVITY] = G.ravel() / gyro.offset
        return Calibration(
            values,
            np.zeros((values.size, values.size)),
            np.ones(values.size, dtype=np.bool_),
            (accel.unit, accel.corrected),
            (gyro.unit, gyro.corrected),
            self.gravity,
            self.rate,
            notes=("true values of a simulated session",),
            temperature=None if degrees is None else float(degrees.mean()),
        )


@dataclass(frozen=True)
class _Output:
    """Conversion of a sensor's output from SI units to samples."""

    names: tuple[str, ...]
    unit: str
    corrected: str
    resolution: float
    range: float | None
    offset: float
    """Size of the samples' unit, SI units."""
    gain: float
    """Divisor for a matrix between SI units."""

    @classmethod
    def of_gyro(cls, errors: GyroErrors) -> _Output:
        device_step = errors.noise.resolution if isinstance(errors.noise, Device) else 0.0
        step = device_step if errors.resolution is None else errors.resolution
        return cls._of("gyro", errors.unit, ("deg/s", "rad/s"), step, errors.range)

    @classmethod
    def of_accel(cls, errors: AccelErrors) -> _Output:
        units = ("g", "m/s^2")
        return cls._of("accel", errors.unit, units, errors.resolution, errors.range)

    @classmethod
    def _of(
        cls, kind: str, unit: str, known: tuple[str, str], step: float, limit: float | None
    ) -> _Output:
        resolution = check_not_negative("resolution", step)
        names = tuple(add_unit_suffix(f"{kind}_{axis}", unit) for axis in "xyz")
        if limit is not None:
            check_positive("range", limit)
        if unit in known:
            return cls(names, unit, unit, resolution, limit, UNITS[unit].amount, 1.0)
        if unit != UNKNOWN_UNIT:
            raise ArgumentError(
                "unit", f"must be one of {', '.join((*known, UNKNOWN_UNIT))}, got {unit!r}"
            )
        if not resolution:
            raise ValueError(
                f"samples in {UNKNOWN_UNIT!r} are counts: they need a resolution above 0"
            )
        return cls(names, unit, known[1], resolution, limit, resolution, resolution)

    def log(self, values: Floats, seconds: Floats, rate: float) -> Log:
        """Return the samples from an output in SI units."""
        if self.resolution > 0.0:
            values = np.round(values / self.resolution) * self.resolution
        if self.range is not None:
            values = np.clip(values, -self.range, self.range)
        return Log(seconds, rate, values / self.offset, self.names, self.unit)


def _draw_accel_parameters(
    errors: AccelErrors, random: np.random.Generator
) -> tuple[Floats, Floats]:
    A = _draw_matrix(errors, random)
    if errors.matrix is None:
        A = np.tril(A)
    if np.triu(A, 1).any():
        raise ValueError("the accelerometer's matrix must be lower triangular: zero above")
    return A, take_or_draw("bias", errors.bias, (3,), random)


def _draw_gyro_parameters(
    errors: GyroErrors, random: np.random.Generator
) -> tuple[Floats, Floats, Floats]:
    W = _draw_matrix(errors, random)
    bias = take_or_draw("bias", errors.bias, (3,), random)
    return W, bias, take_or_draw("g_sensitivity", errors.g_sensitivity, (3, 3), random)


def _draw_matrix(errors: AccelErrors | GyroErrors, random: np.random.Generator) -> Floats:
    size = np.full((3, 3), check_not_negative("misalignment", errors.misalignment))
    np.fill_diagonal(size, check_not_negative("scale", errors.scale))
    drawn: Floats = np.eye(3) + size * random.standard_normal((3, 3))
    return drawn if errors.matrix is None else check_shape("matrix", errors.matrix, (3, 3))


def _sample_temperature(temperature: Course, seconds: Floats) -> Floats:
    if callable(temperature):
        return check_shape("temperature", temperature(seconds), (seconds.size,))
    first, last = check_shape("temperature", temperature, (2,))
    course: Floats = last + (first - last) * np.exp(-3.0 * seconds / seconds[-1])
    return course


def _temperature_bias(gyro: GyroErrors, degrees: Floats | None) -> Floats | float:
    """Return the bias due to temperature, rad/s, shape (n, 3)."""
    coefficients = np.array(gyro.temperature, dtype=np.float64)
    if not coefficients.size:
        return 0.0
    if degrees is None:
        raise ValueError("a bias by temperature needs the session's temperature")
    if coefficients.ndim == 1:
        coefficients = np.repeat(coefficients[:, None], 3, axis=1)
    check_shape("temperature", coefficients, (None, 3))
    warmth = (degrees[:, None] - _REFERENCE_DEGC) / 10.0
    powers = warmth[:, :, None] ** np.arange(1, len(coefficients) + 1)
    bias: Floats = np.sum(powers * coefficients.T, axis=2)
    return bias
