"""The noise of a log of a batch, as ``zerorate allan`` finds it, without a figure."""

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
from zerorate.tasks.batch.command import Command, Made, Quantity, Row, number
from zerorate.tasks.characterise import characterise

if TYPE_CHECKING:
    from zerorate.tasks.batch.task import Settings

_TERMS: Final = ("angle_random_walk", "bias_instability", "rate_random_walk")
_TAUS: Final = {f"deviation_{tau:g}s": tau for tau in (1.0, 10.0, 100.0)}


def _characterised(settings: "Settings", source: Path, output: Path) -> Made:
    """Write the noise models of all axes of a log."""
    # The second opinion is part of neither the models nor the rows.
    made = characterise(source, second_opinion=False, **settings.reading)
    found = made.sensors
    with atomic_path(output, force=True) as temporary:
        temporary.write_text(models_json(found), encoding="utf-8", newline="\n")
    return Made(tuple(row for one in found for row in _rows(one)), (*made.alarms, *made.notes))


def _rows(found: Characterisation) -> Iterator[Row]:
    log = found.log
    parts = zip(found.axes, found.moved, _deviations(log), strict=True)
    for i, (axis, moved, deviations) in enumerate(parts):
        yield {
            "axis": axis.name,
            "unit": log.unit,
            "rate": log.rate,
            "n": log.n,
            "missing_count": int(np.isnan(log.data[:, i]).sum()),
            "mean": number(float(np.nanmean(log.data[:, i]))),
            **_coefficients(axis, log.unit),
            **deviations,
            "moved": moved,
        }


def _deviations(log: Log) -> list[Row]:
    """Return the deviations of each axis, None where the log is too short for them."""
    factors = {name: round(tau * log.rate) for name, tau in _TAUS.items()}
    within = {name: m for name, m in factors.items() if 1 <= m <= log.n // 2}
    rows: list[Row] = [dict.fromkeys(_TAUS) for _ in log.names]
    if not within:
        return rows
    curve = allan(log, taus=[m / log.rate for m in within.values()])
    places = {name: int(np.flatnonzero(curve.factors == m)[0]) for name, m in within.items()}
    return [
        {**row, **{name: number(axis.deviation[place]) for name, place in places.items()}}
        for row, axis in zip(rows, curve, strict=True)
    ]


def _coefficients(axis: Axis, unit: str) -> Row:
    """Return value, error, flag and bound of each coefficient, None without a model."""
    if axis.model is None:
        return dict.fromkeys(_COEFFICIENTS)
    factor = 1.0 / si_unit(unit)[0]
    row: dict[str, float | bool | None] = {}
    for name in _TERMS:
        found = getattr(axis.model, name).scaled(factor)
        # What a record does not determine has a bound, and no value that could be sorted by.
        value, sigma = (found.value, found.sigma) if found.identifiable else (None, None)
        bound = number(found.upper_bound)
        row |= zip(_columns(name), (value, sigma, found.identifiable, bound), strict=True)
    return row


def _columns(term: str) -> tuple[str, ...]:
    return term, f"{term}_sigma", f"{term}_identifiable", f"{term}_upper"


_COEFFICIENTS: Final = {
    column: kind
    for term in _TERMS
    for column, kind in zip(_columns(term), (float, float, bool, float), strict=True)
}

ALLAN: Final = Command(
    name="allan",
    mark="-zerorate-allan",
    ending=lambda _: "-models.json",
    work=_characterised,
    columns={
        "rate": float,
        "n": int,
        "missing_count": int,
        "mean": float,
        **_COEFFICIENTS,
        **dict.fromkeys(_TAUS, float),
        "moved": bool,
    },
    compared=(
        Quantity("mean", "{}", signed=True),
        Quantity("angle_random_walk", "{}/sqrt(Hz)", sigma="angle_random_walk_sigma", both=True),
        Quantity("bias_instability", "{}", sigma="bias_instability_sigma"),
        Quantity("rate_random_walk", "{}/sqrt(s)", sigma="rate_random_walk_sigma"),
        *(Quantity(column, "{}") for column in _TAUS),
    ),
)
