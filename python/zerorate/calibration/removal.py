"""Correction of arrays, logs, recordings and live samples by a calibration.

`zerorate.ImuCorrector` makes all corrections, so a record and a live stream give the same bits.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, Literal, cast, overload

import numpy as np
import numpy.typing as npt

from zerorate._native import ImuCorrector
from zerorate.calibration.parameters import (
    ACCEL_BIAS,
    G_SENSITIVITY,
    GYRO_BIAS,
)
from zerorate.faults import ArgumentError
from zerorate.record import Log, LogError, Recording
from zerorate.record.missing import floats
from zerorate.record.names import UNKNOWN_UNIT, looks_like_accelerometer, looks_like_gyro
from zerorate.types import Floats
from zerorate.units import UNITS, convert

if TYPE_CHECKING:
    from zerorate.calibration.calibration import Calibration
    from zerorate.calibration.temperature import TemperatureModel

Sensor = Literal["gyro", "accel"]

_QUANTITIES: Final = {"gyro": "rate", "accel": "acceleration"}
_SENSOR_NAMES: Final = {"gyro": "a gyro", "accel": "an accelerometer"}
_INPUT_COUNTS: Final = (3, 6, 7)
_MAX_OFFSET_PERIODS: Final = 1e-3
"""Largest distance of samples on one clock, in sampling periods."""

_MAX_GAP_PERIODS: Final = 1.25
"""Largest distance to the nearest sample for interpolation, in sampling periods."""


def convert_units(calibration: Calibration, gyro: str, accel: str) -> Calibration:
    """Return a calibration for samples in other units; corrected samples have these units, too.

    Raises
    ------
    ValueError
        If a unit does not fit its sensor, or only one of the two units is known.
    """
    of_gyro = _unit_factor(calibration.gyro_units[0], gyro, "gyro")
    of_accel = _unit_factor(calibration.accel_units[0], accel, "accel")
    if of_gyro == of_accel == 1.0:
        return calibration
    factors = np.ones(33)
    factors[GYRO_BIAS] = factors[G_SENSITIVITY] = of_gyro
    factors[ACCEL_BIAS] = of_accel
    return replace(
        calibration,
        values=calibration.values * factors,
        covariance=calibration.covariance * np.outer(factors, factors),
        gyro_units=calibration.gyro_units if of_gyro == 1.0 else (gyro, gyro),
        accel_units=calibration.accel_units if of_accel == 1.0 else (accel, accel),
    )


def _unit_factor(own: str, wanted: str, sensor: Sensor) -> float:
    """Return the factor from the calibration's unit to the unit of the samples."""
    if own == wanted:
        return 1.0
    if wanted not in UNITS or own not in UNITS:
        advice = (
            "give their unit when you read them, as for the calibration"
            if own in UNITS
            else "read them as raw counts, as for the calibration, or calibrate with a unit"
        )
        raise ValueError(
            f"the calibration is of {_SENSOR_NAMES[sensor]} {_describe_unit(own)}, and "
            "these samples are "
            f"{_describe_unit(wanted)}: {advice}"
        )
    return convert(1.0, own, wanted)


def _describe_unit(unit: str) -> str:
    return f"in {unit}" if unit in UNITS else "of unknown unit"


def with_temperature(
    calibration: Calibration, model: TemperatureModel | Recording | None
) -> Calibration:
    """Return the same calibration with the gyro's bias by temperature.

    Parameters
    ----------
    model : TemperatureModel, Recording or None
        Model of three axes, in a unit of angular rate. Its prediction replaces ``gyro.bias`` if the
        temperature is known. If `model` is the calibrated recording, with a gyro, an accelerometer
        and a temperature, a model is fitted to the calibration's rests after correction of
        g-sensitivity. None removes the model.

    Raises
    ------
    ValueError
        If the model does not have three axes, or its unit does not fit the raw gyro.
    LogError
        If the recording lacks a gyro or a temperature.
    """
    if isinstance(model, Recording):
        model = _fit_temperature_model(calibration, model)
    if model is not None:
        if model.axes != 3:
            raise ValueError(f"the temperature model must be of three axes, got {model.axes}")
        _unit_factor(calibration.gyro_units[0], model.unit, "gyro")
    return replace(calibration, temperature_model=model)


