"""Files of temperature models: JSON, and parameters of PX4 and ArduPilot."""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from zerorate.calibration.temperature.fit import KELVINS_PER_UNIT
from zerorate.faults import ArgumentError, keyword_argument, make_sentence
from zerorate.noise.coefficient import UNKNOWN_COEFFICIENT, Coefficient
from zerorate.noise.exports import write_text
from zerorate.noise.json_text import decode_coefficient, encode_coefficient
from zerorate.record.exporting import document_export
from zerorate.record.saved import (
    as_json,
    check_format,
    finite_numbers,
    is_null,
    parse_key,
    parse_sentences,
    restore,
)
from zerorate.types import Floats
from zerorate.units import UNITS, convert

if TYPE_CHECKING:
    from zerorate.calibration.temperature import TemperatureModel

Model = TypeVar("Model", bound="TemperatureModel")

_FORMAT: Final = "zerorate temperature model"
_VERSION: Final = 1
_MODEL: Final = (
    "bias = sum of c_k ((T - reference) / 10)^k, T in degC inside the range; beyond it the "
    "tangent, for at most one more span"
)

_ARDUPILOT_REFERENCE_DEGC: Final = 35.0
"""Reference temperature, degC (TEMP_REFERENCE in AP_InertialSensor_tempcal.cpp)."""

_ARDUPILOT_SCALE: Final = 1e6
_AXES: Final = "XYZ"
_DOUBTFUL_TEXT: Final = """\
doubtful : bool
    Write a model without any slope, with a warning in the file; default False."""
_NO_DEPENDENCE_TEXT: Final = "the record does not show that the bias depends on temperature"


@document_export()
def to_json(
    model: TemperatureModel, path: str | os.PathLike[str] | None = None, *, force: bool = False
) -> str:
    """Return the model as JSON, for `TemperatureModel.from_json` and for any other program.

    Returns
    -------
    str
        Text with coefficients, covariance, reference, range, slopes and notes, without loss of
        digits. The block means of the fit are not included.
    """
    content = {
        "format": _FORMAT,
        "version": _VERSION,
        "model": _MODEL,
        "unit": model.unit,
        "single": model.single,
        "reference": model.reference,
        "range": model.range,
        "time_correlation": model.time_correlation,
        "step": model.step,
        "axes": [_axis_content(model, i) for i in range(model.axes)],
        "notes": model.notes,
    }
    return write_text(as_json(content), path, force)


def _axis_content(model: TemperatureModel, i: int) -> dict[str, Any]:
    return {
        "name": model.names[i],
        "degree": model.degrees[i],
        "coefficients": model.coefficients[i],
        "covariance": model.covariance[i],
        "slope": _encode_coefficient(model.slopes[i]),
        "hysteresis": _encode_coefficient(model.hystereses[i]),
    }


def _encode_coefficient(coefficient: Coefficient) -> dict[str, Any] | None:
    return encode_coefficient(coefficient) if coefficient.known else None


def from_json(source: str | os.PathLike[str], build: type[Model]) -> Model:
    """Return the model from a text or a file, as an instance of a class."""
    return restore(source, _FORMAT, lambda content: build(**_parse_arguments(content)))


def _parse_arguments(content: object) -> dict[str, Any]:
    check_format(content, _FORMAT, _VERSION)
    axes = parse_key(content, "axes", list)
    low, high = finite_numbers("range", parse_key(content, "range", list), (2,)).tolist()
    if not axes or low > high:
        raise ValueError("it needs an axis, and a range from low to high")
    single = parse_key(content, "single", bool)
    if single and len(axes) > 1:
        raise ValueError(f"'single' is true of {len(axes)} axes")
    degrees = tuple(parse_key(axis, "degree", int) for axis in axes)
    if not all(0 <= degree <= 3 for degree in degrees):
        raise ArgumentError("degrees", f"must be 0 to 3, got {degrees}")
    return {
        "coefficients": np.array([_parse_numbers(axis, "coefficients", (4,)) for axis in axes]),
        "covariance": np.array([_parse_numbers(axis, "covariance", (4, 4)) for axis in axes]),
        "degrees": degrees,
        "reference": float(parse_key(content, "reference", float)),
        "range": (low, high),
        "slopes": tuple(_decode_coefficient(axis, "slope") for axis in axes),
        "hystereses": tuple(_decode_coefficient(axis, "hysteresis") for axis in axes),
        "time_correlation": float(parse_key(content, "time_correlation", float)),
        "step": float(parse_key(content, "step", float)),
        "names": tuple(parse_key(axis, "name", str) for axis in axes),
        "unit": parse_key(content, "unit", str),
        "notes": parse_sentences(content, "notes"),
        "single": single,
    }


