"""Results as columns, with one row per axis, finding, parameter, averaging time or sample."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zerorate.io.readers.parquet import TIME_NAME, make_metadata
from zerorate.io.writing import make_column_names
from zerorate.noise.coefficient import Coefficient
from zerorate.record import Log
from zerorate.tasks.batch.characterising import allan_rows
from zerorate.tasks.batch.replaying import replay_rows
from zerorate.tasks.batch.summary import batch_rows

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["columns_of"]

Columns = dict[str, Any]
Row = Mapping[str, object]

_AXES: Final = "xyz"


def columns_of(result: object) -> tuple[Columns, dict[str, str]]:
    """Return the columns of a log or a result by name, all of equal length, and the metadata.

    A result with samples has the columns of its log, with rate, unit and names as metadata. A
    result without samples has a row for each axis, finding or parameter. Next to each estimated
    parameter are ``*_sigma``, ``*_identifiable`` and ``*_upper``.
    """
    log = _log_of(result)
    if log is not None:
        names = [TIME_NAME, *make_column_names(log.names, log.unit, log.extra), *log.extra]
        values = [log.sampled, *log.data.T, *log.extra.values()]
        return dict(zip(names, values, strict=True)), make_metadata(log)
    for base in type(result).__mro__:
        make = _COLUMNS.get(f"{base.__module__}.{base.__qualname__}".removeprefix("zerorate."))
        if make is not None:
            return make(result), {}
    return columns_from([flatten(result)]), {}


def _log_of(result: object) -> Log | None:
    if isinstance(result, Log):
        return result
    to_log = getattr(result, "to_log", None)
    return None if to_log is None else to_log()


def columns_from(rows: Iterable[Row]) -> Columns:
    """Convert rows to columns; a name that a row lacks becomes None."""
    table = list(rows)
    names = dict.fromkeys(name for row in table for name in row)
    return {name: [row.get(name) for row in table] for name in names}


def flatten(item: object, prefix: str = "") -> dict[str, object]:
    """Return the numbers and words of an object by name, as a row of a table.

    Vectors of three become ``*_x``, ``*_y`` and ``*_z``. Several sentences become one text. Longer
    arrays, logs and other objects are left out.
    """
    row: dict[str, object] = {}
    for name, value in _public_values(item):
        row |= _cells(f"{prefix}{name}", value)
    return row


def _public_values(item: object) -> Iterator[tuple[str, object]]:
    if is_dataclass(item):
        names = [field.name for field in fields(item)]
    else:
        names = list(getattr(item, "_fields", ()))
    return ((name, getattr(item, name)) for name in names if not name.startswith("_"))


def _cells(name: str, value: object) -> dict[str, object]:
    if isinstance(value, Coefficient):
        return _coefficient_cells(name, value)
    if value is None or isinstance(value, str | bool | int | float | np.number | np.bool_):
        return {name: value.item() if isinstance(value, np.generic) else value}
    if isinstance(value, np.ndarray):
        value = value.tolist() if value.shape == (3,) else ()
    if isinstance(value, list | tuple) and value and all(isinstance(v, str) for v in value):
        return {name: "\n".join(map(str, value))}
    if isinstance(value, list | tuple) and len(value) == 3:
        parts = (_cells(f"{name}_{axis}", v) for axis, v in zip(_AXES, value, strict=True))
        return {key: cell for part in parts for key, cell in part.items()}
    return {}


def _coefficient_cells(name: str, value: Coefficient) -> dict[str, object]:
    known = value.identifiable
    return {
        name: value.value if known else None,
        f"{name}_sigma": value.sigma if known else None,
        f"{name}_identifiable": known,
        f"{name}_upper": value.upper_bound if np.isfinite(value.upper_bound) else None,
    }


def _samples(*names: str) -> Callable[[Any], Columns]:
    """Return a function that converts arrays of a result to columns, one per channel."""

    def columns(result: Any) -> Columns:  # noqa: ANN401
        table: Columns = {}
        for name in names:
            values = getattr(result, name)
            if values is None:
                continue
            values = np.asarray(values)
            flat = values.reshape(len(values), -1)
            labels = [name] if values.ndim == 1 else [f"{name}_{k}" for k in range(flat.shape[1])]
            table |= dict(zip(labels, flat.T, strict=True))
        return table

    return columns


def _items(attribute: str) -> Callable[[Any], Columns]:
    """Return a function that yields a row for each part of a result."""
    return lambda result: columns_from(map(flatten, getattr(result, attribute)))


def _characterised_rows(result: Any) -> Iterator[Row]:  # noqa: ANN401
    return (row for sensor in result.sensors for row in allan_rows(sensor))


def _of_many(rows: Callable[[Any], Iterable[Row]]) -> Callable[[Any], Columns]:
    """Return a function that joins the rows of several sensors."""
    return lambda many: columns_from(
        {"sensor": name, **row} for name, result in many.results.items() for row in rows(result)
    )


def _allan_result_columns(result: Any) -> Columns:  # noqa: ANN401
    measures = ("deviation", "lower", "upper", "edf")
    return columns_from(
        {
            "axis": name,
            "tau": float(result.taus[i]),
            **{measure: float(getattr(axis, measure)[i]) for measure in measures},
        }
        for name, axis in zip(result.names, result.axes, strict=True)
        for i in range(len(result.taus))
    )


def _noise_model_columns(model: Any) -> Columns:  # noqa: ANN401
    return columns_from(
        {"coefficient": term.field, "unit": term.unit, **_coefficient_cells("value", coefficient)}
        for term, coefficient in model._coefficients()
    )


def _calibration_columns(result: Any) -> Columns:  # noqa: ANN401
    identifiable = np.asarray(result.identifiable)
    sigma = np.sqrt(np.diag(result.covariance))
    return {
        "parameter": list(result.parameters),
        "value": result.values,
        "sigma": np.where(identifiable, sigma, np.nan),
        "identifiable": identifiable,
    }


def _checks_columns(result: Any) -> Columns:  # noqa: ANN401
    return columns_from(map(flatten, (result.gyro, result.magnetometer)))


def _change_rows(result: Any) -> Iterator[Row]:  # noqa: ANN401
    for change in result.changes:
        finding = change.finding
        row = {"section": finding.section, "kind": finding.kind, "verdict": change.verdict}
        for name in ("before", "after"):
            one = getattr(change, name)
            row |= {f"{name}_{key}": getattr(one, key, None) for key in ("severity", "value")}
        yield {**row, "unit": finding.unit}


def _comparison_rows(result: Any) -> Iterator[Row]:  # noqa: ANN401
    return ({**flatten(row), **row.values} for row in result.rows)


def _outage_rows(result: Any) -> Iterator[Row]:  # noqa: ANN401
    for length in result.lengths:
        for name in length.errors:
            yield {
                "seconds": length.seconds,
                "method": name,
                "outage_count": length.n,
                "rms": length.rms(name),
                "median": length.median(name),
                "largest": length.largest(name),
            }


def _dynamic_columns(result: Any) -> Columns:  # noqa: ANN401
    time, tau = np.meshgrid(result.times, result.taus, indexing="ij")
    columns = {"time": time, "tau": tau, "deviation": result.deviation}
    return {name: values.ravel() for name, values in columns.items()}


def _rows(make: Callable[[Any], Iterable[Row]]) -> Callable[[Any], Columns]:
    return lambda result: columns_from(make(result))


def _compared_rows(result: Any) -> Iterator[Row]:  # noqa: ANN401
    return (
        {"kind": comparison.kind, **row}
        for comparison in result.comparisons
        for row in _comparison_rows(comparison)
    )


def _identified_rows(result: Any) -> Iterator[Row]:  # noqa: ANN401
    for axis in result.axes:
        p, q = axis.model.order
        order = {"ar_order": p, "ma_order": q, "white": axis.whiteness.white}
        yield {"axis": axis.name, "unit": axis.unit, "rate": axis.rate, **order}


_TRACE: Final = (
    *("estimate", "innovation", "innovation_variance", "measurement_noise"),
    *("bias", "bias_sigma", "missing", "guarded", "at_rest", "saturated", "stuck"),
)

_COLUMNS: Final[Mapping[str, Callable[[Any], Columns]]] = {
    "array.accelerometers.FusedAccelerometers": _samples(
        "accel", "weights", "excluded", "angular_acceleration"
    ),
    "calibration.calibration.Calibration": _calibration_columns,
    "calibration.rate.angle.Integrated": _samples("angle", "quaternion", "sigma", "bridged"),
    "calibration.rate.rate_table.RateTable": _items("axes"),
    "checks.result.Checks": _checks_columns,
    "denoising.wavelet.Denoised": _samples("signal"),
    "findings.before_after.BeforeAfter": _rows(_change_rows),
    "findings.report.Report": _items("findings"),
    "linear.run.LinearRun": _samples("state"),
    "linear.run.SmoothedRun": _samples("state"),
    "navigation.outage.Outages": _rows(_outage_rows),
    "noise.dynamic.DynamicAllan": _dynamic_columns,
    "noise.model.NoiseModel": _noise_model_columns,
    "noise.result.AllanResult": _allan_result_columns,
    "tasks.batch.run.BatchResult": _rows(lambda many: batch_rows(many.in_summary, many.fleet)),
    "tasks.characterise.Characterisations": _of_many(_characterised_rows),
    "tasks.characterise.Characterised": _rows(_characterised_rows),
    "tasks.compare.comparison.Comparison": _rows(_comparison_rows),
    "tasks.compare.task.Compared": _rows(_compared_rows),
    "tasks.identify.Identified": _rows(_identified_rows),
    "tasks.replay.result.Replays": _of_many(replay_rows),
    "tasks.replay.result.Summary": _rows(replay_rows),
    "tasks.trace.Trace": _samples(*_TRACE),
}
"""Functions for results without samples, by module and class."""
