"""Read poses from TUM's text and from EuRoC's table."""

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
"""Times from here on are no seconds: these would be three million years."""
_EXPECTED: Final = (
    "expected TUM's text, 'time x y z qx qy qz qw' with blanks between, or EuRoC's table, "
    "'time [ns],x,y,z,qw,qx,qy,qz,...'"
)


def read_poses(path: str | os.PathLike[str]) -> Poses:
    """Return the poses in a file of TUM's text or of EuRoC's table of ground truth.

    Parameters
    ----------
    path : str or path
        TUM: ``time x y z qx qy qz qw`` with blanks between. EuRoC: commas between, the time in ns,
        ``x,y,z,qw,qx,qy,qz``, and further columns that are not read. Lines that begin with ``#``
        are left out.

    Returns
    -------
    Poses
        On the file's own clock, in s; a pose whose time is not later than the one before is left
        out.

    Raises
    ------
    LogError
        If it is neither.
    OSError
        If it cannot be read.
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
        cells_of_rows = cells_of_rows[1:]  # a line of names
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
