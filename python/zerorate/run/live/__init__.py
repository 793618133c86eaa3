"""A line of numbers in, a line of answers out: what ``zerorate stream`` does, without its files."""

from zerorate.run.live.answers import Beside
from zerorate.run.live.checkpoint import CheckpointError, SettingsError
from zerorate.run.live.rows import ColumnError, LineError
from zerorate.run.live.settings import Settings
from zerorate.run.live.stream import LineStream

__all__ = [
    "Beside",
    "CheckpointError",
    "ColumnError",
    "LineError",
    "LineStream",
    "Settings",
    "SettingsError",
]
