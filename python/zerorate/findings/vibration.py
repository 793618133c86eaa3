"""Findings on vibration in motion: its level, by the autopilots' rule, and its peaks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from zerorate.findings.aliasing import AliasedHarmonic, find_aliased_harmonic
from zerorate.findings.finding import Finding
from zerorate.findings.imus import BLOCK_S, Imu, Sensor
from zerorate.findings.limits import LIMITS
from zerorate.numerals import format_with_error, shorten
from zerorate.types import Booleans, Floats

SECTION: Final = "Vibration in motion"
_MIN_RATE_HZ: Final = 90.0
"""Sampling rate below which samples show only a small part of a vibration, Hz."""
_MIN_BLOCKS: Final = 10
"""Smallest number of blocks in motion for a finding."""
_MAX_WINDOWS: Final = 400
"""Number of one-second windows for the spectrum."""
_CHUNK_BLOCKS: Final = 2000
"""Number of blocks in one computation of vibration."""
_MIN_PEAK_RATIO: Final = 4.0
"""Smallest ratio of a peak to the spectrum around it: 12 dB."""


def vibration_findings(imus: Sequence[Imu]) -> Iterator[Finding]:
    """Yield the level and the dominant frequency of each accelerometer's vibration in motion."""
    for imu in imus:
        accel = imu.accel
        if (
            accel is not None
            and accel.factor is not None
            and accel.log.rate >= _MIN_RATE_HZ
            and imu.still.size
        ):
            yield from _check_level(imu, accel)


def _check_level(imu: Imu, sensor: Sensor) -> Iterator[Finding]:
    moving = ~imu.still & sensor.blocks.present[: len(imu.still)]
    if np.count_nonzero(moving) < _MIN_BLOCKS:
        return
    sizes = _vibration_rms(sensor, len(moving))[moving]
    level = float(np.quantile(sizes, 0.95))
    kind = LIMITS["vibration"]
    first = np.flatnonzero(moving)[sizes >= kind.look]
    spans = tuple((BLOCK_S * b, BLOCK_S * (b + 1)) for b in first.tolist()[:50])
    parts = _select_windows(sensor, moving)
    peak = _find_peak(parts, sensor.log.rate)
    peak_text = "" if peak is None else f", most of it at {shorten(peak, 3)} Hz"
    yield Finding(
        SECTION, "vibration", kind.severity(level),
        f"{sensor.label}: vibration of {level:.3g} m/s² (95 % of motion) in the "
        f"{sensor.log.rate:.4g} Hz "
        f"samples{peak_text}; vibration above half that rate is not seen.",
        level, "m/s²", None, spans, sensor.figure,
        "Compare with the autopilot's own metric at the sensor's rate; log raw samples of a hover.",
    )  # fmt: skip
    harmonic = find_aliased_harmonic(parts, sensor.log.rate)
    if harmonic is not None:
        yield _describe_aliased(sensor, harmonic)


def _describe_aliased(sensor: Sensor, harmonic: AliasedHarmonic) -> Finding:
    kind = LIMITS["aliased peak"]
    size, sigma = (
        (sensor.factor or 0.0) * harmonic.amplitude,
        (sensor.factor or 0.0) * harmonic.sigma,
    )
    rate = harmonic.fold * sensor.log.rate
    return Finding(
        SECTION, "aliased peak", kind.severity(size),
        f"{sensor.label}: a peak at {_format_band(harmonic.alias)} Hz of "
        f"{format_with_error(size, sigma)} m/s² is an alias: "
        f"{harmonic.order} times the frequency of the peak at {_format_band(harmonic.peak)} Hz, "
        f"shifted by {shorten(rate, 4)} Hz.",
        size, "m/s²", sigma, (), sensor.figure,
        "Log at a higher rate, or low-pass below half the present rate before sampling.",
    )  # fmt: skip


def _format_band(edges: tuple[float, float]) -> str:
    return f"{shorten(edges[0], 3)} to {shorten(edges[1], 3)}"


def _vibration_rms(sensor: Sensor, count: int) -> Floats:
    """Return the RMS vibration above 5 Hz over all axes, for each block.

    ArduPilot's rule: subtract the 5 Hz low-pass of the force, square, low-pass at 2 Hz, root.
    """
    gain = 1.0 / (1.0 + sensor.log.rate / (2.0 * np.pi * 5.0))
    width, data = max(1, round(1.0 / gain)), sensor.log.data
    middles = [float(np.nanmedian(column)) for column in data.T]
    edges = np.searchsorted(sensor.log.sampled, np.arange(count + 1) * BLOCK_S + sensor.start)
    sums = np.zeros(count)
    for first in range(0, count, _CHUNK_BLOCKS):
        last = min(first + _CHUNK_BLOCKS, count)
        begin, end = int(edges[first]), int(edges[last])
        before, after = max(begin - width, 0), min(end + width, len(data))
        square = np.zeros(end - begin)
        for column, middle in zip(data[before:after].T, middles, strict=True):
            values = np.where(np.isfinite(column), column, middle)
            values -= _moving_mean(values, width)
            square += np.square(values[begin - before : end - before])
        parts = np.concatenate([[0.0], np.cumsum(square)])[edges[first : last + 1] - begin]
        sums[first:last] = np.diff(parts)
    full = np.maximum(np.diff(edges), 1)
    return np.asarray((sensor.factor or 0.0) * np.sqrt(np.maximum(sums, 0.0) / full))


def _moving_mean(values: Floats, width: int) -> Floats:
    """Return a centred moving mean with twice the width of a low-pass' time constant."""
    half = width
    sums = np.concatenate([[0.0], np.cumsum(values)])
    at = np.arange(len(values))
    low, high = np.maximum(at - half, 0), np.minimum(at + half + 1, len(values))
    return np.asarray((sums[high] - sums[low]) / (high - low))


def _select_windows(sensor: Sensor, moving: Booleans) -> Floats:
    """Return one-second windows in motion, shape (m, n, 3), spread evenly over the motion."""
    length = round(sensor.log.rate)
    starts = np.searchsorted(sensor.log.sampled, np.flatnonzero(moving) * BLOCK_S + sensor.start)
    starts = starts[starts + length <= sensor.log.n]
    sampled_starts = starts[:: max(1, starts.size // _MAX_WINDOWS)]
    parts = sensor.log.data[sampled_starts[:, np.newaxis] + np.arange(length)]
    return np.asarray(parts[np.isfinite(parts).all(axis=(1, 2))])


def _find_peak(parts: Floats, rate: float) -> float | None:
    """Return the frequency of the dominant peak in motion, Hz, None without one."""
    length = parts.shape[1]
    if len(parts) < _MIN_BLOCKS:
        return None
    parts = (parts - parts.mean(axis=1, keepdims=True)) * np.hanning(length)[:, np.newaxis]
    power = (np.abs(np.fft.rfft(parts, axis=1)) ** 2).sum(axis=2)
    middle = np.sqrt(np.median(power, axis=0))
    around = np.array([np.median(middle[max(1, i - 12) : i + 13]) for i in range(len(middle))])
    ratio = middle / np.maximum(around, np.finfo(float).tiny)
    ratio[:5] = 0.0
    best = int(np.argmax(np.where(ratio > _MIN_PEAK_RATIO, middle, 0.0)))
    return float(best * rate / length) if ratio[best] > _MIN_PEAK_RATIO else None
