"""Read and write sensor logs: files of many formats and objects, `Log` and `Recording` out."""

from typing import TYPE_CHECKING, Final

from zerorate.lazy import later

if TYPE_CHECKING:
    from zerorate.io.atomic import atomic_path, check_writable
    from zerorate.io.clocks.grid import ClockReport
    from zerorate.io.counts import RawCounts, raw_counts
    from zerorate.io.explaining import Explanation, explain
    from zerorate.io.log import Log, LogError, Recording
    from zerorate.io.logfile import LogFile, open_imu, open_log
    from zerorate.io.poses import Poses, read_poses
    from zerorate.io.reading import read_log
    from zerorate.io.recording import read_recording
    from zerorate.io.split import split_log
    from zerorate.io.writing import write_log

__all__ = [
    "ClockReport",
    "Explanation",
    "Log",
    "LogError",
    "LogFile",
    "Poses",
    "RawCounts",
    "Recording",
    "atomic_path",
    "check_writable",
    "explain",
    "open_imu",
    "open_log",
    "raw_counts",
    "read_log",
    "read_poses",
    "read_recording",
    "split_log",
    "write_log",
]

_PLACES: Final = {
    "atomic": "atomic_path check_writable",
    "clocks.grid": "ClockReport",
    "counts": "RawCounts raw_counts",
    "explaining": "Explanation explain",
    "log": "Log LogError Recording",
    "logfile": "LogFile open_imu open_log",
    "poses": "Poses read_poses",
    "reading": "read_log",
    "recording": "read_recording",
    "split": "split_log",
    "writing": "write_log",
}

__getattr__, __dir__ = later(__name__, _PLACES)
