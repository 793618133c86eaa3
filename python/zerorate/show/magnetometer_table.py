"""A magnetometer's calibration as plain text."""

from collections.abc import Iterator

import numpy as np

from zerorate.calibration.magnetometer import MagnetometerCalibration
from zerorate.noise.coefficient import Coefficient
from zerorate.numerals import significant, with_error
from zerorate.show.tables import bulleted
from zerorate.units import UNITS

_DEG = UNITS["deg/s"].amount / UNITS["rad/s"].amount


def format_magnetometer(found: MagnetometerCalibration) -> str:
    """Return what is applied, the numbers with their errors, spans and advice."""
    return "\n".join((*_numbers(found), *_spans(found), *_sentences(found)))


def _numbers(found: MagnetometerCalibration) -> Iterator[str]:
    unit = found.unit
    yield f"applied      {'nothing' if found.model == 'none' else found.model}"
    if len(found.groups) > 1:
        yield "             hard iron below: of the spans of that which lasts longest"
    for axis, one in zip("xyz", found.hard_iron, strict=True):
        yield f"hard iron {axis}  {_text(one, unit)}"
    if found.model.startswith("b+"):
        for name, row in zip("xyz", found.soft_iron, strict=True):
            yield f"soft iron {name}  " + "  ".join(_text(one) for one in row)
    yield f"field        {_text(found.field, unit)}"
    degrees = Coefficient(
        found.dip / _DEG,
        found.dip.sigma / _DEG,
        found.dip.identifiable,
        found.dip.upper_bound / _DEG,
    )
    yield f"dip          {_text(degrees, 'deg')}"
    if found.field.known and found.dip.known:
        before, after = (
            float(np.sqrt(np.mean(found.heading_error(raw, found.taken_off) ** 2))) / _DEG
            for raw in (True, False)
        )
        told = f"{significant(before)} deg as it was"
        if found.applied:
            told += f", {significant(after)} deg where iron is taken off"
        yield f"heading      expect it off by {told}"


def _spans(found: MagnetometerCalibration) -> Iterator[str]:
    for span in found.spans:
        group = found.groups[span.group]
        iron = ", ".join(f"{b:.1f}" for b in group.hard_iron)
        state = f"hard iron ({iron}) taken off" if group.applied else "as it was"
        yield f"{span.start:8.1f} to {span.stop:.1f} s  {span.kind}, {state}"


def _sentences(found: MagnetometerCalibration) -> Iterator[str]:
    yield from bulleted((*found.problems, *found.advice, *found.notes)).splitlines()


def _text(one: Coefficient, unit: str = "") -> str:
    if not one.identifiable:
        return "not identifiable"
    return f"{with_error(one.value, one.sigma)} {unit}".rstrip()
