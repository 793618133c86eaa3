"""Geometry that every floor needs: rotations, frames of the earth, the earth and its field."""

from zerorate.geometry.magnetic import EarthField, earth_field

__all__ = ["EarthField", "earth_field"]


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