def _fit_temperature_model(calibration: Calibration, recording: Recording) -> TemperatureModel:
    from zerorate.calibration.temperature import TemperatureModel

    gyro, accel, temperature = recording.gyro, recording.accel, recording.temperature
    if gyro is None or temperature is None:
        missing = "gyro" if gyro is None else "temperature"
        listed = ", ".join(recording)
        raise LogError(f"there is no {missing} to make a model of; the recording has: {listed}")
    converted = convert_units(calibration, gyro.unit, calibration.accel_units[0])
    data = _three_axis_data(gyro, "gyro")
    if accel is not None:
        converted = convert_units(converted, gyro.unit, accel.unit)
        force = _interpolate_at(
            gyro, accel, _correct_forces(converted, _three_axis_data(accel, "accel"))
        )
        sensitivity = converted.values[G_SENSITIVITY].reshape(3, 3)
        data = data - convert(np.nan_to_num(force), converted.accel.unit, "g") @ sensitivity.T
    rests = np.zeros(gyro.n, dtype=np.bool_)
    for rest in calibration.rests:
        rests[rest.first : rest.last] |= rest.used
    return TemperatureModel.fit(gyro.with_data(data), temperature, rests=rests)


@overload
def corrector(
    calibration: Calibration, *, inputs: Literal[3], channels: int | None = ...
) -> ImuCorrector[Floats]: ...
@overload
def corrector(
    calibration: Calibration, *, inputs: Literal[6, 7] = ..., channels: int | None = ...
) -> ImuCorrector[tuple[Floats, Floats]]: ...
def corrector(
    calibration: Calibration,
    *,
    inputs: Literal[3, 6, 7] = 6,
    channels: int | None = None,
) -> ImuCorrector[Floats] | ImuCorrector[tuple[Floats, Floats]]:
    """Return a stream that corrects samples one by one or in blocks.

    Parameters
    ----------
    inputs : {3, 6, 7}
        Number of values per sample. 3: gyro. 6 (default): gyro and accelerometer. 7: gyro,
        accelerometer and temperature in degC. Sensors are raw, in the units of the calibration.
    channels : int, optional
        Number of sensors with the same correction. Default: one.

    Returns
    -------
    ImuCorrector
        Stream that returns the corrected gyro, or gyro and accelerometer. Like all streams it has
        `update`, `process`, checkpoints and copies.

    Raises
    ------
    ValueError
        If `inputs` is not 3, 6 or 7.
    """
    gyro = (calibration.gyro.correction, calibration.values[GYRO_BIAS])
    if inputs == 3:
        return ImuCorrector(*gyro, inputs=3, channels=channels)
    if inputs not in _INPUT_COUNTS:
        raise ArgumentError("inputs", f"must be 3, 6 or 7, got {inputs!r}")
    accel = calibration.accel
    per_g = convert(1.0, "g", accel.unit)
    return ImuCorrector(
        *gyro,
        accel_matrix=accel.correction,
        accel_bias=calibration.values[ACCEL_BIAS],
        g_sensitivity=calibration.values[G_SENSITIVITY].reshape(3, 3) / per_g,
        temperature=_bias_curve(calibration) if inputs == 7 else None,
        inputs=inputs,
        channels=channels,
    )


def _bias_curve(calibration: Calibration) -> Any:  # noqa: ANN401
    """Return the bias by temperature for the stream, in the raw unit of the gyro."""
    model = calibration.temperature_model
    return None if model is None else _convert_model(model, calibration.gyro_units[0]).curve


def _convert_model(model: TemperatureModel, unit: str) -> TemperatureModel:
    return model if model.unit == unit else model.scaled(convert(1.0, model.unit, unit), unit)


