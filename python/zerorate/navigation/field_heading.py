"""Headings from a magnetometer, calibrated with the gyro and levelled by the filter."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from typing import Final, NamedTuple

import numpy as np

from zerorate.calibration.magnet.calibrate import calibrate_magnetometer
from zerorate.calibration.magnetometer import MagnetometerCalibration
from zerorate.faults import make_sentence
from zerorate.geometry import EarthField, earth_field
from zerorate.geometry.magnetic import FIRST_YEAR, LAST_YEAR
from zerorate.geometry.rotations import euler_angles, from_euler_angles, rotate
from zerorate.navigation.aid_channels import Channel
from zerorate.navigation.track import Track
from zerorate.numerals import shorten
from zerorate.record.fixes import Fixes
from zerorate.record.log import LogError
from zerorate.record.recording import Recording
from zerorate.record.samples import Samples
from zerorate.types import Floats

_RATE_HZ: Final = 5.0
"""Rate of headings, Hz."""
_NOISE_RAD: Final = math.radians(1.0)
_CORRELATION_S: Final = 10.0
"""Standard deviation of a heading in an undisturbed field, rad, and correlation time, s."""
_MAX_SIGMA_RAD: Final = math.radians(25.0)
"""Largest standard deviation of a heading that is used, rad."""
_MAX_DEVIATION: Final = 0.25
"""Largest deviation of the field's size or vertical part from its median, relative."""
_SECONDS_PER_YEAR: Final = 365.2425 * 86400.0


class FieldHeading(NamedTuple):
    """Headings of a magnetometer, or the reason why there is none.

    Attributes
    ----------
    channel : Channel or None
        Headings from true north over east, rad, with standard deviations. None without headings.
    notes : tuple of str
        Sentences on the calibration and the declination.
    """

    channel: Channel | None
    notes: tuple[str, ...]


def find_field_heading(recording: Recording, fixes: Fixes, track: Track) -> FieldHeading:
    """Return the headings from a magnetometer, with standard deviations.

    Parameters
    ----------
    recording : Recording
        Recording with gyro, accelerometer and magnetometer, in the axes of the body.
    fixes : Fixes
        Fixes of the receiver. Their position gives the declination.
    track : Track
        Track without this magnetometer. Its roll and pitch level the field.

    Notes
    -----
    `zerorate.calibrate_magnetometer` estimates the hard and soft iron. Headings in a disturbed
    field are left out. The other headings have a standard deviation with three parts:

    - standard deviation of the calibration
    - residual of the field during the second
    - deviation of the field's size and vertical part from their medians

    The standard deviation is raised, because such errors persist for ten seconds.
    """
    try:
        calibration = calibrate_magnetometer(recording)
    except LogError as fault:
        return FieldHeading(
            None, (make_sentence("the magnetometer gives no heading: ", *fault.args),)
        )
    if not calibration.valid:
        reason = "; ".join(calibration.problems)
        return FieldHeading(None, (f"the magnetometer gives no heading: {reason}",))
    place = _find_field(fixes)
    declination = 0.0 if place is None else place.declination
    channel, dip = _level(calibration, recording, track, declination)
    notes = [_describe(calibration, place)]
    if channel is None:
        return FieldHeading(None, ("the magnetometer gives no heading: the field is disturbed",))
    if place is not None and abs(dip - place.dip) > math.radians(10.0):
        notes.append(
            f"the field dips by {math.degrees(dip):.0f} deg, and by {math.degrees(place.dip):.0f} "
            "deg at this place: something magnetic is near"
        )
    return FieldHeading(channel, tuple(notes))


def _level(
    calibration: MagnetometerCalibration, recording: Recording, track: Track, declination: float
) -> tuple[Channel | None, float]:
    """Return the headings from the levelled field, and the field's dip."""
    samples = Samples.of(recording, what="navigation")
    log = recording.mag
    assert log is not None
    field = calibration.apply(log.data, log.sampled)
    assert not isinstance(field, Recording)
    raw_time = log.sampled
    step = max(1, round(log.rate / _RATE_HZ))
    rows = np.arange(0, log.n, step)
    rows = rows[np.isfinite(field[rows]).all(axis=1)]
    time, values = raw_time[rows], field[rows]
    at = np.clip(np.searchsorted(track.time, time), 0, track.n - 1)
    level = _turn_level(values, track, at, samples)
    heading = np.arctan2(-level[:, 1], level[:, 0]) + declination
    sigma, keep = _find_sigma(calibration, level, heading, time)
    if not keep.any():
        return None, 0.0
    dip = float(np.median(np.arctan2(level[keep, 2], np.hypot(*level[keep, :2].T))))
    persisting = math.sqrt(1.0 + _RATE_HZ * _CORRELATION_S)
    total = np.hypot(_NOISE_RAD, persisting * sigma)[keep]
    name = ", ".join(log.names)
    channel = Channel("heading", time[keep], heading[keep], "rad", name, False, total)
    return channel, dip


