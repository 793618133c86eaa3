"""What is not identifiable in a log, and what to record so that it is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from zerorate.findings.axes import SECTION as AXES
from zerorate.findings.enter import Known
from zerorate.findings.finding import Finding
from zerorate.findings.imus import Imu
from zerorate.findings.magnetometer import SECTION as MAGNETOMETER
from zerorate.findings.pairs import SECTION as PAIRS
from zerorate.findings.receiver import SECTION as RECEIVER
from zerorate.findings.rests import OF_BIAS, OF_NOISE
from zerorate.noise import NoiseModel
from zerorate.noise.exports import left_out
from zerorate.record.recording import Recording

SECTION: Final = "What to record next"
_FAST: Final = 90.0
"""Hz from which on a log shows vibration."""
_MINUTES: Final = "Ten minutes at rest, on a firm table"


def record(
    recording: Recording, imu: Imu, told: Known, findings: Sequence[Finding]
) -> Iterator[Finding]:
    """Yield what this log does not determine, with the record that would."""
    wanted: dict[str, list[str]] = {}
    for what, how in _missing(recording, imu, told, findings):
        wanted.setdefault(how, []).append(what)
    for how, unknown in wanted.items():
        yield Finding(
            SECTION, "not identifiable", "good",
            f"{how}, for what this log does not determine: {', '.join(unknown)}.",
        )  # fmt: skip


def _missing(
    recording: Recording, imu: Imu, told: Known, findings: Sequence[Finding]
) -> Iterator[tuple[str, str]]:
    """Yield what is not known, and what to record."""
    longest = max((rest.seconds for rest in imu.rests), default=0.0)
    if imu.sensors[0].log.rate < _FAST:
        yield "vibration", "Gyro and accelerometer at 100 Hz and more"
    if longest < OF_BIAS:
        yield "the gyro's bias", "Ten seconds at rest before and after the motion"
        yield "gravity", "Ten seconds at rest before and after the motion"
    if longest < OF_NOISE:
        yield "white noise", _MINUTES
    yield from _of_noise(told.gyro, "gyro")
    yield from _of_noise(told.accel, "accelerometer")
    if told.calibration is None:
        yield (
            "scale, misalignment and bias of the accelerometer",
            "Twelve poses and more, five seconds each, with turns between them",
        )
    if "temperature" not in recording:
        yield "the bias by temperature", "The sensor's temperature, beside its samples"
    elif any(one.kind == "bias by temperature" and one.value is None for one in findings):
        yield "the bias by temperature", "Still from cold until it is warm, and cool again"
    yield from _of_motion(recording, findings)


def _of_noise(model: NoiseModel | None, name: str) -> Iterator[tuple[str, str]]:
    if model is None:
        return
    if model.doubt:
        yield f"noise of the {name}", _MINUTES
        return
    for one in left_out(model):
        term, _, how = one.partition(": record ")
        yield f"{term} of the {name}", f"{how[0].upper()}{how[1:]}"


def _of_motion(recording: Recording, findings: Sequence[Finding]) -> Iterator[tuple[str, str]]:
    kinds = {(one.section, one.kind) for one in findings}
    if not any(section == AXES and kind.startswith("scale") for section, kind in kinds):
        yield "the scale of the gyro", "Turns by hand about all three axes, a minute of them"
    other = recording.get("gyro_1")
    if other is not None and (PAIRS, "delay") not in kinds:
        turns = "Turns by hand about all three axes, a minute of them"
        yield (
            "delay, rotation and scale between its IMUs",
            turns if other.rate >= _FAST else "Gyro and accelerometer at 100 Hz and more",
        )
    if recording.mag is not None and (MAGNETOMETER, "field") not in kinds:
        yield "iron near the magnetometer", "Turns by hand about all three axes, a minute of them"
    if (RECEIVER, "fixes") in kinds and (RECEIVER, "innovations") not in kinds:
        yield "the receiver's clock and errors", "A drive with turns and stops, some minutes long"
