"""The function by which long work tells how far it is."""

from collections.abc import Callable

__all__ = ["Progress", "silent"]

Progress = Callable[[str, float], None]
"""Called with the step's name and the fraction of it that is done."""


def silent(step: str, fraction: float) -> None:
    """Report nothing."""
