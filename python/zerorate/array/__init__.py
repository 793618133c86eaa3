"""Arrays of gyros: how their noises go together, and how to weigh them."""

from zerorate.array.covariance import AllanCovariance, allan_covariance
from zerorate.array.virtual_gyro import VirtualGyro

__all__ = ["AllanCovariance", "VirtualGyro", "allan_covariance"]
