"""Arrays of gyros: correlation of their noise, and weights to fuse them."""

from typing import TYPE_CHECKING, Final

from zerorate.lazy import lazy_exports

if TYPE_CHECKING:
    from zerorate.array.accelerometers import FusedAccelerometers, fuse_accelerometers
    from zerorate.array.covariance import AllanCovariance, allan_covariance
    from zerorate.array.logs import ArrayLog, array_log
    from zerorate.array.rotations import Rotations, find_rotations, read_rotations
    from zerorate.array.virtual_gyro import VirtualGyro

__all__ = [
    "AllanCovariance",
    "ArrayLog",
    "FusedAccelerometers",
    "Rotations",
    "VirtualGyro",
    "allan_covariance",
    "array_log",
    "find_rotations",
    "fuse_accelerometers",
    "read_rotations",
]

_LAZY_EXPORTS: Final = {
    "accelerometers": "FusedAccelerometers fuse_accelerometers",
    "covariance": "AllanCovariance allan_covariance",
    "logs": "ArrayLog array_log",
    "rotations": "Rotations find_rotations read_rotations",
    "virtual_gyro": "VirtualGyro",
}
if not TYPE_CHECKING:
    __getattr__, __dir__ = lazy_exports(__name__, _LAZY_EXPORTS)
