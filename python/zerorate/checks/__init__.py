"""What a recording contradicts: units, signs and axes of its sensors that motion shows."""

from zerorate.checks.check import check
from zerorate.checks.result import Checks, Finding

__all__ = ["Checks", "Finding", "check"]


def __dir__() -> list[str]:
    """Show what is public."""
    return __all__
