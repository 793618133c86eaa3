"""Comparison of two calibrations of one IMU: the parameters that have changed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate import _native
from zerorate.calibration.calibration import Calibration
from zerorate.calibration.parameters import PARAMETERS
from zerorate.noise.coefficient import Coefficient
from zerorate.types import Floats, Integers
from zerorate.units import UNITS, convert
from zerorate.views import Result

_MIN_MOVED_Z: Final = 3.0
"""Number of standard errors above which a parameter has changed."""
_SESSION_BIAS_G: Final = 3e-3
"""Usual change of an accelerometer's bias between sessions, g."""
_MIN_WARMING_K: Final = 5.0
"""Temperature difference of two records, K, that may explain a changed parameter."""
_MAX_NAMES: Final = 6
"""Largest number of parameters that a note names."""


@dataclass(frozen=True)
class MovedParameter:
    """Change of one parameter between two calibrations.

    Attributes
    ----------
    name : str
        Name from `Calibration.parameters`.
    first, second : Coefficient
        Values in the first and the second calibration, raw unit.
    difference : Coefficient
        Second value minus first value, with the standard error of this difference.
    z : float
        Difference divided by its standard error; NaN if the parameter is not compared.
    moved : bool
        True if the absolute value of z exceeds 3.
    reason : str
        Reason why the parameter is not compared, or a sentence on its change.

    Examples
    --------
    >>> import zerorate as zr
    >>> truth = zr.simulation.simulate_session(6, seed=1).truth
    >>> one = zr.compare_calibrations(truth, truth).parameters[0]
    >>> one.name, float(one.difference), one.moved
    ('accel.matrix.xx', 0.0, False)
    """

    name: str
    first: Coefficient
    second: Coefficient
    difference: Coefficient
    z: float
    moved: bool
    reason: str


@dataclass(frozen=True)
class CalibrationComparison(Result):
    """Result of `compare_calibrations`; `print` shows it as a table.

    Attributes
    ----------
    parameters : tuple of MovedParameter
        All parameters, in the order of `Calibration.parameters`.
    chi_squared : float
        Chi-squared of all compared differences, from their covariance.
    degrees_of_freedom : int
        Number of compared parameters.
    probability : float
        Probability of this chi-squared or a larger one if nothing has changed; NaN if no parameter
        is compared.
    gyro_unit, accel_unit : str
        Raw units of both calibrations.
    notes : tuple of str
        Sentences on the comparison.

    Examples
    --------
    >>> import zerorate as zr
    >>> from zerorate.simulation import simulate_session
    >>> first, second = (zr.calibrate(simulate_session(12, seed=seed).recording) for seed in (3, 4))
    >>> found = zr.compare_calibrations(first, second)  # of two sensors, not of one
    >>> found.probability < 0.01, found.moved[0].moved
    (True, True)
    """

    parameters: tuple[MovedParameter, ...]
    chi_squared: float
    degrees_of_freedom: int
    probability: float
    gyro_unit: str
    accel_unit: str
    notes: tuple[str, ...]

    @property
    def moved(self) -> tuple[MovedParameter, ...]:
        """Parameters that changed by more than three standard errors, largest z first."""
        return tuple(sorted((p for p in self.parameters if p.moved), key=lambda p: -abs(p.z)))


def compare_calibrations(first: Calibration, second: Calibration) -> CalibrationComparison:
    """Compare two calibrations of one IMU, parameter by parameter.

    Use it to find significant changes, for example after a shock or after a year.

    Parameters
    ----------
    first, second : Calibration
        Calibrations in the same units and frame, from different records.

    Returns
    -------
    CalibrationComparison
        z of each parameter, the changed parameters, and the probability of these differences if no
        parameter has changed.

    Raises
    ------
    ValueError
        If units or frames differ.

    Notes
    -----
    z is the difference divided by the root of the sum of both variances. z is computed for
    parameters that both records determine. Standard errors are valid within a session. From one
    session to the next, the bias of a consumer accelerometer changes by about 1 mg. The bias of a
    gyro changes with temperature and at each power-on.

    If none of 30 parameters has changed, one comparison in twelve still has an absolute z above 3.

    Examples
    --------
    >>> import zerorate as zr
    >>> truth = zr.simulation.simulate_session(6, seed=1).truth
    >>> found = compare_calibrations(truth, truth)
    >>> found.moved, found.degrees_of_freedom
    ((), 0)
    """
    _check_comparable(first, second)
    difference = second.values - first.values
    covariance = first.covariance + second.covariance
    variance = np.diagonal(covariance)
    is_counted = first.identifiable & second.identifiable & (variance > 0.0)
    z = np.full(difference.size, np.nan)
    z[is_counted] = difference[is_counted] / np.sqrt(variance[is_counted])
    unit = second.accel_units[0]
    rows = tuple(_compare_parameter(i, first, second, z[i], unit) for i in range(difference.size))
    indices = np.flatnonzero(is_counted)
    chi_squared = _chi_squared(difference, covariance, indices)
    probability = (
        _native.chi_squared_survival(chi_squared, indices.size) if indices.size else math.nan
    )
    notes = (*_notes(rows, first, second), *_validity_notes(first, second))
    return CalibrationComparison(
        rows, chi_squared, indices.size, probability, first.gyro_units[0], unit, notes
    )


