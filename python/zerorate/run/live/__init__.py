"""A stream of lines: samples in, answers out, and a state that can be saved between any two."""

from zerorate.io.packets import PACKETS, Damaged, PacketForm
from zerorate.run.live.array import ArraySettings, WithArray
from zerorate.run.live.attitude import AttitudeSettings, WithAttitude
from zerorate.run.live.checkpoint import CheckpointError, SettingsError
from zerorate.run.live.lines import Beside, ColumnError, LineError
from zerorate.run.live.navigation import NavigationSettings, WithNavigation
from zerorate.run.live.settings import Settings
from zerorate.run.live.stream import LineStream

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
