"""Accelerometers of an array as one, at one point of the body."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from zerorate.array.rotations import sensor_vectors
from zerorate.faults import ArgumentError
from zerorate.record.missing import floats
from zerorate.record.named import in_unit, rate_of
from zerorate.types import Booleans, Floats, Integers
from zerorate.units import canonical, convert, kind
from zerorate.views import Result

AccelWeights: TypeAlias = Literal["auto", "mean", "white"]

_G: Final = 9.80665
_MOST_ACCEL: Final = 1e9
"""m/s^2 that no sensor gives: beyond it a sample is missing."""
_MOST_RATE: Final = 1e6
"""The same in rad/s."""
_MOST_LEVER: Final = 1e3
"""Metres to a sensor."""
_ORTHONORMAL: Final = 1e-6

_ROWS: Final = 1 << 13
"""Samples at a time."""
_TICK: Final = 0.25
"""Seconds over which sensors are compared."""
_BACK: Final = 10.0
"""Seconds of agreement after which a sensor is back."""
_VOTERS: Final = 3
"""Sensors of which one can be told to be wrong."""
_TYPICAL: Final = 5.0
"""Times what half of the sensors differ by in the same tick: biases, motion without levers."""
_SIGMAS: Final = 9.0
_SAMPLE_SHARE, _TICK_SHARE = 0.5, 0.1
"""Parts of the acceleration, gravity at least, by which a sample and the mean of a tick are off."""

_DOUBTS: Final = 3.0
"""Deviations of the rate's derivative, times the lever arm."""
_SOME_LEVER: Final = 0.05
"""Metres between sensors whose positions are not given."""

_QUIET: Final = 4
"""One in so many ticks, the quietest, tells the noise."""
_FLOOR: Final = 1e-6 * _G
"""Least deviation of a sensor, m/s^2."""
_STILL: Final = 1e-6
"""Least deviation of the rate's derivative, rad/s^2; and, of the derivative, the least part."""
_FAST: Final = 35.0
"""rad/s, 2000 deg/s: rates beyond are what gyros miss."""
_RIDGE: Final = 1e-12
"""Part of the spread of the positions that keeps equations solvable."""