def _parse_numbers(axis: object, key: str, shape: tuple[int, ...]) -> Floats:
    return finite_numbers(key, parse_key(axis, key, list), shape)


def _decode_coefficient(axis: object, key: str) -> Coefficient:
    return (
        UNKNOWN_COEFFICIENT
        if is_null(axis, key)
        else decode_coefficient(parse_key(axis, key, dict))
    )


@document_export(".params", options=_DOUBTFUL_TEXT)
def to_px4(
    model: TemperatureModel,
    path: str | os.PathLike[str] | None = None,
    *,
    instance: int = 0,
    device_id: int | None = None,
    doubtful: bool = False,
    force: bool = False,
) -> str:
    """Return the model as parameters of PX4's thermal compensation, in QGroundControl's format.

    Parameters
    ----------
    instance : int
        Number in ``TC_G0_X0_0``, 0 to 3. Default 0.
    device_id : int, optional
        ``TC_G0_ID``, the gyro's ``device_id`` in its messages. Default: the line is left out. PX4
        ignores the other parameters until ``TC_G0_ID`` is set.

    Returns
    -------
    str
        ``TC_G0_X3_0`` to ``TC_G0_X0_2``, rad/s per power of T - ``TC_G0_TREF``, and the range. PX4
        subtracts ``X0 + X1 dT + X2 dT^2 + X3 dT^3`` and limits T to the range. `predict` instead
        continues along the tangent.

    Raises
    ------
    ValueError
        If the record shows no dependence of the bias on temperature and `doubtful` is False. If the
        model does not have three axes, its unit is not an angular rate, or PX4 has no such
        `instance`.
    """
    if instance not in range(4):
        raise ArgumentError("instance", f"must be 0 to 3, got {instance!r}")
    c = _per_kelvin(_convert_to_radians(model, "PX4", doubtful))
    low, high = model.range
    named = [("ENABLE", "TC_G_ENABLE", 1), ("ID", f"TC_G{instance}_ID", device_id)]
    whole = [f"1\t1\t{name}\t{value}\t6" for _, name, value in named if value is not None]
    numbers = [(f"X{k}_{axis}", c[axis, k]) for k in (3, 2, 1, 0) for axis in range(3)] + [
        ("TREF", model.reference),
        ("TMIN", low),
        ("TMAX", high),
    ]
    lines = [
        "# PX4: thermal compensation of a gyro, rad/s and degC.",
        *(() if device_id is not None else (f"# TC_G{instance}_ID must be set, too.",)),
        *_range_comments(model),
        "# Vehicle-Id Component-Id Name Value Type",
        *whole,
        *(f"1\t1\tTC_G{instance}_{name}\t{_format_number(value)}\t9" for name, value in numbers),
    ]
    return write_text("\n".join(lines) + "\n", path, force)


