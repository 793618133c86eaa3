"""Read poses from TUM's text and from EuRoC's table."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from zerorate.record.log import LogError
from zerorate.record.poses import Poses

_COLUMNS: Final = 8
_NANOSECONDS: Final = 1e14
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
        text = Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise LogError(f"{name}: it is no text; {_EXPECTED}") from None
    lines = [line.strip() for line in text.splitlines()]
    rows = [line for line in lines if line and not line.startswith("#")]
    commas = bool(rows) and "," in rows[0]
    split = [line.split(",") if commas else line.split() for line in rows]
    if split and not _is_number(split[0][0]):
        split = split[1:]  # a line of names
    if not split:
        raise LogError(f"{name}: it holds no pose; {_EXPECTED}")
    found = np.array([_numbers(cells, name, commas) for cells in split])
    time = found[:, 0] * (1e-9 if abs(found[0, 0]) > _NANOSECONDS else 1.0)
    turned = found[:, 4:8] if commas else found[:, (7, 4, 5, 6)]
    later = np.concatenate(([True], time[1:] > np.maximum.accumulate(time)[:-1]))
    return Poses(time[later], found[later, 1:4], turned[later], str(path))


def _numbers(cells: Sequence[str], name: str, commas: bool) -> list[float]:
    fits = len(cells) >= _COLUMNS if commas else len(cells) == _COLUMNS
    try:
        if fits:
            return [float(cell) for cell in cells[:_COLUMNS]]
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
