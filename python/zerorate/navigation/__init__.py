"""Navigation with inertial sensors and a satellite receiver: alignment, clocks, tracks, outages.

The filter itself is `zerorate.NavigationFilter`. It is part of the Rust core, like
`NavigationBank`.
"""

from typing import TYPE_CHECKING, Final

from zerorate._native import NavigationBank
from zerorate.lazy import lazy_exports

if TYPE_CHECKING:
    from zerorate.navigation.aids import AID_KINDS, OUTPUTS, Aid, AidResults
    from zerorate.navigation.alignment import Alignment, align
    from zerorate.navigation.axes import Axes
    from zerorate.navigation.begin import Beginning, find_beginning
    from zerorate.navigation.clock import find_time_offset
    from zerorate.navigation.coarse_start import find_start
    from zerorate.navigation.coasting import FoundNoise, find_noise
    from zerorate.navigation.outage import Outages, outages
    from zerorate.navigation.selfcheck import (
        NavigationChecks,
        NavigationFinding,
        check_navigation,
    )
    from zerorate.navigation.track import STATUSES, VERDICTS, Track
    from zerorate.navigation.tracks import write_geojson, write_gpx
    from zerorate.navigation.wheels import Wheels

__all__ = [
    "AID_KINDS",
    "OUTPUTS",
    "STATUSES",
    "VERDICTS",
    "Aid",
    "AidResults",
    "Alignment",
    "Axes",
    "Beginning",
    "FoundNoise",
    "NavigationBank",
    "NavigationChecks",
    "NavigationFinding",
    "Outages",
    "Track",
    "Wheels",
    "align",
    "check_navigation",
    "find_beginning",
    "find_noise",
    "find_start",
    "find_time_offset",
    "outages",
    "write_geojson",
    "write_gpx",
]

_LAZY_EXPORTS: Final = {
    "aids": "AID_KINDS OUTPUTS Aid AidResults",
    "alignment": "Alignment align",
    "axes": "Axes",
    "begin": "Beginning find_beginning",
    "clock": "find_time_offset",
    "outage": "Outages outages",
    "selfcheck": "NavigationChecks NavigationFinding check_navigation",
    "coarse_start": "find_start",
    "coasting": "FoundNoise find_noise",
    "track": "STATUSES VERDICTS Track",
    "tracks": "write_geojson write_gpx",
    "wheels": "Wheels",
}
if not TYPE_CHECKING:
    __getattr__, __dir__ = lazy_exports(__name__, _LAZY_EXPORTS)
