"""Trials: gyros of a recording, with or without a reference for the motion."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, Unpack, get_args

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.formats import LogSource
from zerorate.io.reading import ReadArguments
from zerorate.io.recording import read_topic
from zerorate.record import Log, LogError, Recording
from zerorate.record.names import (
    UNKNOWN_UNIT,
    is_quaternion,
    looks_like_gyro,
    meaning_of,
    to_snake_case,
)
from zerorate.tasks.compare.slope import slope
from zerorate.types import Floats
from zerorate.units import UNITS, convert

Kind = Literal["rest", "turning", "orientation", "attitude"]
"""Kind of a comparison; the first three are also kinds of trials."""

KINDS: Final = get_args(Kind)

_SENSOR_WORD: Final = re.compile(r"(gyr|acc|mag)[a-z]*")
_TRIAL_LOGS: Final = ("gyro", "accel", "mag", "reference")


@dataclass(frozen=True, eq=False)
class Reference:
    """A rate about one axis from another instrument; its scale and sign may differ.

    Attributes
    ----------
    name : str
        Name of the column.
    rate : ndarray, shape (n,)
        Rate in rad/s, or in the column's unit if it is unknown; NaN where missing.
    """

    name: str
    rate: Floats


@dataclass(frozen=True, eq=False)
class Orientation:
    """Orientation of the sensor's axes, measured by another instrument.

    Attributes
    ----------
    names : tuple of str
        Names of the four columns.
    quaternions : ndarray, shape (n, 4)
        Quaternions w, x, y, z from sensor to world; NaN where missing.
    """

    names: tuple[str, ...]
    quaternions: Floats


@dataclass(frozen=True, eq=False)
class Trial:
    """Gyros of a recording, with or without a reference.

    Attributes
    ----------
    log : Log
        Gyros in rad/s, or in the log's unit if it is unknown.
    reference : Reference or None
        Measured rate about the axis of one gyro.
    orientation : Orientation or None
        Orientation of the three gyros together.
    accel, mag : Log or None
        Accelerometer and magnetometer of the gyros' device, with their own clocks and units. They
        have the gyros' device name, or are the only sensors of their kind.

    Examples
    --------
    >>> import zerorate as zr
    >>> table = {"gyro_z_dps": [0.1, 0.3, 0.2], "shaft_deg": [0.0, 1.0, 2.0]}
    >>> trial = zr.tasks.compare.read_trial(table, rate=100.0, reference="shaft_deg")
    >>> trial.kind, trial.log.unit, trial.angle
    ('turning', 'rad/s', 'rad')
    """

    log: Log
    reference: Reference | None = None
    orientation: Orientation | None = None
    accel: Log | None = None
    mag: Log | None = None

    @classmethod
    def of(cls, recording: Recording) -> Trial:
        """Return a trial with all gyros, on the clock of the first gyro.

        The reference is an orientation if the recording has four quaternion columns. Otherwise it
        is the angle or rate in the first reference column.

        Raises
        ------
        LogError
            If there is no gyro, or the gyros with a reference have no known unit.
        """
        log = _join_gyros(recording)
        truth = recording.reference
        if truth is None:
            return cls(log)
        if log.unit != "rad/s":
            raise LogError(
                make_sentence(
                    f"{recording.source}: motion needs gyros of a known unit, got '{log.unit}'; "
                    "give ",
                    keyword_argument("unit"),
                )
            )
        values = align_to_gyros(truth, log)
        if truth.channels == 4:
            companions = (_find_companion(recording, kind, log) for kind in ("accel", "mag"))
            return cls(log, None, Orientation(truth.names, values), *companions)
        return cls(log, Reference(truth.names[0], _reference_rate(recording, truth, log)))

    @property
    def kind(self) -> Kind:
        """Kind of the trial: "rest" if there is no reference."""
        if self.orientation is not None:
            return "orientation"
        return "rest" if self.reference is None else "turning"

    def check_axes(self) -> None:
        """Raise LogError if an axis has no samples."""
        for name, z in zip(self.log.names, self.log.data.T, strict=True):
            if not np.isfinite(z).any():
                raise LogError(f"{self.source}: {name} holds no sample: all are missing")

    @property
    def angle(self) -> str:
        """Unit of the integrated rates."""
        return "rad" if self.log.unit == "rad/s" else f"{self.log.unit} s"

    @property
    def source(self) -> str:
        """Path of the file, or "the log" if there is no file."""
        return str(self.log.meta.get("source", "the log"))


def read_trial(
    path: LogSource,
    *,
    unit: str | None = None,
    reference: str | None = None,
    quaternion: Sequence[str] | None = None,
    **arguments: Unpack[ReadArguments],
) -> Trial:
    """Return the gyros of a recording with its reference.

    Parameters
    ----------
    path, unit
        As in `zerorate.read_log`.
    reference : str, optional
        Column of an angle or rate about the axis of one gyro, from a shaft encoder or a rate table.
        The column is a rate if its unit or name says so. Otherwise it is an angle: in rad if its
        name ends in rad, else in deg. Scale and sign may differ from the gyro's.
    quaternion : sequence of str, optional
        Four columns w, x, y, z of the orientation from sensor to world. Default: columns with
        ``quat`` before the letter, such as ``ref_quat_w``. There is no default if `columns` are
        given.
    **arguments
        Arguments of `zerorate.read_log`; ``start`` and ``stop`` as in `zerorate.read_recording`.

    Returns
    -------
    Trial
        Gyros in rad/s if the unit is known.

    Raises
    ------
    LogError, ValueError, OSError, ImportError
        As `zerorate.read_log`. Also if a reference and a quaternion are both given, or a column is
        missing or contradicts its name. Also if the gyros' unit is unknown.

    Examples
    --------
    >>> import zerorate as zr
    >>> table = {"gyro_z_dps": [0.1, 0.3, 0.2], "shaft_deg": [0.0, 1.0, 2.0]}
    >>> trial = zr.tasks.compare.read_trial(table, rate=100.0, reference="shaft_deg")
    >>> trial.log.names, trial.reference.name
    (('gyro_z_dps',), 'shaft_deg')
    """
    return Trial.of(read_with_reference(path, unit, reference, quaternion, **arguments))


def read_with_reference(
    path: LogSource,
    unit: str | None,
    reference: str | None,
    quaternion: Sequence[str] | None,
    **arguments: Unpack[ReadArguments],
) -> Recording:
    """Return the recording for a trial of `read_trial`."""
    if reference is not None and quaternion is not None:
        raise ValueError("a log is compared with a reference or a quaternion, not with both")
    if quaternion is not None and len(quaternion) != 4:
        raise ValueError(f"a quaternion has four columns w, x, y, z, got {len(quaternion)}")
    truth = [reference] if reference is not None else quaternion
    bare = truth is None and arguments.get("columns") is not None
    only = ("gyro",) if bare else _TRIAL_LOGS
    recording = read_topic(path, reference=truth, unit=unit, only=only, **arguments)
    return recording if truth is not None else _keep_quaternion(recording)


def _keep_quaternion(recording: Recording) -> Recording:
    """Return a recording with its only quaternion as reference, or without a reference."""
    references = [
        log for log in recording.of_kind("reference") if any(map(is_quaternion, log.names))
    ]
    logs = {name: log for name, log in recording.items() if not name.startswith("reference")}
    if references:
        listed = [name for log in references for name in log.names]
        if len(references) > 1 or [to_snake_case(name)[-1] for name in listed] != list("wxyz"):
            raise LogError(
                f"{recording.source}: these columns are not one quaternion w, x, y, z: "
                f"{', '.join(listed)}"
            )
        logs["reference"] = references[0]
    return replace(recording, logs=logs)


def _join_gyros(recording: Recording) -> Log:
    """Return the channels of all gyros with the first gyro's topic and clock, if possible rad/s."""
    gyro_logs = [_to_si(log) for log in recording.of_kind("gyro")]
    if not gyro_logs:
        raise LogError(
            make_sentence(
                f"{recording.source}: no column looks like a gyro; choose with ",
                keyword_argument("columns"),
            )
        )
    first = gyro_logs[0]
    topic = first.meta.get("sensor")
    logs = [
        log for log in gyro_logs if _has_same_clock(log, first) and log.meta.get("sensor") == topic
    ]
    units = {log.unit for log in logs}
    if len(units) > 1:
        raise LogError(
            f"{recording.source}: the gyros differ in unit ({', '.join(sorted(units))}); "
            "choose columns of one unit"
        )
    if len(logs) == 1:
        return first
    notes = dict.fromkeys(note for log in logs for note in log.meta.get("notes", ()))
    return replace(
        first,
        data=np.hstack([log.data for log in logs]),
        names=tuple(name for log in logs for name in log.names),
        meta={**first.meta, "notes": tuple(notes)},
    )


