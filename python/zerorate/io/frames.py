"""Data frames of pandas and polars, read by their own means."""

from __future__ import annotations

from typing import Any

import numpy as np

from zerorate.io.arrays import SCALARS, metadata_of
from zerorate.io.columns import looks_like_time
from zerorate.io.errors import LogError
from zerorate.io.table import Column, Table

__all__ = ["from_pandas", "from_polars"]

_Frame = Any
_Series = Any

_WIDE = {"f": np.float64, "i": np.int64, "u": np.uint64, "b": np.bool_}


def from_pandas(frame: _Frame) -> Table:
    """Return the table of a pandas DataFrame, with an index of times as its time column.

    Its ``attrs`` may tell the rate, the unit and the sensor.
    """
    series = [frame.iloc[:, i] for i in range(frame.shape[1])]
    names = [_joined(label) for label in frame.columns]
    if not series:
        raise LogError("there are no columns")
    timed = _is_time(frame.index) and not any(map(looks_like_time, names))
    if timed:
        series, names = [frame.index, *series], [str(frame.index.name or "time"), *names]
    named = any(isinstance(label, (str, tuple)) for label in frame.columns)
    return Table(
        width=len(series),
        load=lambda wanted: [_from_pandas(series[i], names[i]) for i in wanted],
        names=tuple(names) if named else None,
        meta=metadata_of({k: np.asarray(v) for k, v in frame.attrs.items() if k in SCALARS}),
        time=0 if timed else None,
    )


def from_polars(frame: _Frame) -> Table:
    """Return the table of a polars DataFrame."""
    if frame.width == 0:
        raise LogError("there are no columns")
    return Table(
        width=frame.width,
        load=lambda wanted: [_from_polars(frame.to_series(i)) for i in wanted],
        names=tuple(frame.columns),
    )


def _joined(label: object) -> str:
    return "/".join(map(str, label)) if isinstance(label, tuple) else str(label)


def _is_time(index: _Series) -> bool:
    name = index.name
    return index.dtype.kind in "Mm" or (isinstance(name, str) and looks_like_time(name))


def _from_pandas(series: _Series, name: str) -> Column:
    kind = series.dtype.kind
    if kind in "Mm":
        # Times of a zone become those of UTC, without objects between.
        return np.asarray(series.to_numpy(dtype=f"{kind}8[ns]"))
    if kind not in _WIDE:
        raise LogError(f"column '{name}' holds {series.dtype}, expected numbers")
    if isinstance(series.dtype, np.dtype):
        return np.asarray(series.to_numpy())
    if series.isna().any():
        return np.asarray(series.to_numpy(dtype=np.float64, na_value=np.nan))
    return np.asarray(series.to_numpy(dtype=_WIDE[kind]))


def _from_polars(series: _Series) -> Column:
    kind = series.dtype
    if kind == _polars().Boolean:
        series = series.cast(_polars().Int8)
    elif not (kind.is_numeric() or kind.is_temporal()):
        raise LogError(f"column '{series.name}' holds {kind}, expected numbers")
    return np.asarray(series.to_numpy())


def _polars() -> Any:  # noqa: ANN401
    import polars

    return polars
