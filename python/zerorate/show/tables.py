"""Tables for terminals and pages, and the sentences below them."""

import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from zerorate.faults import render_text
from zerorate.texts import WIDTH, width

__all__ = [
    "GAP",
    "WIDTH",
    "Table",
    "align_rows",
    "as_text",
    "bullet_list",
    "select_fitting_columns",
    "wrap_prose",
]

GAP: Final = "  "
"""Gap between the columns of a table."""

_MIN_WORD_LETTERS: Final = 16
"""Smallest width to which words are cut, letters."""


@dataclass(frozen=True)
class Table:
    """A title, column heads, rows of cells, and a note below them.

    Attributes
    ----------
    title : str
        Title of the table.
    head : tuple of str
        Head of each column. Empty for a table without heads.
    rows : tuple of tuple of str
        Rows with one cell per column.
    words : int
        Number of columns with words, from the left. The other columns have numbers, aligned right.
    note : str
        Sentence below the table. Empty for none.
    spare : tuple of int
        Columns to leave out in this order if lines are too long. Default: columns of numbers from
        the last to the second.
    legend : mapping of int to str
        Meanings of columns, by index. They are written below the note if the column is shown.
    blocks : bool
        True puts columns that do not fit below the others, instead of leaving them out.
    """

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int = 1
    note: str = ""
    spare: tuple[int, ...] = ()
    legend: Mapping[int, str] = field(default_factory=dict)
    blocks: bool = False


def as_text(table: Table) -> str:
    """Return a table as lines that fit; spare columns are left out and long words are cut."""
    rows = [row for row in (table.head, *table.rows) if row]
    if not rows:
        return "\n".join(filter(None, (wrap_prose(table.title), wrap_prose(table.note, GAP))))
    room = width() - len(GAP)
    spare = table.spare or tuple(range(len(rows[0]) - 1, table.words, -1))
    if table.blocks:
        columns, parts = list(range(len(rows[0]))), _split_blocks(rows, table.words, room)
    else:
        columns = select_fitting_columns(rows, table.words, room, spare)
        parts = [columns]
    lines = [
        f"{GAP}{line}".rstrip()
        for part in parts
        for line in align_rows(
            [[row[i] for i in part] for row in rows], sum(i < table.words for i in part), room
        )
    ]
    meanings = _merge_legend(table.legend[i] for i in columns if i in table.legend)
    note = wrap_prose(" ".join(filter(None, (table.note, *meanings))), GAP)
    return "\n".join(filter(None, (wrap_prose(table.title), *lines, note)))


def _merge_legend(legend: Iterable[str]) -> list[str]:
    """Return meanings as ``NAME: meaning``; names with one meaning become ``NAME, NAME:``."""
    names: dict[str, list[str]] = {}
    for entry in dict.fromkeys(legend):
        name, _, meaning = entry.partition(": ")
        names.setdefault(meaning, []).append(name)
    return [f"{', '.join(all_)}: {meaning}" for meaning, all_ in names.items()]


def _split_blocks(rows: Sequence[Sequence[str]], words: int, max_width: int) -> list[list[int]]:
    """Return the columns of blocks that fit; each block has all columns of words."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    first = list(range(words))
    blocks: list[list[int]] = [[*first]]
    for i in range(words, len(widths)):
        if len(blocks[-1]) > words and _min_width(widths, [*blocks[-1], i], ()) > max_width:
            blocks.append([*first])
        blocks[-1].append(i)
    return blocks


def select_fitting_columns(
    rows: Sequence[Sequence[str]], words: int, max_width: int, spare: Sequence[int]
) -> list[int]:
    """Return the columns that fit into a line.

    `rows`: rows with one cell per column. `words`: number of columns with words, from the left;
    they may be cut. `max_width`: largest length of a line, in letters. `spare`: columns that may be
    left out, in this order.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    columns, removable = list(range(len(widths))), list(spare)
    cuttable = _find_cuttable(rows, words)
    while removable and _min_width(widths, columns, cuttable) > max_width:
        columns.remove(removable.pop(0))
    return columns


def _find_cuttable(rows: Sequence[Sequence[str]], words: int) -> list[int]:
    """Return the columns of words that may be cut; a number with its error is never cut."""
    return [i for i in range(words) if not any("±" in row[i] for row in rows)]


def _min_width(widths: Sequence[int], columns: Sequence[int], cut: Sequence[int]) -> int:
    """Return the length of the shortest possible line; the widest of `cut` columns may be cut."""
    whole = sum(widths[i] for i in columns) + len(GAP) * (len(columns) - 1)
    longest = max((widths[i] for i in columns if i in cut), default=0)
    return whole - max(longest - _MIN_WORD_LETTERS, 0)


def wrap_prose(text: str, indent: str = "", hang: str | None = None) -> str:
    """Return a sentence in lines that fit, without breaks inside words or options."""
    return textwrap.fill(
        text,
        min(width(), WIDTH),
        initial_indent=indent,
        subsequent_indent=indent if hang is None else hang,
        break_on_hyphens=False,
        break_long_words=False,
    )


def align_rows(
    rows: Sequence[Sequence[str]], words: int = 1, max_width: int | None = None
) -> list[str]:
    """Return rows of cells as lines with aligned columns.

    `rows`: rows with one cell per column. `words`: number of columns with words, from the left; the
    others have numbers, aligned right. `max_width`: largest length of a line, in letters. The
    widest column of words is cut to reach it. Default: nothing is cut.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    excess = sum(widths) + len(GAP) * (len(widths) - 1) - (max_width or math.inf)
    if excess > 0 and (cut := _find_cuttable(rows, words)):
        widest = max(cut, key=widths.__getitem__)
        widths[widest] = max(widths[widest] - int(excess), 1)
    return [_format_line(cells, widths, words) for cells in rows]


def bullet_list(notes: Iterable[str]) -> str:
    """Return sentences as a list, with a paragraph for each sentence."""
    return "\n".join(wrap_prose(f"- {render_text(note)}", hang=GAP) for note in notes)


def _format_line(cells: Sequence[str], widths: Sequence[int], words: int) -> str:
    padded = (
        _truncate(cell, width).ljust(width) if i < words else cell.rjust(width)
        for i, (cell, width) in enumerate(zip(cells, widths, strict=True))
    )
    return GAP.join(padded).rstrip()


def _truncate(text: str, width: int) -> str:
    return text if len(text) <= width else f"{text[: width - 1]}…"
