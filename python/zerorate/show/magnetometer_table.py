"""Magnetometer calibration as plain text."""

from collections.abc import Iterator

import numpy as np

from zerorate.calibration.magnetometer import MagnetometerCalibration
from zerorate.noise.coefficient import Coefficient
from zerorate.numerals import format_significant, format_with_error
from zerorate.show.tables import bullet_list
from zerorate.units import UNITS

_RAD_PER_DEG = UNITS["deg/s"].amount / UNITS["rad/s"].amount


def format_magnetometer(calibration: MagnetometerCalibration) -> str:
    """Return the correction, the parameters with errors, the spans, and advice."""
    return "\n".join(
        (
            *_format_numbers(calibration),
            *_format_spans(calibration),
            *_format_sentences(calibration),
        )
    )


def _format_numbers(calibration: MagnetometerCalibration) -> Iterator[str]:
    unit = calibration.unit
    yield f"applied      {'nothing' if calibration.model == 'none' else calibration.model}"
    if len(calibration.groups) > 1:
        yield "             hard iron below: of the longest spans"
    for axis, coefficient in zip("xyz", calibration.hard_iron, strict=True):
        yield f"hard iron {axis}  {_format_coefficient(coefficient, unit)}"
    if calibration.model.startswith("b+"):
        for name, row in zip("xyz", calibration.soft_iron, strict=True):
            yield f"soft iron {name}  " + "  ".join(
                _format_coefficient(coefficient) for coefficient in row
            )
    yield f"field        {_format_coefficient(calibration.field, unit)}"
    degrees = Coefficient(
        calibration.dip / _RAD_PER_DEG,
        calibration.dip.sigma / _RAD_PER_DEG,
        calibration.dip.identifiable,
        calibration.dip.upper_bound / _RAD_PER_DEG,
    )
    yield f"dip          {_format_coefficient(degrees, 'deg')}"
    if calibration.field.known and calibration.dip.known:
        before, after = (
            float(
                np.sqrt(np.mean(calibration.heading_error(raw, calibration.longest_applied) ** 2))
            )
            / _RAD_PER_DEG
            for raw in (True, False)
        )
        heading_text = f"{format_significant(before)} deg uncorrected"
        if calibration.applied:
            heading_text += f", {format_significant(after)} deg corrected"
        yield f"heading      expected error {heading_text}"


def _format_spans(calibration: MagnetometerCalibration) -> Iterator[str]:
    for span in calibration.spans:
        group = calibration.groups[span.group]
        iron = ", ".join(f"{b:.1f}" for b in group.hard_iron)
        state = f"hard iron ({iron}) subtracted" if group.applied else "as it was"
        yield f"{span.start:8.1f} to {span.stop:.1f} s  {span.kind}, {state}"


def _format_sentences(calibration: MagnetometerCalibration) -> Iterator[str]:
    yield from bullet_list(
        (*calibration.problems, *calibration.advice, *calibration.notes)
    ).splitlines()


def _format_coefficient(coefficient: Coefficient, unit: str = "") -> str:
    if not coefficient.identifiable:
        return "not identifiable"
    return f"{format_with_error(coefficient.value, coefficient.sigma)} {unit}".rstrip()
