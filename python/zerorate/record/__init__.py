"""Records: logs, recordings, fixes and poses, each on a clock, and their saved forms."""

from typing import TYPE_CHECKING, Final

from zerorate.lazy import lazy_exports

if TYPE_CHECKING:
    from zerorate.record.atomic import atomic_path, check_writable
    from zerorate.record.clock import ClockReport
    from zerorate.record.fixes import Fixes
    from zerorate.record.log import Log, LogError
    from zerorate.record.mounting import Mounting, body_axes
    from zerorate.record.offset import TimeOffset
    from zerorate.record.poses import Poses
    from zerorate.record.recording import Recording

__all__ = [
    "ClockReport",
    "Fixes",
    "Log",
    "LogError",
    "Mounting",
    "Poses",
    "Recording",
    "TimeOffset",
    "atomic_path",
    "body_axes",
    "check_writable",
]

_LAZY_EXPORTS: Final = {
    "atomic": "atomic_path check_writable",
    "clock": "ClockReport",
    "fixes": "Fixes",
    "log": "Log LogError",
    "mounting": "Mounting body_axes",
    "offset": "TimeOffset",
    "poses": "Poses",
    "recording": "Recording",
}

if not TYPE_CHECKING:
    __getattr__, __dir__ = lazy_exports(__name__, _LAZY_EXPORTS)
