"""The type of the functions that report the progress of long work."""

from collections.abc import Callable

__all__ = ["Progress", "silent"]

Progress = Callable[[str, float], None]
"""Called with the step's name and the fraction of it that is done."""


def silent(step: str, fraction: float) -> None:
    """Report nothing."""
