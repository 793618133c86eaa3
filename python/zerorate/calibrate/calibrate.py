"""Calibration of a gyroscope and an accelerometer from poses and turns by hand."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final, get_args

import numpy as np

from zerorate.calibrate.assembly import Case, assembled
from zerorate.calibrate.calibration import Calibration, Rest
from zerorate.calibrate.joint_fit import Prior
from zerorate.calibrate.judgement import handedness
from zerorate.calibrate.parameters import Frame
from zerorate.calibrate.rests import FLOORS, given_rests, rests_of
from zerorate.calibrate.sensors import STANDARD_GRAVITY, Sensor, Source, chosen, sensor
from zerorate.calibrate.solution import GSensitivity, Record, solve
from zerorate.calibrate.starts import PriorName, check_gravity, start_of
from zerorate.calibrate.turns import saturated, turns_between
from zerorate.io.log import Log, LogError, Recording
from zerorate.noise.coefficient import positive

__all__ = ["CalibrationError", "calibrate"]

_FEWEST_RESTS: Final = 4
_FEWEST_TURNS: Final = 6
_JITTER: Final = 0.05
_LEAST_GRAVITY: Final = 9.7
_MOST_GRAVITY: Final = 9.9

_TURNING: Final = 3.0 * np.pi / 180.0
"""Rate, rad/s, beyond the usual one at rest by which a steady turn differs from a rest."""


class CalibrationError(LogError):
    """A record has too few rests or turns; the message says what it has.

    Attributes
    ----------
    calibration : Calibration or None
        What they tell all the same, which is never valid; None if it is nothing.
    """

    def __init__(self, message: str, calibration: Calibration | None = None) -> None:
        """Keep the message to one line."""
        super().__init__(message)
        self.calibration = calibration


def calibrate(
    recording: Recording | None = None,
    *,
    gravity: float | None = None,
    accel: Source = None,
    gyro: Source = None,
    rate: float | None = None,
    rests: Iterable[Rest | tuple[float, float]] | None = None,
    g_sensitivity: GSensitivity = "auto",
    frame: Frame = "x",
    prior: PriorName = "datasheet",
    saturation: float | None = None,
) -> Calibration:
    """Calibrate a gyroscope and an accelerometer by poses at rest and turns by hand between them.

    Parameters
    ----------
    recording : Recording, optional
        With a gyro and an accelerometer, each on its own clock; NaN marks missing samples.
    gravity : float, optional
        Local gravity, m/s^2. Default 9.80665, from which it differs by up to 0.3 %: the scale of
        the accelerometer moves by as much, and nothing else.
    accel, gyro : str, Log or array_like, shape (n, 3), optional
        Which logs of the recording, if it has several; or the samples themselves. An array has no
        unit: gravity and the turns find it, and corrected samples are in rad/s and m/s^2.
    rate : float, optional
        Samples a second of arrays, Hz.
    rests : iterable of Rest or (start, stop), optional
        Where the sensor rested, s. Default: found by `find_rests`.
    g_sensitivity : {"auto", True, False}
        Whether what gravity does to the gyro is taken off in turns, too: "auto" if one of its
        elements differs from zero by three standard errors. It is estimated from rests anyway,
        but for False.
    frame : {"x", "z", "symmetric"}
        Axes of the body: as of `Calibration`.
    prior : {"datasheet", "wide"}
        What is known before: scale within 5 %, cross terms within 30 mrad, bias of the
        accelerometer within 100 mg (standard deviations); or nothing but that they are smaller
        than half of it. Sensors of unknown unit have the wide one.
    saturation : float, optional
        End of the gyro's range, raw unit. Default: the largest or smallest value of an axis, if
        it comes ten times.

    Returns
    -------
    Calibration
        Ask `valid` first: if it is False, ``problems`` says why, and ``advice`` what to do.

    Raises
    ------
    CalibrationError
        With fewer than 4 rests or 6 turns that can be used.
    LogError
        If a sensor is not there, has not three axes, or another unit than it says.
    ValueError, TypeError
        If an argument is not as described.

    Notes
    -----
    The method of Tedaldi, Pretto and Menegatti ("A robust and easy to implement method for IMU
    calibration without external equipments", ICRA 2014, section IV), rests and turns without any
    equipment, as one least-squares fit: the residuals are those of the sensors, in their standard
    errors, with a prior, so that the scale cannot vanish and the covariance is that of all at
    once. A parameter is not identifiable if its standard error is above 0.3 of the data sheet's;
    it stays where it was then.

    Six seconds in each of 20 poses, of all directions, and turns by 60 to 170 degrees about many
    axes determine everything. The bias of the accelerometer moves by about 1 mg from one switching
    on to the next.

    Examples
    --------
    >>> import zerorate as zr
    >>> calibration = zr.calibrate(zr.simulate_session(20, seed=3).recording)
    >>> calibration.valid, calibration.gyro.scale[0].identifiable, calibration.advice
    (True, True, ())
    """
    g = _checked(gravity, g_sensitivity, frame, prior, saturation)
    logs = chosen(recording, gyro, accel, rate)
    sensors = sensor("gyro", logs[0], g), sensor("accel", logs[1], g)
    notes = _notes(gravity, logs, sensors)
    found, stillness = rests_of(*sensors) if rests is None else given_rests(*sensors, rests)
    found = _without_turning(found, sensors[0])
    turns = turns_between(found, sensors[0], saturated(sensors[0], saturation))
    case = Case(
        Record.of(*sensors, found, turns, stillness), found, turns, g, notes, _warmth(recording)
    )
    _check_enough(case, g_sensitivity, prior)
    calibration = _calibrated(case, g_sensitivity, prior)
    return calibration if frame == "x" else calibration.to_frame(frame)


def _checked(
    gravity: float | None,
    g_sensitivity: GSensitivity,
    frame: Frame,
    prior: PriorName,
    saturation: float | None,
) -> float:
    """Return local gravity, m/s^2; ValueError if an argument is not as `calibrate` has it."""
    if g_sensitivity not in ("auto", True, False):
        raise ValueError(f"g_sensitivity must be 'auto', True or False, got {g_sensitivity!r}")
    for name, value, allowed in (
        ("frame", frame, get_args(Frame)),
        ("prior", prior, get_args(PriorName)),
    ):
        if value not in allowed:
            raise ValueError(f"{name} must be one of {', '.join(allowed)}, got {value!r}")
    if saturation is not None:
        positive("saturation", saturation)
    if gravity is None:
        return STANDARD_GRAVITY
    if not _LEAST_GRAVITY <= positive("gravity", gravity) <= _MOST_GRAVITY:
        raise ValueError(
            f"gravity must be that of a place on Earth in m/s^2, {_LEAST_GRAVITY} to "
            f"{_MOST_GRAVITY}, got {gravity}"
        )
    return float(gravity)


def _notes(gravity: float | None, logs: Sequence[Log], sensors: Sequence[Sensor]) -> list[str]:
    """Return what was assumed of a recording, and what is odd about it."""
    notes = []
    if gravity is None:
        notes.append(
            "gravity was not given: 9.80665 m/s^2 was taken, from which it differs by up to 0.3 % "
            "over the Earth; the scale of the accelerometer moves by as much, and nothing else"
        )
    for log, one in zip(logs, sensors, strict=True):
        if not one.known:
            notes.append(f"the {one.kind} has no known unit: gravity and the turns gave its scale")
        clock = log.meta.get("clock")
        if clock is not None and clock.jitter_rms * log.rate > _JITTER:
            notes.append(
                f"the stamps of the {one.kind} jitter by {100 * clock.jitter_rms * log.rate:.0f} % "
                "of a period: turns may be worse for it"
            )
    notes.append(
        "errors are those within this record: the bias of a MEMS accelerometer moves by about 1 mg "
        "from one switching on to the next"
    )
    return notes


def _warmth(recording: Recording | None) -> float | None:
    """Return the mean temperature of the recording, degC, None without one."""
    log = None if recording is None else recording.temperature
    if log is None:
        return None
    there = log.data[np.isfinite(log.data)]
    return float(there.mean()) if there.size else None


def _without_turning(rests: list[Rest], gyro: Sensor) -> list[Rest]:
    """Return the rests, those that are steady turns marked as not used."""
    if not rests or not gyro.known:
        return rests
    usual = np.median([rest.gyro for rest in rests], axis=0)
    faster = [float(np.abs(rest.gyro - usual).max()) for rest in rests]
    return [
        replace(rest, used=False, reason=f"turns at {np.degrees(rate):.0f} deg/s")
        if rate > _TURNING
        else rest
        for rest, rate in zip(rests, faster, strict=True)
    ]


def _calibrated(
    case: Case, g_sensitivity: GSensitivity, name: PriorName, problems: Sequence[str] = ()
) -> Calibration:
    check_gravity(case.record, case.gravity)
    prior = start_of(case.record, name)
    axes = [handedness(prior.gyro)] if _permuted(case.record, prior) else []
    solution = solve(case.record, prior, g_sensitivity)
    return assembled(case, prior, solution, (*problems, *axes))


def _permuted(record: Record, prior: Prior) -> bool:
    return record.gyro.known and not np.array_equal(prior.gyro, np.eye(3))


def _check_enough(case: Case, g_sensitivity: GSensitivity, prior: PriorName) -> None:
    """Refuse a record of too few rests or turns, with what it tells all the same."""
    record = case.record
    if len(record.rests) >= _FEWEST_RESTS and len(record.turns) >= _FEWEST_TURNS:
        return
    text = (
        f"{_counted(record.rests, case.rests, 'rest')} and "
        f"{_counted(record.turns, case.turns, 'turn')} can be used, and a calibration needs "
        f"{_FEWEST_RESTS} and {_FEWEST_TURNS}"
    )
    attempt = _attempt(case, g_sensitivity, prior, text)
    lost = 0 if attempt is None else int((~attempt.identifiable[:24]).sum())
    parts = [text]
    if lost:
        parts.append(f"{lost} of 18 parameters are not identifiable")
    reasons = dict.fromkeys(one.reason for one in (*case.rests, *case.turns) if not one.used)
    if reasons:
        parts.append(f"left out: {', '.join(reasons)}")
    raise CalibrationError("; ".join([*parts, _on_stillness(record), _on_bias(record)]), attempt)


def _counted(used: Sequence[object], found: Sequence[object], name: str) -> str:
    many = "" if len(found) == 1 else "s"
    if len(used) == len(found):
        return f"{len(used)} {name}{many}"
    return f"{len(used)} of {len(found)} {name}{many}"


def _attempt(
    case: Case, g_sensitivity: GSensitivity, prior: PriorName, text: str
) -> Calibration | None:
    if len(case.record.rests) < 2 or not case.record.turns:
        return None
    try:
        return _calibrated(case, g_sensitivity, prior, [text])
    except LogError:
        return None


def _on_stillness(record: Record) -> str:
    floors = (
        f"{np.sqrt(record.stillness.floor[one.kind].mean()) / one.factor:.2g} {one.unit}"
        for one in (record.gyro, record.accel)
    )
    return (
        f"the longest still stretch is {record.stillness.longest:.1f} s, still being a variance "
        f"below {FLOORS:g} times that of the quietest, {' and '.join(floors)} RMS"
    )


def _on_bias(record: Record) -> str:
    if not record.rests:
        return "without a rest the gyro's bias is not known"
    bias = np.average(record.gyro_means, axis=0, weights=record.lengths) / record.gyro.factor
    return f"the gyro's bias is {', '.join(f'{b:.4g}' for b in bias)} {record.gyro.unit} (x, y, z)"
