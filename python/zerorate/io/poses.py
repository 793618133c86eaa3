"""Reading of poses from TUM texts and EuRoC tables."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from zerorate.record.log import LogError
from zerorate.record.poses import Poses
from zerorate.record.regular import read_regular_text

_COLUMN_COUNT: Final = 8
_MAX_SECONDS: Final = 1e14
"""Upper bound of times in seconds, three million years; larger times have another unit."""
_EXPECTED: Final = (
    "expected TUM's text, 'time x y z qx qy qz qw' with blanks between, or EuRoC's table, "
    "'time [ns],x,y,z,qw,qx,qy,qz,...'"
)


def read_poses(path: str | os.PathLike[str]) -> Poses:
    """Return the poses in a TUM text or a EuRoC ground-truth table.

    Parameters
    ----------
    path : str or path
        Path of the file. TUM: ``time x y z qx qy qz qw``, separated by blanks. EuRoC: separated by
        commas, time in ns, ``x,y,z,qw,qx,qy,qz``; further columns are ignored. Lines that begin
        with ``#`` are skipped.

    Returns
    -------
    Poses
        Poses on the file's own clock, s. A pose is left out if its time does not increase.

    Raises
    ------
    LogError
        If the file has neither format.
    OSError
        If the file cannot be read.
    """
    name = Path(path).name
    try:
        text = read_regular_text(path)
    except UnicodeDecodeError:
        raise LogError(f"{name}: it is no text; {_EXPECTED}") from None
    lines = [line.strip() for line in text.splitlines()]
    rows = [line for line in lines if line and not line.startswith("#")]
    commas = bool(rows) and "," in rows[0]
    cells_of_rows = [line.split(",") if commas else line.split() for line in rows]
    if cells_of_rows and not _is_number(cells_of_rows[0][0]):
        cells_of_rows = cells_of_rows[1:]  # the line of names
    if not cells_of_rows:
        raise LogError(f"{name}: it holds no pose; {_EXPECTED}")
    values = np.array([_parse_numbers(cells, name, commas) for cells in cells_of_rows])
    time = values[:, 0] * (1e-9 if abs(values[0, 0]) > _MAX_SECONDS else 1.0)
    quaternions = values[:, 4:8] if commas else values[:, (7, 4, 5, 6)]
    is_later = np.concatenate(([True], time[1:] > np.maximum.accumulate(time)[:-1]))
    return Poses(time[is_later], values[is_later, 1:4], quaternions[is_later], str(path))


def _parse_numbers(cells: Sequence[str], name: str, commas: bool) -> list[float]:
    fits = len(cells) >= _COLUMN_COUNT if commas else len(cells) == _COLUMN_COUNT
    try:
        if fits:
            return [float(cell) for cell in cells[:_COLUMN_COUNT]]
    except ValueError:
        pass
    shown = " ".join(cells)[:60]
    raise LogError(f"{name}: '{shown}' is no pose; {_EXPECTED}")


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
