"""A line of numbers in, a line of answers out: what ``zerorate stream`` does, without its files."""

from zerorate.run.live import (
    Beside,
    CheckpointError,
    ColumnError,
    LineError,
    LineStream,
    Settings,
    SettingsError,
)

__all__ = [
    "Beside",
    "CheckpointError",
    "ColumnError",
    "LineError",
    "LineStream",
    "Settings",
    "SettingsError",
]


def __dir__() -> list[str]:
    """Show what is public."""
    return __all__
