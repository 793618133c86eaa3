"""Detection of missing gravity, as in the linear acceleration of phones."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.record.log import Log, LogError
from zerorate.record.recording import Recording
from zerorate.types import Floats
from zerorate.units import UNITS, convert

_G_M_S2: Final = 9.80665
_WINDOW_S: Final = 0.25
_MIN_WINDOWS: Final = 20
_MAX_MEDIAN_M_S2: Final = 0.9 * _G_M_S2
"""Median force below which gravity may be absent; with gravity even a spinning body shows 1 g."""
_QUIET_WINDOW_S: Final = 0.1
_QUIET_QUANTILE: Final = 0.05
"""Share of the windows with the least rotation."""
_SMALL_QUANTILE: Final = 0.05
"""Share of the windows with the smallest mean force: an oscillation passes through zero."""
_MAX_SMALL_M_S2: Final = 0.25 * _G_M_S2
_MAX_RATIO: Final = 0.25
"""Force in the windows above over the force in the largest tenth, without gravity. With gravity, in
any scale, it is 0.35 on a runner's foot and 0.8 elsewhere.
"""
_APPLE_UNIT: Final = "g"
"""Unit of gravity and of acceleration without gravity on Apple's devices; both have the sign of
gravity. Android uses m/s^2 and the sign of specific force.
"""
_MAX_REST_FORCE_M_S2: Final = 0.06 * _G_M_S2
"""Largest force of the largest tenth of windows for a body at rest without gravity."""


def lacks_gravity(accel: Log, gyro: Log | None = None) -> bool:
    """Return True if an accelerometer's samples are without gravity.

    The evidence is the mean force in windows of 0.25 s. With gravity the smallest means are near 1
    g in any motion. Without gravity an oscillating acceleration passes through zero. A sensor in
    free fall looks the same. If most forces are large, as on a runner's foot, other windows are
    used: the windows of 0.1 s with the least rotation, while the foot is on the ground.

    Parameters
    ----------
    accel : Log
        Accelerometer of three axes. The result is False for an unknown unit and for less than 5 s.
    gyro : Log, optional
        Gyro on the accelerometer's clock.
    """
    if accel.channels != 3 or accel.unit not in UNITS or UNITS[accel.unit].kind != "acceleration":
        return False
    force = convert(accel.data, accel.unit, "m/s^2")
    means = _window_means(force, max(int(_WINDOW_S * accel.rate), 2))
    if len(means) < _MIN_WINDOWS:
        return False
    if np.nanmedian(np.linalg.norm(force, axis=1)) > _MAX_MEDIAN_M_S2:
        return gyro is not None and _lacks_gravity_at_rest(force, gyro)
    small, large = np.quantile(means, (_SMALL_QUANTILE, 0.9))
    return bool(
        small < _MAX_SMALL_M_S2 and (small < _MAX_RATIO * large or large < _MAX_REST_FORCE_M_S2)
    )


def _lacks_gravity_at_rest(force: Floats, gyro: Log) -> bool:
    """Return True if the mean force is small where rotation is least."""
    if gyro.data.shape != force.shape:
        return False
    length = max(int(_QUIET_WINDOW_S * gyro.rate), 2)
    count = len(force) // length
    shape = (count, length, 3)
    rates = np.linalg.norm(gyro.data[: count * length].reshape(shape), axis=2).max(axis=1)
    forces = np.linalg.norm(force[: count * length].reshape(shape).mean(axis=1), axis=1)
    known = np.isfinite(rates) & np.isfinite(forces)
    if known.sum() < _MIN_WINDOWS:
        return False
    quiet = rates[known] <= np.quantile(rates[known], _QUIET_QUANTILE)
    small = float(np.median(forces[known][quiet]))
    return small < min(_MAX_SMALL_M_S2, _MAX_RATIO * float(np.nanmedian(forces)))


def _window_means(force: Floats, length: int) -> Floats:
    """Return the size of the mean force of each whole window, m/s^2."""
    count = len(force) // length
    windows = force[: count * length].reshape(count, length, 3)
    whole = windows[np.isfinite(windows).all(axis=(1, 2))]
    sizes: Floats = np.linalg.norm(whole.mean(axis=1), axis=1)
    return sizes


def restore_gravity(
    recording: Recording, accel: str, needed: bool, gyro: str = "gyro"
) -> tuple[Recording, tuple[str, ...], tuple[str, ...]]:
    """Add gravity to an accelerometer without gravity in its samples.

    Parameters
    ----------
    recording : Recording
        Recording. Its log ``gravity`` is added, if present and on the accelerometer's clock. Values
        in g point down, as on Apple's devices, so their sum is negated.
    accel : str
        Name of the accelerometer.
    needed : bool
        True: raise an error if gravity cannot be added. False: return an alarm.
    gyro : str
        Name of the gyro of the same device.

    Returns
    -------
    tuple
        Recording, alarms and notes.

    Raises
    ------
    LogError
        If gravity is absent and needed, and no column contains it.
    """
    log = recording.get(accel)
    if log is None or not lacks_gravity(log, recording.get(gyro)):
        return recording, (), ()
    gravity = recording.get("gravity")
    named = ", ".join(log.names)
    if gravity is not None and gravity.data.shape == log.data.shape:
        force, action = _add_gravity(log, gravity)
        note = f"{named}: acceleration without gravity; {action}"
        return replace(recording, logs={**recording, accel: force}), (), (note,)
    sentence = make_sentence(
        f"{named}: gravity is absent, as in a phone's linear acceleration; record the "
        f"accelerometer itself, or name its columns with ",
        keyword_argument("columns", "", "columns={'accel': ...}"),
    )
    if needed:
        raise LogError(sentence)
    return recording, (sentence,), ()


def _add_gravity(accel: Log, gravity: Log) -> tuple[Log, str]:
    """Return the specific force, upward at rest, and a note on the change."""
    unit = gravity.unit if gravity.unit in UNITS else accel.unit
    data = accel.data + convert(gravity.data, unit, accel.unit)
    added = f"{', '.join(gravity.names)} is added"
    if unit != _APPLE_UNIT:
        return replace(accel, data=data), added
    return replace(accel, data=-data), f"{added}, and the sum negated, since values in g point down"
