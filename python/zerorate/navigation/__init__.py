"""Navigation by inertial sensors and a receiver: the earth, fixes, alignment, tracks.

The filter itself is `zerorate.NavigationFilter`, of the core.
"""

from zerorate.navigation.track import STATUSES, VERDICTS

__all__ = ["STATUSES", "VERDICTS"]