@document_export(".param", options=_DOUBTFUL_TEXT)
def to_ardupilot(
    model: TemperatureModel,
    path: str | os.PathLike[str] | None = None,
    *,
    instance: int = 1,
    doubtful: bool = False,
    force: bool = False,
) -> str:
    """Return the model as parameters of ArduPilot's temperature calibration.

    Parameters
    ----------
    instance : int
        Number of the IMU in ``INS_TCAL1_GYR1_X``, 1 to 3. Default 1.

    Returns
    -------
    str
        ``INS_TCAL1_GYR1_X`` to ``INS_TCAL1_GYR3_Z``, millionths of rad/s per power of T - 35 degC;
        the range; and the offsets with their temperature, ``INS_GYR1_CALTEMP``. ArduPilot subtracts
        the offset, and the difference of the polynomial between T and this temperature. Both
        temperatures are limited to the range. By default ArduPilot learns new offsets at every
        start.

    Raises
    ------
    ValueError
        If the record shows no dependence of the bias on temperature and `doubtful` is False. If the
        model does not have three axes, its unit is not an angular rate, or ArduPilot has no such
        `instance`.
    """
    if instance not in range(1, 4):
        raise ArgumentError("instance", f"must be 1 to 3, got {instance!r}")
    converted = _convert_to_radians(model, "ArduPilot", doubtful)
    c = _shift_reference(_per_kelvin(converted), _ARDUPILOT_REFERENCE_DEGC - converted.reference)
    low, high = model.range
    calibration, gyro = f"INS_TCAL{instance}", f"INS_GYR{instance}"
    offset = "INS_GYROFFS" if instance == 1 else f"{gyro}OFFS"
    numbers = [(f"{calibration}_TMIN", low), (f"{calibration}_TMAX", high)]
    numbers += [
        (f"{calibration}_GYR{k}_{axis}", _ARDUPILOT_SCALE * c[i, k])
        for k in (1, 2, 3)
        for i, axis in enumerate(_AXES)
    ]
    # At the model's reference temperature the bias is c_0.
    numbers += [(f"{offset}_{axis}", converted.coefficients[i, 0]) for i, axis in enumerate(_AXES)]
    lines = [
        "# ArduPilot: temperature calibration of a gyro, rad/s and degC.",
        *_range_comments(model),
        f"{calibration}_ENABLE,1",
        *(f"{name},{_format_number(value)}" for name, value in numbers),
        f"{gyro}_CALTEMP,{_format_number(model.reference)}",
    ]
    return write_text("\n".join(lines) + "\n", path, force)


def _convert_to_radians(model: TemperatureModel, program: str, doubtful: bool) -> TemperatureModel:
    if not (any(model.degrees) or doubtful):
        raise ValueError(
            make_sentence(
                f"{_NO_DEPENDENCE_TEXT}: record while the temperature changes by 15 K; ",
                keyword_argument("doubtful", "", "doubtful=True"),
                " writes the bias without a slope",
            )
        )
    if model.axes != 3:
        raise ValueError(f"{program} takes a gyro of three axes, the model has {model.axes}")
    if model.unit not in UNITS or UNITS[model.unit].kind != "rate":
        raise ValueError(
            make_sentence(
                f"{program} takes rad/s, and the unit of the model is {model.unit!r}: give ",
                keyword_argument("unit"),
                " where it is fitted",
            )
        )
    return model.scaled(convert(1.0, model.unit, "rad/s"))


def _per_kelvin(model: TemperatureModel) -> Floats:
    """Return the coefficients over powers of kelvins, shape (k, 4)."""
    return model.coefficients / KELVINS_PER_UNIT ** np.arange(4)


def _shift_reference(c: Floats, shift: float) -> Floats:
    """Return the coefficients of cubics about a shifted reference."""
    shifted = np.zeros_like(c)
    for k in range(4):
        for j in range(k + 1):
            shifted[:, j] += c[:, k] * math.comb(k, j) * shift ** (k - j)
    return shifted


def _range_comments(model: TemperatureModel) -> list[str]:
    """Return comments on the range for the reader of the file."""
    low, high = model.range
    lines = [f"# Of {low:.1f} to {high:.1f} degC; outside, the bias at the nearer end is used."]
    if not any(model.degrees):
        lines.append(f"# WARNING: {_NO_DEPENDENCE_TEXT}.")
    return lines


def _format_number(value: float) -> str:
    """Return a number with nine digits, the precision of a 32-bit float."""
    return f"{value:.8e}"
