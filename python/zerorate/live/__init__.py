"""A line of numbers in, a line of answers out: what ``zerorate stream`` does, without its files."""

from zerorate.live.answers import Beside
from zerorate.live.checkpoint import CheckpointError, SettingsError
from zerorate.live.rows import ColumnError, LineError
from zerorate.live.settings import Settings
from zerorate.live.stream import LineStream

__all__ = [
    "Beside",
    "CheckpointError",
    "ColumnError",
    "LineError",
    "LineStream",
    "Settings",
    "SettingsError",
]
