"""Read and write sensor logs: files of many formats and objects, one `Log` type out."""

from zerorate.io.atomic import atomic_path, check_writable
from zerorate.io.clock import ClockReport
from zerorate.io.log import Log, LogError
from zerorate.io.reading import read_log
from zerorate.io.recording import Recording, open_recording
from zerorate.io.writing import write_log

__all__ = [
    "ClockReport",
    "Log",
    "LogError",
    "Recording",
    "atomic_path",
    "check_writable",
    "open_recording",
    "read_log",
    "write_log",
]
