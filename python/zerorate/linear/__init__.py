"""What the linear Kalman filter returns for a record."""

from zerorate.linear.run import LinearRun, SmoothedRun

__all__ = ["LinearRun", "SmoothedRun"]
