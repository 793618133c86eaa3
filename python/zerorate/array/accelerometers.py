"""Accelerometers of an array, fused into one accelerometer at one point of the body."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Final, Literal, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from zerorate.array.rotations import parse_vectors
from zerorate.faults import ArgumentError
from zerorate.geometry.scipy_rotation import RotationLike, as_matrices
from zerorate.record.missing import floats
from zerorate.record.named import convert_to_unit, rate_of
from zerorate.types import Booleans, Floats, Integers
from zerorate.units import canonical, convert, kind
from zerorate.views import OneArray, Result

AccelWeights: TypeAlias = Literal["auto", "mean", "white"]

_G: Final = 9.80665
_MAX_ACCEL_M_S2: Final = 1e9
"""Largest valid force, m/s^2; larger samples count as missing."""
_MAX_RATE_RAD_S: Final = 1e6
"""Largest valid rate, rad/s; larger samples count as missing."""
_MAX_LEVER_M: Final = 1e3
"""Largest valid lever arm, m."""
_MAX_ORTHONORMAL_ERROR: Final = 1e-6

_CHUNK_ROWS: Final = 1 << 13
"""Number of samples processed at once."""
_TICK_S: Final = 0.25
"""Interval over which the sensors' means are compared, s."""
_READMISSION_S: Final = 10.0
"""Time of agreement after which an excluded sensor is used again, s."""
_MIN_VOTERS: Final = 3
"""Smallest number of sensors with which a faulty sensor can be identified."""
_MAX_TYPICAL_RATIO: Final = 5.0
"""Factor on the median difference in a tick, because of biases and unmodelled motion."""
_MAX_SIGMAS: Final = 9.0
_SAMPLE_TOLERANCE, _TICK_TOLERANCE = 0.5, 0.1
"""Largest relative error of a sample and of a tick's mean; the reference is at least gravity."""

_DERIVATIVE_SIGMAS: Final = 3.0
"""Error bound of the rate's derivative, in standard deviations."""
_UNKNOWN_LEVER_M: Final = 0.05
"""Assumed lever arm if no positions are given, m."""

_QUIET_DIVISOR: Final = 4
"""The quietest ticks give the noise: one tick of this number."""
_MIN_SIGMA_M_S2: Final = 1e-6 * _G
"""Smallest standard deviation of a sensor, m/s^2."""
_MIN_DERIVATIVE_SIGMA: Final = 1e-6
"""Smallest standard deviation of the rate's derivative: rad/s^2, and relative."""
_FAST_RATE_RAD_S: Final = 35.0
"""Assumed rate where the rate is unknown, rad/s: the range of a 2000 deg/s gyro."""
_RIDGE: Final = 1e-12
"""Relative regularisation of the positions' spread; it keeps the equations solvable."""


@dataclass(frozen=True, eq=False)
class FusedAccelerometers(OneArray, Result):
    """Accelerometer fused from N sensors over n samples, with weights and residuals.

    Attributes
    ----------
    accel : ndarray, shape (n, 3)
        Specific force in the axes of the body, in `unit`. It is valid at the origin of the
        positions. Without positions it is valid at the mean position of the sensors. NaN where no
        sensor can be used.
    weights : ndarray, shape (n, N)
        Share of each sensor in the result; 0 where the sensor was not used.
    excluded : ndarray of bool, shape (n, N)
        Mask of samples at which a sensor was left out as an outlier.
    residual : ndarray, shape (N,)
        RMS residual of each sensor over samples and axes, in `unit`. NaN for a sensor that was
        never used.
    angular_acceleration : ndarray, shape (n, 3), or None
        Angular acceleration of the body, in the rate's unit per second. It is estimated from the
        accelerometers and the rate. NaN where the rate is NaN. None without positions.
    unit : str
        Unit of the accelerations.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> accel = 9.81 + 0.1 * np.random.default_rng(1).standard_normal((500, 3, 3))
    >>> found = zr.array.fuse_accelerometers(accel, np.zeros((500, 3)), rate=100.0)
    >>> found.accel.shape, found.weights.shape, bool(found.excluded.any())
    ((500, 3), (500, 3), False)
    """

    _array_field: ClassVar[str] = "accel"

    accel: Floats
    weights: Floats
    excluded: Booleans
    residual: Floats
    angular_acceleration: Floats | None
    unit: str

    def __repr__(self) -> str:
        """Return the number of sensors and samples, and the sensors' residual."""
        n, sensors = self.weights.shape
        known = self.residual[np.isfinite(self.residual)]
        left = float(np.sqrt(np.mean(known**2))) if known.size else np.nan
        return (
            f"FusedAccelerometers({sensors} sensors, {n} samples, {left:.3g} {self.unit} left "
            "between them)"
        )


