"""Sequence numbers of a stream: lost and late samples, and the wrap of the counter."""

from dataclasses import dataclass
from typing import Final

from zerorate.tasks.live.lines import LineError

MAX_BITS: Final = 64

_MAX_LATE_S: Final = 1.0
_MAX_GAP_S: Final = 3600.0
# Longer than a run of reordered packets, shorter than a loss that matters to a filter.
_MAX_LATE_RUN: Final = 32
_MIN_LEARNED_BITS: Final = 8


@dataclass
class SequenceCount:
    """Counts of the samples that a source lost, from the sequence numbers.

    A sample is late if its number repeats, or is up to a second behind. The source has restarted if
    a number is further behind or more than an hour ahead. It has also restarted at the 32nd late
    number in a row.

    The wrap follows from `bits`, or is learned. It is learned from a step from the highest to the
    lowest number of a counter with at least 8 bits. Otherwise, it is learned if the numbers jump
    back twice at the same value. Then numbers are read modulo the period, and may be late by a
    quarter of it at most.

    Parameters
    ----------
    rate : float
        Samples per second, Hz.
    bits : int, optional
        Width of the counter; None to learn it.
    last : int or None
        Number of the newest sample.
    lost_count, late_count, restart_count : int
        Counts of missing samples, of late samples and of restarts.
    turn : (int, int) or None
        Lowest and highest number at the last jump back.
    wraps : bool
        True if the numbers are known to wrap at `turn`.
    run, lowest : int
        Number of late samples since the newest sample, and their lowest number.
    """

    rate: float
    bits: int | None = None
    last: int | None = None
    lost_count: int = 0
    late_count: int = 0
    restart_count: int = 0
    turn: tuple[int, int] | None = None
    wraps: bool = False
    run: int = 0
    lowest: int = 0

    def __post_init__(self) -> None:
        """Set the range of numbers if the width is known."""
        if self.bits is not None and self.turn is None:
            self._set_wrap(*_counter_range(self.bits, signed=False))

    @property
    def is_possible(self) -> bool:
        """True if a sequence of numbers can lead to this state."""
        if self.bits is not None:
            ranges = [_counter_range(self.bits, signed) for signed in (False, True)]
            return self.wraps and self.turn in ranges
        return not self.wraps if self.turn is None else self.turn[0] < self.turn[1]

    @property
    def next(self) -> int:
        """Next expected number."""
        if self.last is None:
            return 0
        if self.wraps and self.turn is not None and self.last == self.turn[1]:
            return self.turn[0]
        return self.last + 1

    def step(self, number: int) -> int | None:
        """Return the number of samples missing before this one; None if this one is too late.

        Raises
        ------
        LineError
            If the number does not fit into the counter's bits.
        """
        self._check_range(number)
        last = number - 1 if self.last is None else self.last
        ahead = self._steps_ahead(last, number)
        if -_MAX_LATE_S * self.rate <= ahead <= 0:
            return self._count_late(last, number)
        self.last, self.run = number, 0
        if not 0 < ahead <= _MAX_GAP_S * self.rate:
            self._restart(number, last)
            return 0
        self.lost_count += ahead - 1
        return ahead - 1

    def _steps_ahead(self, last: int, number: int) -> int:
        """Return the lead of a number in steps, modulo the counter's period if it is known."""
        ahead = number - last
        if not self.wraps and ahead < 0:
            self._learn_wrap(last, number)
        if not self.wraps or self.turn is None:
            return ahead
        period = self.turn[1] + 1 - self.turn[0]
        ahead %= period
        return ahead - period if period - ahead <= self._tolerance(period) else ahead

    def _count_late(self, last: int, number: int) -> int | None:
        self.lowest = min(self.lowest, number) if self.run else number
        self.run += 1
        if self.run < _MAX_LATE_RUN:
            self.late_count += 1
            return None
        self._restart(self.lowest, last)
        self.last, self.run = number, 0
        return 0

    def _restart(self, lowest: int, highest: int) -> None:
        self.restart_count += 1
        if not self.wraps:
            self.turn = (lowest, highest) if lowest < highest else None

    def _learn_wrap(self, last: int, number: int) -> None:
        """Learn the wrap from a backward step of a full counter, or from a repeated one."""
        power = max((last - number).bit_length(), _MIN_LEARNED_BITS)
        lowest, highest = _counter_range(power, signed=number < 0)
        if (number, last) == (lowest, highest):
            self._set_wrap(lowest, highest)
        elif self.turn is not None:
            lowest, highest = min(number, self.turn[0]), max(last, self.turn[1])
            near = self._tolerance(highest + 1 - lowest)
            if abs(number - self.turn[0]) <= near and abs(last - self.turn[1]) <= near:
                self._set_wrap(lowest, highest)

    def _tolerance(self, period: int) -> int:
        return min(int(_MAX_LATE_S * self.rate), period // 4)

    def _set_wrap(self, lowest: int, highest: int) -> None:
        self.turn, self.wraps = (lowest, highest), True

    def _check_range(self, number: int) -> None:
        """Discard a wrap that a number contradicts; with a stated width, raise an error."""
        if not self.wraps or self.turn is None or self.turn[0] <= number <= self.turn[1]:
            return
        if self.bits is None:
            self.wraps = False
        elif self.turn[0] == 0 and -number in range(1, (1 << (self.bits - 1)) + 1):
            self._set_wrap(*_counter_range(self.bits, signed=True))
        else:
            raise LineError(f"the sequence number {number} is none of {self.bits} bits")


def _counter_range(bits: int, signed: bool) -> tuple[int, int]:
    lowest = -1 << (bits - 1) if signed else 0
    return lowest, lowest + (1 << bits) - 1
