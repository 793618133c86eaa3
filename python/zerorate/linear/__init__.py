"""What the linear Kalman filter returns for a record."""

from zerorate.linear.run import LinearRun, SmoothedRun

__all__ = ["LinearRun", "SmoothedRun"]


def __dir__() -> list[str]:
    """Show what is public."""
    return __all__
