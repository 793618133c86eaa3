"""What became of one log."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

__all__ = ["Outcome", "Row", "Status"]

Status = Literal["done", "skipped", "failed"]
Row = Mapping[str, str | float | int | None]


@dataclass(frozen=True)
class Outcome:
    """What became of one log; small, since it travels between machines.

    Parameters
    ----------
    name : str
        Path of the log under the folder that all logs share.
    status : {"done", "skipped", "failed"}
        A log is skipped if an earlier run has finished it with the same settings.
    seconds : float
        What reading, filtering and writing took; of a skipped log, in the earlier run.
    rows : tuple of mapping
        Measures, one row an axis.
    error : str or None
        Why it failed, in one sentence.
    """

    name: str
    status: Status
    seconds: float = 0.0
    rows: tuple[Row, ...] = ()
    error: str | None = None
