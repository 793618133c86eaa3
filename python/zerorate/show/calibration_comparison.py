"""Two calibrations next to each other as plain text."""

import math
from typing import Final

from zerorate.calibration.comparison import CalibrationComparison, MovedParameter
from zerorate.numerals import significant, with_error
from zerorate.show.tables import bulleted
from zerorate.units import UNITS, convert

_ROW: Final = "{:31}{:>19}{:>19}{:>13}{:>7}  {}"


def format_comparison(found: CalibrationComparison) -> str:
    """Return a table of the parameters that both records determine, and the notes."""
    lines = [_ROW.format("parameter", "first", "second", "difference", "z", "").rstrip()]
    lines += [_line(found, p) for p in found.parameters if not math.isnan(p.z)]
    others = sum(math.isnan(p.z) for p in found.parameters)
    if others:
        lines.append(f"{others} parameters do not count: fixed, or not identifiable")
    if found.degrees_of_freedom:
        lines.append(
            f"all together: chi-squared {significant(found.chi_squared)}, "
            f"{found.degrees_of_freedom} degrees of freedom, probability {found.probability:.2g}"
        )
    return "\n".join((*lines, bulleted(found.notes)))


def _line(found: CalibrationComparison, p: MovedParameter) -> str:
    factor, offset, unit = _shown(p.name, found.gyro_unit, found.accel_unit)
    values = (
        with_error(factor * (c.value - offset), factor * c.sigma) for c in (p.first, p.second)
    )
    difference = significant(factor * p.difference.value)
    name = f"{p.name} [{unit}]"
    told = "moved" if p.moved else ""
    return _ROW.format(name, *values, difference, f"{p.z:.1f}", told).rstrip()


def _shown(name: str, gyro_unit: str, accel_unit: str) -> tuple[float, float, str]:
    """Return what a parameter is multiplied by, less an offset, to be in a unit, and the unit."""
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
