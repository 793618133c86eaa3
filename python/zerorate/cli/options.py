"""Choices and texts that become arguments."""

import re
from enum import StrEnum

from zerorate.cli.faults import UsageFault

__all__ = [
    "FigureFormat",
    "LogFormat",
    "Method",
    "Noise",
    "parse_adapt_for",
    "parse_columns",
    "parse_order",
]


class Method(StrEnum):
    """Methods of the filter."""

    kf = "kf"
    akf = "akf"
    fading = "fading"


class Noise(StrEnum):
    """Variances that the measurement noise is taken from."""

    allan = "allan"
    hadamard = "hadamard"


class LogFormat(StrEnum):
    """File formats of a log."""

    parquet = "parquet"
    csv = "csv"
    npz = "npz"


class FigureFormat(StrEnum):
    """File formats of a figure."""

    png = "png"
    svg = "svg"
    pdf = "pdf"


def parse_columns(text: str | None) -> list[str | int] | None:
    """Return the names and indices of a list with commas."""
    if text is None:
        return None
    words = [word.strip() for word in text.split(",")]
    if not all(words):
        raise UsageFault(f"--columns takes names or indices with commas between, got '{text}'")
    return [int(word) if re.fullmatch(r"-?\d+", word) else word for word in words]


def parse_order(text: str) -> tuple[int, int]:
    """Return the orders of ``2,1``."""
    found = re.fullmatch(r"\s*(\d+)\s*,\s*(\d+)\s*", text)
    if found is None:
        raise UsageFault(f"--order takes two numbers p,q such as 2,1, got '{text}'")
    return int(found[1]), int(found[2])


def parse_adapt_for(text: str) -> float | None:
    """Return the seconds, None for ``always``."""
    if text == "always":
        return None
    try:
        return float(text)
    except ValueError:
        raise UsageFault(f"--adapt-for takes seconds or 'always', got '{text}'") from None
