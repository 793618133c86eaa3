"""Alignment of a vehicle at rest: roll, pitch and gyro bias."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from zerorate.calibration import find_rests
from zerorate.faults import ArgumentError, keyword_argument, make_sentence
from zerorate.geometry.earth import earth_rate
from zerorate.geometry.rotations import from_euler_angles, inverse, rotate
from zerorate.geometry.scipy_rotation import Oriented
from zerorate.record import LogError, Recording
from zerorate.record.runs import runs
from zerorate.record.samples import Samples
from zerorate.types import Booleans, Floats
from zerorate.views import Result

_MIN_REST_S: Final = 10.0
"""Shortest rest for an alignment, s."""
_MIN_SPAN_S: Final = 1.0
"""Shortest span that a caller may give, s."""
_GRAVITY: Final = 9.80665
_STEADY_SIGMAS: Final = 6.0
_SIGMA_PER_MAD: Final = 1.4826
"""Standard deviation of normal values divided by their median absolute deviation."""
_MIN_SHIFT: Final = np.array([math.radians(0.05)] * 3 + [0.02] * 3)
"""Change of a one-second mean that is always accepted at rest: gyro, rad/s; force, m/s^2."""
_GRAVITY_TOLERANCE: Final = 0.1
"""Largest relative difference between the mean force at rest and gravity."""


@dataclass(frozen=True, eq=False)
class Alignment(Oriented, Result):
    """Alignment of a vehicle at rest, as `align` returns it.

    Parameters
    ----------
    time : float
        End of the rest, s. The filter starts at this time.
    quaternion : ndarray, shape (4,)
        Quaternion w, x, y, z from the body's axes to north, east, down.
    latitude : float
        Latitude, deg.
    heading_known : bool
        True if the heading was given. Otherwise the quaternion has heading zero.
    course : bool
        True if the filter may use the course as the heading.
    gyro_bias, accel_bias : ndarray, shape (3,)
        Biases of the gyro (rad/s) and the accelerometer (m/s^2).
    level_sigma, heading_sigma : float
        Standard deviation of roll and pitch, and of the heading (rad).
    gyro_bias_sigma, accel_bias_sigma : float
        Standard deviations of the biases on each axis: gyro (rad/s) and accelerometer (m/s^2).
    notes : tuple of str
        Sentences that say where the alignment comes from.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> drive = zr.simulate_drive(duration=60.0, seed=1)
    >>> start = zr.align(drive.recording(), latitude=48.0, heading=0.3)
    >>> start.heading_known, start.quaternion.shape, bool(start.level_sigma < np.radians(1.0))
    (True, (4,), True)
    """

    time: float
    quaternion: Floats
    latitude: float
    heading_known: bool
    course: bool
    gyro_bias: Floats
    accel_bias: Floats
    level_sigma: float
    heading_sigma: float
    gyro_bias_sigma: float
    accel_bias_sigma: float
    notes: tuple[str, ...] = ()


def align(
    imu: Recording,
    *,
    latitude: float,
    heading: float | Literal["course"] | None = None,
    span: tuple[float, float] | None = None,
    heading_sigma: float = math.radians(3.0),
    accel_bias_sigma: float = 0.05,
) -> Alignment:
    """Find roll, pitch and gyro bias of a vehicle at rest.

    Parameters
    ----------
    imu : Recording
        Recording with a gyro and an accelerometer. Its axes are forward, right, down (`body_axes`
        rotates them).
    latitude : float
        Latitude, deg, between -89.5 and 89.5.
    heading : float or "course", optional
        Heading, rad, from north over east. "course" takes the direction of the first motion, so the
        vehicle must move forward. This motion must exceed 1 m/s and ten standard deviations of the
        velocity. Default: the heading is unknown, and only a filter for a wheeled vehicle can
        start.
    span : tuple of float, optional
        Start and end of the rest, s, at least one second apart. Default: the first rest of at least
        10 s. If the recording ends during this rest, only the first half of the rest is used, but
        at least 10 s.
    heading_sigma : float
        Standard deviation of a given heading, rad.
    accel_bias_sigma : float
        Standard deviation of the accelerometer bias on each axis, m/s^2. The standard deviation of
        roll and pitch is this value divided by gravity.

    Raises
    ------
    LogError
        If a sensor is missing or no rest is found. Also if the span has too few samples, or its
        mean force is not gravity.
    ValueError
        If an argument is out of range.

    Notes
    -----
    Roll is ``atan2(-f_y, -f_z)`` and pitch is ``atan2(f_x, sqrt(f_y^2 + f_z^2))`` of the mean force
    f. The gyro bias is the mean rate minus the earth's rate. Without a heading only the vertical
    part of the earth's rate is known. The horizontal part is then added to the standard deviation.
    Rests are found by the variance, which misses a gentle start of motion with a noisy sensor. A
    rest therefore ends where the mean over one second differs clearly from the median of these
    means. No motion is searched in a given `span`; only the number of samples and the mean force
    are checked.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=60.0, seed=1)
    >>> start = zr.align(drive.recording(), latitude=48.0, heading=0.3)
    >>> bool(abs(start.gyro_bias - drive.gyro_bias[0]).max() < 5 * start.gyro_bias_sigma)
    True
    """
    _check_bound("latitude", latitude, 89.5, "deg")
    for name, sigma in (("heading_sigma", heading_sigma), ("accel_bias_sigma", accel_bias_sigma)):
        if not 0.0 < sigma <= 10.0:
            raise ArgumentError(name, f"must be above 0 and at most 10, got {sigma}")
    known = heading is not None and heading != "course"
    if isinstance(heading, str) and heading != "course":
        raise ArgumentError(
            "heading", f"must be an angle in rad, 'course' or None, got {heading!r}"
        )
    yaw = float(heading) if known else 0.0  # type: ignore[arg-type]
    _check_bound("heading", yaw, 4.0 * math.pi, "rad")
    samples = Samples.of(imu, mag=False, what="an alignment")
    first, last = _find_rest(imu, samples) if span is None else _check_span(span)
    gyro, accel = _select_samples(samples, first, last)
    force, rate = accel.mean(axis=0), gyro.mean(axis=0)
    _check_force(force, first, last)
    attitude = level_attitude(force, yaw)
    earth = earth_rate(math.radians(latitude))
    unknown = 0.0
    if not known:
        unknown, earth = float(earth[0]), np.array([0.0, 0.0, earth[2]])
    return Alignment(
        time=last,
        quaternion=attitude,
        latitude=float(latitude),
        heading_known=known,
        course=heading == "course",
        gyro_bias=rate - rotate(inverse(attitude), earth),
        accel_bias=np.zeros(3),
        level_sigma=math.hypot(
            accel_bias_sigma / _GRAVITY, _sigma_of_mean(accel, samples) / _GRAVITY
        ),
        heading_sigma=heading_sigma if known else math.pi / 2.0,
        gyro_bias_sigma=math.hypot(_sigma_of_mean(gyro, samples), unknown),
        accel_bias_sigma=accel_bias_sigma,
    )


def _check_bound(name: str, value: float, bound: float, unit: str) -> None:
    if not abs(value) <= bound:
        raise ArgumentError(name, f"must be within {bound:.4g} {unit}, got {value}")


def _find_rest(imu: Recording, samples: Samples) -> tuple[float, float]:
    for rest in find_rests(imu):
        first, last = _find_steady_span(samples, rest.start, rest.stop)
        if last - first < _MIN_REST_S:
            continue
        # If the recording ends with the rest, part of the rest is left for the navigation.
        ends = float(samples.time[-1]) - last < 1.0
        return first, first + max(_MIN_REST_S, 0.5 * (last - first)) if ends else last
    raise LogError(
        make_sentence(
            f"{imu.source}: the vehicle does not rest for {_MIN_REST_S:g} s, which an alignment "
            f"needs: state a rest with ",
            keyword_argument("span"),
            " when it rests",
        )
    )


def _find_steady_span(samples: Samples, first: float, last: float) -> tuple[float, float]:
    """Return the first long part of a rest in which the means over one second are constant.

    The variance finds the rests, but it misses a gentle start if the sensor is noisy.
    """
    time, width = samples.time, max(1, round(samples.log.rate))
    begin, end = np.searchsorted(time, [first, last])
    seconds = (end - begin) // width
    if seconds < _MIN_REST_S - 1.0:
        return first, last
    values = np.concatenate((samples.gyro, samples.accel), axis=1)[begin : begin + seconds * width]
    blocks = values.reshape(seconds, width, 6)
    present: Booleans = np.isfinite(blocks.sum(axis=2))
    counts = present.sum(axis=1)[:, np.newaxis]
    means = np.where(present[:, :, np.newaxis], blocks, 0.0).sum(axis=1) / np.maximum(counts, 1)
    has_samples = counts[:, 0] > 0
    if not has_samples.any():
        return first, last
    distance = np.abs(means - np.median(means[has_samples], axis=0))
    distance[~has_samples] = 0.0
    limit = np.maximum(
        _STEADY_SIGMAS * _SIGMA_PER_MAD * np.median(distance[has_samples], axis=0), _MIN_SHIFT
    )
    steady = runs((distance <= limit).all(axis=1))
    # A cruise with a slow turn is steady, too, and may be longer: the first long part is the rest.
    long = steady[steady[:, 1] - steady[:, 0] >= _MIN_REST_S]
    a, b = long[0] if len(long) else (0, 0)
    if (a, b) == (0, seconds):
        return first, last
    if b < seconds:
        b = max(a, b - 1)  # the vehicle may have started during the last second
    start = first if a == 0 else float(time[begin + a * width])
    return start, float(time[min(begin + b * width, len(time) - 1)])


def _check_span(span: tuple[float, float]) -> tuple[float, float]:
    first, last = (float(x) for x in span)
    if not last - first >= _MIN_SPAN_S:
        raise ArgumentError(
            "span", f"must be at least {_MIN_SPAN_S:g} s long, got {first:g} to {last:g} s"
        )
    return first, last


def _select_samples(samples: Samples, first: float, last: float) -> tuple[Floats, Floats]:
    mask = (samples.time >= first) & (samples.time <= last)
    mask &= np.isfinite(samples.gyro).all(axis=1) & np.isfinite(samples.accel).all(axis=1)
    if mask.sum() < max(10.0, 0.5 * samples.log.rate * (last - first)):
        raise LogError(
            f"there are {int(mask.sum())} samples from {first:g} to {last:g} s, too few for an "
            "alignment"
        )
    return samples.gyro[mask], samples.accel[mask]


def _check_force(force: Floats, first: float, last: float) -> None:
    size = float(np.linalg.norm(force))
    if abs(size / _GRAVITY - 1.0) > _GRAVITY_TOLERANCE:
        raise LogError(
            f"the force from {first:g} to {last:g} s is {size:.2f} m/s^2, expected that of "
            "gravity: the accelerometer has another unit, or the vehicle moves"
        )


def level_attitude(force: Floats, yaw: float) -> Floats:
    """Return the orientation w, x, y, z of a body at rest from its mean specific force."""
    fx, fy, fz = (float(x) for x in force)
    roll, pitch = math.atan2(-fy, -fz), math.atan2(fx, math.hypot(fy, fz))
    return from_euler_angles(roll, pitch, yaw)


def _sigma_of_mean(values: Floats, samples: Samples) -> float:
    """Return the standard deviation of a mean of coloured noise, from means over one second."""
    width = max(1, round(samples.log.rate))
    count = len(values) // width
    if count < 3:
        return float(values.std(axis=0).max() / math.sqrt(len(values)))
    means = values[: count * width].reshape(count, width, 3).mean(axis=1)
    return float(means.std(axis=0, ddof=1).max() / math.sqrt(count)) + 1e-9
