"""Read and write logs: files of many formats and objects in, `Log` and `Recording` out."""

from typing import TYPE_CHECKING, Final

from zerorate.lazy import lazy_exports

if TYPE_CHECKING:
    from zerorate.io.counts import RawCounts, raw_counts
    from zerorate.io.explaining import Explanation, explain
    from zerorate.io.fixes import read_fixes
    from zerorate.io.logfile import LogFile, open_imu, open_log
    from zerorate.io.mounting import read_mounting
    from zerorate.io.poses import read_poses
    from zerorate.io.reading import read_log
    from zerorate.io.recording import read_recording
    from zerorate.io.split import split_log
    from zerorate.io.writing import write_log

__all__ = [
    "Explanation",
    "LogFile",
    "RawCounts",
    "explain",
    "open_imu",
    "open_log",
    "raw_counts",
    "read_fixes",
    "read_log",
    "read_mounting",
    "read_poses",
    "read_recording",
    "split_log",
    "write_log",
]

_LAZY_EXPORTS: Final = {
    "counts": "RawCounts raw_counts",
    "explaining": "Explanation explain",
    "fixes": "read_fixes",
    "logfile": "LogFile open_imu open_log",
    "mounting": "read_mounting",
    "poses": "read_poses",
    "reading": "read_log",
    "recording": "read_recording",
    "split": "split_log",
    "writing": "write_log",
}

if not TYPE_CHECKING:
    __getattr__, __dir__ = lazy_exports(__name__, _LAZY_EXPORTS)
