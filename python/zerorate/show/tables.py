"""Tables that a terminal and a page can both show, and the sentences under them."""

import math
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from zerorate.faults import told

WIDTH: Final = 100
"""Most letters in a line of a table."""

GAP: Final = "  "
"""Between the columns of a table."""


@dataclass(frozen=True)
class Table:
    """A title, a row of column heads, rows of cells, and a note under them.

    Attributes
    ----------
    title : str
        Of the table.
    head : tuple of str
        One a column; empty for a table without heads.
    rows : tuple of tuple of str
        As many cells each as there are columns.
    words : int
        Columns from the left that hold words; the others hold numbers and end flush right.
    note : str
        A sentence; empty for none.
    """

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int = 1
    note: str = ""


def as_text(table: Table) -> str:
    """Return a table as lines, at most `WIDTH` letters long: the longest words are cut."""
    rows = [row for row in (table.head, *table.rows) if row]
    lines = (f"{GAP}{line}" for line in aligned(rows, table.words, WIDTH - len(GAP)))
    note = textwrap.fill(table.note, WIDTH, initial_indent=GAP, subsequent_indent=GAP)
    return "\n".join(filter(None, (table.title, *lines, note)))


def aligned(rows: Sequence[Sequence[str]], words: int = 1, most: int | None = None) -> list[str]:
    """Return rows of cells as lines with aligned columns.

    Parameters
    ----------
    rows : sequence of sequence of str
        As many cells each as there are columns.
    words : int
        Columns from the left that hold words; the others hold numbers and end flush right.
    most : int, optional
        Letters that a line may have: the widest column of words is cut where there are more. By
        default nothing is cut.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    excess = sum(widths) + len(GAP) * (len(widths) - 1) - (most or math.inf)
    if excess > 0:
        widest = max(range(words), key=widths.__getitem__)
        widths[widest] -= int(excess)
    return [_line(cells, widths, words) for cells in rows]


def bulleted(notes: Iterable[str]) -> str:
    """Return sentences as a list, one a paragraph."""
    return "\n".join(
        textwrap.fill(f"- {told(note)}", WIDTH, subsequent_indent="  ") for note in notes
    )


def _line(cells: Sequence[str], widths: Sequence[int], words: int) -> str:
    placed = (
        _cut(cell, width).ljust(width) if i < words else cell.rjust(width)
        for i, (cell, width) in enumerate(zip(cells, widths, strict=True))
    )
    return GAP.join(placed).rstrip()


def _cut(text: str, width: int) -> str:
    return text if len(text) <= width else f"{text[: width - 1]}…"
