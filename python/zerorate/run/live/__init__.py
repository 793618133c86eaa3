"""A stream of lines: samples in, answers out, and a state that can be saved between any two."""

from zerorate.run.live.attitude import AttitudeLines, AttitudeSettings, WithAttitude
from zerorate.run.live.checkpoint import CheckpointError, SettingsError
from zerorate.run.live.lines import Beside, ColumnError, LineError
from zerorate.run.live.settings import Settings
from zerorate.run.live.stream import LineStream

__all__ = [
    "AttitudeLines",
    "AttitudeSettings",
    "Beside",
    "CheckpointError",
    "ColumnError",
    "LineError",
    "LineStream",
    "Settings",
    "SettingsError",
    "WithAttitude",
]
