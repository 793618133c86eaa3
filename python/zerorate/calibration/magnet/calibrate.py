"""Calibration of a magnetometer from ordinary motion, with the gyro or by a sphere."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from typing import Final

import numpy as np

from zerorate._native import Attitude
from zerorate.calibration.magnet.choice import choose_iron
from zerorate.calibration.magnet.exports import MICROTESLA
from zerorate.calibration.magnet.faults import describe_stuck_axes, find_clipped
from zerorate.calibration.magnet.results import gyro_result, median_field, sphere_result
from zerorate.calibration.magnet.spans import partition_spans
from zerorate.calibration.magnet.sphere import fit_sphere
from zerorate.calibration.magnet.ticks import average_ticks
from zerorate.calibration.magnetometer import MagnetometerCalibration
from zerorate.faults import ArgumentError
from zerorate.geometry import EarthField, earth_field
from zerorate.geometry.rotations import to_matrices
from zerorate.record import Log, LogError, Recording
from zerorate.record.samples import Samples

_MIN_TICKS: Final = 100
"""Smallest number of ticks in a record."""
_MIN_FIELD_SHARE: Final = 0.2
"""Smallest field as a share of the samples' size: smaller means that the samples do not rotate with
the sensor.
"""
_MAX_FIELD_DIFFERENCE: Final = 0.3
"""Largest relative difference between the field and the field of the place: buildings and steel
reach this.
"""
_MAX_DIP_DIFFERENCE_RAD: Final = np.radians(20.0)


def calibrate_magnetometer(
    recording: Recording,
    *,
    gyro: str = "gyro",
    one: bool = False,
    field: float | None = None,
    dip: float | None = None,
    place: tuple[float, ...] | None = None,
) -> MagnetometerCalibration:
    """Calibrate a magnetometer from ordinary motion, with the gyro as reference.

    Parameters
    ----------
    recording : Recording
        Recording with gyro, accelerometer and a magnetometer in any unit. Without a gyro a sphere
        is fitted, and a note states this. A sphere needs samples in all directions and a constant
        field.
    gyro : str
        Name of the gyro if there are several. Default: the first.
    one : bool
        True: estimate one hard iron for the whole record. False (default): estimate several if this
        clearly reduces the scatter, for example if a magnet comes and goes.
    field, dip : float, optional
        Magnitude of the earth's field (uT) and its angle below the horizontal (rad), from a
        field model. A result that contradicts them is not valid.
    place : tuple of float, optional
        Latitude and longitude (deg), optionally height (m): `zerorate.geometry.earth_field` then
        gives field and dip. Default: the recording's positions, if it has any and pygeomag is
        installed.

    Returns
    -------
    MagnetometerCalibration
        Check `applied`: a correction is applied only if it more than halves the scatter of samples
        excluded from the fit.

    Raises
    ------
    LogError
        If the magnetometer is missing. If there is a gyro but no accelerometer. If the sensors have
        less than ten seconds in common.
    ValueError
        If ``field`` or ``dip`` does not occur on earth, or ``place`` is not a latitude and
        longitude.
    ImportError
        If ``place`` is given and pygeomag is not installed.

    Notes
    -----
    Two rotations about different axes are enough: hard iron is the part of the field that stays
    constant in the sensor's axes. Standard errors are at least a hundredth of the field, because
    the field differs from place to place.

    Examples
    --------
    >>> import zerorate as zr
    >>> motion = zr.simulate_motion("hand", duration=40.0, seed=3)
    >>> zr.calibrate_magnetometer(motion.recording()).applied
    False
    """
    _check_field(field, dip)
    log = _find_magnetometer(recording, gyro)
    reference = _reference_field(recording, place, log.unit, field, dip)
    field, dip = (field, dip) if reference is None else (reference.size, reference.dip)
    if gyro not in recording:
        result = _calibrate_by_sphere(log, recording)
    else:
        result = _calibrate_by_gyro(recording, gyro, log, one)
    result = _validate_field(result, field, dip)
    if reference is None:
        return result
    note = (
        f"the field of the place has {reference.size:.1f} uT, a dip of "
        f"{np.degrees(reference.dip):.0f} deg, "
        f"by the {reference.model}"
    )
    return replace(result, notes=(*result.notes, note))


def _reference_field(
    recording: Recording,
    place: tuple[float, ...] | None,
    unit: str,
    field: float | None,
    dip: float | None,
) -> EarthField | None:
    """Return the field at the given or recorded place; None if there is no place."""
    if place is not None and (field is not None or dip is not None):
        raise ArgumentError("place", "determines field and dip: give it, or both values")
    if place is not None:
        if len(place) not in (2, 3):
            raise ArgumentError("place", f"takes latitude, longitude and maybe height, got {place}")
        return earth_field(*place)
    needs_no_model = field is not None or dip is not None or unit not in MICROTESLA
    if needs_no_model or find_spec("pygeomag") is None:
        return None
    position = _median_position(recording)
    return None if position is None else earth_field(*position)


def _median_position(recording: Recording) -> tuple[float, float] | None:
    """Return the median latitude and longitude of a recording's positions, deg."""
    log = recording.get("position")
    if log is None or log.names[:2] != ("latitude_deg", "longitude_deg"):
        return None
    positions = log.data[np.isfinite(log.data[:, :2]).all(axis=1), :2]
    positions = positions[(np.abs(positions) <= (90.0, 360.0)).all(axis=1) & positions.any(axis=1)]
    return None if not len(positions) else tuple(np.median(positions, axis=0).tolist())


