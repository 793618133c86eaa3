"""Rests of an IMU: when, the gyro's bias and how it moves, gravity, and noise."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from zerorate.findings.finding import Finding, Spans, counted
from zerorate.findings.imus import BLOCK, GRAVITY, Imu, Rest, Sensor
from zerorate.findings.limits import LIMITS
from zerorate.numerals import with_error
from zerorate.types import Floats

SECTION: Final = "Rest and bias"
NOISE: Final = "Noise at rest"
OF_BIAS, OF_NOISE = 4.0, 12.0
"""Seconds of a rest that tells of the bias, and of the noise."""
_HALVES: Final = math.radians(0.3)
_FASTEST: Final = 10.0
"""Largest bias, deg/s, that a gyro is believed to have, as of `zerorate.Attitude`."""
_AGAIN: Final = 0.5
"""Difference, deg/s, of one bias in two rests."""
_SLOW: Final = 50.0
_WINDOW: Final = 4.0
_MEDIAN: Final = 0.97
"""Median of a periodogram of eight windows over its mean, about."""
_MICRO_G: Final = 1e6 / GRAVITY
_SIDES: Final = math.sqrt(2.0)
"""A density of one side over that of two, which is the N of an Allan deviation."""


def rests(found: Sequence[Imu]) -> Iterator[Finding]:
    """Yield when each IMU rests, its bias, and its gravity."""
    for imu in found:
        if not imu.rests:
            continue
        seconds = sum(rest.seconds for rest in imu.rests)
        text = f"{imu.name} rests for {seconds:.4g} s in all, in {counted(len(imu.rests), 'rest')}."
        yield Finding(
            SECTION, "rests", "good", text, seconds, "s", None, spans(imu.rests), _figure(imu)
        )
        yield from _bias(imu)
        yield from _gravity(imu)


def spans(found: Sequence[Rest]) -> Spans:
    """Return the seconds of rests."""
    return tuple((BLOCK * rest.first, BLOCK * rest.last) for rest in found)


def _figure(imu: Imu) -> str:
    return imu.sensors[0].figure


def means(one: Sensor, rest: Rest) -> tuple[Floats, Floats]:
    """Return the mean of a rest and its standard error, by its seconds, shape (3,)."""
    seconds = _seconds(one, rest)
    return seconds.mean(axis=0), seconds.std(axis=0, ddof=1) / math.sqrt(len(seconds))


def _seconds(one: Sensor, rest: Rest) -> Floats:
    blocks = one.blocks.mean[rest.first : rest.last]
    return np.asarray(blocks[: len(blocks) // 2 * 2].reshape(-1, 2, 3).mean(axis=1))


def _steady(one: Sensor, rest: Rest) -> bool:
    seconds = _seconds(one, rest)
    half = len(seconds) // 2
    moved = np.abs(seconds[:half].mean(axis=0) - seconds[half:].mean(axis=0))
    return bool((moved < _HALVES).all())


def _bias(imu: Imu) -> Iterator[Finding]:
    gyro = imu.gyro
    if gyro is None:
        return
    usable = [r for r in imu.rests if r.seconds >= OF_BIAS and _steady(gyro, r)]
    if not usable:
        return
    known = [means(gyro, rest) for rest in usable]
    values = np.degrees([mean for mean, _ in known])
    sigmas = np.degrees([sigma for _, sigma in known])
    at, axis = np.unravel_index(np.argmax(np.abs(values)), values.shape)
    worst, sigma = float(abs(values[at, axis])), float(sigmas[at, axis])
    how = LIMITS["gyro bias"].severity(worst, sigma)
    told = f"{60.0 * worst:.3g} deg in a minute if it stays"
    if how != "good" and _may_turn(imu, usable[at], values, int(at)):
        how, told = "look", "a bias, or an even turn about the vertical"
    yield Finding(
        SECTION, "gyro bias", how,
        f"{gyro.name} shows {with_error(worst, sigma)} deg/s about {'xyz'[axis]} at rest: {told}.",
        worst, "deg/s", sigma, spans([usable[at]]), gyro.figure,
        "Start with some seconds at rest, so that a filter takes it off.",
    )  # fmt: skip
    yield from _moves(gyro, usable, values, sigmas)


def _may_turn(imu: Imu, rest: Rest, values: Floats, at: int) -> bool:
    """Return whether a rate at rest may be an even turn: no accelerometer feels that.

    It is larger than any bias, or it is about the vertical, and no other rest shows it again.
    """
    rate = values[at]
    if np.linalg.norm(rate) > _FASTEST:
        return True
    if imu.accel is None:
        return False
    force = means(imu.accel, rest)[0]
    up = force / np.linalg.norm(force)
    across = np.linalg.norm(rate - (rate @ up) * up)
    if LIMITS["gyro bias"].severity(float(across)) != "good":
        return False
    others = np.delete(values, at, axis=0)
    return not (np.linalg.norm(others - rate, axis=1) < _AGAIN).any()


def _moves(
    gyro: Sensor, usable: Sequence[Rest], values: Floats, sigmas: Floats
) -> Iterator[Finding]:
    if len(usable) < 2:
        return
    low, high = values.argmin(axis=0), values.argmax(axis=0)
    axes = np.arange(3)
    moved = values[high, axes] - values[low, axes]
    axis = int(np.argmax(moved))
    sigma = float(np.hypot(sigmas[high[axis], axis], sigmas[low[axis], axis]))
    most = float(moved[axis])
    where = spans(sorted({usable[low[axis]], usable[high[axis]]}, key=lambda one: one.first))
    how = LIMITS["bias moves"].severity(most) if most > 4.0 * sigma else "good"
    yield Finding(
        SECTION, "bias moves", how,
        f"{gyro.name}: the bias about {'xyz'[axis]} differs by {with_error(most, sigma)} deg/s "
        "between two rests.",
        most, "deg/s", sigma, where, gyro.figure,
        "Record temperature too, and rest before and after each run.",
    )  # fmt: skip


def _gravity(imu: Imu) -> Iterator[Finding]:
    accel = imu.accel
    if accel is None:
        return
    known = [means(accel, rest) for rest in imu.rests]
    norms = np.array([np.linalg.norm(mean) for mean, _ in known])
    at = int(np.argmax(np.abs(norms - GRAVITY)))
    mean, sigmas = known[at]
    sigma = float(np.linalg.norm(sigmas * mean) / norms[at])
    off = float(abs(norms[at] - GRAVITY))
    seen = f"{norms.min():.4g} to {norms.max():.4g} m/s² over {counted(len(norms), 'rest')}"
    yield Finding(
        SECTION, "gravity", LIMITS["gravity"].severity(off, sigma),
        f"{accel.name} shows {seen}, {with_error(off, sigma)} from 9.807 at most.",
        off, "m/s²", sigma, spans([imu.rests[at]]), accel.figure,
        "Record it still on six sides or more, and calibrate: `zerorate calibrate`.",
    )  # fmt: skip


def noise(found: Sequence[Imu]) -> Iterator[Finding]:
    """Yield the white noise of each sensor in its longest rest."""
    for imu in found:
        longest = max(imu.rests, key=lambda rest: rest.seconds, default=None)
        if longest is None or longest.seconds < OF_NOISE:
            continue
        for one in imu.sensors:
            if one.factor is not None and one.log.rate >= _SLOW:
                yield from _density(one, longest)


def _density(one: Sensor, rest: Rest) -> Iterator[Finding]:
    is_gyro = one.name.startswith("gyro")
    factor = math.degrees(one.factor or 0.0) if is_gyro else _MICRO_G * (one.factor or 0.0)
    kind = LIMITS["gyro noise" if is_gyro else "accel noise"]
    densities = [
        density(column, one.log.rate) for column in one.log.data[one.rows(*spans([rest])[0])].T
    ]
    if any(not math.isfinite(value) for value, _ in densities):
        return
    axis = int(np.argmax([value for value, _ in densities]))
    value, sigma = (factor * number for number in densities[axis])
    yield Finding(
        NOISE, "gyro noise" if is_gyro else "accel noise", kind.severity(value),
        f"{one.name}: {with_error(value, sigma)} {kind.unit} about {'xyz'[axis]}, the noisiest "
        f"axis, one-sided as in data sheets. As N of an Allan deviation: {value / _SIDES:.2g}.",
        value, kind.unit, sigma, spans([rest]), one.figure,
        "For bias instability and random walk record an hour at rest: `zerorate allan`.",
    )  # fmt: skip


def density(column: Floats, rate: float) -> tuple[float, float]:
    """Return the level of white noise between 1 Hz and a quarter of the rate, and its error.

    Welch's windows of four seconds, half overlapped; their median over frequencies, so that peaks
    do not count.
    """
    length = round(_WINDOW * rate)
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
    level = math.sqrt(float(np.median(band)) / _MEDIAN)
    parts = np.sqrt([np.median(part) for part in np.array_split(band, 10)])
    return level, float(parts.std(ddof=1) / math.sqrt(10.0))