@overload
def apply(
    calibration: Calibration, samples: Recording, *, gyro: str = ..., accel: str = ...
) -> Recording: ...
@overload
def apply(calibration: Calibration, samples: Log) -> Log: ...
@overload
def apply(calibration: Calibration, samples: npt.ArrayLike) -> Floats: ...
def apply(
    calibration: Calibration,
    samples: Recording | Log | npt.ArrayLike,
    *,
    gyro: str = "gyro",
    accel: str = "accel",
) -> Recording | Log | Floats:
    """Return samples corrected for scale, misalignment, bias and g-sensitivity.

    Parameters
    ----------
    samples : Recording, Log or array_like
        - Recording: its gyro and accelerometer are corrected, everything else stays. If their
          sample times differ, the force is interpolated at the gyro's times for the g-sensitivity.
        - Log: three channels of a gyro or of an accelerometer.
        - Array, in the units of the calibration: shape (n, 3) or (3,) for the gyro, (n, 6) or (6,)
          for gyro and accelerometer. Shape (n, 7) or (7,) has the temperature, degC, as the last
          column.
    gyro, accel : str
        Names of both logs in a recording, such as ``gyro_1`` and ``accel_1``. A missing log is
        ignored.

    Returns
    -------
    Recording, Log or ndarray
        Samples in the type of `samples` and in their unit; raw counts become rad/s and m/s^2. Notes
        of logs describe the correction, an invalid calibration, and channels that differ from the
        calibration's. For arrays, an invalid calibration gives a warning.

    Raises
    ------
    LogError
        If no sensor has three axes.
    ValueError
        If a unit does not match the calibration's unit, or an array has a wrong shape.
    TypeError
        If `samples` is a data frame, because its columns may be in another order.
    """
    if isinstance(samples, Recording):
        return _apply_to_recording(calibration, samples, gyro, accel)
    if isinstance(samples, Log):
        return _apply_to_log(calibration, samples)
    _warn_if_invalid(calibration)
    return _apply_to_array(calibration, samples)


def apply_gyro(
    calibration: Calibration,
    z: npt.ArrayLike,
    accel: npt.ArrayLike | None = None,
    temperature: npt.ArrayLike | None = None,
) -> Floats:
    """Return the true angular rate from raw samples of the gyro.

    Parameters
    ----------
    z : array_like, shape (n, 3) or (3,)
        Samples in the raw unit of the calibration.
    accel : array_like, of the same shape, optional
        Raw samples of the accelerometer, for the g-sensitivity. Default: g-sensitivity is not
        corrected.
    temperature : array_like, shape (n,) or one number, optional
        Temperature, degC, for a calibration with a temperature model. Default: the calibration's
        bias is used.

    Returns
    -------
    ndarray of float64
        Rate, shape of `z`, in the unit ``gyro.unit``.

    Raises
    ------
    ValueError
        If the shapes do not fit.
    """
    _warn_if_invalid(calibration)
    rates = _parse_vectors(z, "z")
    n = len(np.atleast_2d(rates))
    parts = [np.atleast_2d(rates)]
    if accel is not None or temperature is not None:
        parts.append(_broadcast_like("accel", np.nan if accel is None else accel, (n, 3)))
    if temperature is not None:
        parts.append(_broadcast_like("temperature", temperature, (n,))[:, np.newaxis])
    return _correct_rates(calibration, np.hstack(parts)).reshape(rates.shape)


def apply_accel(calibration: Calibration, z: npt.ArrayLike) -> Floats:
    """Return the true specific force from raw samples of the accelerometer.

    Parameters
    ----------
    z : array_like, shape (n, 3) or (3,)
        Samples in the raw unit of the calibration.

    Returns
    -------
    ndarray of float64
        Specific force, shape of `z`, in the unit ``accel.unit``.

    Raises
    ------
    ValueError
        If `z` has another shape.
    """
    _warn_if_invalid(calibration)
    forces = _parse_vectors(z, "z")
    return _correct_forces(calibration, np.atleast_2d(forces)).reshape(forces.shape)


def _parse_vectors(z: npt.ArrayLike, name: str) -> Floats:
    values = floats(z, name)
    if values.ndim not in (1, 2) or values.shape[-1] != 3:
        raise ArgumentError(name, f"must have shape (n, 3) or (3,), got {values.shape}")
    return values


