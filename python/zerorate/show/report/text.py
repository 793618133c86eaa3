"""What every report keeps to: its width and its notes."""

import textwrap
from collections.abc import Iterable, Iterator
from typing import Final

from zerorate.io import Log
from zerorate.io.log import Header

__all__ = ["WIDTH", "bulleted", "on_clock"]

WIDTH: Final = 100
"""Most columns of text that a table takes."""


def bulleted(notes: Iterable[str]) -> str:
    """Return sentences as a list, one a paragraph."""
    return "\n".join(textwrap.fill(f"- {note}", WIDTH, subsequent_indent="  ") for note in notes)


def on_clock(log: Log | Header) -> Iterator[str]:
    """Yield what there is to say of a log's clock."""
    clock = log.meta.get("clock")
    if clock is not None and not clock.summary().startswith("clock regular"):
        yield clock.summary()
