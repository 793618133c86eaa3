"""Walks of a sensor on a foot: strides, the track of a foot, and both feet joined.

The filter itself is `zerorate.foot.FootFilter`, of the core.
"""

from typing import TYPE_CHECKING, Final

from zerorate._native import FootFilter
from zerorate.lazy import later

if TYPE_CHECKING:
    from zerorate.foot.feet import Asymmetry, Feet, join_feet
    from zerorate.foot.foot import FootNavigation, FootTrack, Origin, PlacedTrack
    from zerorate.foot.strides import Strides

__all__ = [
    "Asymmetry",
    "Feet",
    "FootFilter",
    "FootNavigation",
    "FootTrack",
    "Origin",
    "PlacedTrack",
    "Strides",
    "join_feet",
]

_PLACES: Final = {
    "feet": "Asymmetry Feet join_feet",
    "foot": "FootNavigation FootTrack Origin PlacedTrack",
    "strides": "Strides",
}
if not TYPE_CHECKING:
    __getattr__, __dir__ = later(__name__, _PLACES)
