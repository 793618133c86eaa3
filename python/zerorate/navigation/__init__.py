"""Navigation by inertial sensors and a receiver: the earth, fixes, alignment, tracks.

The filter itself is `zerorate.NavigationFilter`, of the core.
"""

from typing import TYPE_CHECKING, Final

from zerorate.lazy import later

if TYPE_CHECKING:
    from zerorate.navigation.alignment import Alignment, align
    from zerorate.navigation.clock import TimeOffset, find_time_offset
    from zerorate.navigation.fixes import Fixes
    from zerorate.navigation.mounting import Mounting, body_axes, read_mounting
    from zerorate.navigation.outage import Outages, outages
    from zerorate.navigation.readers import read_fixes
    from zerorate.navigation.start import find_start
    from zerorate.navigation.track import STATUSES, VERDICTS, Track
    from zerorate.navigation.tracks import write_geojson, write_gpx

__all__ = [
    "STATUSES",
    "VERDICTS",
    "Alignment",
    "Fixes",
    "Mounting",
    "Outages",
    "TimeOffset",
    "Track",
    "align",
    "body_axes",
    "find_start",
    "find_time_offset",
    "outages",
    "read_fixes",
    "read_mounting",
    "write_geojson",
    "write_gpx",
]

_PLACES: Final = {
    "alignment": (
        "Alignment",
        "align",
    ),
    "clock": (
        "TimeOffset",
        "find_time_offset",
    ),
    "fixes": ("Fixes",),
    "mounting": (
        "Mounting",
        "body_axes",
        "read_mounting",
    ),
    "outage": (
        "Outages",
        "outages",
    ),
    "readers": ("read_fixes",),
    "start": ("find_start",),
    "track": (
        "STATUSES",
        "VERDICTS",
        "Track",
    ),
    "tracks": (
        "write_geojson",
        "write_gpx",
    ),
}
__getattr__, __dir__ = later(__name__, _PLACES)
