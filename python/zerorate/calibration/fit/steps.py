"""Calibration of two logs, step by step."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zerorate.calibration.calibration import Calibration
from zerorate.calibration.errors import CalibrationError
from zerorate.calibration.fit.assembly import Case, assemble_calibration
from zerorate.calibration.fit.assessment import describe_gyro_axes
from zerorate.calibration.fit.joint_fit import Prior
from zerorate.calibration.fit.priors import PriorName, check_gravity, choose_prior
from zerorate.calibration.fit.rests import (
    MAX_VARIANCE_RATIO,
    Stillness,
    detect_rests,
    find_clipped_axes,
    measure_rests,
)
from zerorate.calibration.fit.sensors import (
    STANDARD_GRAVITY,
    UNNAMED,
    Sensor,
    Source,
    choose_logs,
    prepare_sensor,
)
from zerorate.calibration.fit.solution import GSensitivity, Record, Solution, solve
from zerorate.calibration.fit.turns import (
    GAP,
    LONG,
    MAX_TURN_S,
    SATURATED,
    find_saturated,
    find_turns,
)
from zerorate.calibration.options import CALIBRATION_OPTIONS, GRAVITY_RANGE_M_S2
from zerorate.calibration.parameters import Frame
from zerorate.calibration.record import Origin, Rest, Turn
from zerorate.faults import ArgumentError
from zerorate.noise.coefficient import check_positive
from zerorate.record.log import Log, LogError
from zerorate.record.recording import Recording

_MIN_RESTS: Final = 4
_MIN_TURNS: Final = 6
_MAX_JITTER_PERIODS: Final = 0.05

_MAX_CONDITION: Final = 1e6
_MAX_VARIANCE_RATIO: Final = 1.1
_CONTRADICTION: Final = "rests and rotations contradict each other: check axes, units and clocks"

_POSES_ADVICE: Final = (
    "hold it still for five seconds in each of 12 poses or more, and rotate it between them"
)
_REMEDIES: Final = {
    SATURATED: "rotate more slowly, or set a larger range of the gyro",
    LONG: f"rest after each turn, within {MAX_TURN_S:.0f} s",
    GAP: "repeat the rotations with missing gyro samples",
    "turning": "hold it still in each pose; if it was, check the unit of the gyro",
    "force": "hold it still in each pose; if it was, check the accelerometer",
    "clipped": "set a larger range of the accelerometer",
}
"""First advice, by the most frequent reason for unused rests and rotations."""

_MAX_REST_RATE_RAD_S: Final = 3.0 * np.pi / 180.0
"""Largest rate of a rest, rad/s, relative to the usual rate at rest: faster intervals are steady
rotations.
"""


@dataclass(frozen=True)
class Choices:
    """Arguments of `zerorate.calibrate` other than data; ValueError for an invalid value."""

    gravity: float | None
    g_sensitivity: GSensitivity
    frame: Frame
    prior: PriorName
    saturation: float | None

    def __post_init__(self) -> None:
        """Check all arguments."""
        least, most = GRAVITY_RANGE_M_S2
        valid = {
            "g_sensitivity": self.g_sensitivity in ("auto", True, False),
            "frame": self.frame in CALIBRATION_OPTIONS["frame"].choices,
            "prior": self.prior in CALIBRATION_OPTIONS["prior"].choices,
            "gravity": least <= check_positive("gravity", self.local_gravity) <= most,
        }
        for name in (name for name in valid if not valid[name]):
            expected = CALIBRATION_OPTIONS[name].expected
            raise ArgumentError(name, f"must be {expected}, got {getattr(self, name)!r}")
        if self.saturation is not None:
            check_positive("saturation", self.saturation)

    @property
    def local_gravity(self) -> float:
        """Gravity, m/s^2."""
        return STANDARD_GRAVITY if self.gravity is None else self.gravity


def run_calibration(
    choices: Choices,
    recording: Recording | None,
    *,
    gyro: Source,
    accel: Source,
    rate: float | None,
    rests: Iterable[Rest | tuple[float, float]] | None,
) -> Calibration:
    """Return the calibration of two logs; arguments and errors as of `zerorate.calibrate`."""
    gravity = choices.local_gravity
    logs = choose_logs(recording, gyro, accel, rate)
    sensors = prepare_sensor("gyro", logs[0], gravity), prepare_sensor("accel", logs[1], gravity)
    static, stillness = detect_rests(*sensors) if rests is None else measure_rests(*sensors, rests)
    static = _exclude_wrong_force(_exclude_turning(static, sensors[0]), sensors[1])
    static = _exclude_clipped(static, sensors[1], stillness)
    turns = find_turns(static, sensors[0], find_saturated(sensors[0], choices.saturation))
    record = Record.of(*sensors, static, turns, stillness)
    notes = _notes(choices.gravity, logs, sensors)
    origin = _origin(recording, logs)
    case = Case(record, static, turns, gravity, notes, _mean_temperature(recording), origin)
    if record.rests:
        # If the unit is wrong, report this instead of the lack of rests.
        check_gravity(record, gravity)
    _check_enough(case, choices)
    calibration = _solve_case(case, choices)
    return calibration if choices.frame == "x" else calibration.to_frame(choices.frame)


def _origin(recording: Recording | None, logs: Sequence[Log]) -> Origin:
    """Return the source and channel names of a recording, without the names made for arrays."""
    gyro, accel = (() if log.meta.get(UNNAMED) else log.names for log in logs)
    return Origin("" if recording is None else recording.source, gyro, accel)


def _notes(gravity: float | None, logs: Sequence[Log], sensors: Sequence[Sensor]) -> list[str]:
    """Return notes on the assumptions made about a recording, and on its oddities."""
    notes = []
    if gravity is None:
        notes.append(
            "gravity was not given: 9.80665 m/s^2 is assumed, which may be wrong by up to 0.3 %, "
            "and so may the accelerometer's scale"
        )
    for log, sensor in zip(logs, sensors, strict=True):
        if not sensor.known:
            notes.append(
                f"the {sensor.kind} has no known unit: its scale is from gravity and the rotations"
            )
        notes += _outlier_notes(sensor)
        clock = log.meta.get("clock")
        if log.stamps is not None:
            notes.append(
                f"the clock of the {sensor.kind} wanders: its samples were interpolated to a "
                f"uniform clock"
            )
        if clock is not None and clock.jitter_rms * log.rate > _MAX_JITTER_PERIODS:
            notes.append(
                f"the stamps of the {sensor.kind} jitter by "
                f"{100 * clock.jitter_rms * log.rate:.0f} % "
                "of a period, which may reduce the accuracy of rotations"
            )
    notes.append(
        "errors are those within this record: the bias of a MEMS accelerometer changes by about 1 "
        "mg between power-ons"
    )
    return notes


def _outlier_notes(sensor: Sensor) -> list[str]:
    """Return a note on samples that were left out as outliers at rest."""
    indices, values = sensor.outliers
    if not indices.size:
        return []
    listed = ", ".join(f"{value:.4g}" for value in values[0])
    first = f"{listed} {sensor.unit} at {sensor.start + indices[0] / sensor.rate:.3f} s"
    if indices.size == 1:
        return [f"a sample of the {sensor.kind} is an outlier in a rest and was left out: {first}"]
    return [
        f"{indices.size} samples of the {sensor.kind} are outliers in rests and were left out, "
        f"first "
        f"{first}"
    ]


def _mean_temperature(recording: Recording | None) -> float | None:
    """Return the mean temperature of the recording, degC; None if unknown."""
    log = None if recording is None else recording.temperature
    if log is None:
        return None
    finite = log.data[np.isfinite(log.data)]
    return float(finite.mean()) if finite.size else None


def _exclude_turning(rests: list[Rest], gyro: Sensor) -> list[Rest]:
    """Return the rests; steady rotations are marked as not used."""
    if not rests or not gyro.known:
        return rests
    usual = np.median([rest.gyro for rest in rests], axis=0)
    return [_mark_turning(rest, float(np.abs(rest.gyro - usual).max())) for rest in rests]


def _exclude_wrong_force(rests: list[Rest], accel: Sensor) -> list[Rest]:
    """Return the rests; rests without gravity on the accelerometer are marked as not used."""
    if not rests:
        return rests
    sizes = np.linalg.norm([rest.accel for rest in rests], axis=1)
    usual = float(np.median(sizes))
    if not usual > 0.0:
        raise LogError("the accel shows 0 at rest on all axes, expected gravity")
    # A sensor of unknown unit may have a bias as large as gravity.
    least, most = (0.5, 1.5) if accel.known else (0.1, 10.0)
    return [
        rest
        if least * usual < size < most * usual
        else replace(rest, used=False, reason=f"force: {size / usual:.2g} of that at other rests")
        for rest, size in zip(rests, sizes, strict=True)
    ]


def _exclude_clipped(rests: list[Rest], accel: Sensor, stillness: Stillness) -> list[Rest]:
    """Return the rests; rests at the end of the accelerometer's range are marked as not used."""
    return [
        replace(rest, used=False, reason=f"clipped: {axis} is at the end of the accel's range")
        if axis and rest.used
        else rest
        for rest, axis in zip(rests, find_clipped_axes(accel, rests, stillness), strict=True)
    ]


