"""Rate, unit and names of samples, from a log or from a frame's columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.record.clock import RATE_TOLERANCE
from zerorate.record.log import Log, check_rate
from zerorate.record.missing import floats, is_table, real_numbers
from zerorate.record.names import UNKNOWN_UNIT, split_unit
from zerorate.types import Floats
from zerorate.units import UNITS, canonical, convert

_SI_UNITS: Final = {"gyro": "rad/s", "accel": "m/s^2"}
_ARGUMENT_UNITS: Final[Mapping[str, Mapping[str, str]]] = {
    "FootFilter": _SI_UNITS,
    "NavigationBank": _SI_UNITS,
    "NavigationFilter": _SI_UNITS,
    "PositionFilter": {"position": "m", "speed": "m/s"},
    "TemperatureFilter": {"temperature": "degC"},
}
"""Units of arguments of compiled classes; all other classes have a ``gyro_unit``."""


def rate_of(rate: float | None, *records: object) -> float:
    """Return the rate of samples, Hz: the stated rate, else the rate of the first log.

    Raises
    ------
    ValueError
        If there is no rate, it is not positive and finite, or a log's rate differs by over 1 %.
    """
    logs = [record for record in records if isinstance(record, Log)]
    if rate is None and not logs:
        raise ArgumentError("rate", "must be given in Hz: only a Log has one of its own")
    hertz = check_rate(logs[0].rate if rate is None else rate)
    for log in logs:
        if abs(log.rate - hertz) > RATE_TOLERANCE * hertz:
            raise ArgumentError("rate", f"must be that of the log, {log.rate:g} Hz, got {hertz:g}")
    return hertz


def unit_of(unit: str | None, record: object) -> str | None:
    """Return the unit of samples as stated, else by the log or the columns' names.

    Raises
    ------
    ValueError
        If the samples have another unit than stated.
    """
    own_unit = _stated_unit(record)
    if unit is None or unit == UNKNOWN_UNIT:
        return own_unit
    if own_unit is not None and not _is_same_unit(unit, own_unit):
        raise ArgumentError("unit", f"must be that of the samples, {own_unit}, got {unit}")
    return unit


def names_of(record: object) -> tuple[str, ...] | None:
    """Return the names of the channels; None for samples without names."""
    if isinstance(record, Log):
        return record.names
    if is_table(record):
        column_names = getattr(record, "column_names", None)
        labels = (
            list(getattr(record, "columns", ())) if column_names is None else list(column_names)
        )
    else:
        labels = [getattr(record, "name", None)]
    has_names = bool(labels) and all(isinstance(label, str) and label for label in labels)
    return tuple(map(str, labels)) if has_names else None


def columns_of(record: npt.ArrayLike, name: str) -> npt.NDArray[Any]:
    """Return real numbers in their own type, as `real_numbers`; a table becomes an array (n, k)."""
    array = real_numbers(record, name)
    return array[:, np.newaxis] if is_table(record) and array.ndim == 1 else array


def convert_to_unit(record: npt.ArrayLike, unit: str, name: str) -> Floats:
    """Return samples in a unit, converted from the unit that they state, if any.

    Raises
    ------
    ValueError
        If the record is a log with an unknown unit, or its unit cannot be converted.
    """
    array, own_unit = floats(record, name), _stated_unit(record)
    # Only quantities with several units are converted; temperatures are always in deg C.
    if own_unit is None and isinstance(record, Log) and unit in UNITS:
        raise ArgumentError(
            name,
            f"must be in {unit}, and the unit of the log ({', '.join(record.names)}) is not known: "
            "give read_log its unit=, or the log's data",
        )
    if own_unit is None or _is_same_unit(own_unit, unit):
        return array
    try:
        return convert(array, own_unit, unit)
    except ValueError:
        raise ArgumentError(name, f"must be in {unit}, got a log in {own_unit}") from None


def for_stream(owner: object, names: Sequence[str], values: Sequence[Any]) -> list[Any]:
    """Return arguments of a compiled object, with named samples as arrays in the object's units.

    The log provides the times between samples if they are missing.

    Raises
    ------
    ValueError
        If a log has another rate than the object or another clock than the first log. Also if its
        unit cannot be converted.
    """
    logs = {name: one for name, one in zip(names, values, strict=True) if isinstance(one, Log)}
    rate = getattr(owner, "rate", None)
    if rate is not None:
        _check_clocks(type(owner).__name__, rate, logs)
    converted = [_convert_argument(owner, *one) for one in zip(names, values, strict=True)]
    if logs and "dt" in names and converted[(dt_index := list(names).index("dt"))] is None:
        converted[dt_index] = next(iter(logs.values())).steps
    return converted


def _convert_argument(owner: object, name: str, value: Any) -> Any:  # noqa: ANN401
    if names_of(value) is None and not is_table(value):
        return value
    own_unit = _ARGUMENT_UNITS.get(type(owner).__name__, {}).get(name)
    unit = getattr(owner, f"{name}_unit", own_unit)
    array = floats(value, name) if unit is None else convert_to_unit(value, unit, name)
    single = array.ndim == 1 and is_table(value) and getattr(owner, "channels", None) == 1
    return array[:, np.newaxis] if single else array


def _check_clocks(kind: str, rate: float, logs: Mapping[str, Log]) -> None:
    first = next(iter(logs.values()), None)
    for name, log in logs.items():
        if abs(log.rate - rate) > RATE_TOLERANCE * rate:
            raise ArgumentError(name, f"must have the rate of the {kind}, {rate:g} Hz, got {log!r}")
        assert first is not None
        if log.n == first.n and _max_clock_difference(log, first) > 1.0:
            raise ArgumentError(
                name,
                f"must be on the clock of {next(iter(logs))}, but is up to "
                f"{_max_clock_difference(log, first):.3g} samples from it",
            )


def _max_clock_difference(log: Log, other: Log) -> float:
    """Return the largest difference between the times of two logs of equal length, in samples."""
    return float(np.abs(log.sampled - other.sampled).max()) * other.rate


def _stated_unit(record: object) -> str | None:
    """Return the unit stated by samples; None if they state none."""
    if isinstance(record, Log):
        return None if record.unit == UNKNOWN_UNIT else record.unit
    units = {split_unit(name)[1] for name in names_of(record) or ()}
    return units.pop() if len(units) == 1 else None


def _is_same_unit(unit: str, other: str) -> bool:
    try:
        return canonical(unit) == canonical(other)
    except ValueError:
        return unit == other
