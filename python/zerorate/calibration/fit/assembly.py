"""Conversion of a solution to a `Calibration`: raw units, names, errors by rest and rotation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zerorate.calibration.calibration import Calibration
from zerorate.calibration.fit.assessment import find_problems, give_advice
from zerorate.calibration.fit.joint_fit import LOWER_TRIANGLE, Prior, forces
from zerorate.calibration.fit.priors import nominal_sensors
from zerorate.calibration.fit.rests import convert_to_raw
from zerorate.calibration.fit.sensors import STANDARD_GRAVITY
from zerorate.calibration.fit.solution import (
    Record,
    Solution,
    compute_errors,
    compute_held_out_errors,
)
from zerorate.calibration.parameters import (
    ACCEL_BIAS,
    ACCEL_MATRIX,
    G_SENSITIVITY,
    GYRO_BIAS,
    GYRO_MATRIX,
)
from zerorate.calibration.record import Origin, Rest, Turn
from zerorate.geometry.rotations import from_matrices, to_rotation_vectors
from zerorate.types import Booleans, Floats

_MIN_WEIGHT: Final = 0.5


@dataclass(frozen=True, eq=False)
class Case:
    """Contents of a recording, used or not.

    Parameters
    ----------
    record
        Record to fit.
    rests, turns
        All rests and all rotations.
    gravity
        Local gravity, m/s^2.
    notes
        Assumptions, one sentence each.
    temperature
        Mean temperature of the recording, degC; None if unknown.
    origin
        Source of the samples.
    """

    record: Record
    rests: Sequence[Rest]
    turns: Sequence[Turn]
    gravity: float
    notes: Sequence[str]
    temperature: float | None
    origin: Origin


@dataclass(frozen=True, eq=False)
class _Errors:
    """Errors at the used rests and rotations."""

    norms: Floats
    misses: Floats
    raw_norms: Floats
    raw_misses: Floats
    rotations: Floats
    held_out: bool


def assemble_calibration(
    case: Case, prior: Prior, solution: Solution, problems: Sequence[str]
) -> Calibration:
    """Return the calibration of a solution; `problems` are known before the fit."""
    record = case.record
    errors = _collect_errors(record, prior, solution)
    rests, turns = _complete_rests(case, solution, errors), _complete_turns(case, solution, errors)
    identifiable = _find_identifiable(solution)
    used = [turn for turn in turns if turn.used]
    fit_problems = find_problems(
        solution.fit,
        (record.accel.known, record.gyro.known),
        identifiable,
        [rest for rest in rests if rest.used],
        used,
        (errors.norms, errors.misses),
    )
    unused = [turn.reason.partition(":")[0] for turn in turns if not turn.used]
    notes = (*case.notes, *_g_notes(solution))
    return Calibration(
        values=_parameter_values(case, solution),
        covariance=_parameter_covariance(case, solution),
        identifiable=identifiable,
        accel_units=record.accel.units,
        gyro_units=record.gyro.units,
        gravity=case.gravity,
        rate=record.gyro.rate,
        rests=tuple(rests),
        turns=tuple(turns),
        norm_error=_rms(errors.norms),
        norm_error_raw=_rms(errors.raw_norms),
        carry_error=_rms(errors.misses),
        carry_error_raw=_rms(errors.raw_misses),
        held_out=errors.held_out,
        problems=(*problems, *fit_problems),
        advice=tuple(give_advice(solution.fit, prior, rests, used, unused)),
        notes=notes,
        temperature=case.temperature,
        origin=case.origin,
    )


def _g_notes(solution: Solution) -> list[str]:
    return ["g-sensitivity of the gyro was subtracted in the turns"] if solution.in_turns else []


def _rms(errors: Floats) -> float:
    return float(np.sqrt(np.mean(errors**2))) if len(errors) else float("nan")


def _collect_errors(record: Record, prior: Prior, solution: Solution) -> _Errors:
    raw_norms, raw_misses, _ = compute_errors(record, nominal_sensors(record, prior))
    sensors = solution.sensors if solution.in_turns else solution.without_g
    norms, misses, turns = compute_errors(record, sensors)
    held_out_pair = compute_held_out_errors(record, prior, solution)
    if held_out_pair is not None:
        norms, misses = held_out_pair
    held_out = held_out_pair is not None
    return _Errors(norms, misses, raw_norms, raw_misses, turns.rotations, held_out)


def _complete_rests(case: Case, solution: Solution, errors: _Errors) -> list[Rest]:
    """Return all rests in raw units, with direction and error."""
    record, fit = case.record, solution.fit
    fitted = iter(zip(fit.directions, errors.norms, strict=True))
    rests = []
    for rest in case.rests:
        force = forces(rest.accel[np.newaxis], fit.accel, fit.bias)[0]
        size = float(np.linalg.norm(force))
        up, norm = next(fitted) if rest.used else (force / max(size, 1e-300), size - 1.0)
        completed = replace(rest, direction=up, norm_error=float(norm))
        rests.append(convert_to_raw(completed, record.gyro, record.accel))
    return rests


def _complete_turns(case: Case, solution: Solution, errors: _Errors) -> list[Turn]:
    """Return all rotations; used ones with angle, axis and residual."""
    vectors = to_rotation_vectors(from_matrices(errors.rotations))
    fitted = iter(zip(vectors, errors.misses, errors.raw_misses, solution.fit.weights, strict=True))
    turns = []
    for turn in case.turns:
        if turn.used:
            vector, miss, raw_miss, weight = next(fitted)
            angle = float(np.linalg.norm(vector))
            turn = replace(
                turn,
                angle=angle,
                axis=vector / max(angle, 1e-300),
                residual=float(miss),
                residual_raw=float(raw_miss),
                reason="" if weight > _MIN_WEIGHT else f"outlier: counts as {weight:.1g} of a turn",
            )
        turns.append(turn)
    return turns


def _parameter_values(case: Case, solution: Solution) -> Floats:
    """Return the 33 parameters in the units of the result."""
    fit, rest, (accel, gyro) = solution.fit, solution.rest, (case.record.accel, case.record.gyro)
    values = np.zeros(33)
    values[ACCEL_MATRIX] = fit.accel.ravel() / _force_unit(case)
    values[ACCEL_BIAS] = fit.bias / accel.factor
    values[GYRO_MATRIX] = np.linalg.inv(fit.gyro).ravel()
    values[GYRO_BIAS] = rest.bias / gyro.factor
    values[G_SENSITIVITY] = rest.sensitivity.ravel() / gyro.factor * _per_g(case)
    return values


def _force_unit(case: Case) -> float:
    """Return gravity in the fit's unit of corrected samples."""
    return 1.0 if case.record.accel.known else case.gravity


