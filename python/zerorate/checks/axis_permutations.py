"""The 48 signed permutations of three axes, and their names."""

from __future__ import annotations

from itertools import permutations, product
from typing import Final

import numpy as np

from zerorate.types import Floats, Integers


def _make_rotations() -> Floats:
    """Return the permutations of determinant 1, the identity first."""
    matrices = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0.0:
                matrices.append(matrix)
    return np.array(matrices)


SENSES: Final[Floats] = np.concatenate([_make_rotations(), -_make_rotations()])
"""24 rotations, and their negatives in the same order, shape (48, 3, 3)."""

INVERSES: Final[Integers] = np.array(
    [int((SENSES == one.T).all(axis=(1, 2)).argmax()) for one in SENSES], dtype=np.int64
)
"""Index of each sense's inverse."""

IDENTITY: Final = 0
"""Index of the unchanged axes."""

_AXES: Final = "xyz"


def count_mistakes(sense: Floats) -> int:
    """Return the number of mistakes: an exchange, a sign, or all three signs count 1 each."""
    columns = np.abs(sense).argmax(axis=1)
    unmoved = int((columns == np.arange(3)).sum())
    exchanges = {3: 0, 1: 1, 0: 2}[unmoved]
    negative = int((sense.sum(axis=1) < 0.0).sum())
    return exchanges + (1 if negative == 3 else negative)


def format_sense(sense: Floats) -> str:
    """Return a sense in the form that users type: ``x,-y,z``."""
    columns = np.abs(sense).argmax(axis=1)
    signs = ["-" if row.sum() < 0.0 else "" for row in sense]
    return ",".join(f"{sign}{_AXES[column]}" for sign, column in zip(signs, columns, strict=True))


def format_senses(senses: Integers) -> tuple[str, ...]:
    """Return several senses in the form that users type, fewest changes first."""
    ordered = sorted(senses, key=lambda index: (count_mistakes(SENSES[index]), index))
    return tuple(format_sense(SENSES[index]) for index in ordered)


def shared_rows(senses: Integers) -> tuple[str | None, str | None, str | None]:
    """Return the common rows of several senses: ``-y``, ``y`` without sign, or None."""
    rows = [_shared_row(SENSES[senses][:, axis]) for axis in range(3)]
    return rows[0], rows[1], rows[2]


def _shared_row(rows: Floats) -> str | None:
    if (rows == rows[0]).all():
        return format_sense(rows[:1])
    columns = np.abs(rows).argmax(axis=1)
    return f"±{_AXES[columns[0]]}" if (columns == columns[0]).all() else None
