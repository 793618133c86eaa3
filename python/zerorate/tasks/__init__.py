"""Three ways to run anything that streams: the replay of a log, many logs, and live samples."""

from typing import TYPE_CHECKING

from zerorate.lazy import later

if TYPE_CHECKING:
    from zerorate.tasks.trace import Trace

__all__ = ["Trace"]

__getattr__, __dir__ = later(__name__, {"trace": "Trace"})