@dataclass(frozen=True, eq=False)
class FusedAccelerometers(Result):
    """One accelerometer in the place of N, and how each of them did; n samples.

    Attributes
    ----------
    accel : ndarray, shape (n, 3)
        Specific force in the axes of the body, in `unit`: at the origin of the positions, or at the
        mean place of the sensors where none are given. NaN where no sensor is left.
    weights : ndarray, shape (n, N)
        Share of each sensor; 0 where it was not used.
    excluded : ndarray of bool, shape (n, N)
        Where a sensor was left out, for it was far from the others.
    residual : ndarray, shape (N,)
        RMS over samples and axes of what is left of each sensor's difference from all, in `unit`;
        NaN for one that was never used.
    angular_acceleration : ndarray, shape (n, 3), or None
        Of the body, in the unit of the rate per second, from accelerometers and rate; NaN where the
        rate is. None without positions.
    unit : str
        Of the accelerations.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> accel = 9.81 + 0.1 * np.random.default_rng(1).standard_normal((500, 3, 3))
    >>> found = zr.array.fuse_accelerometers(accel, np.zeros((500, 3)), rate=100.0)
    >>> found.accel.shape, found.weights.shape, bool(found.excluded.any())
    ((500, 3), (500, 3), False)
    """

    accel: Floats
    weights: Floats
    excluded: Booleans
    residual: Floats
    angular_acceleration: Floats | None
    unit: str

    def __repr__(self) -> str:
        """Return the number of sensors and samples, and what is left between the sensors."""
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
    rotations: npt.ArrayLike | None = None,
    positions: npt.ArrayLike | None = None,
    weights: AccelWeights | npt.ArrayLike = "auto",
    limit: float | None = None,
    scale_error: float = 0.01,
    gyro_unit: str = "rad/s",
    accel_unit: str = "m/s^2",
) -> FusedAccelerometers:
    """Return one accelerometer of N on one body, at one point of it.

    A sensor at the lever arm l feels f + alpha x l + omega x (omega x l). Omega is the rate of the
    array; alpha, the angular acceleration, follows by least squares from differences between the
    accelerometers, and from the change of the rate as far as that is smooth: at rest the rate tells
    it better, in fast motion the accelerometers do. A mean over sensors that lie evenly around the
    origin needs no lever arms; they matter where a sensor is missing or weighs less, where the
    point lies elsewhere, and to tell a faulty sensor from motion.

    From three sensors on, one is left out while it is far from the middle of the others: a sample
    at once, a sensor when the mean of a quarter second is, until it has agreed for 10 s in which so
    large a fault would have been seen. Far is a tenth of gravity and five times what the others
    usually differ by, so calibrated sensors show smaller faults. In fast turns, where lever arms
    are less certain, only larger ones are seen.

    Nothing is calibrated here: the result has the weighted mean of the sensors' offsets and scale
    errors, and a sensor that drops out leaves a step. `zerorate.calibrate` removes both.

    Parameters
    ----------
    accel : array_like, shape (n, N, 3)
        Specific forces in the sensors' own axes, in `accel_unit`. A sample of which an axis is not
        finite is missing.
    rate_fused : array_like, shape (n, 3)
        Rate of the body at the same times, its bias taken off, in `gyro_unit`: that of
        `zerorate.GyroArray`. Without positions it only tells where sensors may differ; with them,
        where it is not finite, the force at the origin follows from how it changes from sensor to
        sensor.
    rate : float
        Samples per second, Hz; by default that of a `Log` of `rate_fused`.
    rotations : array_like, shape (N, 3, 3), optional
        From each sensor's axes to those of the body; by default all are aligned.
    positions : array_like, shape (N, 3), optional
        Of the sensors in the axes of the body, m, from the point for which the result is wanted.
    weights : {"auto", "mean", "white"} or array_like, shape (N,)
        By noise and scale error; alike; by noise alone; or as given. An accelerometer always feels
        gravity, so "auto" is close to the mean unless a sensor is far noisier than others.
    limit : float, optional
        Size at which a sample is at the end of the sensors' range, and missing, in `accel_unit`.
    scale_error : float, default 0.01
        Deviation of the sensors' scale factors, 0 to 1; less after a calibration.
    gyro_unit, accel_unit : str
        Units of the samples, as in `zerorate.units`.

    Returns
    -------
    FusedAccelerometers

    Raises
    ------
    ValueError
        If an array has another shape, a matrix is no rotation, or an argument is out of range.

    References
    ----------
    I. Skog, J.-O. Nilsson, P. Händel, J. Jaldén, "Inertial Sensor Arrays, Maximum Likelihood, and
    Cramér-Rao Bound", IEEE Trans. Signal Processing 64(16):4218, 2016: the model of the lever arms.

    Examples
    --------
    Two sensors on a turntable, 10 cm from its axis and 20 cm; the axis itself feels gravity alone:

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
    samples = sensor_vectors("accel", accel)
    n, sensors, _ = samples.shape
    matrices, levers = _rotations(rotations, sensors), _positions(positions, sensors)
    given = _given(weights, sensors)
    if not 0.0 <= scale_error <= 1.0:
        raise ArgumentError("scale_error", f"must be from 0 to 1, got {scale_error}")
    omega = _rates(in_unit(rate_fused, gyro_unit, "rate_fused"), n) * units.rate
    there = _present(samples, limit, units.accel)
    force = _in_body(np.where(there[:, :, np.newaxis], samples * units.accel, np.nan), matrices)
    motion = None if levers is None else _Motion.of(omega, hertz, levers)
    noise = _noise(force, hertz)
    blocks = _blocks(n, hertz)
    doubt = _without_levers(omega, hertz) if motion is None else None
    votes = [_voted(force[here], motion, doubt, here, noise, hertz) for here in blocks]
    excluded = _excluded(votes, hertz) & there
    found = _Found(n, sensors)
    for here in blocks:
        variances = _variances(given, noise, scale_error * _size(force[here]))
        usable = there[here] & ~excluded[here]
        found.take(here, force[here], np.where(usable, 1.0 / variances, 0.0), motion)
    return FusedAccelerometers(
        accel=found.force / units.accel,
        weights=found.weights,
        excluded=excluded,
        residual=found.residual / units.accel,
        angular_acceleration=None if motion is None else found.turns / units.rate,
        unit=units.name,
    )


def _in_body(force: Floats, matrices: Floats | None) -> Floats:
    turned: Floats = force if matrices is None else np.einsum("kij,nkj->nki", matrices, force)
    return turned


def _size(force: Floats) -> Floats:
    """Return the size that most sensors feel, (n,); gravity at least, also where nobody is left."""
    size: Floats = _median(np.linalg.norm(force, axis=2)[:, :, np.newaxis])[:, 0]
    return np.fmax(size, _G)


class _Units(NamedTuple):
    """What samples are multiplied by, to rad/s and m/s^2, and the name of the second unit."""

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
    """How the body turns, in SI.

    Sensors' positions (N, 3); the rate (n, 3), zero where it is not known, and where it is known
    (n,); its derivative (n, 3) and the inverse of the variance of that (n,).
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

    def part(self, here: slice) -> _Motion:
        """Return the same of some samples."""
        return _Motion(
            self.levers,
            self.omega[here],
            self.known[here],
            self.change[here],
            self.certainty[here],
        )

    @property
    def turning(self) -> Floats:
        """What turning alone does to the sensors, (n, N, 3)."""
        turn = self.omega[:, np.newaxis]
        return np.cross(turn, np.cross(turn, self.levers))

    @property
    def felt(self) -> Floats:
        """What sensors feel for their lever arms, (n, N, 3), by the rate alone."""
        return self.turning + np.cross(self.change[:, np.newaxis], self.levers)

    @property
    def doubt(self) -> Floats:
        """By how much that may be wrong against the mean place, (n, N); infinite without a rate."""
        sure = np.sqrt(self.certainty)[:, np.newaxis]
        arms = np.linalg.norm(self.levers - self.levers.mean(axis=0), axis=1)
        unknown = np.full((len(sure), len(arms)), np.inf)
        doubt: Floats = np.divide(_DOUBTS * arms, sure, out=unknown, where=sure > 0.0)
        return doubt


