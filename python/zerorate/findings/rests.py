"""Findings on rests: their times, the gyro's bias and its change, gravity and noise."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from zerorate.findings.finding import Finding, Spans, count_noun
from zerorate.findings.imus import BLOCK_S, GRAVITY_M_S2, Imu, Sensor, StaticInterval
from zerorate.findings.limits import LIMITS
from zerorate.numerals import format_with_error, shorten
from zerorate.types import Floats

SECTION: Final = "Rest and bias"
NOISE_SECTION: Final = "Noise at rest"
MIN_BIAS_REST_S, MIN_NOISE_REST_S = 4.0, 12.0
"""Shortest rest for the bias, and for the noise, s."""
_MAX_HALF_DIFFERENCE_RAD_S: Final = math.radians(0.3)
_MAX_BIAS_DEG_S: Final = 10.0
"""Largest rate that counts as a gyro's bias, deg/s, as in `zerorate.Attitude`."""
_SAME_BIAS_DEG_S: Final = 0.5
"""Largest difference of an unchanged bias between two rests, deg/s."""
_MIN_RATE_HZ: Final = 50.0
_WINDOW_S: Final = 4.0
_MEDIAN_OVER_MEAN: Final = 0.97
"""Approximate ratio of median to mean of a periodogram of eight windows."""
_UG_PER_M_S2: Final = 1e6 / GRAVITY_M_S2
_ONE_SIDED_FACTOR: Final = math.sqrt(2.0)
"""Ratio of a one-sided density to the two-sided density N^2 of an Allan deviation."""


def rest_findings(imus: Sequence[Imu]) -> Iterator[Finding]:
    """Yield findings on the rests of each IMU, its bias, and its gravity."""
    for imu in imus:
        if not imu.rests:
            continue
        seconds = sum(rest.seconds for rest in imu.rests)
        text = (
            f"{imu.name} rests for {shorten(seconds, 4)} s in all, "
            f"in {count_noun(len(imu.rests), 'rest')}."
        )
        yield Finding(
            SECTION,
            "rests",
            "good",
            text,
            seconds,
            "s",
            None,
            rest_spans(imu.rests),
            _figure_anchor(imu),
        )
        yield from _check_bias(imu)
        yield from _check_gravity(imu)


def rest_spans(rests_given: Sequence[StaticInterval]) -> Spans:
    """Return the time spans of rests, s."""
    return tuple((BLOCK_S * rest.first, BLOCK_S * rest.last) for rest in rests_given)


def _figure_anchor(imu: Imu) -> str:
    return imu.sensors[0].figure


def rest_mean(sensor: Sensor, rest: StaticInterval) -> tuple[Floats, Floats]:
    """Return the mean of a rest and its standard error, from its second means, shape (3,)."""
    seconds = _second_means(sensor, rest)
    return seconds.mean(axis=0), seconds.std(axis=0, ddof=1) / math.sqrt(len(seconds))


