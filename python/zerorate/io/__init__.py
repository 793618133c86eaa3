"""Read and write sensor logs: files of many formats and objects, `Log` and `Recording` out."""

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