def _mark_turning(rest: Rest, rate: float) -> Rest:
    if rate <= _MAX_REST_RATE_RAD_S:
        return rest
    reason = f"turning: {np.degrees(rate):.0f} deg/s more than at other rests"
    return replace(rest, used=False, reason=reason)


def _solve_case(case: Case, choices: Choices, problems: Sequence[str] = ()) -> Calibration:
    check_gravity(case.record, case.gravity)
    prior = choose_prior(case.record, choices.prior)
    axes = [describe_gyro_axes(prior.gyro)] if _is_permuted(case.record, prior) else []
    try:
        solution = solve(case.record, prior, choices.g_sensitivity)
        _check_size(solution, prior)
        return assemble_calibration(case, prior, solution, (*problems, *axes))
    except np.linalg.LinAlgError:
        raise LogError(_CONTRADICTION) from None


def _check_size(solution: Solution, prior: Prior) -> None:
    """Raise an error for diverged sensors, because their inverse would be noise."""
    for matrix, start in (
        (solution.fit.accel, prior.accel),
        (solution.fit.gyro, prior.gyro),
    ):
        ratio = abs(np.linalg.det(matrix) / np.linalg.det(start))
        if (
            not 1.0 / _MAX_CONDITION < ratio < _MAX_CONDITION
            or np.linalg.cond(matrix) > _MAX_CONDITION
        ):
            raise LogError(_CONTRADICTION)
    # A record cannot increase a standard error.
    sigmas = np.diagonal(solution.fit.covariance) / prior.sigmas**2
    if not ((sigmas > 0.0) & (sigmas < _MAX_VARIANCE_RATIO)).all():
        raise LogError(_CONTRADICTION)


