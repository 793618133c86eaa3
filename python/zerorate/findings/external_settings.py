"""Settings for PX4, ArduPilot, Kalibr and robot_localization, in their file formats."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import numpy as np

from zerorate.calibration.calibrate import calibrate
from zerorate.calibration.calibration import Calibration
from zerorate.calibration.errors import CalibrationError
from zerorate.faults import sentence_of
from zerorate.findings.finding import Finding, Spans
from zerorate.findings.imus import Imu, cut_log
from zerorate.findings.rests import MIN_NOISE_REST_S, rest_mean, rest_spans
from zerorate.noise import NoiseModel
from zerorate.noise.characterise import characterise_log
from zerorate.record.log import LogError
from zerorate.record.recording import Recording
from zerorate.types import Floats

SECTION: Final = "What to enter"
_MIN_RATE_HZ: Final = 50.0
_MIN_POSES: Final = 6
"""Smallest number of rests for a calibration, in half as many directions."""
_MAX_POSE_COSINE: Final = np.cos(np.radians(30.0))


class LogModels(NamedTuple):
    """Models of a log for the settings of other programs.

    Noise models of gyro and accelerometer, a calibration, and the reason for a missing calibration.
    Unknown models are None.
    """

    gyro: NoiseModel | None
    accel: NoiseModel | None
    calibration: Calibration | None
    missing: str


def fit_log_models(recording: Recording, imu: Imu) -> LogModels:
    """Return noise from the longest rest, and a calibration from the poses, if any."""
    models = [_fit_noise(imu, one) for one in (0, 1)]
    calibration, missing = _fit_calibration(recording, imu)
    return LogModels(models[0], models[1], calibration, missing)


def _fit_noise(imu: Imu, sensor_index: int) -> NoiseModel | None:
    """Return the noise of the noisiest axis of a gyro or an accelerometer; None without a rest."""
    sensor = (imu.gyro, imu.accel)[sensor_index]
    rest = max(imu.rests, key=lambda rest: rest.seconds, default=None)
    if sensor is None or sensor.factor is None or sensor.log.rate < _MIN_RATE_HZ or rest is None:
        return None
    if rest.seconds < MIN_NOISE_REST_S:
        return None
    begin, end = rest_spans([rest])[0]
    try:
        characterisation = characterise_log(
            cut_log(sensor.log, sensor.start + begin, sensor.start + end),
            second_opinion=False,
            progress=lambda step, done: None,
        )
    except LogError:
        return None
    return characterisation.worst


def _fit_calibration(recording: Recording, imu: Imu) -> tuple[Calibration | None, str]:
    if imu.gyro is None or imu.accel is None or not _is_posed(imu):
        return None, ""
    try:
        calibration = calibrate(recording, gyro=imu.gyro.name, accel=imu.accel.name)
    except CalibrationError as error:
        return None, str(sentence_of(error)).partition(": ")[0]
    except LogError:
        return None, ""
    return (calibration, "") if calibration.valid else (None, "; ".join(calibration.problems))


def _is_posed(imu: Imu) -> bool:
    """Return True if rests have enough different directions for a calibration."""
    if imu.accel is None or len(imu.rests) < _MIN_POSES:
        return False
    directions: list[Floats] = []
    for rest in imu.rests:
        mean = rest_mean(imu.accel, rest)[0]
        mean = mean / np.linalg.norm(mean)
        if all(mean @ other < _MAX_POSE_COSINE for other in directions):
            directions.append(mean)
    return len(directions) >= _MIN_POSES // 2


def settings_findings(imu: Imu, models: LogModels) -> Iterator[Finding]:
    """Yield the settings that the log determines, as lines of each program's files."""
    longest = max(imu.rests, key=lambda rest: rest.seconds, default=None)
    static_spans = () if longest is None else rest_spans([longest])
    for program, write in _noise_files(imu, models).items():
        if (text := _write_or_none(write)) is not None:
            yield _make_finding(
                imu, program, "noise of the noisiest axis at rest; use larger values for motion",
                text, static_spans,
            )  # fmt: skip
    for program, write in _calibration_files(models.calibration).items():
        if (text := _write_or_none(write)) is not None:
            what = f"offsets and scales from {len(imu.rests)} rests and the rotations between them"
            yield _make_finding(imu, program, what, text, rest_spans(imu.rests))


def _noise_files(imu: Imu, models: LogModels) -> dict[str, Callable[[], str]]:
    gyro, accel = models.gyro, models.accel
    if gyro is None or imu.gyro is None:
        return {}
    rate = imu.gyro.log.rate
    return {
        "PX4, EKF2": lambda: gyro.to_px4(accelerometer=accel),
        "Kalibr": lambda: gyro.to_kalibr(accelerometer=accel, rate=rate),
        "robot_localization": lambda: gyro.to_ros(accelerometer=accel, rate=rate),
    }


def _calibration_files(calibration: Calibration | None) -> dict[str, Callable[[], str]]:
    if calibration is None:
        return {}
    return {"PX4, sensors": calibration.to_px4, "ArduPilot": calibration.to_ardupilot}


def _write_or_none(write: Callable[[], str]) -> str | None:
    """Return a file's text, None if the log does not determine it."""
    try:
        return write()
    except ValueError:
        return None


def _make_finding(imu: Imu, program: str, what: str, text: str, static_spans: Spans) -> Finding:
    return Finding(
        SECTION, program, "good", f"{program}: {what}.",
        spans=static_spans, figure=imu.sensors[0].figure, code=text,
    )  # fmt: skip
