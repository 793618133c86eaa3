"""Aids of a simulated vehicle: barometer, magnetometer, compass, antenna pair."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.geometry.rotations import inverse, rotate
from zerorate.record import Log, Recording
from zerorate.simulation.drive import SimulatedDrive
from zerorate.simulation.field import check_spans
from zerorate.simulation.gyro import check_not_negative, check_whole
from zerorate.simulation.hand import check_shape
from zerorate.types import Floats, Integers

_SEA_LEVEL_PA = 101_325.0
_TROPOSPHERE_M = 44_330.769
_EXPONENT = 0.190_263_24
"""Standard atmosphere: pressure at sea level, Pa, height constant, m, and exponent."""

_AID_LOGS: Mapping[str, tuple[tuple[str, ...], str]] = {
    "pressure": (("pressure_pa",), "Pa"),
    "heading": (("heading_rad",), "rad"),
    "mag": (tuple(f"mag_{axis}_ut" for axis in "xyz"), "uT"),
    "baseline": (tuple(f"baseline_{axis}_m" for axis in ("north", "east", "down")), "m"),
}


def barometer(
    drive: SimulatedDrive,
    rate: float = 10.0,
    *,
    sigma: float = 0.4,
    reference: float = 20.0,
    walk: float = 0.02,
    steps: Iterable[tuple[float, float]] = (),
    frozen: npt.ArrayLike = (),
    seed: int = 0,
) -> Floats:
    """Return the pressure of a barometer on a simulated vehicle, for ``process(pressure=)``.

    Parameters
    ----------
    drive : SimulatedDrive
        Simulated vehicle of n samples.
    rate : float
        Rate of the readings, Hz. Samples without a reading are NaN.
    sigma : float
        Standard deviation of the white noise, as a height, m.
    reference : float
        Height in the standard atmosphere minus height above the ellipsoid at the start, m.
    walk : float
        Random walk of the reference height, m/sqrt(s).
    steps : iterable of (float, float)
        Time (s) and size (m) of each step in the reference height, as from a door or a window.
    frozen : array_like, shape (k, 2)
        Start and end of the spans in which the pressure repeats one value, s.
    seed : int
        Seed of the noise and the random walk.

    Returns
    -------
    ndarray, shape (n,)
        Pressure, Pa.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> drive = zr.simulate_drive(duration=60.0, seed=1)
    >>> pressure = zr.simulation.barometer(drive)
    >>> pressure.shape, int(np.nanmean(pressure) // 1000)
    ((6000,), 95)
    """
    noise, drift = check_not_negative("sigma", sigma), check_not_negative("walk", walk)
    random = np.random.default_rng(check_whole("seed", seed, 0))
    at = _sample_rows(drive, rate)
    time = drive.time[at]
    height = drive.truth_position[at, 2] + reference + noise * random.standard_normal(at.size)
    height += np.cumsum(drift * math.sqrt(1.0 / rate) * random.standard_normal(at.size))
    for begin, step in steps:
        height[time >= begin] += step
    pressure = _SEA_LEVEL_PA * (1.0 - height / _TROPOSPHERE_M) ** (1.0 / _EXPONENT)
    return _spread(drive, at, _freeze(time, pressure, frozen))


def compass_heading(
    drive: SimulatedDrive,
    rate: float = 10.0,
    *,
    sigma: float = 0.03,
    offset: float = 0.0,
    disturbances: Iterable[tuple[float, float, float]] = (),
    frozen: npt.ArrayLike = (),
    seed: int = 0,
) -> Floats:
    """Return the headings of a compass on a simulated vehicle, for ``process(heading=)``.

    Parameters
    ----------
    drive : SimulatedDrive
        Simulated vehicle of n samples.
    rate : float
        Rate of the readings, Hz. Samples without a reading are NaN.
    sigma : float
        Standard deviation of the white noise, rad.
    offset : float
        Constant offset of the readings, rad.
    disturbances : iterable of (float, float, float)
        Spans with a disturbed heading: start (s), end (s), heading error (rad).
    frozen : array_like, shape (k, 2)
        Start and end of the spans in which the heading repeats one value, s.
    seed : int
        Seed of the noise.

    Returns
    -------
    ndarray, shape (n,)
        Headings from north over east, rad, from -pi to pi.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=60.0, seed=1)
    >>> zr.simulation.compass_heading(drive, rate=5.0).shape
    (6000,)
    """
    noise = check_not_negative("sigma", sigma)
    random = np.random.default_rng(check_whole("seed", seed, 0))
    at = _sample_rows(drive, rate)
    time, forward = drive.time[at], rotate(drive.truth_quaternion[at], np.array([1.0, 0.0, 0.0]))
    heading = np.arctan2(forward[:, 1], forward[:, 0]) + offset
    heading += noise * random.standard_normal(at.size)
    for begin, end, error in disturbances:
        heading[(time >= begin) & (time < end)] += error
    wrapped = np.remainder(heading + math.pi, 2.0 * math.pi) - math.pi
    return _spread(drive, at, _freeze(time, wrapped, frozen))


def magnetometer(
    drive: SimulatedDrive,
    rate: float = 50.0,
    *,
    sigma: float = 0.5,
    field: float = 48.8,
    dip: float = 1.12,
    declination: float = 0.075,
    hard_iron: npt.ArrayLike = (0.0, 0.0, 0.0),
    magnets: Iterable[tuple[float, float, npt.ArrayLike]] = (),
    frozen: npt.ArrayLike = (),
    seed: int = 0,
) -> Floats:
    """Return the readings of a magnetometer on a simulated vehicle.

    Parameters
    ----------
    drive : SimulatedDrive
        Simulated vehicle of n samples.
    rate : float
        Rate of the readings, Hz. Samples without a reading are NaN.
    sigma : float
        Standard deviation of the white noise on each axis, uT.
    field, dip, declination : float
        Earth's field: strength (uT), angle below the horizontal (rad), angle from true north to
        magnetic north (rad, positive east). Default: the field at the simulator's default place in
        2026.
    hard_iron : array_like, shape (3,)
        Field of the vehicle in the sensors' axes, uT.
    magnets : iterable of (float, float, array_like)
        Spans with a magnet nearby: start (s), end (s), field in the sensors' axes (uT).
    frozen : array_like, shape (k, 2)
        Start and end of the spans in which the field repeats one value, s.
    seed : int
        Seed of the noise.

    Returns
    -------
    ndarray, shape (n, 3)
        Field in the sensors' axes, uT.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> drive = zr.simulate_drive(duration=60.0, seed=1)
    >>> samples = zr.simulation.magnetometer(drive, sigma=0.0)
    >>> bool(np.allclose(np.linalg.norm(samples[::2], axis=1), 48.8))
    True
    """
    noise = check_not_negative("sigma", sigma)
    random = np.random.default_rng(check_whole("seed", seed, 0))
    at = _sample_rows(drive, rate)
    level = math.cos(dip)
    north, east = level * math.cos(declination), level * math.sin(declination)
    earth = check_not_negative("field", field) * np.array([north, east, math.sin(dip)])
    body = rotate(inverse(drive.truth_quaternion[at]), np.tile(earth, (at.size, 1)))
    values = body @ drive.body_from_sensor + check_shape("hard_iron", hard_iron, (3,))
    values += noise * random.standard_normal(values.shape)
    time = drive.time[at]
    for begin, end, iron in magnets:
        values[(time >= begin) & (time < end)] += check_shape("magnets", iron, (3,))
    return _spread(drive, at, _freeze(time, values, frozen))


def antenna_baseline(
    drive: SimulatedDrive,
    baseline: npt.ArrayLike,
    rate: float = 5.0,
    *,
    sigma: float = 0.01,
    seed: int = 0,
) -> Floats:
    """Return the vectors between two antennas on a simulated vehicle.

    Parameters
    ----------
    drive : SimulatedDrive
        Simulated vehicle of n samples.
    baseline : array_like, shape (3,)
        Vector from the first to the second antenna, m forward, right, down.
    rate : float
        Rate of the readings, Hz. Samples without a reading are NaN.
    sigma : float
        Standard deviation of the white noise on each axis, m.
    seed : int
        Seed of the noise.

    Returns
    -------
    ndarray, shape (n, 3)
        Vectors north, east, down, m, for ``process(baseline=)``.

    Raises
    ------
    ValueError
        If an argument is out of range.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=60.0, seed=1)
    >>> zr.simulation.antenna_baseline(drive, (1.0, 0.0, 0.0)).shape
    (6000, 3)
    """
    noise = check_not_negative("sigma", sigma)
    random = np.random.default_rng(check_whole("seed", seed, 0))
    at = _sample_rows(drive, rate)
    arm = check_shape("baseline", baseline, (3,))
    vectors = rotate(drive.truth_quaternion[at], np.tile(arm, (at.size, 1)))
    return _spread(drive, at, vectors + noise * random.standard_normal(vectors.shape))


def with_aids(drive: SimulatedDrive, **aids: npt.ArrayLike) -> Recording:
    """Return the recording of a simulated vehicle with logs of its aids.

    Parameters
    ----------
    drive : SimulatedDrive
        Simulated vehicle of n samples.
    **aids : array_like, shape (n,) or (n, 3)
        Readings by name: ``pressure``, ``heading``, ``mag`` or ``baseline``. They come from
        `barometer`, `compass_heading`, `magnetometer` and `antenna_baseline`.

    Raises
    ------
    ValueError
        If a name is unknown.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=60.0, seed=1)
    >>> zr.simulation.with_aids(drive, pressure=zr.simulation.barometer(drive)).names
    ('gyro', 'accel', 'pressure')
    """
    recording = drive.recording()
    logs = dict(recording)
    for name, values in aids.items():
        if name not in _AID_LOGS:
            raise ArgumentError(name, f"is no aid; known: {', '.join(_AID_LOGS)}")
        names, unit = _AID_LOGS[name]
        data = np.asarray(values, dtype=np.float64).reshape(len(drive.time), len(names))
        at = np.flatnonzero(np.isfinite(data).all(axis=1))
        rate = (at.size - 1) / float(drive.time[at[-1]] - drive.time[at[0]])
        meta = {"source": drive.source}
        logs[name] = Log.at(drive.time[at], rate, data[at], names, unit, meta)
    return replace(recording, logs=logs)


def _sample_rows(drive: SimulatedDrive, rate: float) -> Integers:
    """Return the samples at which an aid has a reading."""
    if not 0.0 < rate <= drive.rate:
        raise ArgumentError("rate", f"must be above 0 and {drive.rate:g} Hz at most, got {rate}")
    rows = np.rint(np.arange(0.0, len(drive.time), drive.rate / rate)).astype(np.int64)
    inside: Integers = np.unique(rows[rows < len(drive.time)])
    return inside


def _freeze(time: Floats, values: Floats, spans: npt.ArrayLike) -> Floats:
    for begin, end in check_spans(spans):
        inside = np.flatnonzero((time >= begin) & (time < end))
        if inside.size:
            values[inside] = values[inside[0]]
    return values


def _spread(drive: SimulatedDrive, at: Integers, values: Floats) -> Floats:
    spread = np.full((len(drive.time), *values.shape[1:]), np.nan)
    spread[at] = values
    return spread
