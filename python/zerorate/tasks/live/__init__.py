"""A stream of lines: samples in, answers out, and a state that can be saved between any two."""

from zerorate.io.packets import PACKETS, Damaged, PacketForm
from zerorate.tasks.live.array import ArraySettings, WithArray
from zerorate.tasks.live.attitude import AttitudeSettings, WithAttitude
from zerorate.tasks.live.checkpoint import CheckpointError, SettingsError
from zerorate.tasks.live.lines import Beside, ColumnError, LineError
from zerorate.tasks.live.navigation import NavigationSettings, WithNavigation
from zerorate.tasks.live.settings import Settings
from zerorate.tasks.live.stream import LineStream

__all__ = [
    "PACKETS",
    "ArraySettings",
    "AttitudeSettings",
    "Beside",
    "CheckpointError",
    "ColumnError",
    "Damaged",
    "LineError",
    "LineStream",
    "NavigationSettings",
    "PacketForm",
    "Settings",
    "SettingsError",
    "WithArray",
    "WithAttitude",
    "WithNavigation",
]


def __dir__() -> list[str]:
    """Show what is public."""
    return __all__
