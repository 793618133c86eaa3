"""A calibration as plain text: whether it is valid, every number with its error, and advice."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from zerorate.noise.coefficient import Coefficient
from zerorate.numerals import NOTHING, significant, with_error
from zerorate.record.recording import notes_on
from zerorate.show.tables import Table, as_text, bulleted
from zerorate.units import UNITS, convert

if TYPE_CHECKING:
    from zerorate.calibration.calibration import Calibration, SensorCalibration
    from zerorate.calibration.record import Rest, Turn
    from zerorate.tasks.calibrate import Corrected

Row = tuple[str, ...]

_AXES: Final = ("x", "y", "z")
_UNKNOWN: Final = "not identifiable"
_MOST: Final = 12
"""Rests and turns that are listed one by one."""

_FRAMES: Final = {
    "x": "x is that of the accelerometer, y lies in its x-y plane",
    "z": "z is that of the accelerometer, y lies in its y-z plane",
    "symmetric": "as near to all three of the accelerometer as can be",
}


def verdict(calibration: Calibration) -> str:
    """Return whether a calibration is valid, and if not why, in one sentence."""
    if calibration.valid:
        return "the calibration is valid"
    first, *more = calibration.problems
    others = f" (and {len(more)} more)" if more else ""
    return f"the calibration is not valid: {first}{others}"


def format_calibration(calibration: Calibration) -> str:
    """Return the tables of a calibration, at most `WIDTH` columns wide.

    First whether it is valid, then what is wrong before any number, each sensor, the rotation
    between them, errors before and after, rests and turns, advice.
    """
    return "\n\n".join(filter(None, _parts(calibration)))


def _parts(calibration: Calibration) -> Iterator[str]:
    yield "Calibration: valid" if calibration.valid else "Calibration: NOT VALID"
    yield bulleted(calibration.problems)
    for table in (_accel, _gyro, _rotation, _errors):
        yield as_text(table(calibration))
    if calibration.temperature_model is not None:
        yield str(calibration.temperature_model)
    yield _material(calibration)
    for title, sentences in (("Advice", calibration.advice), ("Notes", calibration.notes)):
        if sentences:
            yield f"{title}\n{bulleted(sentences)}"
    if calibration.recording is not None and (notes := notes_on(calibration.recording)):
        yield f"Log\n{bulleted(notes)}"


def format_corrected(found: Corrected) -> str:
    """Return what was corrected, and by which calibration."""
    return bulleted(found.notes)


def _accel(calibration: Calibration) -> Table:
    sensor = calibration.accel
    rows = (
        *_scale_and_bias(sensor, "m/s^2", "mg"),
        *_misalignment(sensor),
    )
    return Table(f"Accelerometer{_raw(sensor)}", ("", "", *_AXES), rows, words=2, blocks=True)


def _gyro(calibration: Calibration) -> Table:
    sensor = calibration.gyro
    rows = (*_scale_and_bias(sensor, "rad/s", "deg/s"), *_misalignment(sensor))
    note = ""
    if any(one.value or one.sigma for row in sensor.g_sensitivity for one in row):
        rows += tuple(_sensitivity(sensor))
        note = "g-sensitivity of an axis: what it reads under 1 g along x, y and z"
    return Table(f"Gyro{_raw(sensor)}", ("", "", *_AXES), rows, words=2, note=note, blocks=True)


def _sensitivity(sensor: SensorCalibration) -> Iterator[Row]:
    for i, row in enumerate(sensor.g_sensitivity):
        label = f"g-sensitivity of {_AXES[i]}"
        yield _row(label, "deg/s/g", _shown(sensor, row, i, "rad/s", "deg/s"))


def _raw(sensor: SensorCalibration) -> str:
    known = sensor.raw_unit in UNITS
    return f", raw in {sensor.raw_unit}" if known else ", raw unit not known"


def _scale_and_bias(sensor: SensorCalibration, si: str, shown: str) -> Iterator[Row]:
    if sensor.raw_unit in UNITS:
        yield _row("scale error", "%", [_times(one, 100.0, 1.0) for one in sensor.scale])
    else:
        yield _row("scale", f"raw per {si}", sensor.scale)
    bias = [one for i in range(3) for one in _shown(sensor, (sensor.bias[i],), i, si, shown)]
    yield _row("bias", shown, bias)


def _shown(
    sensor: SensorCalibration, known: Sequence[Coefficient], axis: int, si: str, unit: str
) -> list[Coefficient]:
    """Return numbers in the raw unit of an axis in another unit."""
    if sensor.raw_unit in UNITS:
        factor = convert(1.0, sensor.raw_unit, unit)
    else:
        factor = convert(1.0, si, unit) / abs(sensor.scale[axis])
    return [_times(one, factor) for one in known]


def _times(known: Coefficient, factor: float, less: float = 0.0) -> Coefficient:
    """Return a number less an offset in another unit; a bound of one sign means nothing here."""
    value, sigma = factor * (known.value - less), factor * known.sigma
    if known.identifiable:
        return Coefficient(value, sigma)
    return Coefficient(value, sigma, False, math.inf)


def _misalignment(sensor: SensorCalibration) -> Iterator[Row]:
    for i, row in enumerate(sensor.misalignment):
        # An axis that leans by more than half a right angle is another axis.
        leans = max(map(abs, row)) > 1.0
        cells = [NOTHING if leans else _cell(_times(one, 1e3)) for one in row]
        cells[i] = ""
        yield f"misalignment of {_AXES[i]}", "mrad", *cells


def _row(label: str, unit: str, known: Sequence[Coefficient]) -> Row:
    return label, unit, *map(_cell, known)


def _cell(known: Coefficient) -> str:
    if not known.identifiable:
        return _UNKNOWN
    # What the frame or the caller fixed has no error.
    return with_error(known.value, known.sigma) if known.sigma or known.value else "0"


def _rotation(calibration: Calibration) -> Table:
    degrees = math.degrees(1.0)
    row = _row(
        "gyro to accelerometer", "deg", [_times(c, degrees) for c in calibration.gyro_to_accel]
    )
    note = f"axes of the body: {_FRAMES[calibration.frame]} (frame '{calibration.frame}')"
    return Table(
        "Rotation between the sensors", ("", "", *_AXES), (row,), words=2, note=note, blocks=True
    )


def _errors(calibration: Calibration) -> Table:
    norm = (calibration.norm_error_raw, calibration.norm_error)
    carry = (calibration.carry_error_raw, calibration.carry_error)
    rows = (
        ("norm of gravity at rest", "mg", *(_number(1e3 * one) for one in norm)),
        ("gravity carried through a turn", "deg", *(_number(math.degrees(one)) for one in carry)),
    )
    seen = "had not seen" if calibration.held_out else "used"
    note = f"RMS; after calibration over rests and turns that the fit {seen}"
    if not calibration.valid:
        note += "; of a calibration that is not valid these numbers mean nothing"
    return Table("Errors", ("", "", "before", "after"), rows, words=2, note=note)


def _number(value: float) -> str:
    return significant(value) if math.isfinite(value) else NOTHING


def _material(calibration: Calibration) -> str:
    """Return what the calibration was made of, and what was left out or is odd, with reasons."""
    told = [
        _counted("rest", calibration.rests),
        _counted("turn", calibration.turns),
    ]
    remarked = sorted(
        [("rest", i, one) for i, one in enumerate(calibration.rests) if one.reason]
        + [("turn", i, one) for i, one in enumerate(calibration.turns) if one.reason],
        key=lambda row: row[2].start,
    )
    rows = tuple(
        (
            f"{kind} {i + 1}",
            f"{one.start:.1f} to {one.stop:.1f} s",
            "used" if one.used else "not used",
            one.reason,
        )
        for kind, i, one in remarked[:_MOST]
    )
    more = len(remarked) - len(rows)
    note = f"and {more} more" if more > 0 else ""
    title = f"Made of {' and '.join(told)}"
    if calibration.origin.source:
        title += f", {calibration.origin.source}"
    return as_text(Table(title, (), rows, words=4, note=note))


def _counted(name: str, many: Sequence[Rest] | Sequence[Turn]) -> str:
    used, there = sum(one.used for one in many), len(many)
    plural = "" if there == 1 else "s"
    return f"{there} {name}{plural}" + ("" if used == there else f" ({used} used)")
