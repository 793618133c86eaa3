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
"""Version of the format; it increases if readers have to change."""


def as_json(comparisons: Sequence[Comparison], simulated: Sequence[Regret] = ()) -> str:
    """Return comparisons as strict JSON: every measure of every axis, null for missing measures.

    Parameters
    ----------
    comparisons : sequence of Comparison
        Comparisons of different kinds, or of different contaminations.
    simulated : sequence of Regret
        Regrets of the methods on simulated gyros, for different contaminations.
    """
    contaminations = [result.contamination for result in comparisons] + [
        result.contamination for result in simulated
    ]
    faults = dict.fromkeys(fault for fault in contaminations if fault is not None)
    content = {
        "schema": SCHEMA,
        "zerorate": __version__,
        **_content(comparisons, simulated, None),
        "contaminated": [
            {"contamination": str(fault), **_content(comparisons, simulated, fault)}
            for fault in faults
        ],
    }
    return strict(content, indent=1)


def _content(
    comparisons: Sequence[Comparison], simulated: Sequence[Regret], fault: Contamination | None
) -> dict[str, Any]:
    """Return the results on the recordings with one contamination, or without."""
    kinds = {
        result.kind: {"rows": list(map(_row_fields, result.rows)), "notes": list(result.notes)}
        for result in comparisons
        if result.contamination == fault
    }
    gyros = [
        row
        for result in simulated
        if result.contamination == fault
        for i in range(len(result.models))
        for row in _gyro_rows(result, i)
    ]
    return {"kinds": kinds} | ({"simulated": gyros} if simulated else {})


def _row_fields(row: Row) -> dict[str, Any]:
    return {
        "source": Path(row.source).name,
        "axis": row.axis,
        "method": row.method,
        "causal": row.causal,
        "angle": row.angle,
        **row.values,
    }


def _gyro_rows(simulated: Regret, i: int) -> Iterator[dict[str, Any]]:
    """Yield the result of each method on one gyro."""
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
