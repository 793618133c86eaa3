"""The noise of a log of a batch, as ``zerorate allan`` finds it, without a figure."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.io import Log, atomic_path
from zerorate.io.log import notes_of, present_axes
from zerorate.io.reading import read_sensors
from zerorate.noise import allan
from zerorate.noise.characterise import Axis, Characterisation, characterise
from zerorate.noise.quantities import UNKNOWN, si_unit
from zerorate.run.batch.command import Command, Made, Quantity, Row, number

if TYPE_CHECKING:
    from zerorate.run.batch.task import Settings

__all__ = ["ALLAN"]

_TERMS: Final = ("angle_random_walk", "bias_instability", "rate_random_walk")
_TAUS: Final = {f"deviation_{tau:g}s": tau for tau in (1.0, 10.0, 100.0)}


def _characterised(settings: "Settings", source: Path, output: Path) -> Made:
    """Write the noise models of all axes of a log."""
    sensors = read_sensors(source, **settings.reading)
    # The second opinion has no place in models or rows, and takes as long as all the rest.
    found = [characterise(log, second_opinion=False) for log in _present(sensors)]
    with atomic_path(output, force=True) as temporary:
        temporary.write_text(_models(found), encoding="utf-8", newline="\n")
    notes = [note for one in found for note in one.notes]
    notes += [note for one in found for note in notes_of(one.log)]
    return Made(tuple(row for one in found for row in _rows(one)), tuple(dict.fromkeys(notes)))


def _present(sensors: Sequence[Log]) -> list[Log]:
    """Return what holds samples, all if nothing does: the notes of a log name what does not."""
    present = [present_axes(log) for log in sensors if np.isfinite(log.data).any()]
    return present or list(sensors)


def _models(found: Sequence[Characterisation]) -> str:
    models = {
        axis.name: None if axis.model is None else json.loads(axis.model.to_json())
        for one in found
        for axis in one.axes
    }
    return json.dumps({"axes": models}, indent=2) + "\n"


def _rows(found: Characterisation) -> Iterator[Row]:
    log = found.log
    for i, (axis, deviations) in enumerate(zip(found.axes, _deviations(log), strict=True)):
        yield {
            "axis": axis.name,
            "unit": log.unit,
            "rate": log.rate,
            "samples": log.n,
            "missing": int(np.isnan(log.data[:, i]).sum()),
            "mean": number(float(np.nanmean(log.data[:, i]))),
            **_coefficients(axis, log.unit),
            **deviations,
            "moved": axis.moved,
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
    factor = 1.0 if unit == UNKNOWN else 1.0 / si_unit(unit)[0]
    row: dict[str, float | bool | None] = {}
    for name in _TERMS:
        found = getattr(axis.model, name).scaled(factor)
        # What a record does not determine has a bound, and no value that could be sorted by.
        value, sigma = (found.value, found.sigma) if found.identifiable else (None, None)
        row |= zip(
            _columns(name), (value, sigma, found.identifiable, found.upper_bound), strict=True
        )
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
        "samples": int,
        "missing": int,
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
