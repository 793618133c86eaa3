"""Walks with a sensor on a foot: strides, the track of a foot, and both feet combined.

The filter itself is `zerorate.foot.FootFilter`. It is part of the Rust core.
"""

from typing import TYPE_CHECKING, Final

from zerorate._native import FootFilter
from zerorate.lazy import lazy_exports

if TYPE_CHECKING:
    from zerorate.foot.feet import Asymmetry, Feet, join_feet
    from zerorate.foot.foot import FootNavigation, FootTrack, GeodeticTrack, Origin
    from zerorate.foot.lifts import Ride
    from zerorate.foot.strides import Strides
    from zerorate.foot.swings import Swings

__all__ = [
    "Asymmetry",
    "Feet",
    "FootFilter",
    "FootNavigation",
    "FootTrack",
    "GeodeticTrack",
    "Origin",
    "Ride",
    "Strides",
    "Swings",
    "join_feet",
]

_LAZY_EXPORTS: Final = {
    "feet": "Asymmetry Feet join_feet",
    "foot": "FootNavigation FootTrack Origin GeodeticTrack",
    "lifts": "Ride",
    "strides": "Strides",
    "swings": "Swings",
}
if not TYPE_CHECKING:
    __getattr__, __dir__ = lazy_exports(__name__, _LAZY_EXPORTS)
