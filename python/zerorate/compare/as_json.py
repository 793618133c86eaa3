"""Comparisons as JSON."""

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

from zerorate._native import __version__
from zerorate.compare.comparison import Comparison
from zerorate.compare.measures import Row
from zerorate.compare.simulated import Regret

__all__ = ["SCHEMA", "as_json"]

SCHEMA: Final = "zerorate-compare/1"
"""The form of the document; the number rises when a reader has to change."""


def as_json(found: Sequence[Comparison], simulated: Regret | None = None) -> str:
    """Return comparisons as strict JSON: every measure of every axis, null where there is none.

    Parameters
    ----------
    found : sequence of Comparison
        Of different kinds.
    simulated : Regret, optional
        What came of the methods on simulated gyros.
    """
    content: dict[str, Any] = {
        "schema": SCHEMA,
        "zerorate": __version__,
        "kinds": {
            one.kind: {"rows": list(map(_row, one.rows)), "notes": list(one.notes)} for one in found
        },
    }
    if simulated is not None:
        content["simulated"] = [
            row for i in range(len(simulated.models)) for row in _gyro(simulated, i)
        ]
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def _row(row: Row) -> dict[str, Any]:
    return {
        "source": Path(row.source).name,
        "axis": row.axis,
        "method": row.method,
        "angle": row.angle,
        **{name: _number(value) for name, value in row.values.items()},
    }


def _gyro(simulated: Regret, i: int) -> Iterator[dict[str, Any]]:
    """Yield what each method came to on one gyro."""
    for j, method in enumerate(simulated.methods):
        yield {
            "model": simulated.models[i].name,
            "method": method,
            "optimum_dps": float(simulated.optimum[i]),
            "regret": _number(simulated.regret[i, j]),
            "regret_sigma": _number(simulated.sigma[i, j]),
            "coverage": _number(simulated.coverage[i, j]),
        }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
