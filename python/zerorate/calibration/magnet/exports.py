"""Export of a magnetometer's calibration to PX4 and ArduPilot."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.noise.exports import write_text
from zerorate.record.exporting import document_export
from zerorate.types import Floats

if TYPE_CHECKING:
    from zerorate.calibration.magnetometer import MagnetometerCalibration

MICROTESLA: Final = {
    "uT": 1.0,
    "µT": 1.0,
    "nT": 1e-3,
    "mT": 1e3,
    "T": 1e6,
    "gauss": 1e2,
    "Gauss": 1e2,
    "G": 1e2,
    "mgauss": 0.1,
    "mG": 0.1,
}
"""Size of each unit of a magnetic field, uT."""
_AXES: Final = "XYZ"
_PAIRS: Final = ((0, 1), (0, 2), (1, 2))

_writes = partial(
    document_export,
    faults="""\
ValueError
    If `doubtful` is False, and nothing is applied or fewer than three directions of the hard iron
    are known. If the unit of the samples is not a unit of magnetic field.""",
    options="""\
doubtful : bool
    Also write doubtful numbers, with a warning in the file; default False.""",
)


@_writes(".params")
def to_px4(
    calibration: MagnetometerCalibration,
    path: str | os.PathLike[str] | None = None,
    *,
    instance: int = 0,
    doubtful: bool = False,
    force: bool = False,
) -> str:
    """Return hard and soft iron as parameters of PX4, in the format of QGroundControl.

    Parameters
    ----------
    instance : int
        Number in the parameters' names: 0 for ``CAL_MAG0_XOFF``.

    Returns
    -------
    str
        ``CAL_MAG``, gauss. PX4 corrects samples by M (sample - offset). ``XSCALE`` to ``ZSCALE``
        are the diagonal of M; ``XODIAG``, ``YODIAG`` and ``ZODIAG`` are its elements xy, xz and yz.
        The sensor must have the axes of the body. If there are several hard irons, the hard iron of
        group `longest` is written.
    """
    offset, matrix = _offset_and_matrix(calibration, 1e2, doubtful)
    names = [f"CAL_MAG{instance}_{axis}OFF" for axis in _AXES]
    names += [f"CAL_MAG{instance}_{axis}SCALE" for axis in _AXES]
    names += [f"CAL_MAG{instance}_{axis}ODIAG" for axis in _AXES]
    values = [*offset, *np.diagonal(matrix), *(matrix[i, j] for i, j in _PAIRS)]
    lines = [
        *_header_lines(
            calibration, "PX4: offsets and scales of a magnetometer, gauss, axes of the body."
        ),
        "# Vehicle-Id Component-Id Name Value Type",
        *(f"1\t1\t{name}\t{float(value)!r}\t9" for name, value in zip(names, values, strict=True)),
    ]
    return write_text("\n".join(lines) + "\n", path, force)


@_writes(".param")
def to_ardupilot(
    calibration: MagnetometerCalibration,
    path: str | os.PathLike[str] | None = None,
    *,
    compass: int = 1,
    doubtful: bool = False,
    force: bool = False,
) -> str:
    """Return hard and soft iron as parameters of ArduPilot.

    Parameters
    ----------
    compass : int
        Number of the compass: 1 for ``COMPASS_OFS_X``, 2 for ``COMPASS_OFS2_X``.

    Returns
    -------
    str
        ``COMPASS_OFS``, milligauss, with ArduPilot's sign: samples are corrected by E (sample +
        offset). ``COMPASS_DIA`` is the diagonal of E; ``COMPASS_ODI_X``, ``_Y`` and ``_Z`` are its
        elements xy, xz and yz. If there are several hard irons, the hard iron of group `longest` is
        written.
    """
    offset, matrix = _offset_and_matrix(calibration, 0.1, doubtful)
    number = "" if compass == 1 else str(compass)
    names = [f"COMPASS_{kind}{number}_{axis}" for kind in ("OFS", "DIA", "ODI") for axis in _AXES]
    values = [*(-offset), *np.diagonal(matrix), *(matrix[i, j] for i, j in _PAIRS)]
    lines = [
        *_header_lines(calibration, "ArduPilot: offsets of a compass in milligauss, and scales."),
        *(f"{name},{float(value)!r}" for name, value in zip(names, values, strict=True)),
    ]
    return write_text("\n".join(lines) + "\n", path, force)


def _offset_and_matrix(
    calibration: MagnetometerCalibration, microtesla: float, doubtful: bool
) -> tuple[Floats, Floats]:
    """Return the hard iron in a unit of a given size in uT, and the inverse of the soft iron."""
    if calibration.unit not in MICROTESLA:
        raise ValueError(
            make_sentence(
                f"the magnetometer's unit, '{calibration.unit}', is none of a magnetic field: read "
                "the log with ",
                keyword_argument("unit"),
                " of it, such as uT or gauss",
            )
        )
    doubts = list(_doubts(calibration))
    if doubts and not doubtful:
        advice = "; ".join(calibration.advice) or "rotate the device about two different axes"
        raise ValueError(
            make_sentence(
                f"{doubts[0]}: {advice}; ",
                keyword_argument("doubtful", "", "doubtful=True"),
                " writes the numbers with this warning",
            )
        )
    iron = np.array(calibration.groups[calibration.longest].hard_iron)
    matrix = np.linalg.inv(np.array(calibration.soft_iron, dtype=np.float64))
    return iron * MICROTESLA[calibration.unit] / microtesla, matrix


def _doubts(calibration: MagnetometerCalibration) -> Iterator[str]:
    if not calibration.valid:
        yield f"the calibration is not valid, {calibration.problems[0]}"
    elif not calibration.groups[calibration.longest].applied:
        yield "the log shows no iron worth subtracting"
    elif not all(coefficient.identifiable for coefficient in calibration.hard_iron):
        unknown = (
            axis
            for axis, coefficient in zip("xyz", calibration.hard_iron, strict=True)
            if not coefficient.identifiable
        )
        yield f"the hard iron's {' and '.join(unknown)} is not known"


def _header_lines(calibration: MagnetometerCalibration, title: str) -> Iterator[str]:
    yield f"# {title}"
    for doubt in _doubts(calibration):
        yield f"# WARNING: {doubt}"
    for k, group in enumerate(calibration.groups):
        if k != calibration.longest:
            iron = ", ".join(f"{b:.4g}" for b in group.hard_iron)
            yield f"# For a shorter time the hard iron was ({iron}) {calibration.unit}."
