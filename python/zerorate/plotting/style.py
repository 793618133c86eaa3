"""Colours that colour-blind readers can tell apart (Okabe and Ito), sizes, units of time."""

from typing import Final

__all__ = [
    "AR_COLOURS",
    "BLACK",
    "BLUE",
    "DPI",
    "FONT",
    "GREY",
    "MA_COLOURS",
    "MM",
    "ORANGE",
    "SKY",
    "VERMILION",
    "time_unit",
]

BLACK: Final = "#000000"
ORANGE: Final = "#E69F00"
SKY: Final = "#56B4E9"
GREEN: Final = "#009E73"
BLUE: Final = "#0072B2"
VERMILION: Final = "#D55E00"
PURPLE: Final = "#CC79A7"
GREY: Final = "#DDDDDD"

AR_COLOURS: Final = (BLUE, SKY, GREEN)
MA_COLOURS: Final = (VERMILION, ORANGE, PURPLE)

MM: Final = 1.0 / 25.4
"""A millimetre in inches."""

FONT: Final = 6.5
DPI: Final = 200


def time_unit(duration: float) -> tuple[str, float]:
    """Return the unit in which a time axis of so many seconds reads well, and its length in s."""
    if duration <= 600.0:
        return "s", 1.0
    return ("min", 60.0) if duration <= 4 * 3600.0 else ("h", 3600.0)
