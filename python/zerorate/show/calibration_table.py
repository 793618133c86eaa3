"""Calibration as plain text: verdict, parameters with errors, and advice."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from zerorate.noise.coefficient import Coefficient
from zerorate.numerals import DASH, format_significant, format_with_error
from zerorate.record.recording import notes_on
from zerorate.show.tables import Table, as_text, bullet_list
from zerorate.units import UNITS, convert

if TYPE_CHECKING:
    from zerorate.calibration.calibration import Calibration, SensorCalibration
    from zerorate.calibration.record import Rest, Turn
    from zerorate.tasks.calibrate import Corrected

Row = tuple[str, ...]

_AXES: Final = ("x", "y", "z")
_UNKNOWN_TEXT: Final = "not identifiable"
_MAX_LISTED: Final = 12
"""Largest number of rests and rotations that are listed one by one."""

_FRAMES: Final = {
    "x": "x is that of the accelerometer, y lies in its x-y plane",
    "z": "z is that of the accelerometer, y lies in its y-z plane",
    "symmetric": "as close as possible to all three axes of the accelerometer",
}


def describe_verdict(calibration: Calibration) -> str:
    """Return the verdict on a calibration in one sentence, with the reason if it is not valid."""
    if calibration.valid:
        return "the calibration is valid"
    first, *more = calibration.problems
    others = f" (and {len(more)} more)" if more else ""
    return f"the calibration is not valid: {first}{others}"


def format_calibration(calibration: Calibration) -> str:
    """Return the tables of a calibration, at most `WIDTH` characters wide.

    The order is: verdict, problems, each sensor, the rotation between the sensors, errors before
    and after the calibration, rests and rotations, advice.
    """
    return "\n\n".join(filter(None, _format_parts(calibration)))


def _format_parts(calibration: Calibration) -> Iterator[str]:
    yield "Calibration: valid" if calibration.valid else "Calibration: NOT VALID"
    yield bullet_list(calibration.problems)
    for table in (_make_accel_table, _make_gyro_table, _make_rotation_table, _make_errors_table):
        yield as_text(table(calibration))
    if calibration.temperature_model is not None:
        yield str(calibration.temperature_model)
    yield _list_material(calibration)
    for title, sentences in (("Advice", calibration.advice), ("Notes", calibration.notes)):
        if sentences:
            yield f"{title}\n{bullet_list(sentences)}"
    if calibration.recording is not None and (notes := notes_on(calibration.recording)):
        yield f"Log\n{bullet_list(notes)}"


def format_corrected(result: Corrected) -> str:
    """Return the notes on the correction and on its calibration."""
    return bullet_list(result.notes)


def _make_accel_table(calibration: Calibration) -> Table:
    sensor = calibration.accel
    rows = (
        *_scale_and_bias_rows(sensor, "m/s^2", "mg"),
        *_misalignment_rows(sensor),
    )
    return Table(
        f"Accelerometer{_describe_unit(sensor)}", ("", "", *_AXES), rows, words=2, blocks=True
    )


def _make_gyro_table(calibration: Calibration) -> Table:
    sensor = calibration.gyro
    rows = (*_scale_and_bias_rows(sensor, "rad/s", "deg/s"), *_misalignment_rows(sensor))
    note = ""
    if any(
        coefficient.value or coefficient.sigma
        for row in sensor.g_sensitivity
        for coefficient in row
    ):
        rows += tuple(_sensitivity_rows(sensor))
        note = "g-sensitivity of an axis: its output per g along x, y and z"
    return Table(
        f"Gyro{_describe_unit(sensor)}", ("", "", *_AXES), rows, words=2, note=note, blocks=True
    )


def _sensitivity_rows(sensor: SensorCalibration) -> Iterator[Row]:
    for i, row in enumerate(sensor.g_sensitivity):
        label = f"g-sensitivity of {_AXES[i]}"
        yield _format_row(label, "deg/s/g", _convert_shown(sensor, row, i, "rad/s", "deg/s"))


def _describe_unit(sensor: SensorCalibration) -> str:
    known = sensor.raw_unit in UNITS
    return f", raw in {sensor.raw_unit}" if known else ", raw unit not known"


def _scale_and_bias_rows(sensor: SensorCalibration, si: str, shown: str) -> Iterator[Row]:
    if sensor.raw_unit in UNITS:
        yield _format_row(
            "scale error", "%", [_scale_coefficient(one, 100.0, 1.0) for one in sensor.scale]
        )
    else:
        yield _format_row("scale", f"raw per {si}", sensor.scale)
    bias = [
        one for i in range(3) for one in _convert_shown(sensor, (sensor.bias[i],), i, si, shown)
    ]
    yield _format_row("bias", shown, bias)


def _convert_shown(
    sensor: SensorCalibration, coefficients: Sequence[Coefficient], axis: int, si: str, unit: str
) -> list[Coefficient]:
    """Return numbers of an axis, converted from its raw unit to another unit."""
    if sensor.raw_unit in UNITS:
        factor = convert(1.0, sensor.raw_unit, unit)
    else:
        factor = convert(1.0, si, unit) / abs(sensor.scale[axis])
    return [_scale_coefficient(coefficient, factor) for coefficient in coefficients]


def _scale_coefficient(coefficient: Coefficient, factor: float, offset: float = 0.0) -> Coefficient:
    """Return a converted number minus an offset; a one-sided bound is not converted."""
    value, sigma = factor * (coefficient.value - offset), factor * coefficient.sigma
    if coefficient.identifiable:
        return Coefficient(value, sigma)
    return Coefficient(value, sigma, False, math.inf)


def _misalignment_rows(sensor: SensorCalibration) -> Iterator[Row]:
    for i, row in enumerate(sensor.misalignment):
        # An axis that is off by more than 45 deg is another axis.
        is_swapped = max(map(abs, row)) > 1.0
        cells = [
            DASH if is_swapped else _format_cell(_scale_coefficient(coefficient, 1e3))
            for coefficient in row
        ]
        cells[i] = ""
        yield f"misalignment of {_AXES[i]}", "mrad", *cells


def _format_row(label: str, unit: str, coefficients: Sequence[Coefficient]) -> Row:
    return label, unit, *map(_format_cell, coefficients)


def _format_cell(coefficient: Coefficient) -> str:
    if not coefficient.identifiable:
        return _UNKNOWN_TEXT
    # Values fixed by the frame or by the user have no error.
    return (
        format_with_error(coefficient.value, coefficient.sigma)
        if coefficient.sigma or coefficient.value
        else "0"
    )


def _make_rotation_table(calibration: Calibration) -> Table:
    degrees = math.degrees(1.0)
    row = _format_row(
        "gyro to accelerometer",
        "deg",
        [_scale_coefficient(c, degrees) for c in calibration.gyro_to_accel],
    )
    note = f"axes of the body: {_FRAMES[calibration.frame]} (frame '{calibration.frame}')"
    return Table(
        "Rotation between the sensors", ("", "", *_AXES), (row,), words=2, note=note, blocks=True
    )


def _make_errors_table(calibration: Calibration) -> Table:
    norm = (calibration.norm_error_raw, calibration.norm_error)
    carry = (calibration.carry_error_raw, calibration.carry_error)
    rows = (
        ("norm of gravity at rest", "mg", *(_format_number(1e3 * error) for error in norm)),
        (
            "gravity propagated through a rotation",
            "deg",
            *(_format_number(math.degrees(error)) for error in carry),
        ),
    )
    usage = "had not seen" if calibration.held_out else "used"
    note = f"RMS; after calibration over rests and turns that the fit {usage}"
    if not calibration.valid:
        note += "; these numbers mean nothing if the calibration is not valid"
    return Table("Errors", ("", "", "before", "after"), rows, words=2, note=note)


def _format_number(value: float) -> str:
    return format_significant(value) if math.isfinite(value) else DASH


def _list_material(calibration: Calibration) -> str:
    """Return the data of the calibration, and the unused or unusual data with reasons."""
    counts = [
        _count_used("rest", calibration.rests),
        _count_used("turn", calibration.turns),
    ]
    odd_segments = sorted(
        [("rest", i, segment) for i, segment in enumerate(calibration.rests) if segment.reason]
        + [("turn", i, segment) for i, segment in enumerate(calibration.turns) if segment.reason],
        key=lambda row: row[2].start,
    )
    rows = tuple(
        (
            f"{kind} {i + 1}",
            f"{segment.start:.1f} to {segment.stop:.1f} s",
            "used" if segment.used else "not used",
            segment.reason,
        )
        for kind, i, segment in odd_segments[:_MAX_LISTED]
    )
    more = len(odd_segments) - len(rows)
    note = f"and {more} more" if more > 0 else ""
    title = f"Made of {' and '.join(counts)}"
    if calibration.origin.source:
        title += f", {calibration.origin.source}"
    return as_text(Table(title, (), rows, words=4, note=note))


def _count_used(name: str, segments: Sequence[Rest] | Sequence[Turn]) -> str:
    used, total = sum(segment.used for segment in segments), len(segments)
    plural = "" if total == 1 else "s"
    return f"{total} {name}{plural}" + ("" if used == total else f" ({used} used)")
