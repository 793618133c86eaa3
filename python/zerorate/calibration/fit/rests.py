"""Static intervals, found by the variance of both sensors in short windows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from zerorate import units
from zerorate.calibration.fit.sensors import STANDARD_GRAVITY, Sensor, prepare_sensor, resolution
from zerorate.calibration.record import Rest
from zerorate.faults import ArgumentError
from zerorate.record.log import Log, LogError
from zerorate.record.recording import Recording
from zerorate.record.runs import runs_of_rows
from zerorate.types import Booleans, Floats, Integers

MAX_VARIANCE_RATIO: Final = 5.0
"""Largest variance of a still window over the variance of the quietest windows, for each axis."""

_BLOCK_S: Final = 0.1
_WINDOW_S: Final = 0.5
_TRIM_S: Final = 0.1
_MAX_BREAK_S: Final = 0.4
_MIN_REST_S: Final = 1.0

_POSE_SIGMA: Final = 0.3e-3
"""Standard deviation between two rests in one pose, in units of gravity: sensors are less stable
than the averaged white noise.
"""

_HARMONICS: Final = np.arange(1, 33)
"""Harmonics of the sawtooth error of rounding; higher ones have 2 % of its variance."""

_MIN_CLIPPED_SHARE: Final = 0.25
"""Smallest share of a rest's samples at one value that counts as saturation: noise of two steps
gives at most a fifth.
"""

_MIN_MOTION_RATIO: Final = 5.0
_MEDIAN_OF_SQUARE: Final = 0.4549364
"""Median of the square of a standard normal variable."""


@dataclass(frozen=True, eq=False)
class _Windows:
    """Variances in windows shifted by one block, and the floor of each axis.

    Parameters
    ----------
    ratio
        Largest ratio of variance to floor over the axes, shape (m,); infinite if most samples are
        missing.
    floor
        Variance of each axis at its quietest, shape (3,), unit of the samples squared.
    step
        Step between neighbouring values of each axis, shape (3,).
    block
        Samples from one window to the next.
    blocks
        Blocks in a window.
    """

    ratio: Floats
    floor: Floats
    step: Floats
    block: int
    blocks: int

    def at_blocks(self, count: int) -> Floats:
        """Return the ratio of the window around each block; at the ends, of the nearest window."""
        indices = np.arange(count) - self.blocks // 2
        return np.asarray(self.ratio[indices.clip(0, len(self.ratio) - 1)])


@dataclass(frozen=True, eq=False)
class Stillness:
    """Thresholds between rest and motion: the variance of each sensor at its quietest.

    Parameters
    ----------
    floor
        By kind of sensor: variance of each axis, shape (3,), in the unit of the fit squared.
    step
        By kind of sensor: step between neighbouring values of each axis, shape (3,).
    longest
        Longest still interval, s, even if it is too short for a rest.
    """

    floor: dict[str, Floats]
    step: dict[str, Floats]
    longest: float

    def rounding(self, kind: str) -> Floats:
        """Return the variance that rounding leaves in a long mean, shape (3,).

        It is the variance of the harmonics of rounding's sawtooth, each damped by the noise (B.
        Widrow and I. Kollar, "Quantization Noise", 2008, chapter 4). With noise large compared with
        the step it is zero; without noise it is the variance of a uniform error.
        """
        square = self.step[kind] ** 2
        # With hardly any noise, toggling between two values has a variance of up to a quarter of
        # the square.
        noise = np.maximum(np.nan_to_num(self.floor[kind]) - square / 4.0, 0.0)
        ratio = noise / np.maximum(square, np.finfo(float).tiny)
        damped = np.exp(-((2.0 * np.pi * _HARMONICS[:, np.newaxis]) ** 2) * ratio)
        left = (damped / _HARMONICS[:, np.newaxis] ** 2).sum(axis=0)
        return np.asarray(square * left / (2.0 * np.pi**2))


def _measure_windows(sensor: Sensor) -> _Windows:
    block = max(1, round(_BLOCK_S * sensor.rate))
    # Fewer than four samples give no variance.
    blocks = max(round(_WINDOW_S * sensor.rate / block), -(-4 // block))
    count = sensor.n // block
    if count < blocks:
        return _Windows(np.full(1, np.inf), np.full(3, np.nan), np.zeros(3), block, blocks)
    variance, counts = _window_variances(sensor, block, blocks, count)
    step = resolution(sensor.data)
    least = np.maximum(step**2 / 12.0, np.finfo(float).tiny)
    full = counts >= 0.5 * block * blocks
    floor = (
        _estimate_floors(np.maximum(variance[full], least)) if full.any() else np.full(3, np.nan)
    )
    ratio = (np.maximum(variance, least) / floor).max(axis=1)
    return _Windows(np.where(full, ratio, np.inf), floor, step, block, blocks)


def _window_variances(sensor: Sensor, block: int, blocks: int, count: int) -> tuple[Floats, Floats]:
    """Return the variances and the numbers of present samples in windows."""
    # The median is subtracted first: the square of an offset would hide the noise.
    level = sensor.data - np.nanmedian(sensor.data[:: max(1, sensor.n // 1000)], axis=0)
    number = np.full(count, float(block))
    if sensor.missing is not None:
        level[sensor.missing] = 0.0
        number = (~sensor.missing[: count * block]).reshape(count, block).sum(axis=1).astype(float)
    cells = level[: count * block].reshape(count, block, 3)
    # Then the mean of each block is subtracted, because most poses are far from the median.
    centre = cells.sum(axis=1) / np.maximum(number, 1.0)[:, np.newaxis]
    squares = np.einsum("ijk,ijk->ik", cells, cells) - number[:, np.newaxis] * centre**2
    n = _moving_sum(number, blocks)[:, np.newaxis]
    weighted = number[:, np.newaxis] * centre
    mean = _moving_sum(weighted, blocks) / np.maximum(n, 1.0)
    between = _moving_sum(weighted * centre, blocks) - n * mean**2
    total = _moving_sum(squares, blocks) + between
    return np.maximum(total, 0.0) / np.maximum(n - 1.0, 1.0), n[:, 0]


def _moving_sum(values: Floats, width: int) -> Floats:
    length = len(values) - width + 1
    total = values[:length].copy()
    for i in range(1, width):
        total += values[i : i + length]
    return total


def _estimate_floors(variance: Floats) -> Floats:
    """Return the variance of each axis at rest: the median of the small variances."""
    floor = np.percentile(variance, 10, axis=0)
    for _ in range(3):
        low = np.where(variance < 3.0 * floor, variance, np.nan)
        floor = np.nanmedian(low, axis=0)
    return np.asarray(floor)


def _find_still_blocks(sensors: Sequence[Sensor]) -> tuple[Booleans, list[_Windows]]:
    """Return the mask of the first sensor's blocks with all sensors still, and the windows."""
    all_windows = [_measure_windows(sensor) for sensor in sensors]
    first, block = sensors[0], all_windows[0].block
    count = first.n // block
    times = first.start + (np.arange(count) + 0.5) * block / first.rate
    still = all_windows[0].at_blocks(count) < MAX_VARIANCE_RATIO
    for sensor, windows in zip(sensors[1:], all_windows[1:], strict=True):
        ratios = windows.at_blocks(max(sensor.n // windows.block, 1))
        index = np.floor((times - sensor.start) * sensor.rate / windows.block).astype(int)
        inside = (index >= 0) & (index < len(ratios))
        still &= inside & (ratios[index.clip(0, len(ratios) - 1)] < MAX_VARIANCE_RATIO)
    return still, all_windows


def _find_spans(sensors: Sequence[Sensor]) -> tuple[Integers, Stillness]:
    """Return first and last samples of the first sensor's rests, and the thresholds."""
    still, windows = _find_still_blocks(sensors)
    rate, block = sensors[0].rate, windows[0].block
    joined = max(1, round(_MAX_BREAK_S * rate / block))
    still_runs = runs_of_rows(np.flatnonzero(still), joined) * block
    longest = float((still_runs[:, 1] - still_runs[:, 0]).max(initial=0)) / rate
    trim = round(_TRIM_S * rate)
    spans = still_runs + np.array([trim, -trim])
    long_enough = spans[:, 1] - spans[:, 0] >= _MIN_REST_S * rate
    floor: dict[str, Floats] = {
        sensor.kind: sensor_windows.floor
        for sensor, sensor_windows in zip(sensors, windows, strict=True)
    }
    step: dict[str, Floats] = {
        sensor.kind: sensor_windows.step
        for sensor, sensor_windows in zip(sensors, windows, strict=True)
    }
    return spans[long_enough], Stillness(floor, step, longest)


def detect_rests(gyro: Sensor, accel: Sensor) -> tuple[list[Rest], Stillness]:
    """Return all rests of two sensors, with means in the unit of the fit, and the thresholds."""
    spans, stillness = _find_spans((gyro, accel))
    rests = [_measure_rest(gyro, gyro, accel, int(first), int(last)) for first, last in spans]
    complete = [rest for rest in rests if np.isfinite([rest.gyro, rest.accel]).all()]
    return _add_sigmas(complete, accel, gyro, stillness), stillness


def measure_rests(
    gyro: Sensor, accel: Sensor, spans: Iterable[Rest | tuple[float, float]]
) -> tuple[list[Rest], Stillness]:
    """Return the rests between given start and stop times, s.

    Raises
    ------
    ValueError, TypeError
        If a rest does not stop after its start, lacks samples of a sensor, or overlaps another
        rest.
    """
    times = sorted(_parse_span(rest) for rest in spans)
    for (_, stop), (start, _) in pairwise(times):
        if start < stop:
            raise ArgumentError(
                "rests", f"must not overlap: one ends at {stop:g} s, after {start:g} s"
            )
    rests = []
    for start, stop in times:
        rest = _measure_rest(gyro, gyro, accel, gyro.index_at(start), gyro.index_at(stop))
        if not np.isfinite([rest.gyro, rest.accel]).all():
            raise ValueError(f"at the rest {start:g} s to {stop:g} s a sensor has no samples")
        rests.append(rest)
    _, stillness = _find_spans((gyro, accel))
    return _add_sigmas(rests, accel, gyro, stillness), stillness


def _parse_span(rest: Rest | tuple[float, float]) -> tuple[float, float]:
    """Return the start and stop of a rest given by the user, s."""
    pair = (rest.start, rest.stop) if isinstance(rest, Rest) else rest
    try:
        start, stop = map(float, pair)
    except (TypeError, ValueError):
        raise TypeError(f"rests must be Rest or (start, stop) in seconds, got {rest!r}") from None
    if not -np.inf < start < stop < np.inf:
        raise ValueError(f"a rest must stop after its start, got {start:g} s to {stop:g} s")
    return start, stop


def _measure_rest(
    clock: Sensor, gyro: Sensor | None, accel: Sensor | None, first: int, last: int
) -> Rest:
    """Return a rest between two samples of the clock, with NaN means of a missing sensor."""
    start, stop = clock.start + first / clock.rate, clock.start + last / clock.rate
    rate, force = (
        np.full(3, np.nan)
        if sensor is None
        else sensor.mean(sensor.index_at(start), sensor.index_at(stop))
        for sensor in (gyro, accel)
    )
    size = float(np.linalg.norm(force))
    return Rest(
        start=start,
        stop=stop,
        first=first,
        last=last,
        accel=force,
        gyro=rate,
        accel_sigma=np.full(3, np.nan),
        direction=force / max(size, np.finfo(float).tiny),
        norm_error=size - 1.0,
    )


def _rest_errors(sensor: Sensor, rests: Sequence[Rest]) -> tuple[Floats, Floats]:
    """Return the standard errors of the mean of each rest, from its halves and its quarters."""
    parts = []
    for rest in rests:
        ends = np.linspace(sensor.index_at(rest.start), sensor.index_at(rest.stop), 5).astype(int)
        parts.append([sensor.mean(first, last) for first, last in pairwise(ends)])
    quarters = np.nan_to_num(parts)
    halves = np.abs(quarters[:, :2].sum(axis=1) - quarters[:, 2:].sum(axis=1)) / 4.0
    return halves, np.maximum(halves, quarters.std(axis=1, ddof=1) / 2.0)


def mean_variances(
    sensor: Sensor, rests: Sequence[Rest], stillness: Stillness
) -> tuple[Floats, Floats]:
    """Return the variances of the means at rests: usual variances, and individual variances.

    The usual variance is the variance of rounding plus a larger part: white noise, or the median
    difference between the halves of all rests, whichever is larger. The individual variance uses
    the halves or the quarters of the rest, whichever differ more. Quarters also detect a motion and
    its return.
    """
    if not rests:
        return np.zeros((0, 3)), np.zeros((0, 3))
    halves, own = _rest_errors(sensor, rests)
    pooled = np.median(halves**2, axis=0) / _MEDIAN_OF_SQUARE
    count = np.array([[(rest.stop - rest.start) * sensor.rate] for rest in rests])
    white = np.nan_to_num(stillness.floor[sensor.kind]) / np.maximum(count, 1.0)
    return np.maximum(white, pooled) + stillness.rounding(sensor.kind), own**2


def _add_sigmas(
    rests: list[Rest], accel: Sensor, gyro: Sensor | None, stillness: Stillness
) -> list[Rest]:
    """Return the rests with standard errors of their means, and a reason for rests with motion."""
    if not rests:
        return rests
    usual, own = mean_variances(accel, rests, stillness)
    pose = (_POSE_SIGMA * np.median([np.linalg.norm(rest.accel) for rest in rests])) ** 2
    excess = (own / (usual + pose)).max(axis=1)
    if gyro is not None:
        of_gyro = mean_variances(gyro, rests, stillness)
        excess = np.maximum(excess, (of_gyro[1] / np.maximum(of_gyro[0], 1e-300)).max(axis=1))
    ratio = np.sqrt(excess)
    # Motion does not average out like noise: the mean of four quarters is no better than one
    # quarter.
    parts = np.where(ratio > _MIN_MOTION_RATIO, 4.0, 1.0)[:, np.newaxis]
    sigmas = np.sqrt(np.maximum(usual, parts * own) + pose)
    return [
        replace(rest, accel_sigma=sigma, reason=_describe_motion(float(times)))
        for rest, sigma, times in zip(rests, sigmas, ratio, strict=True)
    ]


def find_clipped_axes(accel: Sensor, rests: Sequence[Rest], stillness: Stillness) -> list[str]:
    """Return the axis of each rest that is at the end of the accelerometer's range, or "".

    Many samples of such an axis have one value, the largest or smallest of the record. Its noise is
    nevertheless larger than the step between values.
    """
    ends = np.nanmin(accel.data, axis=0), np.nanmax(accel.data, axis=0)
    step = stillness.step["accel"]
    noisy = (step > 0.0) & (stillness.floor["accel"] > (2.0 * step) ** 2)
    axes = []
    for rest in rests:
        part = accel.data[accel.index_at(rest.start) : accel.index_at(rest.stop)]
        share = np.maximum(*((part == end).mean(axis=0) for end in ends))
        clipped_axes = np.flatnonzero(noisy & (share > _MIN_CLIPPED_SHARE))
        axes.append("xyz"[clipped_axes[0]] if clipped_axes.size else "")
    return axes


def _describe_motion(ratio: float) -> str:
    return (
        f"moving: its parts differ by {ratio:.0f} times the usual"
        if ratio > _MIN_MOTION_RATIO
        else ""
    )


def convert_to_raw(rest: Rest, gyro: Sensor | None, accel: Sensor | None) -> Rest:
    """Return a rest with its means in the unit of the raw samples."""
    force = 1.0 if accel is None else accel.factor
    return replace(
        rest,
        gyro=rest.gyro / (1.0 if gyro is None else gyro.factor),
        accel=rest.accel / force,
        accel_sigma=rest.accel_sigma / force,
    )


def find_rests(recording: Recording | Log) -> tuple[Rest, ...]:
    """Return the static intervals of a recording.

    Parameters
    ----------
    recording
        A `Recording` with a gyro, an accelerometer or both, or a `Log` of one of them with three
        axes. NaN marks missing samples.

    Returns
    -------
    tuple of Rest
        Rests in the order of time. Start and stop are times of the gyro, or of the accelerometer if
        there is no gyro. Means are in the raw units, NaN for a missing sensor. ``direction`` is the
        direction of the raw specific force.

    Raises
    ------
    LogError
        If both sensors are missing, or a sensor does not have three axes.
    TypeError
        If `recording` is neither a recording nor a log.

    Notes
    -----
    The variance of each axis in windows of 0.5 s is divided by the floor of this axis: the typical
    variance in its quietest windows. A window is at rest if no axis exceeds 5 times its floor.
    Interruptions below 0.4 s are ignored. Each rest is shortened by 0.1 s at both ends, and must
    then be at least 1 s long. At least a tenth of the record must be at rest: otherwise the floor
    is unknown.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> rate = 0.1 * rng.standard_normal((1000, 3))
    >>> rate[400:600] += 20 * np.hanning(200)[:, np.newaxis]
    >>> log = Log(np.arange(1000) / 100, 100.0, rate, ["gyro_x", "gyro_y", "gyro_z"], "deg/s")
    >>> [(round(rest.start, 1), round(rest.stop, 1)) for rest in find_rests(log)]
    [(0.1, 3.8), (6.2, 9.9)]
    """
    gyro, accel = _select_sensors(recording)
    sensors = [sensor for sensor in (gyro, accel) if sensor is not None]
    spans, stillness = _find_spans(sensors)
    rests = [_measure_rest(sensors[0], gyro, accel, int(first), int(last)) for first, last in spans]
    if accel is not None:
        rests = _add_sigmas(rests, accel, gyro, stillness)
    return tuple(convert_to_raw(rest, gyro, accel) for rest in rests)


def _select_sensors(recording: Recording | Log) -> tuple[Sensor | None, Sensor | None]:
    if isinstance(recording, Log):
        if _is_accel(recording):
            return None, prepare_sensor("accel", recording, STANDARD_GRAVITY)
        return prepare_sensor("gyro", recording, STANDARD_GRAVITY), None
    if not isinstance(recording, Recording):
        raise TypeError(f"expected a Recording or a Log, got {type(recording).__name__}")
    gyro, accel = recording.gyro, recording.accel
    if gyro is None and accel is None:
        raise LogError(
            f"rests are found by a gyro or an accel; the recording has: {', '.join(recording)}"
        )
    return (
        None if gyro is None else prepare_sensor("gyro", gyro, STANDARD_GRAVITY),
        None if accel is None else prepare_sensor("accel", accel, STANDARD_GRAVITY),
    )


def _is_accel(log: Log) -> bool:
    try:
        return units.kind(log.unit) == "acceleration"
    except ValueError:
        return "acc" in log.names[0].lower()
