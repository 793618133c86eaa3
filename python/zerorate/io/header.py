"""What is known of a log without its data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from zerorate.io.log import Log

__all__ = ["Header"]


@dataclass(frozen=True)
class Header:
    """Length, rate (Hz), names, unit and metadata of a log, as in `Log`."""

    n: int
    rate: float
    names: tuple[str, ...]
    unit: str
    meta: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, log: Log) -> Header:
        """Return what is known of a log in memory."""
        return cls(log.n, log.rate, log.names, log.unit, log.meta)

    def noting(self, sentences: Iterable[str]) -> Header:
        """Return the header with further notes, none of them twice."""
        notes = dict.fromkeys((*self.meta.get("notes", ()), *sentences))
        return replace(self, meta={**self.meta, "notes": tuple(notes)}) if notes else self

    @property
    def channels(self) -> int:
        """Number of channels."""
        return len(self.names)

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return self.n / self.rate
