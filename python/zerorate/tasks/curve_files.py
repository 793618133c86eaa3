"""Deviation curves as files."""

import csv
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from zerorate.io.readers.cells import make_inert
from zerorate.noise import AllanResult

_COLUMNS: Final = ("deviation", "lower", "upper", "edf", "exponent", "term_count")


CURVE_FORMATS: Final = ("csv", "json", "npz")
"""File formats of a deviation curve; the first is the default."""


def write_curves(curves: Sequence[AllanResult], path: Path) -> None:
    """Write the curves of all axes as CSV, JSON or npz, by the suffix."""
    suffix = path.suffix.lower()
    if suffix == ".csv":
        _write_csv(curves, path)
    elif suffix == ".json":
        content = {"axes": [_as_dict(axis) for axis in _axes(curves)]}
        path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    else:
        _write_npz(list(_axes(curves)), path)


def _axes(curves: Sequence[AllanResult]) -> Iterator[AllanResult]:
    return (axis for curve in curves for axis in curve)


def _write_csv(curves: Sequence[AllanResult], path: Path) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("axis", "kind", "unit", "tau_s", *_COLUMNS))
        for axis in _axes(curves):
            head = (make_inert(axis.names[0]), axis.kind, make_inert(axis.unit))
            columns = (axis.taus, *(getattr(axis, name) for name in _COLUMNS))
            writer.writerows((*head, *row) for row in zip(*map(_to_list, columns), strict=True))


def _as_dict(axis: AllanResult) -> dict[str, Any]:
    """Return an axis as a dict for JSON, with None for NaN."""
    arrays = {name: _to_list(getattr(axis, name)) for name in _COLUMNS}
    return {
        "axis": axis.names[0],
        "kind": axis.kind,
        "unit": axis.unit,
        "rate": axis.rate,
        "n": axis.n,
        "confidence": axis.confidence,
        "tau_s": _to_list(axis.taus),
        **{
            name: [v if np.isfinite(v) else None for v in values] for name, values in arrays.items()
        },
    }


def _write_npz(axes: Sequence[AllanResult], path: Path) -> None:
    arrays = {name: np.column_stack([getattr(a, name) for a in axes]) for name in _COLUMNS}
    with path.open("wb") as file:
        np.savez(
            file,
            axis=np.array([axis.names[0] for axis in axes]),
            unit=np.array([axis.unit for axis in axes]),
            kind=np.array(axes[0].kind),
            tau_s=axes[0].taus,
            **arrays,  # type: ignore[arg-type]
        )


def _to_list(values: Any) -> list[Any]:  # noqa: ANN401
    items: list[Any] = values.tolist()
    return items
