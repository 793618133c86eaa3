"""Three ways to run anything that streams: the replay of a log, many logs, and live samples."""

from zerorate._native import Trace

__all__ = ["Trace"]
