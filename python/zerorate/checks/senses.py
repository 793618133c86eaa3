"""The 48 signed permutations of three axes, and what to call them."""

from __future__ import annotations

from itertools import permutations, product
from typing import Final

import numpy as np

from zerorate.types import Floats, Integers


def _rotations() -> Floats:
    """Return those of determinant 1, the identity first."""
    found = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0.0:
                found.append(matrix)
    return np.array(found)


SENSES: Final[Floats] = np.concatenate([_rotations(), -_rotations()])
"""Shape (48, 3, 3): 24 rotations, and their negatives in the same order."""

INVERSES: Final[Integers] = np.array(
    [int((SENSES == one.T).all(axis=(1, 2)).argmax()) for one in SENSES], dtype=np.int64
)
"""The place of the inverse of each."""

GIVEN: Final = 0
"""The sense in which a sensor's axes are as they are named."""

_AXES: Final = "xyz"


def changes(sense: Floats) -> int:
    """Return how many mistakes make a sense: an exchange, a sign, or all three signs, 1 each."""
    places = np.abs(sense).argmax(axis=1)
    kept = int((places == np.arange(3)).sum())
    exchanges = {3: 0, 1: 1, 0: 2}[kept]
    negative = int((sense.sum(axis=1) < 0.0).sum())
    return exchanges + (1 if negative == 3 else negative)


def typed(sense: Floats) -> str:
    """Return a sense as one would type it, each new axis by an old one: ``x,-y,z``."""
    places = np.abs(sense).argmax(axis=1)
    signs = ["-" if row.sum() < 0.0 else "" for row in sense]
    return ",".join(f"{sign}{_AXES[place]}" for sign, place in zip(signs, places, strict=True))


def listed(senses: Integers) -> tuple[str, ...]:
    """Return several senses as one would type them, the one of fewest changes first."""
    ordered = sorted(senses, key=lambda place: (changes(SENSES[place]), place))
    return tuple(typed(SENSES[place]) for place in ordered)


def shared_rows(senses: Integers) -> tuple[str | None, str | None, str | None]:
    """Return what several senses agree on, a new axis each: ``-y``, ``y`` without sign, or None."""
    rows = [_shared(SENSES[senses][:, axis]) for axis in range(3)]
    return rows[0], rows[1], rows[2]


def _shared(rows: Floats) -> str | None:
    if (rows == rows[0]).all():
        return typed(rows[:1])
    places = np.abs(rows).argmax(axis=1)
    return f"±{_AXES[places[0]]}" if (places == places[0]).all() else None
