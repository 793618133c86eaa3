"""Logs in Gyroflow's format ``.gcsv``, a text with a header, for a video."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from zerorate.io.table import Column
from zerorate.record.log import Log, LogError
from zerorate.record.names import meaning_of
from zerorate.units import convert

_HEADER: Final = (
    "GYROFLOW IMU LOG\nversion,1.3\nid,zerorate\norientation,XYZ\n"
    "tscale,0.000001\ngscale,1\nascale,1\n"
)
_CHUNK_ROWS: Final = 100_000


def find_triad(columns: Mapping[str, Column], kind: str, unit: str) -> dict[str, Column] | None:
    """Return the three axes of a sensor in any of its units, by the columns' names."""
    axes: dict[int, str] = {}
    for name in columns:
        meaning = meaning_of(name)
        words = None if meaning is None or meaning.unit is None else meaning.words
        if meaning is not None and meaning.kind == kind and words and words.axis is not None:
            axes.setdefault(words.axis, name)
    if set(axes) != {0, 1, 2}:
        return None
    units = {name: getattr(meaning_of(name), "unit", "") for name in axes.values()}
    return {axes[i]: convert(columns[axes[i]], units[axes[i]], unit) for i in range(3)}


def write_gcsv(log: Log, path: Path, names: Sequence[str]) -> None:
    """Write the three axes of a gyro, rad/s, and an accelerometer from the extra columns, g.

    Times are integer microseconds from the first sample. Missing samples are left out.

    Raises
    ------
    LogError
        If the log has no gyro with three axes.
    """
    columns = {**dict(zip(names, log.data.T, strict=True)), **log.extra}
    gyro = find_triad(columns, "gyro", "rad/s")
    if gyro is None:
        raise LogError(
            f"Gyroflow takes a gyro of three axes with a unit, got the columns {', '.join(names)}"
        )
    accel = find_triad(columns, "accel", "g") or {}
    times = np.rint(1e6 * (log.sampled - log.sampled[0])).astype(np.int64)
    values = np.column_stack([*gyro.values(), *accel.values()])
    is_complete = np.isfinite(values).all(axis=1)
    heads = ["t", "gx", "gy", "gz", *(["ax", "ay", "az"] if accel else [])]
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(_HEADER + ",".join(heads) + "\n")
        for first in range(0, len(values), _CHUNK_ROWS):
            part = slice(first, first + _CHUNK_ROWS)
            rows = zip(
                times[part][is_complete[part]].tolist(),
                values[part][is_complete[part]].tolist(),
                strict=True,
            )
            file.writelines(f"{time},{','.join(map(repr, row))}\n" for time, row in rows)
