"""Lossless JSON of calibrations."""

from __future__ import annotations

import json
import math
import os
from typing import TYPE_CHECKING, Any, Final, TypeVar, get_args

import numpy as np

from zerorate.calibration.parameters import PARAMETERS, Frame
from zerorate.calibration.record import Origin, Rest, Turn
from zerorate.noise.exports import write_text
from zerorate.record.exporting import document_export
from zerorate.record.saved import (
    as_json,
    check_format,
    fields_of,
    finite_numbers,
    from_fields,
    is_null,
    parse_key,
    parse_number,
    parse_sentences,
    restore,
)
from zerorate.types import Booleans, Floats

if TYPE_CHECKING:
    from zerorate.calibration.calibration import Calibration

CalibrationType = TypeVar("CalibrationType", bound="Calibration")

_FORMAT: Final = "zerorate calibration"
_VERSION: Final = 1
_ERROR_NAMES: Final = ("norm_error", "norm_error_raw", "carry_error", "carry_error_raw")
_SENTENCE_NAMES: Final = ("problems", "advice", "notes")
_MAX_ROUNDING: Final = 1e-9
"""Largest asymmetry or negative part of a covariance, as a share of the larger variance."""


@document_export()
def to_json(
    calibration: Calibration, path: str | os.PathLike[str] | None = None, *, force: bool = False
) -> str:
    """Return the calibration as JSON, for `Calibration.from_json` and for any other program.

    Returns
    -------
    str
        Text with value and standard error of each parameter, and a flag that is true if the record
        determines it. The text also has covariance, rests, rotations, errors, problems and advice.
        No digit is lost, and unknown numbers are null. ``model`` says in words how to apply the
        parameters.
    """
    model = calibration.temperature_model
    content = {
        "format": _FORMAT,
        "version": _VERSION,
        "model": _MODEL,
        "valid": calibration.valid,
        "problems": calibration.problems,
        "advice": calibration.advice,
        "notes": calibration.notes,
        "units": {
            "accel": dict(zip(("raw", "corrected"), calibration.accel_units, strict=True)),
            "gyro": dict(zip(("raw", "corrected"), calibration.gyro_units, strict=True)),
        },
        "origin": vars(calibration.origin),
        "frame": calibration.frame,
        "gravity": calibration.gravity,
        "rate": calibration.rate,
        "temperature": calibration.temperature,
        "errors": {
            **{name: getattr(calibration, name) for name in _ERROR_NAMES},
            "held_out": calibration.held_out,
        },
        "parameters": _encode_parameters(calibration),
        "covariance": calibration.covariance,
        "rests": [fields_of(rest) for rest in calibration.rests],
        "turns": [fields_of(turn) for turn in calibration.turns],
        "temperature_model": None if model is None else json.loads(model.to_json()),
    }
    return write_text(as_json(content, indent=None), path, force)


_MODEL: Final = (
    "raw_accel = A f + b_a; raw_gyro = W w + b_g + G f, in the last term with f in g (9.80665 "
    "m/s^2). A: accel.matrix, W: gyro.matrix, G: gyro.g_sensitivity, element ij in row i."
)


def _encode_parameters(calibration: Calibration) -> dict[str, dict[str, Any]]:
    sigmas = np.sqrt(np.diagonal(calibration.covariance))
    known = zip(PARAMETERS, calibration.values, sigmas, calibration.identifiable, strict=True)
    return {
        name: {"value": value, "sigma": sigma, "identifiable": bool(identifiable)}
        for name, value, sigma, identifiable in known
    }


def from_json(source: str | os.PathLike[str], build: type[CalibrationType]) -> CalibrationType:
    """Return the calibration from a text or a file, as an instance of a class."""
    return restore(source, _FORMAT, lambda content: build(**_parse_arguments(content)))


def _parse_arguments(content: object) -> dict[str, Any]:
    check_format(content, _FORMAT, _VERSION, "calibrate again from the log")
    frame = parse_key(content, "frame", str)
    if frame not in get_args(Frame):
        raise ValueError(f"frame is {frame!r}, expected one of {', '.join(get_args(Frame))}")
    units, errors = (parse_key(content, name, dict) for name in ("units", "errors"))
    values, identifiable = _parse_estimates(parse_key(content, "parameters", dict))
    rests = tuple(from_fields(entry, Rest) for entry in parse_key(content, "rests", list))
    turns = tuple(from_fields(entry, Turn) for entry in parse_key(content, "turns", list))
    for turn in turns:
        if not all(0 <= index < len(rests) for index in turn.rests):
            raise ValueError(f"a turn lies between rests {turn.rests}, of which not both are there")
    return {
        "values": values,
        "covariance": _parse_covariance(parse_key(content, "covariance", list)),
        "identifiable": identifiable,
        "accel_units": _parse_units(units, "accel"),
        "gyro_units": _parse_units(units, "gyro"),
        "gravity": _parse_positive(content, "gravity"),
        "rate": _parse_positive(content, "rate"),
        "frame": frame,
        "rests": rests,
        "turns": turns,
        **{name: parse_number(errors, name) for name in _ERROR_NAMES},
        "held_out": parse_key(errors, "held_out", bool),
        **{name: parse_sentences(content, name) for name in _SENTENCE_NAMES},
        "temperature": None
        if is_null(content, "temperature")
        else parse_key(content, "temperature", float),
        "temperature_model": _parse_temperature_model(content),
        "origin": from_fields(parse_key(content, "origin", dict), Origin),
    }


def _parse_temperature_model(content: object) -> Any:  # noqa: ANN401
    if is_null(content, "temperature_model"):
        return None
    from zerorate.calibration.temperature import TemperatureModel

    return TemperatureModel.from_json(json.dumps(parse_key(content, "temperature_model", dict)))


def _parse_estimates(parameters: dict[str, Any]) -> tuple[Floats, Booleans]:
    entries = [parse_key(parameters, name, dict) for name in PARAMETERS]
    values = np.array([parse_key(entry, "value", float) for entry in entries], dtype=np.float64)
    return values, np.array([parse_key(entry, "identifiable", bool) for entry in entries])


def _parse_covariance(rows: list[Any]) -> Floats:
    size = len(PARAMETERS)
    covariance = finite_numbers("covariance", rows, (size, size))
    limits = np.sqrt(np.outer(np.diagonal(covariance), np.diagonal(covariance)).clip(min=0.0))
    if (
        (np.diagonal(covariance) < 0.0).any()
        or (np.abs(covariance) > limits * (1.0 + _MAX_ROUNDING)).any()
        or not np.allclose(covariance, covariance.T, rtol=_MAX_ROUNDING, atol=0.0)
    ):
        raise ValueError("'covariance' is not that of any numbers")
    return covariance


def _parse_units(units: object, sensor: str) -> tuple[str, str]:
    pair = parse_key(units, sensor, dict)
    return parse_key(pair, "raw", str), parse_key(pair, "corrected", str)


def _parse_positive(content: object, name: str) -> float:
    value = float(parse_key(content, name, float))
    if not 0.0 < value < math.inf:
        raise ValueError(f"{name!r} must be a positive number, got {value}")
    return value
