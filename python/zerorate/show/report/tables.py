"""Tables that a terminal and a page can both show."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from zerorate.show.report.text import WIDTH

__all__ = ["Table", "as_text"]

_GAP: Final = "  "


@dataclass(frozen=True)
class Table:
    """A title, a row of column heads, rows of cells, and what must be said under them.

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
    """Return a table as lines, at most `WIDTH` columns wide: the longest words are cut."""
    lines = [row for row in (table.head, *table.rows) if row]
    widths = _fitting([max(map(len, column)) for column in zip(*lines, strict=True)], table.words)
    texts = (f"{_GAP}{_line(cells, widths, table.words)}" for cells in lines)
    note = textwrap.fill(table.note, WIDTH, initial_indent=_GAP, subsequent_indent=_GAP)
    return "\n".join(filter(None, (table.title, *texts, note)))


def _fitting(widths: list[int], words: int) -> list[int]:
    excess = sum(widths) + len(_GAP) * len(widths) - WIDTH
    widest = max(range(words), key=widths.__getitem__)
    return [width - max(excess, 0) * (i == widest) for i, width in enumerate(widths)]


def _line(cells: Sequence[str], widths: Sequence[int], words: int) -> str:
    placed = (
        _cut(cell, width).ljust(width) if i < words else cell.rjust(width)
        for i, (cell, width) in enumerate(zip(cells, widths, strict=True))
    )
    return _GAP.join(placed).rstrip()


def _cut(text: str, width: int) -> str:
    return text if len(text) <= width else f"{text[: width - 1]}…"
