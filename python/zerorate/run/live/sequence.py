"""Sequence numbers: what was lost between two samples."""

from dataclasses import dataclass
from typing import Final

__all__ = ["SequenceCount"]

_LATE_SECONDS: Final = 1.0
_GAP_SECONDS: Final = 3600.0


@dataclass
class SequenceCount:
    """Counts what a source lost, by the numbers of the samples that came.

    Parameters
    ----------
    rate : float
        Samples a second.
    last : int, optional
        Number of the newest sample; None before the first.
    lost, late, restarts : int
        Samples that never came, that came again or after a newer one, and jumps by more than an
        hour, or back by more than a second: there the source began anew, or its counter did.
    """

    rate: float
    last: int | None = None
    lost: int = 0
    late: int = 0
    restarts: int = 0

    def step(self, number: int) -> int | None:
        """Return how many samples are missing before this one, None if it comes too late."""
        ahead = 1 if self.last is None else number - self.last
        if -_LATE_SECONDS * self.rate <= ahead <= 0:
            self.late += 1
            return None
        self.last = number
        if not 0 < ahead <= _GAP_SECONDS * self.rate:
            self.restarts += 1
            return 0
        self.lost += ahead - 1
        return ahead - 1
