"""What a batch answers."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from zerorate.run.batch.outcome import Outcome

__all__ = ["BatchResult"]


@dataclass(frozen=True)
class BatchResult:
    """What became of every log, by name, and where the summary lies."""

    outcomes: tuple[Outcome, ...]
    summary: Path
    seconds: float

    @property
    def failed(self) -> tuple[Outcome, ...]:
        """The logs without a result."""
        return tuple(one for one in self.outcomes if one.status == "failed")

    @property
    def counts(self) -> Counter[str]:
        """How many logs have each status."""
        return Counter(one.status for one in self.outcomes)