def _broadcast_like(name: str, values: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
    array = floats(values, name)
    if array.ndim and array.shape != shape and array.shape != shape[1:]:
        raise ArgumentError(name, f"must have shape {shape} as the gyro, got {array.shape}")
    return np.broadcast_to(array, shape)


def _apply_to_array(calibration: Calibration, samples: npt.ArrayLike) -> Floats:
    if hasattr(samples, "columns"):
        # The order of its columns is unknown: a time in the first column would be read as a rate.
        raise TypeError(
            f"samples must be a Recording, a Log or an array, got {type(samples).__name__}; "
            "zr.read_recording reads data frames"
        )
    values = floats(samples, "samples")
    if values.ndim not in (1, 2) or values.shape[-1] not in _INPUT_COUNTS:
        raise ArgumentError(
            "samples",
            "must have shape (n, 3) of a gyro, (n, 6) of gyro and accelerometer or (n, 7) "
            f"with the temperature behind, got {values.shape}",
        )
    rows = np.atleast_2d(values)
    if rows.shape[1] == 3:
        return _correct_rates(calibration, rows).reshape(values.shape)
    both = _correct_both(calibration, rows)
    return np.hstack((*both, rows[:, 6:])).reshape(values.shape)


def _correct_rates(calibration: Calibration, rows: Floats) -> Floats:
    """Return the corrected gyro from rows of 3, 6 or 7 numbers."""
    if rows.shape[1] == 3:
        return corrector(calibration, inputs=3).process(rows)
    return _correct_both(calibration, rows)[0]


def _correct_both(calibration: Calibration, rows: Floats) -> tuple[Floats, Floats]:
    """Return the corrected gyro and accelerometer from rows of 6 or 7 numbers."""
    inputs: Literal[6, 7] = 6 if rows.shape[1] == 6 else 7
    return corrector(calibration, inputs=inputs).process(rows)


def _correct_forces(calibration: Calibration, rows: Floats) -> Floats:
    """Return the corrected accelerometer, computed in the same way as a gyro."""
    accel = calibration.accel.correction
    return ImuCorrector(accel, calibration.values[ACCEL_BIAS], inputs=3).process(rows)


def _apply_to_log(calibration: Calibration, log: Log) -> Log:
    if _identify_sensor(log) == "gyro":
        converted = convert_units(calibration, log.unit, calibration.accel_units[0])
        return _make_corrected_log(
            log,
            _correct_rates(converted, _three_axis_data(log, "gyro")),
            "gyro",
            converted,
            without_accel=True,
        )
    converted = convert_units(calibration, calibration.gyro_units[0], log.unit)
    return _make_corrected_log(
        log, _correct_forces(converted, _three_axis_data(log, "accel")), "accel", converted
    )


def _identify_sensor(log: Log) -> Sensor:
    """Return the sensor of a log, from its unit or else its names."""
    unit = UNITS.get(log.units[0])
    for sensor, kind in _QUANTITIES.items():
        if unit is not None and unit.kind == kind:
            return cast(Sensor, sensor)
    if unit is None and log.unit == UNKNOWN_UNIT:
        if all(map(looks_like_accelerometer, log.names)):
            return "accel"
        if all(map(looks_like_gyro, log.names)):
            return "gyro"
    raise LogError(
        f"neither unit ({log.unit}) nor names ({', '.join(log.names)}) show that this log is of a "
        f"gyro or of an accelerometer"
    )


def _apply_to_recording(
    calibration: Calibration, recording: Recording, gyro_name: str, accel_name: str
) -> Recording:
    gyro, accel = (recording.logs.get(name) for name in (gyro_name, accel_name))
    if gyro is None and accel is None:
        listed = ", ".join(recording)
        raise LogError(f"there is no {gyro_name} and no {accel_name}; the recording has: {listed}")
    converted = convert_units(
        calibration,
        calibration.gyro_units[0] if gyro is None else gyro.unit,
        calibration.accel_units[0] if accel is None else accel.unit,
    )
    logs = dict(recording.logs)
    if gyro is not None:
        rates = _correct_rates(
            converted, _join_inputs(gyro, accel, recording.temperature, converted)
        )
        corrected = _make_corrected_log(gyro, rates, "gyro", converted, without_accel=accel is None)
        logs[gyro_name] = _add_notes(
            corrected, _temperature_notes(converted, recording.temperature)
        )
    if accel is not None:
        logs[accel_name] = _make_corrected_log(
            accel, _correct_forces(converted, _three_axis_data(accel, "accel")), "accel", converted
        )
    return replace(recording, logs=logs)


def _join_inputs(
    gyro: Log, accel: Log | None, temperature: Log | None, calibration: Calibration
) -> Floats:
    """Return the gyro's samples with the inputs of its correction, at the gyro's times."""
    parts = [_three_axis_data(gyro, "gyro")]
    has_temperature = calibration.temperature_model is not None and temperature is not None
    if accel is not None:
        parts.append(_interpolate_at(gyro, accel, _three_axis_data(accel, "accel")))
    elif has_temperature:
        parts.append(np.full((gyro.n, 3), np.nan))
    if has_temperature and temperature is not None:
        parts.append(_interpolate_at(gyro, temperature, temperature.data[:, :1]))
    return np.hstack(parts)


def _interpolate_at(gyro: Log, log: Log, values: Floats) -> Floats:
    """Return a log's values at the times of the gyro, NaN without a sample nearby."""
    if (
        log.n == gyro.n
        and np.abs(log.sampled - gyro.sampled).max() * gyro.rate < _MAX_OFFSET_PERIODS
    ):
        return values
    finite = np.isfinite(values).all(axis=1)
    if not finite.any():
        return np.full((gyro.n, values.shape[1]), np.nan)
    time, values = log.sampled[finite], values[finite]
    interpolated = np.stack([np.interp(gyro.sampled, time, column) for column in values.T], axis=1)
    interpolated[_distance_to_nearest(gyro.sampled, time) * log.rate > _MAX_GAP_PERIODS] = np.nan
    return interpolated


def _distance_to_nearest(times: Floats, known: Floats) -> Floats:
    """Return the distance of each time to the nearest known time; known times are sorted."""
    after = np.searchsorted(known, times)
    return np.minimum(
        np.abs(times - known[np.maximum(after - 1, 0)]),
        np.abs(times - known[np.minimum(after, known.size - 1)]),
    )


def _three_axis_data(log: Log, sensor: Sensor) -> Floats:
    if log.channels != 3:
        raise LogError(
            f"a calibration needs three axes of {_SENSOR_NAMES[sensor]}, got {log.channels}: "
            f"{', '.join(log.names)}"
        )
    return log.data


def _channel_notes(log: Log, sensor: Sensor, calibration: Calibration) -> Iterator[str]:
    """Yield a sentence if the channels differ from the channels of the calibration."""
    own = calibration.origin.gyro if sensor == "gyro" else calibration.origin.accel
    if own and own != log.names:
        yield (
            f"the calibration was made of {', '.join(own)}, and is applied to "
            f"{', '.join(log.names)}: it is valid only for the same sensor"
        )


def _make_corrected_log(
    log: Log, data: Floats, sensor: Sensor, calibration: Calibration, without_accel: bool = False
) -> Log:
    """Return a log with corrected samples, and with notes on the correction."""
    unit = calibration.gyro_units[1] if sensor == "gyro" else calibration.accel_units[1]
    sentences = (*_correction_notes(calibration, sensor), *_channel_notes(log, sensor, calibration))
    corrected = _add_notes(replace(log, data=data, unit=unit), sentences)
    if without_accel and calibration.values[G_SENSITIVITY].any():
        note = "the log has no accelerometer, so the gyro's g-sensitivity is not corrected"
        return _add_notes(corrected, [note])
    return corrected


def _add_notes(log: Log, sentences: Iterable[str]) -> Log:
    """Return a log with further notes."""
    return replace(log, meta={**log.meta, "notes": (*log.meta.get("notes", ()), *sentences)})


def _temperature_notes(calibration: Calibration, temperature: Log | None) -> Iterator[str]:
    """Yield notes on the bias that was subtracted and on temperatures outside its range."""
    model = calibration.temperature_model
    if model is None:
        return
    if temperature is None:
        yield "the log has no temperature, so the calibration's bias is used"
        return
    low, high = model.range
    known = temperature.data[np.isfinite(temperature.data[:, 0]), 0]
    beyond = float(np.mean((known < low) | (known > high))) if known.size else 0.0
    yield "the bias is corrected for temperature"
    if beyond > 0.0:
        yield (
            f"{100.0 * beyond:.0f} % of the temperatures lie outside of the {low:.1f} to "
            f"{high:.1f} degC range of the model: the bias there is extrapolated"
        )


def _correction_notes(calibration: Calibration, sensor: Sensor) -> Iterator[str]:
    """Yield notes on the correction, and on reasons against it."""
    rests, turns = (sum(entry.used for entry in m) for m in (calibration.rests, calibration.turns))
    yield f"{sensor}: corrected by a calibration of {rests} rests and {turns} turns"
    if not calibration.valid:
        yield f"the calibration that was applied is not valid: {calibration.problems[0]}"


def _warn_if_invalid(calibration: Calibration) -> None:
    if not calibration.valid:
        warnings.warn(
            f"the calibration that is applied is not valid: {calibration.problems[0]}",
            stacklevel=3,
        )
