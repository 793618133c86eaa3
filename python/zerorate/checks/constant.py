"""Detection of sensors without a measurement: unused fields, dead axes, stuck magnetometers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.record.log import Log
from zerorate.record.recording import Recording
from zerorate.record.runs import runs
from zerorate.types import Booleans, Floats
from zerorate.units import UNITS, convert

_MIN_SAMPLES: Final = 100
"""Smallest number of equal samples that counts: a coarse sensor may repeat a value."""
_MIN_FROZEN_S: Final = 3.0
_MIN_TURN_RAD: Final = np.radians(5.0)
"""Rotation in which a magnetometer must change: one degree changes 50 uT by a microtesla."""
_KINDS: Final = ("gyro", "accel", "mag")


def drop_absent_sensors(recording: Recording) -> tuple[Recording, tuple[str, ...]]:
    """Exclude constant sensors if another sensor of the kind measures.

    A message such as ``sensor_msgs/Imu`` always has fields for a gyro and an accelerometer. A
    driver that publishes each sensor in its own topic fills the other fields with zeros.

    Returns
    -------
    tuple
        The recording, with the remaining sensors renumbered from the first, and notes.
    """
    notes: list[str] = []
    logs = dict(recording)
    for kind in _KINDS:
        names = [name for name in recording if _kind_of(name) == kind]
        absent = [name for name in names if _is_constant(recording[name])]
        if not absent or len(absent) == len(names):
            continue
        notes += [_describe_absent(recording[name]) for name in absent]
        measuring = [name for name in names if name not in absent]
        for name in names:
            del logs[name]
        logs |= {_numbered_name(kind, i): recording[name] for i, name in enumerate(measuring)}
    if not notes:
        return recording, ()
    return replace(recording, logs=logs), tuple(notes)


def _kind_of(name: str) -> str:
    stem, _, number = name.rpartition("_")
    return stem if number.isdigit() else name


def _numbered_name(kind: str, index: int) -> str:
    return f"{kind}_{index}" if index else kind


def _is_constant(log: Log) -> bool:
    """Return True if every axis of a log has one value in enough samples."""
    return log.n >= _MIN_SAMPLES and bool(constant_axes(log).all())


def constant_axes(log: Log) -> Booleans:
    """Return the mask of axes with one value in all samples present, shape (k,)."""
    with np.errstate(invalid="ignore"):
        low, high = np.fmin.reduce(log.data, axis=0), np.fmax.reduce(log.data, axis=0)
        same: Booleans = low == high
    return same


def _describe_absent(log: Log) -> str:
    where = log.meta.get("sensor")
    named = f"{', '.join(log.names)} of {where}" if where else ", ".join(log.names)
    values = ", ".join(f"{x:g}" for x in log.data[0])
    return f"{named}: {values} in every sample: the sensor measures nothing and is left out"


def describe_dead_axes(recording: Mapping[str, Log], names: tuple[str, ...]) -> Iterator[str]:
    """Yield a sentence for each sensor with an axis that never changes while its others do."""
    for name in names:
        log = recording.get(name)
        if log is None or log.channels < 2 or log.n < _MIN_SAMPLES:
            continue
        dead = constant_axes(log)
        if dead.any() and not dead.all():
            which = ", ".join(log.names[i] for i in np.flatnonzero(dead))
            value = log.data[0, int(np.flatnonzero(dead)[0])]
            yield f"{which}: {value:g} in every sample while the other axes change: a dead axis"


def mask_frozen_field(
    recording: Recording, gyro: str, mag: str
) -> tuple[Recording, tuple[str, ...]]:
    """Mask a magnetometer's samples that repeat one value during a rotation.

    Parameters
    ----------
    recording : Recording
        Recording with a gyro of a known unit; otherwise nothing is checked.
    gyro, mag : str
        Names of the logs.

    Returns
    -------
    tuple
        Recording, without the magnetometer if no sample is left; and alarms.
    """
    field, rates = recording.get(mag), recording.get(gyro)
    if field is None or rates is None or not _is_rate(rates):
        return recording, ()
    rotation = _cumulative_angle(rates)
    spans = [
        (first, last)
        for first, last in _equal_rows(field.data)
        if _is_frozen(field, rotation, first, last)
    ]
    if not spans:
        return recording, ()
    frozen = np.zeros(field.n, dtype=np.bool_)
    for first, last in spans:
        frozen[first:last] = True
    seconds = frozen.sum() / field.rate
    named = ", ".join(field.names)
    if frozen.mean() > 0.99:
        logs = {name: log for name, log in recording.items() if name != mag}
        alarm = f"{named}: one value in every sample while the gyro turns: it is left out"
        return replace(recording, logs=logs), (alarm,)
    data = np.where(frozen[:, np.newaxis], np.nan, field.data)
    alarm = f"{named}: one value for {seconds:.1f} s while the gyro turns: left out there"
    return replace(recording, logs={**recording, mag: replace(field, data=data)}), (alarm,)


def _is_rate(log: Log) -> bool:
    return log.channels == 3 and log.unit in UNITS and UNITS[log.unit].kind == "rate"


def _cumulative_angle(rates: Log) -> tuple[Floats, Floats]:
    """Return times, and the gyro's cumulative angle after removal of its median rate."""
    data = np.nan_to_num(
        convert(rates.data - np.nanmedian(rates.data, axis=0), rates.unit, "rad/s")
    )
    steps = np.diff(rates.sampled, append=rates.sampled[-1])
    return rates.sampled, np.cumsum(np.linalg.norm(data, axis=1) * steps)


def _equal_rows(data: Floats) -> Iterator[tuple[int, int]]:
    """Yield the first row and the row after the last of each run of equal rows."""
    same = np.concatenate(([False], (data[1:] == data[:-1]).all(axis=1)))
    yield from ((first - 1, last) for first, last in runs(same).tolist())


def _is_frozen(field: Log, rotation: tuple[Floats, Floats], first: int, last: int) -> bool:
    start, stop = field.sampled[first], field.sampled[last - 1]
    if stop - start < _MIN_FROZEN_S:
        return False
    before, after = np.interp([start, stop], *rotation)
    return bool(after - before > _MIN_TURN_RAD)
