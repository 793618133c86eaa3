"""What every report keeps to: its width, its notes, and numbers with their errors."""

import math
import textwrap
from collections.abc import Iterable, Iterator
from typing import Final

from zerorate.io import Log

__all__ = ["WIDTH", "bulleted", "on_clock", "significant", "with_error"]

WIDTH: Final = 100
"""Most columns of text that a table takes."""


def bulleted(notes: Iterable[str]) -> str:
    """Return sentences as a list, one a paragraph."""
    return "\n".join(textwrap.fill(f"- {note}", WIDTH, subsequent_indent="  ") for note in notes)


def on_clock(log: Log) -> Iterator[str]:
    """Yield what there is to say of a log's clock."""
    clock = log.meta.get("clock")
    if clock is not None and not clock.summary().startswith("clock regular"):
        yield clock.summary()


def with_error(value: float, sigma: float) -> str:
    """Return a number and its standard error, both down to the error's last telling digit."""
    if not sigma > 0.0:
        return significant(value, 4)
    if not 1e-4 <= max(abs(value), sigma) < 1e6:
        return f"{value:.3g} ± {sigma:.1g}"
    # The second digit of an error tells something only behind a small first one.
    digits = 2 if f"{sigma:e}"[0] in "12" else 1
    last = digits - 1 - math.floor(math.log10(sigma))
    return " ± ".join(f"{round(number, last):.{max(last, 0)}f}" for number in (value, sigma))


def significant(value: float, digits: int = 3) -> str:
    """Return a number of so many digits, without an exponent if it is of moderate size."""
    text = f"{value:#.{digits}g}".rstrip(".")
    return f"{float(text):.0f}" if "e+" in text and abs(value) < 1e6 else text
