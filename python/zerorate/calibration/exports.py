"""Export of calibrations to other programs: Kalibr, imu_tk, PX4, ArduPilot."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from zerorate.calibration.frames import rotation_into_frame
from zerorate.calibration.parameters import (
    ACCEL_BIAS,
    ACCEL_MATRIX,
    G_SENSITIVITY,
    GYRO_BIAS,
    GYRO_MATRIX,
    PARAMETERS,
)
from zerorate.faults import keyword_argument, make_sentence
from zerorate.noise.exports import write_text
from zerorate.numerals import shorten
from zerorate.record.atomic import atomic_path
from zerorate.record.exporting import document_export
from zerorate.types import Floats
from zerorate.units import UNITS, convert

if TYPE_CHECKING:
    from zerorate.calibration.calibration import Calibration
    from zerorate.calibration.temperature import TemperatureModel

_AXES: Final = "XYZ"
_SUFFIXES: Final = ("_acc.calib", "_gyro.calib")

_writes = partial(
    document_export,
    faults="""\
ValueError
    If the calibration is not valid and `doubtful` is False. If the unit of the raw samples is
    unknown. If a sensor's axes are left-handed.""",
    options="""\
doubtful : bool
    Write a calibration that is not valid, with a warning in the file; default False.""",
)


@_writes()
def to_kalibr(
    calibration: Calibration,
    path: str | os.PathLike[str] | None = None,
    *,
    doubtful: bool = False,
    force: bool = False,
) -> str:
    """Return the calibration as the intrinsics of an IMU in Kalibr's YAML.

    Returns
    -------
    str
        The model "scale-misalignment": ``accelerometers.M``, ``gyroscopes.M``, ``gyroscopes.A`` and
        ``gyroscopes.C_gyro_i``, for samples in rad/s and m/s^2. The format has no biases: comments
        state the biases, with the formulas from raw to true samples and back.
        `NoiseModel.to_kalibr` writes the noise. The pose ``T_i_b`` is not part of a calibration.

    Notes
    -----
    Kalibr multiplies the force by C_gyro_i before A (``IccSensors.py``,
    ``IccScaledMisalignedImu``). Its A is therefore G, rotated into the axes of the gyro.
    """
    _check_valid(calibration, doubtful)
    converted = _convert_to_si(calibration.to_frame("x"), "Kalibr")
    gyro = converted.values[GYRO_MATRIX].reshape(3, 3)
    rotation = rotation_into_frame(gyro, "x")
    per_force = converted.values[G_SENSITIVITY].reshape(3, 3) / convert(1.0, "g", "m/s^2")
    lines = [
        *_header_lines(calibration, "Kalibr: scale, misalignment and g-sensitivity of an IMU."),
        *_KALIBR_COMMENTS,
        f"#   b_a = {_format_row(converted.values[ACCEL_BIAS])}  # m/s^2",
        f"#   b_g = {_format_row(converted.values[GYRO_BIAS])}  # rad/s",
        "imu0:",
        "  model: scale-misalignment",
        f"  update_rate: {calibration.rate:.10g}",
        "  accelerometers:",
        *_format_yaml("M", converted.values[ACCEL_MATRIX].reshape(3, 3)),
        "  gyroscopes:",
        *_format_yaml("M", np.tril(gyro @ rotation.T)),
        *_format_yaml("A", per_force @ rotation.T),
        *_format_yaml("C_gyro_i", rotation),
    ]
    return write_text("\n".join(lines) + "\n", path, force)


_KALIBR_COMMENTS: Final = (
    "# raw_a, raw_g: samples in m/s^2 and rad/s; a: specific force; w: angular rate.",
    "# Output of the sensors:",
    "#   raw_a = accelerometers.M a + b_a",
    "#   raw_g = gyroscopes.M C_gyro_i w + gyroscopes.A C_gyro_i a + b_g",
    "# How to correct samples:",
    "#   a = inverse(accelerometers.M) (raw_a - b_a)",
    "#   w = transpose(C_gyro_i) inverse(gyroscopes.M) (raw_g - gyroscopes.A C_gyro_i a - b_g)",
    "# Biases at the time of calibration; Kalibr estimates its own:",
)


class ImuTk(NamedTuple):
    """Texts of the two files of imu_tk.

    Parameters
    ----------
    accel, gyro : str
        Input of ``CalibratedTriad::load``: misalignment T, scale K, bias.
    """

    accel: str
    gyro: str


