"""Attitude as plain text: direction, standard deviations, gyro errors, true errors."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.numerals import format_with_error
from zerorate.show.tables import Table, as_text, bullet_list, wrap_prose

if TYPE_CHECKING:
    from zerorate.attitude.estimate import AttitudeEstimate
    from zerorate.types import Booleans, Floats

_AXES: Final = ("x", "y", "z")
_SETTLED_AFTER_S: Final = 2.0
_MAX_FRAME_ERROR_RAD: Final = math.radians(120.0)
_HEADING_NOTES: Final = {
    "absolute": "Headings are compared with the reference's north, which must be magnetic north.",
    "relative": "Headings are relative to the first sample of each row: no magnetometer.",
    "aligned": "Headings are aligned: the estimate is rotated back by {:.2f} deg about z.",
}
_FRAME_NAMES: Final = {
    "enu": "east, north, up",
    "ned": "north, east, down",
    "nwu": "north, west, up",
}


def format_attitude(estimate: AttitudeEstimate) -> str:
    """Return the tables of an attitude, at most `WIDTH` characters wide.

    They show the angles with standard deviations, the times of rest and of a disturbed field, the
    gyro errors, and notes. If there is a reference, they show the errors relative to it.
    """
    return "\n\n".join(filter(None, _format_parts(estimate)))


def attitude_title(estimate: AttitudeEstimate) -> str:
    """Return the title of an attitude: its source, sensors and method."""
    axes = "nine axes" if estimate.mag else "six axes"
    offline_text = ", offline" if estimate.offline else ""
    name = Path(estimate.source).name
    return f"{name}: {axes}, {estimate.method}{offline_text}, to {_FRAME_NAMES[estimate.frame]}"


def _format_parts(estimate: AttitudeEstimate) -> Iterator[str]:
    yield wrap_prose(f"Attitude of {attitude_title(estimate)}")
    if estimate.reference is not None:
        yield as_text(_make_errors_table(estimate))
    yield as_text(_make_angles_table(estimate))
    yield as_text(_make_states_table(estimate))
    if np.isfinite(estimate.bias_sigma[-1]).all():
        yield as_text(_make_gyro_table(estimate))
    if estimate.notes:
        yield f"Notes\n{bullet_list(estimate.notes)}"


def _make_angles_table(estimate: AttitudeEstimate) -> Table:
    # The angles are known only after the first second, which gives the mean force.
    first_row = min(round(_SETTLED_AFTER_S * estimate.rate), estimate.n - 1)
    first, last = np.degrees(estimate.euler[[first_row, -1]])
    ends = [(f"{a:.2f}", f"{b:.2f}") for a, b in zip(first, last, strict=True)]
    names = ("roll", "pitch", "yaw")
    rows: list[tuple[str, ...]] = [(name, *end) for name, end in zip(names, ends, strict=True)]
    for name, sigma in (("tilt", estimate.tilt_sigma), ("heading", estimate.heading_sigma)):
        rows.append(
            (f"{name}, σ", *(_format_number(math.degrees(sigma[i])) for i in (first_row, -1)))
        )
    return Table("Angles, deg", ("", f"after {_SETTLED_AFTER_S:g} s", "at the end"), tuple(rows))


def _make_states_table(estimate: AttitudeEstimate) -> Table:
    states = [("at rest", estimate.at_rest)]
    if estimate.mag:
        states.append(("magnetic field disturbed", estimate.disturbed))
    rows = tuple((name, *_format_share(there, estimate.rate)) for name, there in states)
    return Table("Time", ("", "s", "%"), rows)


def _format_share(there: Booleans, rate: float) -> tuple[str, str]:
    return f"{there.sum() / rate:.1f}", f"{100.0 * there.mean():.1f}"


def _make_gyro_table(estimate: AttitudeEstimate) -> Table:
    bias = _format_row(np.degrees(estimate.bias[-1]), np.degrees(estimate.bias_sigma[-1]))
    rows = [("bias", "deg/s", *bias)]
    matrix, sigma = estimate.gyro_matrix, estimate.gyro_matrix_sigma
    note = ""
    if np.isfinite(sigma).all():
        # The matrix is a correction: if the gyro reads too much, its element is below 1.
        error, deviation = 100.0 * (matrix - np.eye(3)), 100.0 * sigma
        rows += [
            (f"correction of {axis}", "%", *_format_row(error[i], deviation[i]))
            for i, axis in enumerate(_AXES)
        ]
        note = "Correction: M - 1 in rate = M (gyro - bias), row by row, with ± σ."
    return Table("Gyro at the end", ("", "", *_AXES), tuple(rows), words=2, note=note, blocks=True)


def _format_row(values: Floats, sigmas: Floats) -> tuple[str, ...]:
    return tuple(
        format_with_error(v, s) for v, s in zip(values.tolist(), sigmas.tolist(), strict=True)
    )


def _make_errors_table(estimate: AttitudeEstimate) -> Table:
    rows = [
        _make_error_row("all", estimate, None),
        _make_error_row("in motion", estimate, ~estimate.at_rest),
    ]
    errors = estimate.errors()
    note = _HEADING_NOTES[estimate.compared_heading]
    if estimate.compared_heading == "aligned":
        note = note.format(math.degrees(estimate.heading_offset()))
    if errors.inclination > _MAX_FRAME_ERROR_RAD:
        note += " So large an inclination error means that the reference has other earth axes."
    head = ("RMS over", "total", "heading", "inclination", "samples")
    return Table("Errors against the reference, deg", head, tuple(rows), note=note)


def _make_error_row(
    name: str, estimate: AttitudeEstimate, where: Booleans | None
) -> tuple[str, ...]:
    try:
        errors = estimate.errors(where)
    except ValueError:
        return (name, "-", "-", "-", "0")
    angles = (errors.total, errors.heading, errors.inclination)
    return (name, *(f"{math.degrees(angle):.2f}" for angle in angles), str(errors.sample_count))


def _format_number(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else "-"
