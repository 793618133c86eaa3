"""A stream of lines: samples in, answers out; its state can be saved after any line."""

from zerorate.io.packets import PACKETS, Damage, PacketProtocol
from zerorate.tasks.live.array import ArrayColumn, ArraySettings
from zerorate.tasks.live.attitude import AttitudeColumn, AttitudeSettings
from zerorate.tasks.live.checkpoint import CheckpointError, SettingsError
from zerorate.tasks.live.lines import ColumnError, DriftColumn, LineError
from zerorate.tasks.live.navigation import NavigationColumn, NavigationSettings
from zerorate.tasks.live.settings import Settings
from zerorate.tasks.live.stream import LineStream

__all__ = [
    "PACKETS",
    "ArrayColumn",
    "ArraySettings",
    "AttitudeColumn",
    "AttitudeSettings",
    "CheckpointError",
    "ColumnError",
    "Damage",
    "DriftColumn",
    "LineError",
    "LineStream",
    "NavigationColumn",
    "NavigationSettings",
    "PacketProtocol",
    "Settings",
    "SettingsError",
]


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
