"""The bias of a gyro by its temperature at rest: a slope with its error, or why there is none."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from zerorate.calibration.temperature import TemperatureModel
from zerorate.findings.finding import Finding
from zerorate.findings.imus import BLOCK, Imu
from zerorate.findings.limits import LIMITS
from zerorate.findings.rests import SECTION, spans
from zerorate.numerals import with_error
from zerorate.record.log import Log
from zerorate.record.recording import Recording
from zerorate.types import Floats

_LEAST: Final = 60.0
"""Seconds at rest, in all, without which no slope is looked for."""
_FEWEST: Final = 2
_ADVICE: Final = (
    "Record it still from cold until it is warm, half an hour or more, and let it cool again: "
    "`zerorate calibrate --temperature`."
)


def by_temperature(recording: Recording, found: Sequence[Imu]) -> Iterator[Finding]:
    """Yield how the bias of each gyro that has a thermometer goes with its temperature."""
    for imu in found:
        if imu.gyro is None or imu.gyro.factor is None or not imu.still.size:
            continue
        name = imu.gyro.name
        log = recording.get(name.replace("gyro", "temperature"))
        # Thermometers are counted by themselves: those beside every sample are of the same sensor.
        if log is not None and log.channels == 1 and (name == "gyro" or log.n == imu.gyro.log.n):
            yield _of_imu(imu, log)


def _of_imu(imu: Imu, thermometer: Log) -> Finding:
    gyro = imu.gyro
    assert gyro is not None
    seconds = BLOCK * np.count_nonzero(imu.still)
    if seconds < _LEAST:
        return _unknown(imu, f"it rests for {seconds:.4g} s in all, and {_LEAST:g} s are needed")
    temperature = _at_blocks(thermometer, gyro.start, len(imu.still))
    if temperature is None:
        return _unknown(imu, "its thermometer shows nothing")
    rates = np.degrees(gyro.blocks.mean[: len(imu.still)])
    try:
        model = TemperatureModel.fit(rates, temperature, 1.0 / BLOCK, rests=imu.still, unit="deg/s")
    except ValueError:  # fewer means than it needs
        return _unknown(imu, "the rests are too few")
    low, high = model.range
    known = [k for k, one in enumerate(model.slopes) if one.identifiable]
    if not known:
        return _unknown(imu, _why(model))
    worst = max(known, key=lambda k: abs(model.slopes[k]))
    slope, kind = model.slopes[worst], LIMITS["bias by temperature"]
    told = ", ".join(
        f"{with_error(model.slopes[k], model.slopes[k].sigma)} about {'xyz'[k]}" for k in known
    )
    others = "" if len(known) == 3 else "; of the other axes no slope is seen"
    together = "" if model.time_apart else "; temperature and time went together"
    return Finding(
        SECTION, "bias by temperature", kind.severity(max(abs(slope) - 2.0 * slope.sigma, 0.0)),
        f"{gyro.name}: the bias goes with temperature by {told} deg/s/K at "
        f"{model.reference:.1f} degC, over {low:.1f} to {high:.1f} degC{others}{together}.",
        float(abs(slope)), kind.unit, slope.sigma, spans(imu.rests), gyro.figure, _ADVICE,
    )  # fmt: skip


def _at_blocks(thermometer: Log, start: float, count: int) -> Floats | None:
    """Return the temperature in the middle of each block, None where none is known."""
    shown = thermometer.data[:, 0]
    good = np.isfinite(shown)
    if np.count_nonzero(good) < _FEWEST:
        return None
    middles = start + BLOCK * (np.arange(count) + 0.5)
    return np.asarray(np.interp(middles, thermometer.sampled[good], shown[good]))


def _why(model: TemperatureModel) -> str:
    """Return why no slope is identifiable."""
    if model.span < 1.0:
        return f"temperature moved by {model.span:.2g} K only"
    bound = max(one.upper_bound for one in model.slopes)
    if not math.isfinite(bound):
        return "the rests are too few"
    return f"over {model.span:.3g} K no slope stands out, of {bound:.2g} deg/s/K or less"


def _unknown(imu: Imu, why: str) -> Finding:
    gyro = imu.gyro
    assert gyro is not None
    return Finding(
        SECTION, "bias by temperature", "good",
        f"{gyro.name}: the bias by temperature is not identifiable: {why}.",
        figure=gyro.figure, advice=_ADVICE,
    )  # fmt: skip
