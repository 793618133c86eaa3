"""Noise of one log of a batch, as in ``zerorate allan`` without a figure."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.noise import allan
from zerorate.noise.characterise import (
    Axis,
    Characterisation,
    models_json,
)
from zerorate.noise.quantities import si_unit
from zerorate.record import Log, atomic_path
from zerorate.tasks.batch.command import Command, LogOutput, LogPath, Quantity, Row, finite_or_none
from zerorate.tasks.characterise import characterise

if TYPE_CHECKING:
    from zerorate.tasks.batch.task import Settings

_TERMS: Final = ("angle_random_walk", "bias_instability", "rate_random_walk")
_TAUS: Final = {f"deviation_{tau:g}s": tau for tau in (1.0, 10.0, 100.0)}


def _characterise_log(settings: "Settings", source: LogPath, output: Path) -> LogOutput:
    """Write the noise models of all axes of a log."""
    # The estimate from the spectrum is in neither the models nor the rows.
    result = characterise(source, second_opinion=False, **settings.reading)
    sensors = result.sensors
    with atomic_path(output, force=True) as temporary:
        temporary.write_text(models_json(sensors), encoding="utf-8", newline="\n")
    return LogOutput(
        tuple(row for sensor in sensors for row in allan_rows(sensor)),
        (*result.alarms, *result.notes),
    )


def allan_rows(sensor: Characterisation) -> Iterator[Row]:
    """Yield one row of coefficients and deviations for each axis of a sensor."""
    log = sensor.log
    parts = zip(sensor.axes, sensor.moved, _deviations(log), strict=True)
    for i, (axis, moved, deviations) in enumerate(parts):
        yield {
            "axis": axis.name,
            "unit": log.unit,
            "rate": log.rate,
            "n": log.n,
            "missing_count": int(np.isnan(log.data[:, i]).sum()),
            "mean": finite_or_none(float(np.nanmean(log.data[:, i]))),
            **_coefficients(axis, log.unit),
            **deviations,
            "moved": moved,
        }


def _deviations(log: Log) -> list[Row]:
    """Return the deviations of each axis; None if the log is too short."""
    factors = {name: round(tau * log.rate) for name, tau in _TAUS.items()}
    cluster_lengths = {name: m for name, m in factors.items() if 1 <= m <= log.n // 2}
    rows: list[Row] = [dict.fromkeys(_TAUS) for _ in log.names]
    if not cluster_lengths:
        return rows
    curve = allan(log, taus=[m / log.rate for m in cluster_lengths.values()])
    indices = {
        name: int(np.flatnonzero(curve.factors == m)[0]) for name, m in cluster_lengths.items()
    }
    return [
        {**row, **{name: finite_or_none(axis.deviation[index]) for name, index in indices.items()}}
        for row, axis in zip(rows, curve, strict=True)
    ]


def _coefficients(axis: Axis, unit: str) -> Row:
    """Return value, error, flag and bound of each coefficient; None without a model."""
    if axis.model is None:
        return dict.fromkeys(_COEFFICIENTS)
    factor = 1.0 / si_unit(unit)[0]
    row: dict[str, float | bool | None] = {}
    for name in _TERMS:
        coefficient = getattr(axis.model, name).scaled(factor)
        # An undetermined coefficient has only a bound, so tables are not sorted by its value.
        value, sigma = (
            (coefficient.value, coefficient.sigma) if coefficient.identifiable else (None, None)
        )
        bound = finite_or_none(coefficient.upper_bound)
        row |= zip(
            _term_columns(name), (value, sigma, coefficient.identifiable, bound), strict=True
        )
    return row


def _term_columns(term: str) -> tuple[str, ...]:
    return term, f"{term}_sigma", f"{term}_identifiable", f"{term}_upper"


_COEFFICIENTS: Final = {
    column: kind
    for term in _TERMS
    for column, kind in zip(_term_columns(term), (float, float, bool, float), strict=True)
}

ALLAN: Final = Command(
    name="allan",
    mark="-zerorate-allan",
    ending=lambda _: "-models.json",
    work=_characterise_log,
    columns={
        "rate": float,
        "n": int,
        "missing_count": int,
        "mean": float,
        **_COEFFICIENTS,
        **dict.fromkeys(_TAUS, float),
        "moved": bool,
    },
    quantities=(
        Quantity("mean", "{}", signed=True),
        Quantity(
            "angle_random_walk", "{}/sqrt(Hz)", sigma="angle_random_walk_sigma", two_sided=True
        ),
        Quantity("bias_instability", "{}", sigma="bias_instability_sigma"),
        Quantity("rate_random_walk", "{}/sqrt(s)", sigma="rate_random_walk_sigma"),
        *(Quantity(column, "{}") for column in _TAUS),
    ),
)