def _per_g(case: Case) -> float:
    """Return the factor from numbers per local gravity to numbers per g."""
    return STANDARD_GRAVITY / case.gravity


def _parameter_covariance(case: Case, solution: Solution) -> Floats:
    fit, rest, (accel, gyro) = solution.fit, solution.rest, (case.record.accel, case.record.gyro)
    to_all = np.zeros((33, 18))
    to_all[ACCEL_MATRIX][3 * LOWER_TRIANGLE[:, 0] + LOWER_TRIANGLE[:, 1], range(6)] = (
        1.0 / _force_unit(case)
    )
    to_all[ACCEL_BIAS, 6:9] = np.eye(3) / accel.factor
    # dW = -W dM W.
    inverse = np.linalg.inv(fit.gyro)
    to_all[GYRO_MATRIX, 9:] = -np.kron(inverse, inverse.T)
    covariance = to_all @ fit.covariance @ to_all.T
    units = np.append(1.0, np.full(3, _per_g(case))) / gyro.factor
    for axis in range(3):
        indices = [GYRO_BIAS.start + axis, *range(24 + 3 * axis, 27 + 3 * axis)]
        axis_covariance = rest.covariance_of(axis) * np.outer(units, units)
        covariance[np.ix_(indices, indices)] = axis_covariance
    return np.asarray((covariance + covariance.T) / 2.0)


def _find_identifiable(solution: Solution) -> Booleans:
    """Return the mask of the 33 parameters that are fixed or that the record determines."""
    known = np.ones(33, dtype=bool)
    known[ACCEL_MATRIX][3 * LOWER_TRIANGLE[:, 0] + LOWER_TRIANGLE[:, 1]] = solution.identifiable[:6]
    known[ACCEL_BIAS] = solution.identifiable[6:9]
    # An element of W depends on the element of M at its index, or at the permuted index.
    axes = np.abs(solution.fit.gyro)
    axes = (axes > 0.5 * axes.max()).astype(float)
    undetermined = (~solution.identifiable[9:]).reshape(3, 3).astype(float)
    known[GYRO_MATRIX] = (axes.T @ undetermined @ axes.T == 0.0).ravel()
    known[G_SENSITIVITY] = solution.rest.identifiable.ravel()
    return known
