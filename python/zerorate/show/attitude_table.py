"""An attitude as plain text: where it points, how far to trust it, what was learned, its errors."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.numerals import with_error
from zerorate.show.tables import Table, as_text, bulleted, prose

if TYPE_CHECKING:
    from zerorate.attitude.estimate import AttitudeEstimate
    from zerorate.types import Booleans, Floats

_AXES: Final = ("x", "y", "z")
_BEGUN: Final = 2.0
_OTHER_FRAME: Final = math.radians(120.0)
_ON_HEADING: Final = {
    "absolute": "Heading against the north of the reference, which is to be the magnetic one.",
    "relative": "Heading against the first sample of each row: without a magnetometer it is any.",
    "aligned": "Headings are aligned: the estimate is turned back by {:.2f} deg about z.",
}
_FRAMES: Final = {
    "enu": "east, north, up",
    "ned": "north, east, down",
    "nwu": "north, west, up",
}


def format_attitude(estimate: AttitudeEstimate) -> str:
    """Return the tables of an attitude, at most `WIDTH` columns wide.

    Angles with their standard deviations, rest and disturbance, what was learned of the gyro,
    errors where there is a reference, notes.
    """
    return "\n\n".join(filter(None, _parts(estimate)))


def attitude_title(estimate: AttitudeEstimate) -> str:
    """Return what an attitude is of, and how it was found."""
    axes = "nine axes" if estimate.mag else "six axes"
    way = ", offline" if estimate.offline else ""
    name = Path(estimate.source).name
    return f"{name}: {axes}, {estimate.method}{way}, to {_FRAMES[estimate.frame]}"


def _parts(estimate: AttitudeEstimate) -> Iterator[str]:
    yield prose(f"Attitude of {attitude_title(estimate)}")
    if estimate.reference is not None:
        yield as_text(_errors(estimate))
    yield as_text(_angles(estimate))
    yield as_text(_states(estimate))
    if np.isfinite(estimate.bias_sigma[-1]).all():
        yield as_text(_gyro(estimate))
    if estimate.notes:
        yield f"Notes\n{bulleted(estimate.notes)}"


def _angles(estimate: AttitudeEstimate) -> Table:
    # Before the mean force of the first second nothing is known of any angle.
    begun = min(round(_BEGUN * estimate.rate), estimate.n - 1)
    first, last = np.degrees(estimate.euler[[begun, -1]])
    ends = [(f"{a:.2f}", f"{b:.2f}") for a, b in zip(first, last, strict=True)]
    names = ("roll", "pitch", "yaw")
    rows: list[tuple[str, ...]] = [(name, *end) for name, end in zip(names, ends, strict=True)]
    for name, sigma in (("tilt", estimate.tilt_sigma), ("heading", estimate.heading_sigma)):
        rows.append((f"{name}, σ", *(_number(math.degrees(sigma[i])) for i in (begun, -1))))
    return Table("Angles, deg", ("", f"after {_BEGUN:g} s", "at the end"), tuple(rows))


def _states(estimate: AttitudeEstimate) -> Table:
    states = [("at rest", estimate.at_rest)]
    if estimate.mag:
        states.append(("magnetic field disturbed", estimate.disturbed))
    rows = tuple((name, *_share(there, estimate.rate)) for name, there in states)
    return Table("Time", ("", "s", "%"), rows)


def _share(there: Booleans, rate: float) -> tuple[str, str]:
    return f"{there.sum() / rate:.1f}", f"{100.0 * there.mean():.1f}"


def _gyro(estimate: AttitudeEstimate) -> Table:
    bias = _row(np.degrees(estimate.bias[-1]), np.degrees(estimate.bias_sigma[-1]))
    rows = [("bias", "deg/s", *bias)]
    matrix, sigma = estimate.gyro_matrix, estimate.gyro_matrix_sigma
    note = ""
    if np.isfinite(sigma).all():
        # The matrix corrects: a gyro that reads too much has an element below 1.
        error, deviation = 100.0 * (matrix - np.eye(3)), 100.0 * sigma
        rows += [
            (f"correction of {axis}", "%", *_row(error[i], deviation[i]))
            for i, axis in enumerate(_AXES)
        ]
        note = "Correction: M - 1 in rate = M (gyro - bias), row by row, with ± σ."
    return Table("Gyro at the end", ("", "", *_AXES), tuple(rows), words=2, note=note, blocks=True)


def _row(values: Floats, sigmas: Floats) -> tuple[str, ...]:
    return tuple(with_error(v, s) for v, s in zip(values.tolist(), sigmas.tolist(), strict=True))


def _errors(estimate: AttitudeEstimate) -> Table:
    rows = [_error("all", estimate, None), _error("in motion", estimate, ~estimate.at_rest)]
    found = estimate.errors()
    note = _ON_HEADING[estimate.compared_heading]
    if estimate.compared_heading == "aligned":
        note = note.format(math.degrees(estimate.heading_offset()))
    if found.inclination > _OTHER_FRAME:
        note += " So large an inclination is that of a reference to other axes of the earth."
    head = ("RMS over", "total", "heading", "inclination", "samples")
    return Table("Errors against the reference, deg", head, tuple(rows), note=note)


def _error(name: str, estimate: AttitudeEstimate, where: Booleans | None) -> tuple[str, ...]:
    try:
        found = estimate.errors(where)
    except ValueError:
        return (name, "-", "-", "-", "0")
    angles = (found.total, found.heading, found.inclination)
    return (name, *(f"{math.degrees(one):.2f}" for one in angles), str(found.sample_count))


def _number(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else "-"