def fuse_accelerometers(
    accel: npt.ArrayLike,
    rate_fused: npt.ArrayLike,
    rate: float | None = None,
    *,
    rotations: RotationLike | None = None,
    positions: npt.ArrayLike | None = None,
    weights: AccelWeights | npt.ArrayLike = "auto",
    limit: float | None = None,
    scale_error: float = 0.01,
    gyro_unit: str = "rad/s",
    accel_unit: str = "m/s^2",
) -> FusedAccelerometers:
    """Fuse N accelerometers on one body into one accelerometer at one point.

    A sensor at the lever arm l measures f + alpha x l + omega x (omega x l). The rate omega comes
    from the gyro array. Least squares determine the angular acceleration alpha from the differences
    between the accelerometers. If the derivative of the rate is smooth, it is used in the same
    least squares. At rest the rate determines alpha better than the accelerometers. In fast motion
    the accelerometers determine alpha better than the rate.

    Lever arms are not needed for the mean of sensors that are evenly spread around the origin. They
    are needed if a sensor is missing or has less weight, or if the origin is elsewhere. They are
    also needed to distinguish a faulty sensor from motion.

    With three sensors or more, each sensor is compared with the median of the other sensors. A
    single outlier is left out at once. A sensor is left out if its mean over a quarter second is an
    outlier. It is used again after it agrees for 10 s in which a fault of this size is detectable.
    The threshold is a tenth of gravity plus five times the usual difference between the other
    sensors. It is therefore lower for calibrated sensors than for uncalibrated sensors. It is
    higher in fast rotations than at rest, because of the errors of the lever arms.

    The function does not calibrate the sensors. The result has the weighted mean of their offsets
    and scale errors, and a sensor that drops out causes a step. `zerorate.calibrate` removes these
    errors.

    Parameters
    ----------
    accel : array_like, shape (n, N, 3)
        Specific forces in the sensors' own axes, in `accel_unit`. A sample counts as missing if one
        of its axes is not finite.
    rate_fused : array_like, shape (n, 3)
        Rate of the body at the same times, without bias, in `gyro_unit`: the output of
        `zerorate.GyroArray`. Without positions, the rate only determines the allowed differences
        between the sensors. With positions, the rate may be NaN. The force at the origin then
        follows from the force gradient over the sensors.
    rate : float
        Sampling rate, Hz. Default: the rate of `rate_fused` if it is a `Log`.
    rotations : array_like, shape (N, 3, 3), optional
        Rotations from each sensor's axes to the axes of the body. Default: all sensors are aligned.
    positions : array_like, shape (N, 3), optional
        Positions of the sensors relative to the point of the result, m, in the axes of the body.
    weights : {"auto", "mean", "white"} or array_like, shape (N,)
        "auto" weights by noise and scale error, "mean" weights equally, and "white" weights by
        noise alone. An array gives the weights. An accelerometer always measures gravity, so scale
        errors dominate. "auto" is therefore close to "mean" for sensors with similar noise.
    limit : float, optional
        Range of the sensors, in `accel_unit`. Samples of this size or larger count as missing.
    scale_error : float, default 0.01
        Standard deviation of the sensors' scale factors, 0 to 1. Give a smaller value for
        calibrated sensors.
    gyro_unit, accel_unit : str
        Units of the samples, as in `zerorate.units`.

    Returns
    -------
    FusedAccelerometers

    Raises
    ------
    ValueError
        If an array does not have the stated shape, a matrix is not a rotation, or an argument is
        out of range.

    References
    ----------
    I. Skog, J.-O. Nilsson, P. Händel, J. Jaldén, "Inertial Sensor Arrays, Maximum Likelihood, and
    Cramér-Rao Bound", IEEE Trans. Signal Processing 64(16):4218, 2016 (model of the lever arms).

    Examples
    --------
    Two sensors are on a turntable, 10 cm and 20 cm from its axis. On the axis only gravity acts:

    >>> import numpy as np
    >>> import zerorate as zr
    >>> omega = np.tile([0.0, 0.0, 2.0], (500, 1))
    >>> accel = np.tile([[-0.4, 0.0, 9.81], [-0.8, 0.0, 9.81]], (500, 1, 1))
    >>> places = [[0.1, 0.0, 0.0], [0.2, 0.0, 0.0]]
    >>> found = zr.array.fuse_accelerometers(accel, omega, rate=100.0, positions=places)
    >>> print(found.accel[0].round(6) + 0.0)
    [0.   0.   9.81]
    """
    hertz, units = rate_of(rate, rate_fused), _Units.of(gyro_unit, accel_unit)
    samples = parse_vectors("accel", accel)
    n, sensors, _ = samples.shape
    matrices, levers = _parse_rotations(rotations, sensors), _parse_positions(positions, sensors)
    weighting = _parse_weights(weights, sensors)
    if not 0.0 <= scale_error <= 1.0:
        raise ArgumentError("scale_error", f"must be from 0 to 1, got {scale_error}")
    omega = _parse_rates(convert_to_unit(rate_fused, gyro_unit, "rate_fused"), n) * units.rate
    present = _find_present(samples, limit, units.accel)
    force = _rotate_to_body(
        np.where(present[:, :, np.newaxis], samples * units.accel, np.nan), matrices
    )
    motion = None if levers is None else _Motion.of(omega, hertz, levers)
    noise = _estimate_noise(force, hertz)
    blocks = _split_blocks(n, hertz)
    lever_error = _unknown_lever_error(omega, hertz) if motion is None else None
    votes = [
        _vote_on_block(force[block], motion, lever_error, block, noise, hertz) for block in blocks
    ]
    excluded = _find_excluded(votes, hertz) & present
    solution = _Solution(n, sensors)
    for block in blocks:
        variances = _weight_variances(weighting, noise, scale_error * _median_force(force[block]))
        usable = present[block] & ~excluded[block]
        solution.add(block, force[block], np.where(usable, 1.0 / variances, 0.0), motion)
    return FusedAccelerometers(
        accel=solution.force / units.accel,
        weights=solution.weights,
        excluded=excluded,
        residual=solution.residual / units.accel,
        angular_acceleration=None if motion is None else solution.angular_acceleration / units.rate,
        unit=units.name,
    )