def _turn_level(values: Floats, track: Track, at: np.ndarray, samples: Samples) -> Floats:
    """Return the field vectors in level axes, x forward."""
    angles = euler_angles(track.quaternion[at])
    unknown = ~track.navigating[at]
    if unknown.any():
        force = _smooth(samples.accel, round(samples.log.rate))[at[unknown]]
        roll = np.arctan2(-force[:, 1], -force[:, 2])
        pitch = np.arctan2(force[:, 0], np.hypot(force[:, 1], force[:, 2]))
        angles[unknown, 0], angles[unknown, 1] = roll, pitch
    tilt = from_euler_angles(angles[:, 0], angles[:, 1], np.zeros(len(angles)))
    return rotate(tilt, values)


def _smooth(values: Floats, width: int) -> Floats:
    """Return centred moving means. NaN counts as the median."""
    filled = np.where(np.isfinite(values), values, np.nanmedian(values, axis=0))
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(filled, axis=0)])
    n = len(values)
    first = np.clip(np.arange(n) - width // 2, 0, n)
    last = np.clip(np.arange(n) + width // 2 + 1, 0, n)
    means: Floats = (sums[last] - sums[first]) / (last - first)[:, np.newaxis]
    return means


def _find_sigma(
    calibration: MagnetometerCalibration, level: Floats, heading: Floats, time: Floats
) -> tuple[Floats, np.ndarray]:
    """Return the persistent error of each heading, rad, and the mask of headings to keep."""
    horizontal = np.hypot(*level[:, :2].T)
    size = np.linalg.norm(level, axis=1)
    typical, down = float(np.median(size)), float(np.median(level[:, 2]))
    deviation = np.maximum(np.abs(size - typical), np.abs(level[:, 2] - down))
    noise = float(np.median(deviation))
    excess = np.sqrt(np.maximum(deviation**2 - (2.0 * noise) ** 2, 0.0))
    iron = np.interp(
        np.remainder(heading, 2.0 * math.pi),
        np.radians(10.0) * np.arange(37),
        np.append(errors := calibration.heading_error(), errors[0]),
    )
    residual = np.zeros(len(time))
    if calibration.residual.size and calibration.spans:
        second = np.floor(time - calibration.spans[0].start).astype(np.intp)
        inside = (second >= 0) & (second < calibration.residual.size)
        residual[inside] = calibration.residual[second[inside]]
    disturbed = np.zeros(len(time), dtype=np.bool_)
    for span in calibration.spans:
        if span.kind == "disturbed":
            disturbed |= (time >= span.start) & (time < span.stop)
    with np.errstate(invalid="ignore", divide="ignore"):
        sigma = np.sqrt(iron**2 + (residual**2 + excess**2) / horizontal**2)
    keep = ~disturbed & np.isfinite(sigma) & (sigma < _MAX_SIGMA_RAD)
    keep &= deviation < _MAX_DEVIATION * typical
    return sigma, keep


def _find_field(fixes: Fixes) -> EarthField | None:
    """Return the earth's field at the first fix. None without a model of the field."""
    known = np.flatnonzero(np.isfinite(fixes.position[:, :2]).all(axis=1))
    if not known.size:
        return None
    latitude, longitude, height = fixes.position[known[0]].tolist()
    year = None
    if fixes.epoch is not None:
        when = datetime.fromtimestamp(fixes.epoch + float(fixes.time[0]), UTC)
        first = datetime(when.year, 1, 1, tzinfo=UTC)
        year = when.year + (when - first).total_seconds() / _SECONDS_PER_YEAR
        year = year if FIRST_YEAR <= year < LAST_YEAR else None
    try:
        return earth_field(latitude, longitude, height if math.isfinite(height) else 0.0, year)
    except (ImportError, ValueError):
        return None


def _describe(calibration: MagnetometerCalibration, place: EarthField | None) -> str:
    iron = float(np.linalg.norm([float(axis) for axis in calibration.hard_iron]))
    learned = (
        f"hard iron of {shorten(iron, 3)} {calibration.unit} removed"
        if calibration.applied
        else "no iron to remove"
    )
    if place is None:
        return f"heading from the magnetometer: {learned}; the declination is not known"
    return (
        f"heading from the magnetometer: {learned}; declination "
        f"{math.degrees(place.declination):.1f} deg, by the {place.model}"
    )
