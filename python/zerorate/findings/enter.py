"""What to enter in PX4, ArduPilot, Kalibr and robot_localization, as their files have it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import numpy as np

from zerorate.calibration.calibrate import calibrate
from zerorate.calibration.calibration import Calibration
from zerorate.calibration.refusal import CalibrationError
from zerorate.faults import sentence_of
from zerorate.findings.finding import Finding, Spans
from zerorate.findings.imus import Imu, part
from zerorate.findings.rests import OF_NOISE, means, spans
from zerorate.noise import NoiseModel
from zerorate.noise.characterise import characterise_log
from zerorate.record.log import LogError
from zerorate.record.recording import Recording
from zerorate.types import Floats

SECTION: Final = "What to enter"
_SLOW: Final = 50.0
_POSES: Final = 6
"""Rests that may be the poses of a calibration, in as many directions as half of that."""
_APART: Final = np.cos(np.radians(30.0))


class Known(NamedTuple):
    """What a log tells for the settings of others.

    A model of the noise of the gyro and one of the accelerometer, a calibration, and why there is
    none; None, or empty, where nothing is told.
    """

    gyro: NoiseModel | None
    accel: NoiseModel | None
    calibration: Calibration | None
    missing: str


def known(recording: Recording, imu: Imu) -> Known:
    """Return what the longest rest tells of noise, and the poses of a calibration, if any."""
    models = [_model(imu, one) for one in (0, 1)]
    calibration, missing = _calibration(recording, imu)
    return Known(models[0], models[1], calibration, missing)


def _model(imu: Imu, which: int) -> NoiseModel | None:
    """Return the noise of the noisiest axis of a gyro or an accelerometer; None without a rest."""
    one = (imu.gyro, imu.accel)[which]
    rest = max(imu.rests, key=lambda rest: rest.seconds, default=None)
    if one is None or one.factor is None or one.log.rate < _SLOW or rest is None:
        return None
    if rest.seconds < OF_NOISE:
        return None
    begin, end = spans([rest])[0]
    try:
        found = characterise_log(
            part(one.log, one.start + begin, one.start + end),
            second_opinion=False,
            progress=lambda step, done: None,
        )
    except LogError:
        return None
    return found.worst


def _calibration(recording: Recording, imu: Imu) -> tuple[Calibration | None, str]:
    if imu.gyro is None or imu.accel is None or not _is_posed(imu):
        return None, ""
    try:
        found = calibrate(recording, gyro=imu.gyro.name, accel=imu.accel.name)
    except CalibrationError as error:
        return None, str(sentence_of(error)).partition(": ")[0]
    except LogError:
        return None, ""
    return (found, "") if found.valid else (None, "; ".join(found.problems))


def _is_posed(imu: Imu) -> bool:
    """Return whether rests are in many directions, as those of a calibration are."""
    if imu.accel is None or len(imu.rests) < _POSES:
        return False
    directions: list[Floats] = []
    for rest in imu.rests:
        mean = means(imu.accel, rest)[0]
        mean = mean / np.linalg.norm(mean)
        if all(mean @ other < _APART for other in directions):
            directions.append(mean)
    return len(directions) >= _POSES // 2


def enter(imu: Imu, told: Known) -> Iterator[Finding]:
    """Yield the settings of each program that the log tells, as lines of its own files."""
    longest = max(imu.rests, key=lambda rest: rest.seconds, default=None)
    rested = () if longest is None else spans([longest])
    for program, write in _noise_files(imu, told).items():
        if (text := _written(write)) is not None:
            yield _of(
                imu, program, "noise of the noisiest axis at rest; in motion a filter wants more",
                text, rested,
            )  # fmt: skip
    for program, write in _calibration_files(told.calibration).items():
        if (text := _written(write)) is not None:
            what = f"offsets and scales by {len(imu.rests)} rests and the turns between them"
            yield _of(imu, program, what, text, spans(imu.rests))


def _noise_files(imu: Imu, told: Known) -> dict[str, Callable[[], str]]:
    gyro, accel = told.gyro, told.accel
    if gyro is None or imu.gyro is None:
        return {}
    rate = imu.gyro.log.rate
    return {
        "PX4, EKF2": lambda: gyro.to_px4(accelerometer=accel),
        "Kalibr": lambda: gyro.to_kalibr(accelerometer=accel, rate=rate),
        "robot_localization": lambda: gyro.to_ros(accelerometer=accel, rate=rate),
    }


def _calibration_files(found: Calibration | None) -> dict[str, Callable[[], str]]:
    if found is None:
        return {}
    return {"PX4, sensors": found.to_px4, "ArduPilot": found.to_ardupilot}


def _written(write: Callable[[], str]) -> str | None:
    """Return a file's text, None where the log does not bear it out."""
    try:
        return write()
    except ValueError:
        return None


def _of(imu: Imu, program: str, what: str, text: str, rested: Spans) -> Finding:
    return Finding(
        SECTION, program, "good", f"{program}: {what}.",
        spans=rested, figure=imu.sensors[0].figure, code=text,
    )  # fmt: skip