def _check_comparable(first: Calibration, second: Calibration) -> None:
    pairs = (
        ("units of the accelerometer", first.accel_units, second.accel_units),
        ("units of the gyro", first.gyro_units, second.gyro_units),
        ("frame", first.frame, second.frame),
    )
    for name, first_value, second_value in pairs:
        if first_value != second_value:
            values = " and ".join(
                " to ".join(x) if isinstance(x, tuple) else repr(x)
                for x in (first_value, second_value)
            )
            advice = f": bring both into one by {'to_frame' if name == 'frame' else 'in_units'}"
            raise ValueError(f"the {name} must be the same in both, got {values}{advice}")


def _chi_squared(difference: Floats, covariance: Floats, indices: Integers) -> float:
    """Return the chi-squared of the differences, scaled first for independence of units."""
    if not indices.size:
        return 0.0
    submatrix = covariance[np.ix_(indices, indices)]
    size = np.sqrt(np.diagonal(submatrix))
    correlation, z = submatrix / np.outer(size, size), difference[indices] / size
    # A rounding difference between nearly dependent parameters must not count.
    return float(z @ np.linalg.pinv(correlation, rcond=1e-12, hermitian=True) @ z)


def _compare_parameter(
    index: int, first: Calibration, second: Calibration, z: float, accel_unit: str
) -> MovedParameter:
    name = PARAMETERS[index]
    first_value, second_value = (_coefficient(c, index) for c in (first, second))
    difference = Coefficient(
        second_value.value - first_value.value, math.hypot(first_value.sigma, second_value.sigma)
    )
    moved = bool(abs(z) > _MIN_MOVED_Z)
    reason = (
        _describe_exclusion(first.identifiable[index], second.identifiable[index])
        if math.isnan(z)
        else ""
    )
    if moved and name.startswith("accel.bias") and accel_unit in UNITS:
        usual = abs(convert(difference.value, accel_unit, "g")) <= _SESSION_BIAS_G
        reason = "as far as is usual between sessions" if usual else ""
    return MovedParameter(name, first_value, second_value, difference, float(z), moved, reason)


def _coefficient(calibration: Calibration, index: int) -> Coefficient:
    value = float(calibration.values[index])
    sigma = math.sqrt(float(calibration.covariance[index, index]))
    known = Coefficient(value, sigma)
    if calibration.identifiable[index]:
        return known
    return Coefficient(value, sigma, identifiable=False, upper_bound=known.upper_bound)


def _describe_exclusion(first: bool, second: bool) -> str:
    if first and second:
        return "fixed"
    which = "either" if not (first or second) else "the second" if first else "the first"
    return f"not identifiable in {which}"


def _notes(
    rows: tuple[MovedParameter, ...], first: Calibration, second: Calibration
) -> Iterator[str]:
    moved = [row.name for row in sorted(rows, key=lambda row: -abs(row.z)) if row.moved]
    usual = [row.name for row in rows if row.reason.startswith("as far")]
    if not any(not math.isnan(row.z) for row in rows):
        yield "no parameter can be compared"
    elif moved:
        counted = sum(not math.isnan(row.z) for row in rows)
        yield f"moved by more than {_MIN_MOVED_Z:g} standard errors: {_list_names(moved)}"
        if len(moved) > max(0.5 * counted, _MAX_NAMES):
            yield "most parameters have changed: are sensor, mounting and reading options the same?"
    else:
        yield f"no parameter has changed by more than {_MIN_MOVED_Z:g} standard errors"
    if usual:
        yield (
            f"{', '.join(usual)}: the bias of an accelerometer changes by about 1 mg between "
            f"sessions, which the standard error of one session does not include"
        )
    if any(name.startswith("gyro.bias") for name in moved):
        yield "the bias of a gyro changes with temperature and at each start"
    if None not in (first.temperature, second.temperature):
        warmer = float(second.temperature or 0.0) - float(first.temperature or 0.0)
        if abs(warmer) > _MIN_WARMING_K:
            yield f"the second record is {warmer:+.1f} K warmer, which may change bias and scale"
    if first.gravity != second.gravity:
        yield (
            f"gravity was taken as {first.gravity:.5f} and {second.gravity:.5f} m/s^2, which moves "
            "the scale of the accelerometer"
        )


def _list_names(names: list[str]) -> str:
    """Return the first names, and the number of the remaining names."""
    more = len(names) - _MAX_NAMES
    return ", ".join(names[:_MAX_NAMES]) + (f" and {more} more" if more > 0 else "")


def _validity_notes(first: Calibration, second: Calibration) -> Iterator[str]:
    for name, calibration in (("first", first), ("second", second)):
        if not calibration.valid:
            yield f"the {name} calibration is not valid: {calibration.problems[0]}"
