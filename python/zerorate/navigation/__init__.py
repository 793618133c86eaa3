"""Navigation by inertial sensors and a receiver: the earth, fixes, alignment, tracks.

The filter itself is `zerorate.NavigationFilter`, of the core.
"""

from typing import TYPE_CHECKING, Final

from zerorate._native import FootFilter
from zerorate.lazy import later

if TYPE_CHECKING:
    from zerorate.navigation.alignment import Alignment, align
    from zerorate.navigation.axes import Axes
    from zerorate.navigation.clipped import (
        ClippedAxis,
        RestoredGyro,
        restore_clipped,
        restore_recording,
    )
    from zerorate.navigation.clock import find_time_offset
    from zerorate.navigation.feet import Asymmetry, Feet, join_feet
    from zerorate.navigation.fixes import Fixes
    from zerorate.navigation.foot import FootNavigation, FootTrack, PlacedTrack
    from zerorate.navigation.mounting import Mounting, body_axes, read_mounting
    from zerorate.navigation.offset import TimeOffset
    from zerorate.navigation.outage import Outages, outages
    from zerorate.navigation.readers import read_fixes
    from zerorate.navigation.selfcheck import (
        NavigationChecks,
        NavigationFinding,
        check_navigation,
    )
    from zerorate.navigation.start import find_start
    from zerorate.navigation.strides import Strides
    from zerorate.navigation.track import STATUSES, VERDICTS, Track
    from zerorate.navigation.tracks import write_geojson, write_gpx
    from zerorate.navigation.wheels import Wheels

__all__ = [
    "STATUSES",
    "VERDICTS",
    "Alignment",
    "Asymmetry",
    "Axes",
    "ClippedAxis",
    "Feet",
    "Fixes",
    "FootFilter",
    "FootNavigation",
    "FootTrack",
    "Mounting",
    "NavigationChecks",
    "NavigationFinding",
    "Outages",
    "PlacedTrack",
    "RestoredGyro",
    "Strides",
    "TimeOffset",
    "Track",
    "Wheels",
    "align",
    "body_axes",
    "check_navigation",
    "find_start",
    "find_time_offset",
    "join_feet",
    "outages",
    "read_fixes",
    "read_mounting",
    "restore_clipped",
    "restore_recording",
    "write_geojson",
    "write_gpx",
]

_PLACES: Final = {
    "alignment": "Alignment align",
    "axes": "Axes",
    "clipped": "ClippedAxis RestoredGyro restore_clipped restore_recording",
    "clock": "find_time_offset",
    "fixes": "Fixes",
    "feet": "Asymmetry Feet join_feet",
    "foot": "FootNavigation FootTrack PlacedTrack",
    "mounting": "Mounting body_axes read_mounting",
    "offset": "TimeOffset",
    "outage": "Outages outages",
    "readers": "read_fixes",
    "selfcheck": "NavigationChecks NavigationFinding check_navigation",
    "start": "find_start",
    "strides": "Strides",
    "track": "STATUSES VERDICTS Track",
    "tracks": "write_geojson write_gpx",
    "wheels": "Wheels",
}
__getattr__, __dir__ = later(__name__, _PLACES)
