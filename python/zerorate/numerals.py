"""Numbers as text: rounded to significant digits, with standard errors."""

import math
from typing import Final

__all__ = ["DASH", "format_or_dash", "format_significant", "format_with_error", "shorten"]

DASH: Final = "-"
"""Text for a number that has no meaning."""


def format_with_error(value: float, sigma: float) -> str:
    """Return a number and its standard error, rounded to the error's significant digits."""
    if not sigma > 0.0:
        return format_significant(value, 4)
    if not 1e-4 <= max(abs(value), sigma) < 1e6:
        return f"{value:.3g} ± {sigma:.1g}"
    # Two digits of the error are shown only if the first one is small.
    digits = 2 if f"{sigma:e}"[0] in "12" else 1
    last = digits - 1 - math.floor(math.log10(sigma))
    # A number that rounds to zero gets no minus sign.
    rounded = (round(number, last) + 0.0 for number in (value, sigma))
    return " ± ".join(f"{number:.{max(last, 0)}f}" for number in rounded)


def format_significant(value: float, digits: int = 3) -> str:
    """Return a number rounded to `digits` significant digits, with trailing zeros."""
    return _without_exponent(f"{value:#.{digits}g}".rstrip("."))


def _without_exponent(text: str) -> str:
    """Return the text of a number below a million without its exponent; keep other texts."""
    return f"{float(text):.0f}" if "e+" in text and abs(float(text)) < 1e6 else text


def shorten(value: float, digits: int = 2) -> str:
    """Return a number rounded to `digits` digits, without an exponent if its size is moderate.

    Examples
    --------
    >>> shorten(170.3), shorten(0.0234), shorten(2.0), shorten(16384.0, 3)
    ('170', '0.023', '2', '16400')
    """
    return _without_exponent(f"{value:.{digits}g}")


def format_or_dash(value: float) -> str:
    """Return a number with three digits, or a dash if it is not finite."""
    return format_significant(value) if math.isfinite(value) else DASH