def _rotate_to_body(force: Floats, matrices: Floats | None) -> Floats:
    rotated: Floats = force if matrices is None else np.einsum("kij,nkj->nki", matrices, force)
    return rotated


def _median_force(force: Floats) -> Floats:
    """Return the median force of the sensors, (n,); at least gravity."""
    size: Floats = _sensor_median(np.linalg.norm(force, axis=2)[:, :, np.newaxis])[:, 0]
    return np.fmax(size, _G)


class _Units(NamedTuple):
    """Factors from the samples' units to rad/s and m/s^2, and the accelerometer's unit."""

    rate: float
    accel: float
    name: str

    @classmethod
    def of(cls, gyro_unit: str, accel_unit: str) -> _Units:
        for name, unit, expected in (
            ("gyro_unit", gyro_unit, "rate"),
            ("accel_unit", accel_unit, "acceleration"),
        ):
            if kind(unit) != expected:
                raise ArgumentError(name, f"must be a unit of {expected}, got '{unit}'")
        return cls(
            convert(1.0, gyro_unit, "rad/s"),
            convert(1.0, accel_unit, "m/s^2"),
            canonical(accel_unit),
        )


class _Motion(NamedTuple):
    """Rotation of the body, in SI units.

    The fields are:

    - positions of the sensors (N, 3)
    - rate (n, 3), zero where unknown
    - mask of known rates (n,)
    - derivative of the rate (n, 3)
    - inverse variance of the derivative (n,)
    """

    levers: Floats
    omega: Floats
    known: Booleans
    change: Floats
    certainty: Floats

    @classmethod
    def of(cls, omega: Floats, rate: float, levers: Floats) -> _Motion:
        known: Booleans = np.all(np.isfinite(omega), axis=1)
        change, variance = _derivative(omega, rate)
        certainty = np.divide(1.0, variance, out=np.zeros_like(variance), where=variance > 0.0)
        turns = np.where(known[:, np.newaxis], omega, 0.0)
        return cls(levers, turns, known, change, certainty * known)

    def part(self, block: slice) -> _Motion:
        """Return the motion of a block of samples."""
        return _Motion(
            self.levers,
            self.omega[block],
            self.known[block],
            self.change[block],
            self.certainty[block],
        )

    @property
    def centripetal(self) -> Floats:
        """Centripetal acceleration at each sensor, (n, N, 3)."""
        turn = self.omega[:, np.newaxis]
        return np.cross(turn, np.cross(turn, self.levers))

    @property
    def lever_acceleration(self) -> Floats:
        """Acceleration at each lever arm, from the rate and its derivative, (n, N, 3)."""
        return self.centripetal + np.cross(self.change[:, np.newaxis], self.levers)

    @property
    def lever_error(self) -> Floats:
        """Bound of the error of `lever_acceleration`, (n, N); infinite without a rate."""
        sure = np.sqrt(self.certainty)[:, np.newaxis]
        arms = np.linalg.norm(self.levers - self.levers.mean(axis=0), axis=1)
        unknown = np.full((len(sure), len(arms)), np.inf)
        doubt: Floats = np.divide(_DERIVATIVE_SIGMAS * arms, sure, out=unknown, where=sure > 0.0)
        return doubt


