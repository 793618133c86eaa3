"""Temperature slope of a gyro's bias at rest, or the reason why there is none."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from zerorate.calibration.temperature import TemperatureModel
from zerorate.findings.finding import Finding
from zerorate.findings.imus import BLOCK_S, Imu
from zerorate.findings.limits import LIMITS
from zerorate.findings.rests import SECTION, rest_spans
from zerorate.numerals import format_with_error, shorten
from zerorate.record.log import Log
from zerorate.record.recording import Recording
from zerorate.types import Floats

_MIN_REST_S: Final = 60.0
"""Smallest total time at rest for a slope, s."""
_MIN_READINGS: Final = 2
_ADVICE: Final = (
    "Record at rest for half an hour or more while it warms up from cold and cools down again: "
    "`zerorate calibrate --temperature`."
)


def temperature_findings(recording: Recording, imus: Sequence[Imu]) -> Iterator[Finding]:
    """Yield the temperature slope of the bias of each gyro with a thermometer."""
    for imu in imus:
        if imu.gyro is None or imu.gyro.factor is None or not imu.still.size:
            continue
        name = imu.gyro.name
        log = recording.get(name.replace("gyro", "temperature"))
        # Thermometers have their own numbers: a thermometer with the gyro's number of samples
        # belongs to it.
        if log is not None and log.channels == 1 and (name == "gyro" or log.n == imu.gyro.log.n):
            yield _check_imu(imu, log)


def _check_imu(imu: Imu, thermometer: Log) -> Finding:
    gyro = imu.gyro
    assert gyro is not None
    seconds = BLOCK_S * np.count_nonzero(imu.still)
    if seconds < _MIN_REST_S:
        return _describe_unidentifiable(
            imu, f"it rests for {shorten(seconds, 4)} s in all, and {_MIN_REST_S:g} s are needed"
        )
    temperature = _temperature_at_blocks(thermometer, gyro.start, len(imu.still))
    if temperature is None:
        return _describe_unidentifiable(imu, "its thermometer has no readings")
    rates = np.degrees(gyro.blocks.mean[: len(imu.still)])
    try:
        model = TemperatureModel.fit(
            rates, temperature, 1.0 / BLOCK_S, rests=imu.still, unit="deg/s"
        )
    except ValueError:  # too few means for a fit
        return _describe_unidentifiable(imu, "the rests are too few")
    low, high = model.range
    known_axes = [k for k, slope_estimate in enumerate(model.slopes) if slope_estimate.identifiable]
    if not known_axes:
        return _describe_unidentifiable(imu, _explain_missing_slope(model))
    worst = max(known_axes, key=lambda k: abs(model.slopes[k]))
    slope, kind = model.slopes[worst], LIMITS["bias by temperature"]
    slopes_text = ", ".join(
        f"{format_with_error(model.slopes[k], model.slopes[k].sigma)} about {'xyz'[k]}"
        for k in known_axes
    )
    other_axes_text = "" if len(known_axes) == 3 else "; the other axes show no slope"
    confounding_text = "" if model.time_separable else "; temperature and time changed together"
    return Finding(
        SECTION, "bias by temperature", kind.severity(max(abs(slope) - 2.0 * slope.sigma, 0.0)),
        f"{gyro.label}: the bias changes with temperature by {slopes_text} deg/s/K at "
        f"{model.reference:.1f} degC, over {low:.1f} to {high:.1f} "
        f"degC{other_axes_text}{confounding_text}.",
        float(abs(slope)), kind.unit, slope.sigma, rest_spans(imu.rests), gyro.figure, _ADVICE,
    )  # fmt: skip


def _temperature_at_blocks(thermometer: Log, start: float, count: int) -> Floats | None:
    """Return the temperature in the middle of each block, None if unknown."""
    readings = thermometer.data[:, 0]
    finite = np.isfinite(readings)
    if np.count_nonzero(finite) < _MIN_READINGS:
        return None
    middles = start + BLOCK_S * (np.arange(count) + 0.5)
    return np.asarray(np.interp(middles, thermometer.sampled[finite], readings[finite]))


def _explain_missing_slope(model: TemperatureModel) -> str:
    """Return the reason why no slope is identifiable."""
    if model.span < 1.0:
        return f"temperature moved by {shorten(model.span)} K only"
    bound = max(slope.upper_bound for slope in model.slopes)
    if not math.isfinite(bound):
        return "the rests are too few"
    return f"over {model.span:.3g} K no slope is significant, of {shorten(bound)} deg/s/K or less"


def _describe_unidentifiable(imu: Imu, why: str) -> Finding:
    gyro = imu.gyro
    assert gyro is not None
    return Finding(
        SECTION, "bias by temperature", "good",
        f"{gyro.label}: the bias by temperature is not identifiable: {why}.",
        figure=gyro.figure, advice=_ADVICE,
    )  # fmt: skip
