"""Contradictions in a recording: units, signs and axes of its sensors, and clipped rates."""

from zerorate.checks.check import check
from zerorate.checks.clipped import ClippedAxis, RestoredGyro, restore_clipped, restore_recording
from zerorate.checks.result import Checks, Finding

__all__ = [
    "Checks",
    "ClippedAxis",
    "Finding",
    "RestoredGyro",
    "check",
    "restore_clipped",
    "restore_recording",
]


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
