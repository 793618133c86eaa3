"""What samples say of themselves: rate, unit and names of a log, names of a frame's columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.record.clock import ALIKE
from zerorate.record.log import Log, checked_rate
from zerorate.record.missing import floats, is_table, real_numbers
from zerorate.record.names import UNKNOWN, split_unit
from zerorate.types import Floats
from zerorate.units import UNITS, canonical, convert

_SI: Final = {"gyro": "rad/s", "accel": "m/s^2"}
_UNITS: Final[Mapping[str, Mapping[str, str]]] = {
    "FootFilter": _SI,
    "NavigationFilter": _SI,
    "PositionFilter": {"position": "m", "speed": "m/s"},
    "TemperatureFilter": {"temperature": "degC"},
}
"""Units of arguments of compiled classes; others have a ``gyro_unit`` of their own."""


def rate_of(rate: float | None, *records: object) -> float:
    """Return the rate of samples in Hz: the one given, else that of the first log among them.

    Raises
    ------
    ValueError
        If neither is there, it is not positive and finite, or a log has another rate by over 1 %.
    """
    logs = [record for record in records if isinstance(record, Log)]
    if rate is None and not logs:
        raise ArgumentError("rate", "must be given in Hz: only a Log has one of its own")
    hertz = checked_rate(logs[0].rate if rate is None else rate)
    for log in logs:
        if abs(log.rate - hertz) > ALIKE * hertz:
            raise ArgumentError("rate", f"must be that of the log, {log.rate:g} Hz, got {hertz:g}")
    return hertz


def unit_of(unit: str | None, record: object) -> str | None:
    """Return the unit of samples: the one given, else that of the log or in the columns' names.

    Raises
    ------
    ValueError
        If the samples have another unit than the one given.
    """
    own = _own_unit(record)
    if unit is None or unit == UNKNOWN:
        return own
    if own is not None and not _alike(unit, own):
        raise ArgumentError("unit", f"must be that of the samples, {own}, got {unit}")
    return unit


def names_of(record: object) -> tuple[str, ...] | None:
    """Return the names of channels, None for samples without."""
    if isinstance(record, Log):
        return record.names
    if is_table(record):
        found = getattr(record, "column_names", None)
        labels = list(getattr(record, "columns", ())) if found is None else list(found)
    else:
        labels = [getattr(record, "name", None)]
    named = bool(labels) and all(isinstance(label, str) and label for label in labels)
    return tuple(map(str, labels)) if named else None


def columns_of(record: npt.ArrayLike, name: str) -> npt.NDArray[Any]:
    """Return real numbers of their own type, as `real_numbers`; of a table always (n, k)."""
    array = real_numbers(record, name)
    return array[:, np.newaxis] if is_table(record) and array.ndim == 1 else array


def in_unit(record: npt.ArrayLike, unit: str, name: str) -> Floats:
    """Return samples in a unit, converted where they say that they have another one.

    Raises
    ------
    ValueError
        If the record is a log of unknown unit, or has a unit that does not convert.
    """
    array, own = floats(record, name), _own_unit(record)
    # Of what has several units; degrees Celsius go without saying.
    if own is None and isinstance(record, Log) and unit in UNITS:
        raise ArgumentError(
            name,
            f"must be in {unit}, and the unit of the log ({', '.join(record.names)}) is not known: "
            "give read_log its unit=, or the log's data",
        )
    if own is None or _alike(own, unit):
        return array
    try:
        return convert(array, own, unit)
    except ValueError:
        raise ArgumentError(name, f"must be in {unit}, got a log in {own}") from None


def for_stream(owner: object, names: Sequence[str], given: Sequence[Any]) -> list[Any]:
    """Return arguments of a compiled object, those with names as arrays in its units.

    Times between samples that are not given are those of the log.

    Raises
    ------
    ValueError
        If a log has another rate than the object, a unit that cannot be converted, or another
        clock than the first one.
    """
    logs = {name: one for name, one in zip(names, given, strict=True) if isinstance(one, Log)}
    rate = getattr(owner, "rate", None)
    if rate is not None:
        _check_clocks(type(owner).__name__, rate, logs)
    taken = [_argument(owner, *one) for one in zip(names, given, strict=True)]
    if logs and "dt" in names and taken[(place := list(names).index("dt"))] is None:
        taken[place] = next(iter(logs.values())).steps
    return taken


def _argument(owner: object, name: str, given: Any) -> Any:  # noqa: ANN401
    if names_of(given) is None and not is_table(given):
        return given
    own = _UNITS.get(type(owner).__name__, {}).get(name)
    unit = getattr(owner, f"{name}_unit", own)
    array = floats(given, name) if unit is None else in_unit(given, unit, name)
    single = array.ndim == 1 and is_table(given) and getattr(owner, "channels", None) == 1
    return array[:, np.newaxis] if single else array


def _check_clocks(kind: str, rate: float, logs: Mapping[str, Log]) -> None:
    first = next(iter(logs.values()), None)
    for name, log in logs.items():
        if abs(log.rate - rate) > ALIKE * rate:
            raise ArgumentError(name, f"must have the rate of the {kind}, {rate:g} Hz, got {log!r}")
        assert first is not None
        if log.n == first.n and _apart(log, first) > 1.0:
            raise ArgumentError(
                name,
                f"must be on the clock of {next(iter(logs))}, but is up to "
                f"{_apart(log, first):.3g} samples from it",
            )


def _apart(log: Log, other: Log) -> float:
    """Return how many samples two logs of one length are apart at most."""
    return float(np.abs(log.sampled - other.sampled).max()) * other.rate


def _own_unit(record: object) -> str | None:
    """Return the unit that samples say they have, None for none."""
    if isinstance(record, Log):
        return None if record.unit == UNKNOWN else record.unit
    units = {split_unit(name)[1] for name in names_of(record) or ()}
    return units.pop() if len(units) == 1 else None


def _alike(one: str, other: str) -> bool:
    try:
        return canonical(one) == canonical(other)
    except ValueError:
        return one == other
