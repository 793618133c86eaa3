"""Time spans of a log, counted from its first sample."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Real

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.record.log import Log, LogError

_ROUNDING_SAMPLES = 1e-6
"""Tolerance of times when samples are selected, in samples."""


@dataclass(frozen=True)
class Span:
    """Time span from `start` to before `stop`, s after the first sample; None: the log's own end.

    Raises
    ------
    ValueError
        If a value is negative or no number, or `stop` is not after `start`.
    """

    start: float | None = None
    stop: float | None = None

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name, value in (("start", self.start), ("stop", self.stop)):
            number = value if isinstance(value, Real) and not isinstance(value, bool) else math.nan
            if value is not None and not 0.0 <= float(number) < math.inf:
                raise ValueError(
                    make_sentence(
                        keyword_argument(name), f" is seconds from the first sample, got {value!r}"
                    )
                )
        if self.stop is not None and self.stop <= (self.start or 0.0):
            raise ValueError(
                make_sentence(
                    keyword_argument("stop"),
                    f" at {self.stop:g} s is not after ",
                    keyword_argument("start"),
                    f" at {self.start or 0:g} s",
                )
            )

    @property
    def whole(self) -> bool:
        """True if the span includes the whole log."""
        return self.start is None and self.stop is None

    def row_range(self, samples: int, rate: float, first_time: float = 0.0) -> range:
        """Return the range of a log's samples within the span.

        Parameters
        ----------
        samples, rate
            Number of samples of the log, and its rate, Hz.
        first_time
            Time of the log's first sample from the origin of the span, s.
        """
        low = 0 if self.start is None else _first_row_at((self.start - first_time) * rate)
        high = samples if self.stop is None else _first_row_at((self.stop - first_time) * rate)
        return range(min(max(low, 0), samples), min(max(high, 0), samples))

    def check(self, duration: float, rate: float) -> None:
        """Raise LogError if the span extends beyond a log of this duration, s."""
        for name, value in (("start", self.start), ("stop", self.stop)):
            # The log ends one period after its last sample; a rounded duration may lack it.
            beyond = value is not None and value > duration + (1 / rate if name == "stop" else 0)
            if beyond or (name == "start" and value == duration):
                raise LogError(
                    make_sentence(
                        keyword_argument(name),
                        f" is at {value:g} s, but the log is {duration:.6g} s long",
                    ),
                    name,
                )

    def note(self, duration: float) -> str:
        """Return a sentence on the span that was read of a log of this duration, s."""
        stop = duration if self.stop is None else self.stop
        return (
            f"read from {self.start or 0:g} s to {stop:.6g} s of {duration:.6g} s, on the clock of "
            "the whole log"
        )

    def of(self, logs: Sequence[Log]) -> list[Log | None]:
        """Return the parts of logs on one clock, counted from the earliest sample of all logs.

        A log without samples in the span becomes None.
        """
        if self.whole:
            return list(logs)
        first = min(float(log.time[0]) for log in logs)
        duration = max(float(log.time[0]) - first + log.duration for log in logs)
        self.check(duration, max(log.rate for log in logs))
        return [self._cut_log(log, float(log.time[0]) - first, duration) for log in logs]

    def _cut_log(self, log: Log, first_time: float, duration: float) -> Log | None:
        inside = self.row_range(log.n, log.rate, first_time)
        if not inside:
            return None
        part = slice(inside.start, inside.stop)
        notes = (*log.meta.get("notes", ()), self.note(duration), *_note_empty_columns(log, part))
        return replace(log.part(part), meta={**log.meta, "notes": notes})

    def empty_error(self) -> LogError:
        """Return the error for a log without samples in the span."""
        last = math.inf if self.stop is None else self.stop
        return LogError(
            make_sentence(
                "there is no sample between ",
                keyword_argument("start"),
                f" at {self.start or 0.0:g} s and ",
                keyword_argument("stop"),
                f" at {last:g} s",
            ),
            "start",
        )


def _note_empty_columns(log: Log, part: slice) -> list[str]:
    return [
        f"column '{name}' is all missing there"
        for name, column in zip(log.names, log.data.T, strict=True)
        if np.isnan(column[part]).all() and not np.isnan(column).all()
    ]


def _first_row_at(samples: float) -> int:
    return math.ceil(samples - _ROUNDING_SAMPLES)