def _unknown_lever_error(omega: Floats, rate: float) -> Floats:
    """Return the largest acceleration that unknown lever arms can cause, (n, 1)."""
    change, variance = _derivative(omega, rate)
    size = np.square(np.linalg.norm(omega, axis=1)) + np.linalg.norm(change, axis=1)
    size += _DERIVATIVE_SIGMAS * np.sqrt(variance)
    doubt = np.where(np.isfinite(size) & (variance > 0.0), _UNKNOWN_LEVER_M * size, np.inf)
    return doubt[:, np.newaxis]


def _derivative(omega: Floats, rate: float) -> tuple[Floats, Floats]:
    """Return the derivative of the rate, (n, 3), and its variance, (n,); both are 0 if unknown.

    The difference between the slopes before and after a sample shows the error of their mean. The
    error comes from noise, or from motion that is too fast for the sampling rate.
    """
    slopes = np.diff(omega, axis=0) * rate
    edge = np.full((1, 3), np.nan)
    before, after = np.concatenate((edge, slopes)), np.concatenate((slopes, edge))
    both = 0.5 * (before + after)
    one_sided = np.where(np.isfinite(before), before, after)
    change = np.where(np.isfinite(both), both, one_sided)
    doubt = np.where(np.isfinite(both), after - before, one_sided)
    variance = np.mean(doubt**2, axis=1)
    # Include the neighbours' variances, because slopes may agree by chance.
    padded = np.pad(variance, 1, constant_values=np.nan)
    variance = np.fmax(np.fmax(padded[:-2], padded[2:]), variance)
    known = np.isfinite(change).all(axis=1) & np.isfinite(variance)
    floor = (
        _MIN_DERIVATIVE_SIGMA * np.linalg.norm(np.where(known[:, np.newaxis], change, 0.0), axis=1)
    ) ** 2
    return (
        np.where(known[:, np.newaxis], change, 0.0),
        np.where(known, variance + floor + _MIN_DERIVATIVE_SIGMA**2, 0.0),
    )


