"""Preparation of a recording: contradictions are reported, and certain errors corrected.

Every task begins with the same preparation, so that all tasks use the same data. The table
`PREPARATIONS` has the steps with evidence, threshold, default and the option that changes the
default.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np

from zerorate.checks.check import check
from zerorate.checks.clipped import ClippedAxis, restore_recording
from zerorate.checks.constant import describe_dead_axes, drop_absent_sensors, mask_frozen_field
from zerorate.checks.gravity import restore_gravity
from zerorate.checks.held import drop_held_fixes
from zerorate.checks.impossible import mask_impossible_rates
from zerorate.checks.result import Checks, Finding
from zerorate.checks.spikes import drop_spikes
from zerorate.checks.stillness import SteadyRate, detect_steady_rate
from zerorate.faults import Argument, keyword_argument, make_sentence
from zerorate.numerals import shorten
from zerorate.record.fixes import Fixes
from zerorate.record.recording import Recording
from zerorate.record.samples import partner_name

Clipped: TypeAlias = Literal["auto", "restore", "leave"]
"""Treatments of clipped rates."""


class Remark(NamedTuple):
    """Remark of one check.

    Attributes
    ----------
    check : str
        Name of the check in `PREPARATIONS`.
    text : str
        Sentence on the observation or the correction.
    alarm : bool
        True for a contradiction, False for a note.
    """

    check: str
    text: str
    alarm: bool


@dataclass(frozen=True)
class PreparedRecording:
    """Recording that is ready for a task.

    Attributes
    ----------
    recording : Recording
        Corrected recording; its notes list the corrections.
    remarks : tuple of Remark
        Remarks of the checks, in the order of `PREPARATIONS`.
    gyro_fix : Finding or None
        Correction of the gyro's unit and axes. Other data of this gyro need the same correction.
    """

    recording: Recording
    remarks: tuple[Remark, ...] = ()
    gyro_fix: Finding | None = None

    @property
    def alarms(self) -> tuple[str, ...]:
        """Contradictions in the recording, one sentence each, with the option that corrects it."""
        return self.alarms_except()

    def alarms_except(self, *checks: str) -> tuple[str, ...]:
        """Return the alarms of all checks except the named checks."""
        source = self.recording.source
        return tuple(
            make_sentence(f"{source}: ", remark.text)
            for remark in self.remarks
            if remark.alarm and remark.check not in checks
        )


@dataclass(frozen=True)
class Choices:
    """Choices of a task or its user for the preparation.

    Attributes
    ----------
    gyro : str
        Name of the gyro that the task uses. The magnetometer of the same device is used.
    accel : str, optional
        Name of the accelerometer. Default: the accelerometer of the gyro's device.
    fix : bool
        Correct a unit or axes of the gyro if motion contradicts them.
    clipped : {"auto", "restore", "leave", "tell"}
        Treatment of clipped rates. "tell": an alarm, for tasks that use rates as measured.
    gravity : bool
        True if the task needs gravity: an error is raised if gravity is absent.
    bias_limit : float, optional
        Largest bias of this gyro, rad/s, if the user states it. A steady rate up to this limit is
        not a contradiction.
    correct : callable, optional
        Function that removes known errors from a recording, such as `zerorate.Calibration.apply`.
    skip : tuple of str
        Names of steps that the task performs itself.
    """

    gyro: str = "gyro"
    accel: str | None = None
    fix: bool = False
    clipped: Clipped | Literal["tell"] = "auto"
    gravity: bool = True
    bias_limit: float | None = None
    correct: Callable[[Recording], Recording] | None = None
    skip: tuple[str, ...] = ()

    def accel_name(self, recording: Recording) -> str:
        """Return the name of the accelerometer."""
        return self.accel or partner_name(recording, self.gyro, "accel")

    def mag_name(self, recording: Recording) -> str:
        """Return the name of the magnetometer."""
        return partner_name(recording, self.gyro, "mag")


class Step(NamedTuple):
    """Result of a step: recording, alarms and notes on the changes.

    `gyro_fix` is the correction of the gyro.
    """

    recording: Recording
    alarms: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    gyro_fix: Finding | None = None


class Preparation(NamedTuple):
    """Row of the table: a check with its evidence and consequence.

    Attributes
    ----------
    name : str
        Name of the check.
    evidence, threshold : str
        Evidence and threshold, with the reason.
    default, option : str
        Default action, and the argument that changes it.
    step : callable or None
        Function of the step. None for a check of fixes, which `prepare_fixes` performs.
    used_by : str
        Tasks that perform the step.
    """

    name: str
    evidence: str
    threshold: str
    default: str
    option: str
    step: Callable[[Recording, Choices], Step] | None
    used_by: str = "all tasks"


def prepare(recording: Recording, choices: Choices | None = None) -> PreparedRecording:
    """Prepare a recording for a task.

    Parameters
    ----------
    recording : Recording
        Recording as read from a file.
    choices : Choices, optional
        Choices of the task and its user.

    Returns
    -------
    Prepared
        Recording and its contradictions.

    Raises
    ------
    LogError
        If a task needs gravity and the acceleration lacks it.

    Examples
    --------
    >>> import zerorate as zr
    >>> from zerorate.checks.preparation import Choices, prepare
    >>> recording = zr.simulate_motion("hand", duration=60.0).recording()
    >>> wrong = zr.Log(**{**vars(recording.gyro), "data": recording.gyro.data * [1, -1, 1]})
    >>> made = prepare(zr.Recording({**recording, "gyro": wrong}, "hand.csv"), Choices(fix=True))
    >>> made.alarms
    ("hand.csv: the gyro's y axis has the opposite sign to the accelerometer's: corrected by fix",)
    """
    selected = choices or Choices()
    remarks: list[Remark] = []
    prepared, gyro_fix = recording, None
    for row in PREPARATIONS:
        if row.step is not None and row.name not in selected.skip:
            result = row.step(prepared, selected)
            prepared, gyro_fix = result.recording, gyro_fix or result.gyro_fix
            remarks += [Remark(row.name, entry, alarm=True) for entry in result.alarms]
            remarks += [Remark(row.name, entry, alarm=False) for entry in result.notes]
    notes = [entry.text for entry in remarks if not entry.alarm]
    all_notes = tuple(dict.fromkeys((*prepared.notes, *notes)))
    return PreparedRecording(
        replace(prepared, notes=all_notes) if notes else prepared, tuple(remarks), gyro_fix
    )


def prepare_fixes(fixes: Fixes) -> Fixes:
    """Return the fixes without repeated and isolated fixes, and notes on the excluded ones."""
    return drop_spikes(drop_held_fixes(fixes)[0])


def _drop_absent(recording: Recording, choices: Choices) -> Step:
    reduced, notes = drop_absent_sensors(recording)
    return Step(reduced, (), notes)


def _report_dead_axes(recording: Recording, choices: Choices) -> Step:
    names = (choices.gyro, choices.accel_name(recording), choices.mag_name(recording))
    return Step(recording, tuple(describe_dead_axes(recording, names)))


def _restore_gravity(recording: Recording, choices: Choices) -> Step:
    return Step(
        *restore_gravity(
            recording, choices.accel_name(recording), choices.gravity, gyro=choices.gyro
        )
    )


def _apply_correction(recording: Recording, choices: Choices) -> Step:
    return Step(recording if choices.correct is None else choices.correct(recording))


def _fix_axes(recording: Recording, choices: Choices) -> Step:
    checks = check_axes(recording, choices.gyro, choices.accel, scale=False)
    steady = find_steady_rate(recording, choices.gyro, choices.accel_name(recording))
    alarms = tuple(_contradictions(checks, choices, steady))
    if not (choices.fix and checks.gyro.exact) or steady is not None:
        return Step(recording, alarms)
    return Step(checks.apply(recording), alarms, gyro_fix=checks.gyro)


def check_axes(
    recording: Recording, gyro: str, accel: str | None = None, *, scale: bool = True
) -> Checks:
    """Return the check of units and axes by motion (`zerorate.check`)."""
    # Clipped or restored rates may fit wrong axes better than the correct axes.
    whole, sides = restore_recording(recording, gyro=gyro, certain=False)
    if sides:
        rates = recording[gyro]
        changed = (whole[gyro].data != rates.data).any(axis=1)
        known = rates.with_data(np.where(changed[:, np.newaxis], np.nan, rates.data))
        whole = replace(recording, logs={**recording, gyro: known})
    return check(whole, gyro=gyro, accel=accel, scale=scale)


def find_steady_rate(recording: Recording, gyro: str, accel: str) -> SteadyRate | None:
    """Return a gyro's steady rate without motion, None if there is none.

    It replaces the finding on unit and axes, which needs motion.
    """
    rates, forces = recording.get(gyro), recording.get(accel)
    return None if rates is None or forces is None else detect_steady_rate(rates, forces)


def _contradictions(checks: Checks, choices: Choices, steady: SteadyRate | None) -> Iterator[str]:
    if steady is not None:
        if choices.bias_limit is None or steady.size > choices.bias_limit:
            yield steady.text
    elif checks.gyro.alarm:
        yield make_sentence(checks.gyro.text, *_fix_advice(checks.gyro, choices.fix))
    if checks.magnetometer.alarm:
        yield checks.magnetometer.text
    if checks.clock:
        yield checks.clock


def _fix_advice(finding: Finding, fix: bool) -> tuple[str | Argument, ...]:
    option = keyword_argument("fix", "", "fix" if fix else "fix=True")
    if finding.exact:
        return (": corrected by ", option) if fix else (": ", option, " corrects it")
    return (": ", option, " changes nothing, because several corrections fit") if fix else ()


def _mask_frozen(recording: Recording, choices: Choices) -> Step:
    return Step(*mask_frozen_field(recording, choices.gyro, choices.mag_name(recording)))


def _mask_impossible(recording: Recording, choices: Choices) -> Step:
    return Step(*mask_impossible_rates(recording, choices.gyro))


def _restore_clipped(recording: Recording, choices: Choices) -> Step:
    if choices.clipped == "leave":
        return Step(recording)
    if choices.clipped == "tell":
        _, sides = restore_recording(recording, gyro=choices.gyro)
        certain_axes = (axis for axis in sides if axis.certain)
        return Step(
            recording,
            tuple(f"{_describe_clipped(axis)}: no rate is known there" for axis in certain_axes),
        )
    certain = choices.clipped == "auto"
    restored, sides = restore_recording(recording, gyro=choices.gyro, certain=certain)
    is_restored = restored is not recording
    return Step(restored, tuple(_clipped_remark(axis, is_restored, certain) for axis in sides))


def _describe_clipped(axis: ClippedAxis, verb: str = "is") -> str:
    limit = math.degrees(axis.sign * axis.limit)
    share = f"{shorten(100.0 * axis.share)} % of the samples"
    return f"gyro {axis.axis} {verb} clipped at {limit:.0f} deg/s in {share}"


def _clipped_remark(axis: ClippedAxis, done: bool, certain: bool) -> str:
    if not done:
        option = keyword_argument("clipped", "restore", "clipped='restore'")
        return make_sentence(_describe_clipped(axis, "may be"), ": ", option, " restores it")
    text = f"{_describe_clipped(axis)}, and restored from its flanks"
    if not certain:
        return text
    return make_sentence(
        text, ": ", keyword_argument("clipped", "leave", "clipped='leave'"), " leaves it"
    )


IMPOSSIBLE: Final = "impossible rates"
ABSENT: Final = "absent sensor"
DEAD: Final = "dead axis"
GRAVITY: Final = "gravity absent"
FROZEN: Final = "frozen magnetometer"
AXES: Final = "units and axes"
CLIPPED: Final = "clipped rates"
"""Names of checks that a task performs or reports itself."""

AS_MEASURED_CHOICES: Final = Choices(clipped="tell", skip=(GRAVITY,))
"""Choices of the tasks on noise and bias: clipped rates stay, gravity is not needed."""

FILTER_CHOICES: Final = replace(AS_MEASURED_CHOICES, skip=(GRAVITY, IMPOSSIBLE))
"""Choices of the tasks with a drift filter, which tests every rate itself, as in live use."""

PREPARATIONS: Final = (
    Preparation(
        ABSENT,
        "in each axis all samples are equal, while another sensor of the same kind measures",
        "at least 100 samples",
        "the sensor is excluded, with a note",
        "",
        _drop_absent,
    ),
    Preparation(
        DEAD,
        "all samples of an axis are equal, while the other axes change",
        "at least 100 samples",
        "an alarm",
        "columns",
        _report_dead_axes,
    ),
    Preparation(
        GRAVITY,
        "*low force*: 5th percentile of the mean force in windows of 0.25 s; in violent motion, "
        "median force of the windows of 0.1 s with the least rotation",
        "the low force is below 0.25 g, and below a quarter of the 90th percentile of the windows; "
        "in violent motion, below a quarter of the median of all windows",
        "gravity columns are added if present; otherwise tasks that need gravity raise an error",
        "columns",
        _restore_gravity,
        "all tasks except replay, allan and identify",
    ),
    Preparation(
        "known errors",
        "a calibration that the user passes",
        "",
        "the errors are removed from the samples",
        "calibration",
        _apply_correction,
        "tasks with a calibration",
    ),
    Preparation(
        FROZEN,
        "consecutive samples are equal, while the gyro measures a rotation",
        "at least 3 s and 5 deg of rotation",
        "the samples count as missing, with an alarm",
        "columns",
        _mask_frozen,
    ),
    Preparation(
        AXES,
        "3 units, and 48 orders and signs of the axes, are tried: with the correct ones, gravity "
        "and field stay constant during motion",
        "see `zerorate.check`",
        "an alarm; without motion a steady rate is reported as a bias",
        "fix",
        _fix_axes,
    ),
    Preparation(
        IMPOSSIBLE,
        "rates above the range of any gyro; single samples far larger than both neighbours",
        "any rate above 4000 deg/s; a rate above 1000 deg/s that is 8 times larger than both "
        "neighbours; a rate above 300 deg/s that is 50 times larger than both neighbours",
        "the samples count as missing; an alarm gives their number",
        "columns",
        _mask_impossible,
        "all tasks except replay, where the filter tests every rate",
    ),
    Preparation(
        CLIPPED,
        "samples at the largest value of an axis, and the flanks of the peak",
        "see `zerorate.checks.restore_recording`",
        "rates are restored if they are clipped beyond doubt; replay, allan, identify and compare "
        "only raise an alarm",
        "clipped",
        _restore_clipped,
        "all tasks except correct, calibrate and report",
    ),
    Preparation(
        "held fixes",
        "position and velocity are equal to the previous fix",
        "the median number of rows per fix is at least 2; or a fix repeats within half the usual "
        "interval",
        "the repeated fixes are excluded; a note gives their number",
        "",
        None,
        "navigate, report",
    ),
    Preparation(
        "wrong positions",
        "a single position is far from the line between the previous and the next fix",
        "the distance is above six standard deviations, and above eight times the median distance "
        "of all fixes, without its part from noise; only for receivers without velocities",
        "the wrong positions are excluded; a note gives their number",
        "",
        None,
        "navigate, report",
    ),
)
"""Steps in order; each checks the recording as corrected by the earlier steps."""