def _has_same_clock(log: Log, other: Log) -> bool:
    return (log.n, log.rate, log.time[0]) == (other.n, other.rate, other.time[0])


def _find_companion(recording: Recording, kind: str, gyros: Log) -> Log | None:
    """Return the log of another kind with the gyros' sensor name, or the only log of its kind."""
    logs = [log for log in recording.of_kind(kind) if log.channels == 3]
    same_sensor = [log for log in logs if _sensor_key(log) == _sensor_key(gyros)]
    if same_sensor:
        return same_sensor[0]
    return logs[0] if len(logs) == 1 else None


def _sensor_key(log: Log) -> tuple[object, str]:
    """Return the key of a log's sensor: its topic, and the name without the kind's word.

    For example, ``left_gyro_x`` and ``left_accel_x`` belong to one sensor.
    """
    meaning = meaning_of(log.names[0])
    return log.meta.get("sensor"), "" if meaning is None else _SENSOR_WORD.sub("", meaning.sensor)


def align_to_gyros(log: Log, gyros: Log) -> Floats:
    """Return a log's samples, each at the nearest gyro sample; NaN elsewhere."""
    if _has_same_clock(log, gyros):
        return log.data
    indices = np.rint((log.time - gyros.time[0]) * gyros.rate).astype(np.int64)
    inside = (indices >= 0) & (indices < gyros.n)
    values = np.full((gyros.n, log.channels), np.nan)
    values[indices[inside]] = log.data[inside]
    return values


def _to_si(log: Log) -> Log:
    if log.unit not in UNITS or UNITS[log.unit].kind != "rate":
        return log
    return replace(log, data=convert(log.data, log.unit, "rad/s"), unit="rad/s")


def _reference_rate(recording: Recording, log: Log, gyros: Log) -> Floats:
    """Return a reference in rad/s if its unit is known; an angle without a unit is in deg."""
    rate = _to_si(log)
    if rate.unit == "rad/s" or (log.unit == UNKNOWN_UNIT and looks_like_gyro(log.names[0])):
        return align_to_gyros(rate, gyros)[:, 0]
    unit = "deg" if log.unit == UNKNOWN_UNIT else log.unit
    if unit not in UNITS or UNITS[unit].kind != "angle":
        raise LogError(
            f"{recording.source}: column '{log.names[0]}' is in {unit}, expected an angle or a rate"
        )
    angle = convert(align_to_gyros(log, gyros)[:, 0], unit, "rad")
    return slope(angle, gyros.rate)
