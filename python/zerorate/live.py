"""A line of numbers in, a line of answers out: what ``zerorate stream`` does, without its files."""

from zerorate.run.live import (
    ArraySettings,
    AttitudeSettings,
    Beside,
    CheckpointError,
    ColumnError,
    LineError,
    LineStream,
    NavigationSettings,
    Settings,
    SettingsError,
    WithArray,
    WithAttitude,
    WithNavigation,
)

__all__ = [
    "ArraySettings",
    "AttitudeSettings",
    "Beside",
    "CheckpointError",
    "ColumnError",
    "LineError",
    "LineStream",
    "NavigationSettings",
    "Settings",
    "SettingsError",
    "WithArray",
    "WithAttitude",
    "WithNavigation",
]


def __dir__() -> list[str]:
    """Show what is public."""
    return __all__