def _check_field(field: float | None, dip: float | None) -> None:
    if field is not None and not 10.0 <= field <= 100.0:
        raise ArgumentError("field", f"must be that of a place on earth, 20 to 70 uT, got {field}")
    if dip is not None and not abs(dip) <= np.pi / 2.0:
        raise ArgumentError("dip", f"must be an angle from -pi/2 to pi/2 rad, got {dip}")


def _find_magnetometer(recording: Recording, gyro: str) -> Log:
    own = gyro.replace("gyro", "mag")
    log = recording.get(own if own in recording else "mag")
    if log is None:
        listed = ", ".join(recording) or "nothing"
        raise LogError(f"there is no magnetometer to calibrate; the recording has: {listed}")
    return log


def _calibrate_by_gyro(
    recording: Recording, gyro: str, log: Log, single_iron: bool
) -> MagnetometerCalibration:
    samples = Samples.of(recording, gyro, what="a magnetometer's calibration")
    assert samples.mag is not None
    saturated, faults, notes = find_clipped(samples.mag, samples.gyro)
    problems = (*describe_stuck_axes(samples.mag), *faults)
    mag = np.where(saturated[:, None], np.nan, samples.mag)
    attitude = Attitude(samples.log.rate, mag=False)
    quaternions = attitude.smooth(samples.gyro, samples.accel, dt=samples.dt)["quaternion"]
    begin = float(samples.time[0])
    ticks = average_ticks(
        samples.time - begin, to_matrices(quaternions), samples.mag if problems else mag
    )
    _check_length(ticks.n / 10.0)
    choice = None if problems else choose_iron(ticks, partition_spans(ticks), single_iron)
    if choice is not None and median_field(choice) < _MIN_FIELD_SHARE:
        problems = ("the samples do not rotate with the sensor: the magnetometer is stuck",)
        choice = None
    sentences = (*notes, *samples.notes)
    return gyro_result(ticks, choice, begin, log.unit, problems, sentences, recording.source)


def _check_length(seconds: float) -> None:
    if seconds < _MIN_TICKS / 10.0:
        raise LogError(
            f"a magnetometer's calibration needs ten seconds of samples, got {seconds:.1f} s"
        )


def _calibrate_by_sphere(log: Log, recording: Recording) -> MagnetometerCalibration:
    known = np.isfinite(log.data).all(axis=1) & np.any(log.data != 0.0, axis=1)
    seconds = float(known.sum() / log.rate)
    _check_length(seconds)
    problems = describe_stuck_axes(log.data)
    centre = None if problems else fit_sphere(log.data[known], seconds)
    begin, end = float(log.sampled[0]), float(log.sampled[-1])
    note = (
        "without a gyro a sphere was fitted: it needs all directions, and treats a magnet that "
        "comes and goes as noise"
    )
    return sphere_result(centre, begin, end, log.unit, problems, note, recording.source)


def _validate_field(
    result: MagnetometerCalibration, field: float | None, dip: float | None
) -> MagnetometerCalibration:
    """Return the calibration, not valid if its field contradicts the field of the place."""
    problems = list(result.problems)
    if field is not None and result.unit not in MICROTESLA:
        raise ArgumentError(
            "field", f"is in uT: the unit of the magnetometer must be known, got '{result.unit}'"
        )
    if field is not None and result.field.identifiable:
        size, sigma = (
            MICROTESLA[result.unit] * value for value in (result.field.value, result.field.sigma)
        )
        if abs(size - field) > 3.0 * sigma + _MAX_FIELD_DIFFERENCE * field:
            problems.append(
                f"the field is {size:.3g} uT, and that of the place {field:.3g} uT: the unit or "
                "the scale of the magnetometer is wrong, or iron that rotates with it is near"
            )
    if dip is not None and result.dip.identifiable:
        difference = abs(result.dip - dip)
        if difference > 3.0 * result.dip.sigma + _MAX_DIP_DIFFERENCE_RAD:
            problems.append(
                f"the dip is {np.degrees(result.dip):.3g} deg, and that of the place "
                f"{np.degrees(dip):.3g} deg: axes of the magnetometer differ from the gyro's, or "
                "this is another place"
            )
    return replace(result, problems=tuple(problems))
