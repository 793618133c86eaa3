"""Tables for the studies in this folder."""

from collections.abc import Iterable, Sequence
from typing import Final

Rows = Iterable[Sequence[str]]

WORDS: Final = (
    "process noise G0",
    "sensor",
    "recording",
    "limits",
    "axis",
    "filter",
    "order",
    "model",
    "judgement",
)
"""Columns that are aligned left."""


def table(title: str, head: Sequence[str], rows: Rows, markdown: bool) -> str:
    """Return an aligned table, with words at the left and numbers at the right."""
    body = [head, *rows]
    widths = [max(map(len, column)) for column in zip(*body, strict=True)]
    words = [name in WORDS for name in head]
    lines = [
        [
            cell.ljust(w) if left else cell.rjust(w)
            for cell, w, left in zip(row, widths, words, strict=True)
        ]
        for row in body
    ]
    if not markdown:
        return "\n".join([title, *("  ".join(line).rstrip() for line in lines), ""])
    rule = ["-" * w if left else "-" * (w - 1) + ":" for w, left in zip(widths, words, strict=True)]
    lines.insert(1, rule)
    return "\n".join([f"**{title}**", "", *("| " + " | ".join(line) + " |" for line in lines), ""])