def _without_levers(omega: Floats, rate: float) -> Floats:
    """Return what lever arms that are not known may do, (n, 1)."""
    change, variance = _derivative(omega, rate)
    size = np.square(np.linalg.norm(omega, axis=1)) + np.linalg.norm(change, axis=1)
    size += _DOUBTS * np.sqrt(variance)
    doubt = np.where(np.isfinite(size) & (variance > 0.0), _SOME_LEVER * size, np.inf)
    return doubt[:, np.newaxis]


def _derivative(omega: Floats, rate: float) -> tuple[Floats, Floats]:
    """Return the derivative (n, 3), zero where it is not known, and its variance (n,), 0 there.

    What the slopes to the last and to the next sample differ by, tells how wrong their mean is:
    motion that is too fast for the samples, or noise.
    """
    slopes = np.diff(omega, axis=0) * rate
    edge = np.full((1, 3), np.nan)
    before, after = np.concatenate((edge, slopes)), np.concatenate((slopes, edge))
    both = 0.5 * (before + after)
    one = np.where(np.isfinite(before), before, after)
    change = np.where(np.isfinite(both), both, one)
    doubt = np.where(np.isfinite(both), after - before, one)
    variance = np.mean(doubt**2, axis=1)
    # Of its neighbours too, for slopes may agree by chance.
    padded = np.pad(variance, 1, constant_values=np.nan)
    variance = np.fmax(np.fmax(padded[:-2], padded[2:]), variance)
    known = np.isfinite(change).all(axis=1) & np.isfinite(variance)
    floor = (_STILL * np.linalg.norm(np.where(known[:, np.newaxis], change, 0.0), axis=1)) ** 2
    return (
        np.where(known[:, np.newaxis], change, 0.0),
        np.where(known, variance + floor + _STILL**2, 0.0),
    )


def _rates(rate_fused: npt.ArrayLike, n: int) -> Floats:
    rates = floats(rate_fused, "rate_fused")
    if rates.shape != (n, 3):
        raise ArgumentError(
            "rate_fused", f"must have shape ({n}, 3), as accel has, got {rates.shape}"
        )
    return np.where(np.abs(rates) <= _MOST_RATE, rates, np.nan)


