"""Comparisons as what JSON can hold."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from zerorate._native import __version__
from zerorate.compare.result import Comparison, Row

__all__ = ["SCHEMA", "as_json"]

SCHEMA: Final = "zerorate-compare/1"
"""The form of the document; the number rises when a reader has to change."""


def as_json(found: Sequence[Comparison]) -> str:
    """Return comparisons as strict JSON: every measure of every axis, null where there is none.

    Parameters
    ----------
    found : sequence of Comparison
        Of different kinds.
    """
    content = {
        "schema": SCHEMA,
        "zerorate": __version__,
        "kinds": {
            one.kind: {"rows": list(map(_row, one.rows)), "notes": list(one.notes)} for one in found
        },
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def _row(row: Row) -> dict[str, Any]:
    return {
        "source": Path(row.source).name,
        "axis": row.axis,
        "method": row.method,
        "angle": row.angle,
        **{name: value if math.isfinite(value) else None for name, value in row.values.items()},
    }
