"""Tasks, one for each command: from a recording to a result, live samples and many logs too."""

from typing import TYPE_CHECKING

from zerorate.lazy import later

if TYPE_CHECKING:
    from zerorate.tasks.trace import Trace

__all__ = ["Trace"]

_PLACES = {"trace": "Trace", **dict.fromkeys(("batch", "compare", "live", "replay"), "")}
__getattr__, __dir__ = later(__name__, _PLACES)