def _rotations(rotations: npt.ArrayLike | None, sensors: int) -> Floats | None:
    if rotations is None:
        return None
    matrices = floats(rotations, "rotations")
    if matrices.shape != (sensors, 3, 3):
        raise ArgumentError("rotations", f"must have shape ({sensors}, 3, 3), got {matrices.shape}")
    for k, matrix in enumerate(matrices):
        off = np.abs(matrix @ matrix.T - np.eye(3)).max()
        # Not so for NaN.
        if not (off <= _ORTHONORMAL and np.linalg.det(matrix) > 0.0):
            raise ValueError(f"the matrix of sensor {k + 1} is no rotation")
    return matrices


def _positions(positions: npt.ArrayLike | None, sensors: int) -> Floats | None:
    if positions is None:
        return None
    levers = floats(positions, "positions")
    if levers.shape != (sensors, 3):
        raise ArgumentError(
            "positions", f"must have shape ({sensors}, 3), in m, got {levers.shape}"
        )
    if not (np.abs(levers) <= _MOST_LEVER).all():
        raise ArgumentError("positions", f"must be finite, within {_MOST_LEVER:g} m")
    return levers


def _given(weights: str | npt.ArrayLike, sensors: int) -> Floats | str:
    """Return the word, or numbers of mean 1."""
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


def _present(samples: Floats, limit: float | None, factor: float) -> Booleans:
    """Return which samples (n, N) are there on all axes, and not at the end of the range."""
    most = _MOST_ACCEL / factor
    if limit is not None:
        if not limit > 0.0:
            raise ArgumentError("limit", f"must be positive, got {limit}")
        most = min(most, np.nextafter(limit, 0.0))
    there: Booleans = np.all(np.abs(samples) <= most, axis=2)
    return there


def _starts(n: int, rate: float) -> Integers:
    """Return where ticks begin."""
    return np.arange(0, n, max(round(_TICK * rate), 1))


def _tick_means(values: Floats, starts: Integers) -> tuple[Floats, Integers]:
    """Return the means over each tick of the values (n, N, 3) that are there, and their number."""
    there = np.isfinite(values)
    counts = np.add.reduceat(there, starts, axis=0, dtype=np.int64)
    sums = np.add.reduceat(np.where(there, values, 0.0), starts, axis=0)
    means = np.divide(sums, counts, out=np.full(sums.shape, np.nan), where=counts > 0)
    return means, counts[:, :, 0]


