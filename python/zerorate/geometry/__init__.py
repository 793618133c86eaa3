"""Geometry for all packages: rotations, earth frames, the earth's shape and magnetic field."""

from zerorate.geometry.magnetic import EarthField, earth_field

__all__ = ["EarthField", "earth_field"]


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