def to_imu_tk(
    calibration: Calibration,
    path: str | os.PathLike[str] | None = None,
    *,
    doubtful: bool = False,
    force: bool = False,
) -> ImuTk:
    """Return the calibration as the two files of imu_tk.

    Parameters
    ----------
    path : str or path, optional
        Beginning of the file names: ``imu`` writes ``imu_acc.calib`` and ``imu_gyro.calib``, the
        names of imu_tk's programs. Default: no file is written.
    doubtful : bool
        Write a calibration that is not valid, with a warning in the files. Default False.
    force : bool
        Replace existing files. Default False.

    Returns
    -------
    ImuTk
        The texts `accel` and `gyro`. Corrected samples are T K (raw - bias), in m/s^2 and rad/s;
        raw samples are in their own unit. The axes are those of frame "z", in which the
        accelerometer's T is upper triangular. The format has no g-sensitivity: a comment after the
        numbers states its size.

    Raises
    ------
    ValueError
        If the calibration is not valid and `doubtful` is False, or the accelerometer's axes are
        left-handed.
    OSError
        If a file exists and `force` is False, or a file cannot be written. No incomplete file
        remains.

    Notes
    -----
    Sources of the convention: imu_tk's ``calibration.h``, and D. Tedaldi, A. Pretto and E.
    Menegatti, "A robust and easy to implement method for IMU calibration without external
    equipments", ICRA 2014, equations 6 to 10.
    """
    _check_valid(calibration, doubtful)
    converted = calibration.to_frame("z")
    sensors = (
        (converted.accel.correction, converted.values[ACCEL_BIAS], converted.accel_units, "m/s^2"),
        (converted.gyro.correction, converted.values[GYRO_BIAS], converted.gyro_units, "rad/s"),
    )
    texts = ImuTk(*(_format_triad(calibration, *sensor) for sensor in sensors))
    if path is not None:
        with ExitStack() as stack:
            for text, suffix in zip(texts, _SUFFIXES, strict=True):
                temporary = stack.enter_context(atomic_path(f"{os.fspath(path)}{suffix}", force))
                Path(temporary).write_text(text, encoding="utf-8", newline="\n")
    return texts


def _format_triad(
    calibration: Calibration, correction: Floats, bias: Floats, units: tuple[str, str], si: str
) -> str:
    """Return the numbers of one sensor, then remarks, which imu_tk does not read."""
    si_correction = correction * convert(1.0, units[1], si)
    scale = np.diagonal(si_correction)
    rows = [*(si_correction / scale), [], *np.diag(scale), [], *bias[:, np.newaxis], []]
    raw = units[0] if units[0] in UNITS else "their own unit"
    remarks = _header_lines(calibration, "imu_tk: misalignment T, scale K and bias, in this order.")
    usage = f"# corrected = T K (raw - bias): raw samples in {raw}, corrected ones in {si}."
    remarks = (*remarks, usage)
    if si == "rad/s" and calibration.values[G_SENSITIVITY].any():
        largest = np.abs(calibration.values[G_SENSITIVITY]).max()
        remarks += (
            f"# g-sensitivity cannot be stored here: up to {shorten(largest, 3)} {raw} a g is "
            f"left.",
        )
    return "\n".join((*(" ".join(map(_format_number, row)) for row in rows), *remarks)) + "\n"


@_writes(".params")
def to_px4(
    calibration: Calibration,
    path: str | os.PathLike[str] | None = None,
    *,
    instance: int = 0,
    doubtful: bool = False,
    force: bool = False,
) -> str:
    """Return offsets and scales as parameters of PX4, in the format of QGroundControl.

    Parameters
    ----------
    instance : int
        Number in the parameters' names: 0 for ``CAL_ACC0_XOFF``.

    Returns
    -------
    str
        ``CAL_ACC`` and ``CAL_GYRO``. PX4 corrects an accelerometer by (raw - offset) scale and a
        gyro by raw - offset, axis by axis in the sensor's own axes. The format has no misalignment,
        gyro scale or g-sensitivity: comments state the sizes of these errors. The frame is
        "symmetric", which minimises them. With a temperature model, ``TC_G0`` has the gyro's bias,
        and the gyro's offsets are zero.
    """
    _check_valid(calibration, doubtful)
    converted, names = _convert_to_si(calibration.to_frame("symmetric"), "PX4"), _PX4_NAMES
    lines = [
        *_header_lines(calibration, "PX4: offsets and scales of raw sensor_accel and sensor_gyro."),
        *_describe_remainder(converted),
        f"# PX4 uses them for the sensors in CAL_ACC{instance}_ID and CAL_GYRO{instance}_ID.",
        "# Vehicle-Id Component-Id Name Value Type",
        *(
            f"1\t1\t{name.format(instance)}\t{_format_number(value)}\t9"
            for name, value in _offsets_and_scales(converted, names)
        ),
    ]
    model = _significant_model(calibration)
    if model is not None:
        lines += [
            "# These include the whole bias of the gyro:",
            model.to_px4(instance=instance).rstrip(),
        ]
    return write_text("\n".join(lines) + "\n", path, force)