def _noise(force: Floats, rate: float) -> Floats:
    """Return the deviation of the samples of each sensor on an axis, shape (N,).

    It is that of steps from sample to sample, in the quarter of the ticks in which most sensors are
    quietest; for a sensor that is not there then it is the others'.
    """
    steps = 0.5 * np.diff(force, axis=0, prepend=force[:1]) ** 2
    squares = _tick_means(steps, _starts(len(force), rate))[0].mean(axis=2)
    loud = _median(squares[:, :, np.newaxis])[:, 0]
    order = np.argsort(loud, kind="stable")
    known = order[: max(int(np.isfinite(loud).sum()) // _QUIET, 1)]
    quiet = squares[known]
    there = np.isfinite(quiet)
    sums = np.where(there, quiet, 0.0).sum(axis=0)
    means = np.divide(sums, there.sum(axis=0), out=np.full(sums.shape, np.nan), where=there.any(0))
    usual = float(_median(means[np.newaxis, :, np.newaxis])[0, 0])
    return np.sqrt(np.where(np.isfinite(means), means, usual if np.isfinite(usual) else 0.0))


def _median(values: Floats) -> Floats:
    """Return the medians (n, k) over the sensors of values (n, N, k), of those that are there."""
    # NaN come last.
    ranked = np.sort(values, axis=1)
    counts = np.isfinite(values).sum(axis=1, keepdims=True)
    low = np.take_along_axis(ranked, np.maximum(counts - 1, 0) // 2, axis=1)
    high = np.take_along_axis(ranked, np.minimum(counts // 2, values.shape[1] - 1), axis=1)
    return 0.5 * (low + high)[:, 0]


def _blocks(n: int, rate: float) -> list[slice]:
    """Return parts of whole ticks, small enough for the memory."""
    length = max(round(_TICK * rate), 1)
    step = length * max(_ROWS // length, 1)
    return [slice(first, min(first + step, n)) for first in range(0, n, step)]


class _Vote(NamedTuple):
    """Samples that are far (n, N); of each tick who is, how far, and how far nobody wonders."""

    far: Booleans
    out: Booleans
    sizes: Floats
    bounds: Floats


def _voted(
    force: Floats,
    motion: _Motion | None,
    doubt: Floats | None,
    here: slice,
    noise: Floats,
    rate: float,
) -> _Vote:
    """Return the vote on some samples; `doubt` is that without lever arms."""
    if motion is None:
        assert doubt is not None
        return _vote(force, np.broadcast_to(doubt[here], force.shape[:2]), noise, rate)
    part = motion.part(here)
    return _vote(force - part.felt, part.doubt, noise, rate)


def _vote(alike: Floats, doubt: Floats, noise: Floats, rate: float) -> _Vote:
    """Return which sensors (n, N) are far from the middle of all.

    They should be `alike` but for `doubt` (n, N), which is infinite where nothing can be said.
    """
    middle = _median(alike)
    apart = alike - middle[:, np.newaxis]
    size = np.maximum(np.linalg.norm(middle, axis=1), _G)[:, np.newaxis]
    sizes, bounds = _compared(apart, noise, _SAMPLE_SHARE * size + doubt)
    far: Booleans = sizes > bounds
    starts = _starts(len(alike), rate)
    judged = np.isfinite(doubt + size)
    means, counts = _tick_means(np.where(judged[:, :, np.newaxis], apart, np.nan), starts)
    tolerated, _ = _tick_means(
        np.where(judged, _TICK_SHARE * size + doubt, np.nan)[:, :, np.newaxis], starts
    )
    sizes, bounds = _compared(means, noise / np.sqrt(np.maximum(counts, 1)), tolerated[:, :, 0])
    spikes = np.add.reduceat(far, starts, axis=0, dtype=np.int64)
    out = (sizes > bounds) | ((2 * spikes > counts) & (counts > 0))
    return _Vote(far, out, sizes, bounds)


def _excluded(votes: list[_Vote], rate: float) -> Booleans:
    """Return which sensors (n, N) are left out."""
    far, out, sizes, bounds = (np.concatenate(parts) for parts in zip(*votes, strict=True))
    starts = _starts(len(far), rate)
    lengths = np.diff(np.append(starts, len(far)))
    held = _held(out, sizes, bounds, math.ceil(_BACK * rate / lengths[0]))
    excluded: Booleans = far | np.repeat(held, lengths, axis=0)
    return excluded


def _compared(apart: Floats, noise: Floats, tolerated: Floats) -> tuple[Floats, Floats]:
    """Return how far sensors are from the middle (m, N), and what the others explain of it.

    Both are NaN where a sensor is missing, and the bound is infinite where too few are there.
    """
    sizes = np.linalg.norm(apart, axis=2)
    typical = _median(sizes[:, :, np.newaxis])
    several = np.isfinite(sizes).sum(axis=1, keepdims=True) >= _VOTERS
    bounds: Floats = _TYPICAL * typical + _SIGMAS * noise + tolerated
    return sizes, np.where(several, bounds, np.inf)


def _held(out: Booleans, sizes: Floats, bounds: Floats, back: int) -> Booleans:
    """Return in which ticks (m, N) a sensor is out.

    It is back after so many ticks in which it was not, and would have been by what it was last.
    """
    held = np.empty_like(out)
    seen, agreed = np.zeros(out.shape[1]), np.full(out.shape[1], back)
    for t, now in enumerate(out):
        seen = np.where(now, np.fmax(sizes[t], bounds[t]), seen)
        agreed = np.where(now, 0, agreed + (np.isfinite(sizes[t]) & (bounds[t] < seen)))
        held[t] = agreed < back
    return held


def _variances(given: Floats | str, noise: Floats, scale: Floats) -> Floats:
    """Return the variances (n, N) by which sensors weigh; `scale` (n,) is that of scale errors."""
    each = noise**2 + _FLOOR**2
    alike = np.square(scale)[:, np.newaxis]
    if isinstance(given, str):
        if given == "white":
            return np.broadcast_to(each, (len(scale), len(each)))
        total: Floats = (each if given == "auto" else each.mean()) + alike
        return np.broadcast_to(total, (len(scale), len(each)))
    with np.errstate(divide="ignore"):
        divided: Floats = (each.mean() + alike) / given
    return divided


class _Found:
    """What is found, part by part: force and turns (n, 3), weights (n, N), residual (N,)."""

    def __init__(self, n: int, sensors: int) -> None:
        self.force, self.turns = np.empty((n, 3)), np.empty((n, 3))
        self.weights = np.empty((n, sensors))
        self._squares, self._counts = np.zeros(sensors), np.zeros(sensors)

    def take(self, here: slice, force: Floats, information: Floats, motion: _Motion | None) -> None:
        """Solve for some samples."""
        solved = _solved(force, information, None if motion is None else motion.part(here))
        self.force[here], self.turns[here] = solved.force, solved.turns
        self.weights[here] = solved.weights
        used = solved.weights > 0.0
        self._squares += np.sum(
            np.where(used[:, :, np.newaxis], solved.left, 0.0) ** 2, axis=(0, 2)
        )
        self._counts += 3 * used.sum(axis=0)

    @property
    def residual(self) -> Floats:
        """The RMS of what is left over the used samples and the axes, of each sensor."""
        unknown = np.full(self._counts.shape, np.nan)
        means: Floats = np.divide(self._squares, self._counts, out=unknown, where=self._counts > 0)
        return np.sqrt(means)


class _Solved(NamedTuple):
    """Force (n, 3), weights (n, N), angular acceleration (n, 3), differences left (n, N, 3)."""

    force: Floats
    weights: Floats
    turns: Floats
    left: Floats


def _solved(force: Floats, information: Floats, motion: _Motion | None) -> _Solved:
    """Return the force at the origin, by least squares.

    About their weighted mean place the sensors tell the angular acceleration alone, as a rigid body
    with their information for masses would: of inertia J, J alpha = sum of r x force.
    """
    if motion is not None:
        force = force - motion.turning
    held = np.where(information[:, :, np.newaxis] > 0.0, force, 0.0)
    total = information.sum(axis=1)
    nobody = total == 0.0
    weights = information / np.where(nobody, 1.0, total)[:, np.newaxis]
    mean = np.einsum("nk,nki->ni", weights, held)
    left = np.where(information[:, :, np.newaxis] > 0.0, held - mean[:, np.newaxis], 0.0)
    turns = np.full(mean.shape, np.nan)
    if motion is not None:
        place = weights @ motion.levers
        arms = motion.levers - place[:, np.newaxis]
        change = _changes(arms, left, information, motion)
        mean = mean - np.einsum("nij,nj->ni", change, place)
        left = left - np.einsum("nij,nkj->nki", change, arms)
        turns = np.stack([change[:, 2, 1], change[:, 0, 2], change[:, 1, 0]], axis=1)
        turns[nobody | ~motion.known] = np.nan
    mean[nobody] = np.nan
    return _Solved(mean, weights, turns, left)


def _changes(arms: Floats, left: Floats, u: Floats, motion: _Motion) -> Floats:
    """Return by how much the force changes with the place, (n, 3, 3): times an arm it is a force.

    Differences from the mean at arms (n, N, 3) tell it. Where the rate is known it is a cross
    product with the angular acceleration, which the rate tells as well; else it is anything, of a
    size as in turning as fast as a rate is at the end of its range.
    """
    squares = np.einsum("nk,nki,nkj->nij", u, arms, arms)
    spread = np.trace(squares, axis1=1, axis2=2)
    ridge = np.maximum(_RIDGE * spread, np.finfo(float).tiny) + motion.certainty
    inertia = (spread + ridge)[:, np.newaxis, np.newaxis] * np.eye(3) - squares
    moment = np.einsum("nk,nki->ni", u, np.cross(arms, left))
    moment += motion.certainty[:, np.newaxis] * motion.change
    x, y, z = np.linalg.solve(inertia, moment[:, :, np.newaxis])[:, :, 0].T
    zero = np.zeros_like(x)
    changes: Floats = np.stack([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    lost = np.flatnonzero(~motion.known)
    across = np.einsum("nk,nki,nkj->nij", u[lost], arms[lost], left[lost])
    free = np.linalg.solve(squares[lost] + np.eye(3) / _FAST**4, across)
    changes[lost] = free.transpose(0, 2, 1)
    return changes