def _parse_rates(rate_fused: npt.ArrayLike, n: int) -> Floats:
    rates = floats(rate_fused, "rate_fused")
    if rates.shape != (n, 3):
        raise ArgumentError(
            "rate_fused", f"must have shape ({n}, 3), as accel has, got {rates.shape}"
        )
    return np.where(np.abs(rates) <= _MAX_RATE_RAD_S, rates, np.nan)


def _parse_rotations(rotations: RotationLike | None, sensors: int) -> Floats | None:
    if rotations is None:
        return None
    matrices = floats(as_matrices(rotations), "rotations")
    if matrices.shape != (sensors, 3, 3):
        raise ArgumentError("rotations", f"must have shape ({sensors}, 3, 3), got {matrices.shape}")
    for k, matrix in enumerate(matrices):
        off = np.abs(matrix @ matrix.T - np.eye(3)).max()
        # NaN must not pass, hence the negation.
        if not (off <= _MAX_ORTHONORMAL_ERROR and np.linalg.det(matrix) > 0.0):
            raise ValueError(f"the matrix of sensor {k + 1} is no rotation")
    return matrices


def _parse_positions(positions: npt.ArrayLike | None, sensors: int) -> Floats | None:
    if positions is None:
        return None
    levers = floats(positions, "positions")
    if levers.shape != (sensors, 3):
        raise ArgumentError(
            "positions", f"must have shape ({sensors}, 3), in m, got {levers.shape}"
        )
    if not (np.abs(levers) <= _MAX_LEVER_M).all():
        raise ArgumentError("positions", f"must be finite, within {_MAX_LEVER_M:g} m")
    return levers


def _parse_weights(weights: str | npt.ArrayLike, sensors: int) -> Floats | str:
    """Return the name of the weighting, or the weights scaled to mean 1."""
    if isinstance(weights, str):
        if weights not in ("auto", "mean", "white"):
            raise ArgumentError("weights", f"must be auto, mean, white or numbers, got '{weights}'")
        return weights
    numbers = floats(weights, "weights")
    if numbers.shape != (sensors,) or not (np.isfinite(numbers) & (numbers >= 0.0)).all():
        raise ArgumentError("weights", f"must be {sensors} numbers, none negative")
    largest = float(numbers.max())
    if largest == 0.0:
        raise ArgumentError("weights", "must not all be zero")
    scaled: Floats = numbers / largest
    scaled /= scaled.mean()
    return scaled


def _find_present(samples: Floats, limit: float | None, factor: float) -> Booleans:
    """Return the mask (n, N) of samples that are complete and below the range."""
    largest = _MAX_ACCEL_M_S2 / factor
    if limit is not None:
        if not limit > 0.0:
            raise ArgumentError("limit", f"must be positive, got {limit}")
        largest = min(largest, np.nextafter(limit, 0.0))
    present: Booleans = np.all(np.abs(samples) <= largest, axis=2)
    return present


def _tick_starts(n: int, rate: float) -> Integers:
    """Return the first sample of each tick."""
    return np.arange(0, n, max(round(_TICK_S * rate), 1))


def _tick_means(values: Floats, starts: Integers) -> tuple[Floats, Integers]:
    """Return each tick's mean over the present values (n, N, 3), and their number."""
    present = np.isfinite(values)
    counts = np.add.reduceat(present, starts, axis=0, dtype=np.int64)
    sums = np.add.reduceat(np.where(present, values, 0.0), starts, axis=0)
    means = np.divide(sums, counts, out=np.full(sums.shape, np.nan), where=counts > 0)
    return means, counts[:, :, 0]