@_writes(".param")
def to_ardupilot(
    calibration: Calibration,
    path: str | os.PathLike[str] | None = None,
    *,
    instance: int = 1,
    doubtful: bool = False,
    force: bool = False,
) -> str:
    """Return offsets and scales as parameters of ArduPilot.

    Parameters
    ----------
    instance : int
        Number of the IMU: 1 for ``INS_ACCOFFS_X``, 2 for ``INS_ACC2OFFS_X``.

    Returns
    -------
    str
        ``INS_ACCOFFS``, ``INS_ACCSCAL`` and ``INS_GYROFFS``. `to_px4` describes the correction and
        the remaining errors. With a temperature model, ``INS_TCAL1`` is added. By default ArduPilot
        learns new gyro offsets at every start.
    """
    _check_valid(calibration, doubtful)
    converted, names = (
        _convert_to_si(calibration.to_frame("symmetric"), "ArduPilot"),
        _ARDUPILOT_NAMES,
    )
    number = "" if instance == 1 else instance
    model = _significant_model(calibration)
    lines = [
        *_header_lines(calibration, "ArduPilot: offsets and scales of accelerometer and gyro."),
        *_describe_remainder(converted),
        *(
            f"{name.format(number)},{_format_number(value)}"
            for name, value in _offsets_and_scales(converted, names if model is None else names[:2])
        ),
    ]
    if model is not None:
        lines.append(model.to_ardupilot(instance=instance).rstrip())
    return write_text("\n".join(lines) + "\n", path, force)


_PX4_NAMES: Final = ("CAL_ACC{{}}_{}OFF", "CAL_ACC{{}}_{}SCALE", "CAL_GYRO{{}}_{}OFF")
_ARDUPILOT_NAMES: Final = ("INS_ACC{{}}OFFS_{}", "INS_ACC{{}}SCAL_{}", "INS_GYR{{}}OFFS_{}")
"""Names of three parameters: accelerometer offset, accelerometer scale and gyro offset."""


def _offsets_and_scales(
    calibration: Calibration, names: Sequence[str]
) -> Iterator[tuple[str, float]]:
    """Yield the best offset and scale of each axis, as in (raw - offset) scale."""
    zero = calibration.values[GYRO_BIAS] * (_significant_model(calibration) is None)
    scale = np.diagonal(calibration.accel.correction)
    for name, values in zip(names, (calibration.values[ACCEL_BIAS], scale, zero), strict=False):
        yield from zip(map(name.format, _AXES), values.tolist(), strict=True)


def _describe_remainder(calibration: Calibration) -> Iterator[str]:
    """Yield sentences on the errors that offsets and scales leave."""
    accel = calibration.accel.correction
    cross = 1e3 * np.abs(accel - np.diag(np.diagonal(accel))).max()
    yield f"# Left: misalignment of the accelerometer, up to {shorten(cross)} mrad,"
    rest = 100.0 * np.abs(calibration.values[GYRO_MATRIX].reshape(3, 3) - np.eye(3)).max()
    force = convert(float(np.abs(calibration.values[G_SENSITIVITY]).max()), "rad/s", "deg/s")
    yield f"# scale and misalignment of the gyro, up to {shorten(rest)} % of a rate,"
    yield f"# its g-sensitivity, up to {shorten(force)} deg/s a g."


def _convert_to_si(calibration: Calibration, program: str) -> Calibration:
    for sensor, unit in (
        ("accelerometer", calibration.accel_units[0]),
        ("gyro", calibration.gyro_units[0]),
    ):
        if unit not in UNITS:
            raise ValueError(
                make_sentence(
                    f"{program} takes samples in rad/s and m/s^2, and the unit of the {sensor} is "
                    "not known: give ",
                    keyword_argument("unit"),
                    " or ",
                    keyword_argument("scale"),
                    " where the log is read",
                )
            )
    return calibration.in_units(gyro="rad/s", accel="m/s^2")


def _check_valid(calibration: Calibration, doubtful: bool) -> None:
    """Raise ValueError, with advice for another record, if the calibration is doubtful."""
    if calibration.valid or doubtful:
        return
    advice = "; ".join(calibration.advice) or "rests in a dozen poses, and rotations between them"
    raise ValueError(
        make_sentence(
            f"the calibration is not valid, {calibration.problems[0]}: record {advice}; ",
            keyword_argument("doubtful", "", "doubtful=True"),
            " writes it with this warning",
        )
    )


def _significant_model(calibration: Calibration) -> TemperatureModel | None:
    """Return the temperature model if the record shows that the bias depends on temperature."""
    model = calibration.temperature_model
    return model if model is not None and any(model.degrees) else None


def _header_lines(calibration: Calibration, title: str) -> tuple[str, ...]:
    """Return the first lines of a file: its content and its validity."""
    lines = [f"# {title}"]
    if not calibration.valid:
        lines.append(f"# WARNING, NOT VALID: {calibration.problems[0]}")
    if calibration.temperature_model is not None and _significant_model(calibration) is None:
        lines.append("# The record does not show that the bias depends on temperature.")
    unknown = [
        name for name, known in zip(PARAMETERS, calibration.identifiable, strict=True) if not known
    ]
    if unknown:
        lines.append(f"# Not determined by the record: {', '.join(unknown)}")
    return tuple(lines)


def _format_yaml(name: str, matrix: Floats) -> Iterator[str]:
    yield f"    {name}:"
    yield from (f"    - {_format_row(row)}" for row in matrix)


def _format_row(row: Floats) -> str:
    return f"[{', '.join(map(_format_number, row))}]"


def _format_number(value: float) -> str:
    return repr(float(value))
