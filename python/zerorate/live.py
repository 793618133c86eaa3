"""A line of numbers in, a line of answers out: what ``zerorate stream`` does, without its files."""

from zerorate.run.live import (
    AttitudeLines,
    AttitudeSettings,
    Beside,
    CheckpointError,
    ColumnError,
    LineError,
    LineStream,
    Settings,
    SettingsError,
    WithAttitude,
)

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


def __dir__() -> list[str]:
    """Show what is public."""
    return __all__
