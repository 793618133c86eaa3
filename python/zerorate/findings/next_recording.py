"""Quantities that a log does not determine, with advice for the next recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from zerorate.findings.axes import SECTION as AXES
from zerorate.findings.external_settings import LogModels
from zerorate.findings.finding import Finding
from zerorate.findings.imus import Imu
from zerorate.findings.magnetometer import SECTION as MAGNETOMETER
from zerorate.findings.pairs import SECTION as PAIRS
from zerorate.findings.receiver import SECTION as RECEIVER
from zerorate.findings.rests import MIN_BIAS_REST_S, MIN_NOISE_REST_S
from zerorate.noise import NoiseModel
from zerorate.noise.exports import list_undetermined
from zerorate.record.recording import Recording

SECTION: Final = "What to record next"
_MIN_VIBRATION_RATE_HZ: Final = 90.0
"""Smallest sampling rate that shows vibration, Hz."""
_LONG_REST_ADVICE: Final = "Ten minutes at rest, on a firm table"


def next_record_findings(
    recording: Recording, imu: Imu, models: LogModels, findings: Sequence[Finding]
) -> Iterator[Finding]:
    """Yield the recordings that would determine the missing quantities."""
    missing_by_advice: dict[str, list[str]] = {}
    for what, advice in _list_missing(recording, imu, models, findings):
        missing_by_advice.setdefault(advice, []).append(what)
    for advice, unknown in missing_by_advice.items():
        yield Finding(
            SECTION, "not identifiable", "good",
            f"{advice}, for what this log does not determine: {', '.join(unknown)}.",
        )  # fmt: skip


def _list_missing(
    recording: Recording, imu: Imu, models: LogModels, findings: Sequence[Finding]
) -> Iterator[tuple[str, str]]:
    """Yield each unknown quantity with advice for a recording."""
    longest = max((rest.seconds for rest in imu.rests), default=0.0)
    if imu.sensors[0].log.rate < _MIN_VIBRATION_RATE_HZ:
        yield "vibration", "Gyro and accelerometer at 100 Hz and more"
    if longest < MIN_BIAS_REST_S:
        yield "the gyro's bias", "Ten seconds at rest before and after the motion"
        yield "gravity", "Ten seconds at rest before and after the motion"
    if longest < MIN_NOISE_REST_S:
        yield "white noise", _LONG_REST_ADVICE
    yield from _list_missing_noise(models.gyro, "gyro")
    yield from _list_missing_noise(models.accel, "accelerometer")
    if models.calibration is None:
        yield (
            "scale, misalignment and bias of the accelerometer",
            "Twelve or more poses of five seconds each, with rotations between them",
        )
    if "temperature" not in recording:
        yield "the bias by temperature", "The sensor's temperature with each sample"
    elif any(one.kind == "bias by temperature" and one.value is None for one in findings):
        yield (
            "the bias by temperature",
            "At rest while the sensor warms up from cold and cools down again",
        )
    yield from _list_missing_motion(recording, findings)


def _list_missing_noise(model: NoiseModel | None, name: str) -> Iterator[tuple[str, str]]:
    if model is None:
        return
    if model.doubt:
        yield f"noise of the {name}", _LONG_REST_ADVICE
        return
    for missing_term in list_undetermined(model):
        term, _, advice = missing_term.partition(": record ")
        yield f"{term} of the {name}", f"{advice[0].upper()}{advice[1:]}"


def _list_missing_motion(
    recording: Recording, findings: Sequence[Finding]
) -> Iterator[tuple[str, str]]:
    kinds = {(one.section, one.kind) for one in findings}
    if not any(section == AXES and kind.startswith("scale") for section, kind in kinds):
        yield "the scale of the gyro", "A minute of rotations by hand about all three axes"
    second_gyro = recording.get("gyro_1")
    if second_gyro is not None and (PAIRS, "delay") not in kinds:
        turns = "A minute of rotations by hand about all three axes"
        yield (
            "delay, rotation and scale between its IMUs",
            turns
            if second_gyro.rate >= _MIN_VIBRATION_RATE_HZ
            else "Gyro and accelerometer at 100 Hz and more",
        )
    if recording.mag is not None and (MAGNETOMETER, "field") not in kinds:
        yield "iron near the magnetometer", "A minute of rotations by hand about all three axes"
    if (RECEIVER, "fixes") in kinds and (RECEIVER, "innovations") not in kinds:
        yield "the receiver's clock and errors", "A drive with turns and stops, some minutes long"
