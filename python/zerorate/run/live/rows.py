"""One line of numbers: its cells, and what each of them says."""

import math

from zerorate.io.text import MISSING

__all__ = ["ColumnError", "LineError", "cells_of", "is_number", "number", "shortened"]


class LineError(ValueError):
    """A line is not what the lines before it, or the options, let expect."""


class ColumnError(LineError):
    """A line shows that the columns are others than was asked for: no later line can be used."""


def cells_of(line: str) -> list[str]:
    """Return the cells of a line; commas separate them, or blanks where there is no comma."""
    if "," in line:
        return [cell.strip() for cell in line.split(",")]
    return line.split() or [""]


def number(cell: str) -> float:
    """Return the number in a cell, NaN where it is missing.

    Raises
    ------
    LineError
        If it is neither.
    """
    if cell in MISSING:
        return math.nan
    try:
        # Python's own literals may hold underscores, which no sensor sends.
        return float(cell.replace("_", "?"))
    except ValueError:
        raise LineError(f"'{shortened(cell)}' is not a number") from None


def is_number(cell: str) -> bool:
    """Return whether a cell holds a number, or says that one is missing."""
    try:
        number(cell)
    except LineError:
        return False
    return True


def shortened(cell: str) -> str:
    """Return a cell as a message may show it."""
    shown = cell if len(cell) <= 40 else cell[:37] + "..."
    return shown.encode("unicode_escape").decode("ascii")
