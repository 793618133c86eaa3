"""A line of numbers in, a line of answers out: what ``zerorate stream`` does, without its files."""

from zerorate.run.live import *  # noqa: F403
from zerorate.run.live import __all__ as __all__


def __dir__() -> list[str]:
    """Show what is public."""
    return __all__