def _is_permuted(record: Record, prior: Prior) -> bool:
    return record.gyro.known and not np.array_equal(prior.gyro, np.eye(3))


def _check_enough(case: Case, choices: Choices) -> None:
    """Raise CalibrationError, with the incomplete result, for too few rests or rotations."""
    record = case.record
    if len(record.rests) >= _MIN_RESTS and len(record.turns) >= _MIN_TURNS:
        return
    text = (
        f"{_format_count(record.rests, case.rests, 'rest')} and "
        f"{_format_count(record.turns, case.turns, 'turn')} can be used, and a calibration needs "
        f"{_MIN_RESTS} and {_MIN_TURNS}"
    )
    attempt = _try_solving(case, choices, text)
    undetermined_count = 0 if attempt is None else int((~attempt.identifiable[:24]).sum())
    parts = [f"{text}: {_choose_remedy(case)}"]
    if undetermined_count:
        parts.append(f"{undetermined_count} of 18 parameters are not identifiable")
    parts += _describe_unused(case)
    raise CalibrationError(
        "; ".join([*parts, _describe_stillness(record), _describe_bias(record)]), attempt
    )


def _format_count(used: Sequence[object], found: Sequence[object], name: str) -> str:
    many = "" if len(found) == 1 else "s"
    if len(used) == len(found):
        return f"{len(used)} {name}{many}"
    return f"{len(used)} of {len(found)} {name}{many}"


def _choose_remedy(case: Case) -> str:
    """Return the most useful advice: against the commonest reason, or else more poses."""
    counts = Counter(reason for _, reason in _unused_reasons(case))
    if not counts or len(case.rests) <= _MIN_TURNS:
        return _POSES_ADVICE
    return _REMEDIES.get(counts.most_common(1)[0][0], _POSES_ADVICE)


def _unused_reasons(case: Case) -> list[tuple[str, str]]:
    """Return the kind (rest or rotation) and the short reason of each unused interval."""
    kinds: tuple[tuple[str, Sequence[Rest | Turn]], ...] = (
        ("rest", case.rests),
        ("turn", case.turns),
    )
    return [
        (kind, interval.reason.partition(":")[0])
        for kind, items in kinds
        for interval in items
        if not interval.used
    ]


def _describe_unused(case: Case) -> list[str]:
    """Return the numbers of unused rests and rotations by reason."""
    counts = Counter(_unused_reasons(case)).items()
    counts_text = [f"{n} {kind}{'' if n == 1 else 's'} ({reason})" for (kind, reason), n in counts]
    return [f"left out: {', '.join(counts_text)}"] if counts_text else []


def _try_solving(case: Case, choices: Choices, text: str) -> Calibration | None:
    if len(case.record.rests) < 2 or not case.record.turns:
        return None
    try:
        return _solve_case(case, choices, [text])
    except LogError:
        return None


def _describe_stillness(record: Record) -> str:
    floors = (
        f"{_quietest_rms(record, sensor):.2g} {sensor.unit}"
        for sensor in (record.gyro, record.accel)
    )
    return (
        f"the longest still stretch is {record.stillness.longest:.1f} s, still being a variance "
        f"below {MAX_VARIANCE_RATIO:g} times that of the quietest, {' and '.join(floors)} RMS"
    )


def _quietest_rms(record: Record, sensor: Sensor) -> float:
    """Return the RMS of a sensor in its quietest part, raw unit; 0 for a constant."""
    floor = float(np.sqrt(record.stillness.floor[sensor.kind].mean())) / sensor.factor
    return floor if floor > np.finfo(float).eps else 0.0


def _describe_bias(record: Record) -> str:
    if not record.rests:
        return "without a rest the gyro's bias is not known"
    bias = np.average(record.gyro_means, axis=0, weights=record.lengths) / record.gyro.factor
    return f"the gyro's bias is {', '.join(f'{b:.4g}' for b in bias)} {record.gyro.unit} (x, y, z)"
