"""Comparisons as JSON."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

from zerorate._native import __version__
from zerorate.record.saved import as_json as strict
from zerorate.simulation import Contamination
from zerorate.tasks.compare.comparison import Comparison
from zerorate.tasks.compare.measures import Row
from zerorate.tasks.compare.simulated import Regret

SCHEMA: Final = "zerorate-compare/1"
"""The form of the document; the number rises when a reader has to change."""


def as_json(found: Sequence[Comparison], simulated: Sequence[Regret] = ()) -> str:
    """Return comparisons as strict JSON: every measure of every axis, null where there is none.

    Parameters
    ----------
    found : sequence of Comparison
        Of different kinds, or of different contaminations.
    simulated : sequence of Regret
        What came of the methods on simulated gyros, of different contaminations.
    """
    given = [one.contamination for one in found] + [one.contamination for one in simulated]
    faults = dict.fromkeys(fault for fault in given if fault is not None)
    content = {
        "schema": SCHEMA,
        "zerorate": __version__,
        **_content(found, simulated, None),
        "contaminated": [
            {"contamination": str(fault), **_content(found, simulated, fault)} for fault in faults
        ],
    }
    return strict(content, indent=1)


def _content(
    found: Sequence[Comparison], simulated: Sequence[Regret], fault: Contamination | None
) -> dict[str, Any]:
    """Return what came of the records with one contamination, or with none."""
    kinds = {
        one.kind: {"rows": list(map(_row, one.rows)), "notes": list(one.notes)}
        for one in found
        if one.contamination == fault
    }
    gyros = [
        row
        for one in simulated
        if one.contamination == fault
        for i in range(len(one.models))
        for row in _gyro(one, i)
    ]
    return {"kinds": kinds} | ({"simulated": gyros} if simulated else {})


def _row(row: Row) -> dict[str, Any]:
    return {
        "source": Path(row.source).name,
        "axis": row.axis,
        "method": row.method,
        "causal": row.causal,
        "angle": row.angle,
        **row.values,
    }


def _gyro(simulated: Regret, i: int) -> Iterator[dict[str, Any]]:
    """Yield what each method came to on one gyro."""
    for j, method in enumerate(simulated.methods):
        yield {
            "model": simulated.models[i].name,
            "method": method,
            "causal": simulated.causal[j],
            "optimum_dps": simulated.optimum[i],
            "regret": simulated.regret[i, j],
            "regret_sigma": simulated.sigma[i, j],
            "coverage": simulated.coverage[i, j],
        }