def _estimate_noise(force: Floats, rate: float) -> Floats:
    """Return each sensor's standard deviation of a sample on an axis, shape (N,).

    It comes from the steps between samples, in the quarter of the ticks in which most sensors are
    quietest. A sensor without samples in these ticks gets the value of the other sensors.
    """
    steps = 0.5 * np.diff(force, axis=0, prepend=force[:1]) ** 2
    squares = _tick_means(steps, _tick_starts(len(force), rate))[0].mean(axis=2)
    loud = _sensor_median(squares[:, :, np.newaxis])[:, 0]
    order = np.argsort(loud, kind="stable")
    known = order[: max(int(np.isfinite(loud).sum()) // _QUIET_DIVISOR, 1)]
    quiet = squares[known]
    present = np.isfinite(quiet)
    sums = np.where(present, quiet, 0.0).sum(axis=0)
    means = np.divide(
        sums, present.sum(axis=0), out=np.full(sums.shape, np.nan), where=present.any(0)
    )
    usual = float(_sensor_median(means[np.newaxis, :, np.newaxis])[0, 0])
    return np.sqrt(np.where(np.isfinite(means), means, usual if np.isfinite(usual) else 0.0))


def _sensor_median(values: Floats) -> Floats:
    """Return the medians over the present sensors, (n, k), of values (n, N, k)."""
    # Sorting puts NaN last.
    ranked = np.sort(values, axis=1)
    counts = np.isfinite(values).sum(axis=1, keepdims=True)
    low = np.take_along_axis(ranked, np.maximum(counts - 1, 0) // 2, axis=1)
    high = np.take_along_axis(ranked, np.minimum(counts // 2, values.shape[1] - 1), axis=1)
    return 0.5 * (low + high)[:, 0]


def _split_blocks(n: int, rate: float) -> list[slice]:
    """Return blocks of whole ticks that are small enough for the memory."""
    length = max(round(_TICK_S * rate), 1)
    step = length * max(_CHUNK_ROWS // length, 1)
    return [slice(first, min(first + step, n)) for first in range(0, n, step)]


class _Vote(NamedTuple):
    """Outliers: mask of samples (n, N), and per tick the mask, distances and bounds of sensors."""

    outliers: Booleans
    outlier_ticks: Booleans
    sizes: Floats
    bounds: Floats


def _vote_on_block(
    force: Floats,
    motion: _Motion | None,
    lever_error: Floats | None,
    block: slice,
    noise: Floats,
    rate: float,
) -> _Vote:
    """Return the outliers of a block; `lever_error` applies if lever arms are unknown."""
    if motion is None:
        assert lever_error is not None
        return _vote_on_sensors(
            force, np.broadcast_to(lever_error[block], force.shape[:2]), noise, rate
        )
    part = motion.part(block)
    return _vote_on_sensors(force - part.lever_acceleration, part.lever_error, noise, rate)


def _vote_on_sensors(forces: Floats, lever_error: Floats, noise: Floats, rate: float) -> _Vote:
    """Return the mask (n, N) of sensors that are outliers from the median of all.

    The sensors should agree up to `lever_error` (n, N), which is infinite where it is unknown.
    """
    middle = _sensor_median(forces)
    differences = forces - middle[:, np.newaxis]
    size = np.maximum(np.linalg.norm(middle, axis=1), _G)[:, np.newaxis]
    sizes, bounds = _compare_sizes(differences, noise, _SAMPLE_TOLERANCE * size + lever_error)
    outliers: Booleans = sizes > bounds
    starts = _tick_starts(len(forces), rate)
    comparable = np.isfinite(lever_error + size)
    means, counts = _tick_means(np.where(comparable[:, :, np.newaxis], differences, np.nan), starts)
    tolerance, _ = _tick_means(
        np.where(comparable, _TICK_TOLERANCE * size + lever_error, np.nan)[:, :, np.newaxis], starts
    )
    sizes, bounds = _compare_sizes(
        means, noise / np.sqrt(np.maximum(counts, 1)), tolerance[:, :, 0]
    )
    spikes = np.add.reduceat(outliers, starts, axis=0, dtype=np.int64)
    outlier_ticks = (sizes > bounds) | ((2 * spikes > counts) & (counts > 0))
    return _Vote(outliers, outlier_ticks, sizes, bounds)


def _find_excluded(votes: list[_Vote], rate: float) -> Booleans:
    """Return the mask (n, N) of sensors to leave out."""
    outliers, outlier_ticks, sizes, bounds = (
        np.concatenate(parts) for parts in zip(*votes, strict=True)
    )
    starts = _tick_starts(len(outliers), rate)
    lengths = np.diff(np.append(starts, len(outliers)))
    held = _find_held_out(
        outlier_ticks, sizes, bounds, math.ceil(_READMISSION_S * rate / lengths[0])
    )
    excluded: Booleans = outliers | np.repeat(held, lengths, axis=0)
    return excluded


def _compare_sizes(differences: Floats, noise: Floats, tolerance: Floats) -> tuple[Floats, Floats]:
    """Return each sensor's distance from the median (m, N), and its bound from the other sensors.

    Both are NaN if the sensor is missing. The bound is infinite if too few sensors are present.
    """
    sizes = np.linalg.norm(differences, axis=2)
    typical = _sensor_median(sizes[:, :, np.newaxis])
    several = np.isfinite(sizes).sum(axis=1, keepdims=True) >= _MIN_VOTERS
    bounds: Floats = _MAX_TYPICAL_RATIO * typical + _MAX_SIGMAS * noise + tolerance
    return sizes, np.where(several, bounds, np.inf)


def _find_held_out(
    out: Booleans, sizes: Floats, bounds: Floats, readmission_ticks: int
) -> Booleans:
    """Return the mask of ticks (m, N) in which a sensor is excluded.

    The sensor returns after `readmission_ticks` ticks without an outlier. In these ticks the last
    outlier would have been detected.
    """
    held = np.empty_like(out)
    last_size, agreed_ticks = np.zeros(out.shape[1]), np.full(out.shape[1], readmission_ticks)
    for t, now in enumerate(out):
        last_size = np.where(now, np.fmax(sizes[t], bounds[t]), last_size)
        agreed_ticks = np.where(
            now, 0, agreed_ticks + (np.isfinite(sizes[t]) & (bounds[t] < last_size))
        )
        held[t] = agreed_ticks < readmission_ticks
    return held


def _weight_variances(weighting: Floats | str, noise: Floats, scale: Floats) -> Floats:
    """Return the variances (n, N) for the weights; `scale` (n,) is the size of scale errors."""
    sensor_variance = noise**2 + _MIN_SIGMA_M_S2**2
    common = np.square(scale)[:, np.newaxis]
    if isinstance(weighting, str):
        if weighting == "white":
            return np.broadcast_to(sensor_variance, (len(scale), len(sensor_variance)))
        total: Floats = (
            sensor_variance if weighting == "auto" else sensor_variance.mean()
        ) + common
        return np.broadcast_to(total, (len(scale), len(sensor_variance)))
    with np.errstate(divide="ignore"):
        divided: Floats = (sensor_variance.mean() + common) / weighting
    return divided


class _Solution:
    """Solution, filled in blocks: force, rotation (n, 3), weights (n, N), and residual (N,)."""

    def __init__(self, n: int, sensors: int) -> None:
        self.force, self.angular_acceleration = np.empty((n, 3)), np.empty((n, 3))
        self.weights = np.empty((n, sensors))
        self._squares, self._counts = np.zeros(sensors), np.zeros(sensors)

    def add(self, block: slice, force: Floats, information: Floats, motion: _Motion | None) -> None:
        """Solve a block of samples."""
        solved = _solve_block(force, information, None if motion is None else motion.part(block))
        self.force[block], self.angular_acceleration[block] = (
            solved.force,
            solved.angular_acceleration,
        )
        self.weights[block] = solved.weights
        used = solved.weights > 0.0
        self._squares += np.sum(
            np.where(used[:, :, np.newaxis], solved.residuals, 0.0) ** 2, axis=(0, 2)
        )
        self._counts += 3 * used.sum(axis=0)

    @property
    def residual(self) -> Floats:
        """RMS residual of each sensor over its used samples and the axes."""
        unknown = np.full(self._counts.shape, np.nan)
        means: Floats = np.divide(self._squares, self._counts, out=unknown, where=self._counts > 0)
        return np.sqrt(means)


class _BlockSolution(NamedTuple):
    """Force (n, 3), weights (n, N), angular acceleration (n, 3), and residuals (n, N, 3)."""

    force: Floats
    weights: Floats
    angular_acceleration: Floats
    residuals: Floats


def _solve_block(force: Floats, information: Floats, motion: _Motion | None) -> _BlockSolution:
    """Return the force at the origin, by least squares.

    Relative to their weighted mean position, the sensors show the angular acceleration alone. The
    equations describe a rigid body with the sensors' information as masses. With inertia J: J alpha
    = sum of r x force.
    """
    if motion is not None:
        force = force - motion.centripetal
    present_force = np.where(information[:, :, np.newaxis] > 0.0, force, 0.0)
    total = information.sum(axis=1)
    unobserved = total == 0.0
    weights = information / np.where(unobserved, 1.0, total)[:, np.newaxis]
    mean = np.einsum("nk,nki->ni", weights, present_force)
    differences = np.where(
        information[:, :, np.newaxis] > 0.0, present_force - mean[:, np.newaxis], 0.0
    )
    turns = np.full(mean.shape, np.nan)
    if motion is not None:
        centre = weights @ motion.levers
        arms = motion.levers - centre[:, np.newaxis]
        change = _force_gradient(arms, differences, information, motion)
        mean = mean - np.einsum("nij,nj->ni", change, centre)
        differences = differences - np.einsum("nij,nkj->nki", change, arms)
        turns = np.stack([change[:, 2, 1], change[:, 0, 2], change[:, 1, 0]], axis=1)
        turns[unobserved | ~motion.known] = np.nan
    mean[unobserved] = np.nan
    return _BlockSolution(mean, weights, turns, differences)


def _force_gradient(arms: Floats, differences: Floats, u: Floats, motion: _Motion) -> Floats:
    """Return the gradient of the force by position, (n, 3, 3). An arm times it is a force.

    The differences from the mean at the arms (n, N, 3) determine it. If the rate is known, the
    gradient is a cross product with the angular acceleration, and the rate contributes to it.
    Otherwise it is an unconstrained matrix. Its prior size corresponds to a rotation at the end of
    the gyro's range.
    """
    squares = np.einsum("nk,nki,nkj->nij", u, arms, arms)
    spread = np.trace(squares, axis1=1, axis2=2)
    ridge = np.maximum(_RIDGE * spread, np.finfo(float).tiny) + motion.certainty
    inertia = (spread + ridge)[:, np.newaxis, np.newaxis] * np.eye(3) - squares
    moment = np.einsum("nk,nki->ni", u, np.cross(arms, differences))
    moment += motion.certainty[:, np.newaxis] * motion.change
    x, y, z = np.linalg.solve(inertia, moment[:, :, np.newaxis])[:, :, 0].T
    zero = np.zeros_like(x)
    changes: Floats = np.stack([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    unknown = np.flatnonzero(~motion.known)
    across = np.einsum("nk,nki,nkj->nij", u[unknown], arms[unknown], differences[unknown])
    free = np.linalg.solve(squares[unknown] + np.eye(3) / _FAST_RATE_RAD_S**4, across)
    changes[unknown] = free.transpose(0, 2, 1)
    return changes
