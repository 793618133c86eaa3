"""Two calibrations next to each other as plain text."""

import math
from typing import Final

from zerorate.calibration.comparison import CalibrationComparison, MovedParameter
from zerorate.numerals import format_significant, format_with_error
from zerorate.show.tables import bullet_list
from zerorate.units import UNITS, convert

_ROW_FORMAT: Final = "{:31}{:>19}{:>19}{:>13}{:>7}  {}"


def format_comparison(comparison: CalibrationComparison) -> str:
    """Return a table of the parameters that both records determine, with the notes."""
    lines = [_ROW_FORMAT.format("parameter", "first", "second", "difference", "z", "").rstrip()]
    lines += [_format_row(comparison, p) for p in comparison.parameters if not math.isnan(p.z)]
    excluded = sum(math.isnan(p.z) for p in comparison.parameters)
    if excluded:
        lines.append(f"{excluded} parameters do not count: fixed, or not identifiable")
    if comparison.degrees_of_freedom:
        lines.append(
            f"all together: chi-squared {format_significant(comparison.chi_squared)}, "
            f"{comparison.degrees_of_freedom} degrees of freedom, probability "
            f"{comparison.probability:.2g}"
        )
    return "\n".join((*lines, bullet_list(comparison.notes)))


def _format_row(comparison: CalibrationComparison, p: MovedParameter) -> str:
    factor, offset, unit = _choose_unit(p.name, comparison.gyro_unit, comparison.accel_unit)
    values = (
        format_with_error(factor * (c.value - offset), factor * c.sigma)
        for c in (p.first, p.second)
    )
    difference = format_significant(factor * p.difference.value)
    name = f"{p.name} [{unit}]"
    verdict = "moved" if p.moved else ""
    return _ROW_FORMAT.format(name, *values, difference, f"{p.z:.1f}", verdict).rstrip()


def _choose_unit(name: str, gyro_unit: str, accel_unit: str) -> tuple[float, float, str]:
    """Return a parameter's factor and offset to the shown unit, and this unit."""
    sensor, part, axes = name.split(".")
    raw = gyro_unit if sensor == "gyro" else accel_unit
    known = raw in UNITS
    if part == "matrix":
        if not known:
            return 1.0, 0.0, raw
        return (1e2, 1.0, "%") if axes[0] == axes[1] else (1e3, 0.0, "mrad")
    shown = {"gyro": "deg/s", "accel": "mg"}[sensor]
    factor = convert(1.0, raw, shown) if known else 1.0
    unit = shown if known else raw
    return factor, 0.0, f"{unit}/g" if part == "g_sensitivity" else unit