def _second_means(sensor: Sensor, rest: StaticInterval) -> Floats:
    blocks = sensor.blocks.mean[rest.first : rest.last]
    return np.asarray(blocks[: len(blocks) // 2 * 2].reshape(-1, 2, 3).mean(axis=1))


def _is_steady(sensor: Sensor, rest: StaticInterval) -> bool:
    seconds = _second_means(sensor, rest)
    half = len(seconds) // 2
    change = np.abs(seconds[:half].mean(axis=0) - seconds[half:].mean(axis=0))
    return bool((change < _MAX_HALF_DIFFERENCE_RAD_S).all())


def _check_bias(imu: Imu) -> Iterator[Finding]:
    gyro = imu.gyro
    if gyro is None:
        return
    usable = [r for r in imu.rests if r.seconds >= MIN_BIAS_REST_S and _is_steady(gyro, r)]
    if not usable:
        return
    rest_means = [rest_mean(gyro, rest) for rest in usable]
    values = np.degrees([mean for mean, _ in rest_means])
    sigmas = np.degrees([sigma for _, sigma in rest_means])
    at, axis = np.unravel_index(np.argmax(np.abs(values)), values.shape)
    worst, sigma = float(abs(values[at, axis])), float(sigmas[at, axis])
    severity = LIMITS["gyro bias"].severity(worst, sigma)
    consequence = f"{shorten(60.0 * worst, 3)} deg in a minute if it is constant"
    if severity != "good" and _may_turn(imu, usable[at], values, int(at)):
        severity, consequence = "look", "a bias, or a steady rotation about the vertical"
    yield Finding(
        SECTION, "gyro bias", severity,
        f"{gyro.label} shows {format_with_error(worst, sigma)} deg/s about {'xyz'[axis]} at "
        f"rest: {consequence}.",
        worst, "deg/s", sigma, rest_spans([usable[at]]), gyro.figure,
        "Begin logs with some seconds at rest, in which a filter estimates the bias.",
    )  # fmt: skip
    yield from _check_bias_change(gyro, usable, values, sigmas)


def _may_turn(imu: Imu, rest: StaticInterval, values: Floats, at: int) -> bool:
    """Return True if a rate at rest may be a steady rotation, which no accelerometer shows.

    It is True for a rate above the largest bias, and for a vertical rate that is absent from all
    other rests.
    """
    rate = values[at]
    if np.linalg.norm(rate) > _MAX_BIAS_DEG_S:
        return True
    if imu.accel is None:
        return False
    force = rest_mean(imu.accel, rest)[0]
    up = force / np.linalg.norm(force)
    across = np.linalg.norm(rate - (rate @ up) * up)
    if LIMITS["gyro bias"].severity(float(across)) != "good":
        return False
    other_rests = np.delete(values, at, axis=0)
    return not (np.linalg.norm(other_rests - rate, axis=1) < _SAME_BIAS_DEG_S).any()


def _check_bias_change(
    gyro: Sensor, usable: Sequence[StaticInterval], values: Floats, sigmas: Floats
) -> Iterator[Finding]:
    if len(usable) < 2:
        return
    low, high = values.argmin(axis=0), values.argmax(axis=0)
    axes = np.arange(3)
    change = values[high, axes] - values[low, axes]
    axis = int(np.argmax(change))
    sigma = float(np.hypot(sigmas[high[axis], axis], sigmas[low[axis], axis]))
    largest = float(change[axis])
    where = rest_spans(sorted({usable[low[axis]], usable[high[axis]]}, key=lambda one: one.first))
    severity = LIMITS["bias moves"].severity(largest) if largest > 4.0 * sigma else "good"
    yield Finding(
        SECTION, "bias moves", severity,
        f"{gyro.label}: the bias about {'xyz'[axis]} differs by "
        f"{format_with_error(largest, sigma)} deg/s "
        "between two rests.",
        largest, "deg/s", sigma, where, gyro.figure,
        "Record temperature too, and rest before and after each run.",
    )  # fmt: skip


def _check_gravity(imu: Imu) -> Iterator[Finding]:
    accel = imu.accel
    if accel is None:
        return
    rest_means = [rest_mean(accel, rest) for rest in imu.rests]
    norms = np.array([np.linalg.norm(mean) for mean, _ in rest_means])
    at = int(np.argmax(np.abs(norms - GRAVITY_M_S2)))
    mean, sigmas = rest_means[at]
    sigma = float(np.linalg.norm(sigmas * mean) / norms[at])
    error = float(abs(norms[at] - GRAVITY_M_S2))
    norm_range = (
        f"{shorten(norms.min(), 4)} to {shorten(norms.max(), 4)} m/s² "
        f"over {count_noun(len(norms), 'rest')}"
    )
    yield Finding(
        SECTION, "gravity", LIMITS["gravity"].severity(error, sigma),
        f"{accel.label} shows {norm_range}, {format_with_error(error, sigma)} from 9.807 at most.",
        error, "m/s²", sigma, rest_spans([imu.rests[at]]), accel.figure,
        "Record the sensor at rest on six or more sides, and calibrate: `zerorate calibrate`.",
    )  # fmt: skip


def noise_findings(imus: Sequence[Imu]) -> Iterator[Finding]:
    """Yield the white noise of each sensor in its longest rest."""
    for imu in imus:
        longest = max(imu.rests, key=lambda rest: rest.seconds, default=None)
        if longest is None or longest.seconds < MIN_NOISE_REST_S:
            continue
        for sensor in imu.sensors:
            if sensor.factor is not None and sensor.log.rate >= _MIN_RATE_HZ:
                yield from _check_noise(sensor, longest)


def _check_noise(sensor: Sensor, rest: StaticInterval) -> Iterator[Finding]:
    is_gyro = sensor.name.startswith("gyro")
    factor = (
        math.degrees(sensor.factor or 0.0) if is_gyro else _UG_PER_M_S2 * (sensor.factor or 0.0)
    )
    kind = LIMITS["gyro noise" if is_gyro else "accel noise"]
    densities = [
        white_noise_density(column, sensor.log.rate)
        for column in sensor.log.data[sensor.rows(*rest_spans([rest])[0])].T
    ]
    if any(not math.isfinite(value) for value, _ in densities):
        return
    axis = int(np.argmax([value for value, _ in densities]))
    value, sigma = (factor * number for number in densities[axis])
    yield Finding(
        NOISE_SECTION, "gyro noise" if is_gyro else "accel noise", kind.severity(value),
        f"{sensor.label}: {format_with_error(value, sigma)} {kind.unit} about "
        f"{'xyz'[axis]}, the noisiest "
        "axis, one-sided as in data sheets. As N of an Allan deviation: "
        f"{shorten(value / _ONE_SIDED_FACTOR)}.",
        value, kind.unit, sigma, rest_spans([rest]), sensor.figure,
        "For bias instability and random walk record an hour at rest: `zerorate allan`.",
    )  # fmt: skip


def white_noise_density(column: Floats, rate: float) -> tuple[float, float]:
    """Return the level of white noise between 1 Hz and a quarter of the rate, and its error.

    Welch's method with windows of 4 s, half overlapping; the median over frequencies ignores peaks.
    """
    length = round(_WINDOW_S * rate)
    values = np.where(np.isfinite(column), column, np.nanmedian(column))
    starts = np.arange(0, len(values) - length + 1, length // 2)
    if len(starts) < 3:
        return math.nan, math.nan
    taper = np.hanning(length)
    power = np.zeros(length // 2 + 1)
    for start in starts:
        part = values[start : start + length]
        power += np.abs(np.fft.rfft(taper * (part - part.mean()))) ** 2
    power *= 2.0 / (rate * (taper**2).sum() * len(starts))
    hertz = np.fft.rfftfreq(length, 1.0 / rate)
    band = power[(hertz >= max(1.0, rate / 20.0 if rate < 20.0 else 1.0)) & (hertz <= rate / 4.0)]
    level = math.sqrt(float(np.median(band)) / _MEDIAN_OVER_MEAN)
    parts = np.sqrt([np.median(part) for part in np.array_split(band, 10)])
    return level, float(parts.std(ddof=1) / math.sqrt(10.0))
