"""Results of the linear Kalman filter for a record."""

from zerorate.linear.run import LinearRun, SmoothedRun

__all__ = ["LinearRun", "SmoothedRun"]


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
