"""Tasks, one for each command: results from a recording, from live samples, from many logs."""

from typing import TYPE_CHECKING

from zerorate.lazy import lazy_exports

if TYPE_CHECKING:
    from zerorate.tasks import batch as batch
    from zerorate.tasks import compare as compare
    from zerorate.tasks import live as live
    from zerorate.tasks import replay as replay
    from zerorate.tasks.trace import Trace

__all__ = ["Trace"]

if not TYPE_CHECKING:
    __getattr__, __dir__ = lazy_exports(
        __name__, {"": "batch compare live replay", "trace": "Trace"}
    )
