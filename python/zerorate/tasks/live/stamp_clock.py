"""Clock of a stream's samples: decisions before later stamps arrive, and their corrections."""

import base64
import math
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple, Self

from zerorate.checks.impossible import ImpossibleRateDetector
from zerorate.io.clocks.causal import CausalClock, Step
from zerorate.io.clocks.held import HeldRows
from zerorate.io.clocks.stamp_cells import StampCells
from zerorate.record import LogError
from zerorate.tasks.live.checkpoint import check_count
from zerorate.tasks.live.engine import Engine
from zerorate.tasks.live.lines import Layout, LineError, position_of


class StampClock(NamedTuple):
    """Column of the stamps, with the reader and the clock."""

    column: int
    cells: StampCells
    clock: CausalClock

    @classmethod
    def of(
        cls,
        rate: float,
        time: str | int | None,
        unit: str | None,
        names: tuple[str, ...] | None,
        fields: int,
        times: bool = False,
    ) -> Self | None:
        """Return the clock for a column by name or position; None without a column."""
        if time is None:
            return None
        column = position_of(time, names, fields)
        name = None if names is None else names[column]
        return cls(column, StampCells(rate, unit, name), CausalClock(rate, times))

    def sentences(self) -> Iterator[str]:
        """Yield sentences on the corrections, with their counts."""
        if self.cells.wrap_count:
            yield f"clock: wrapped {self.cells.wrap_count} times as counters do; it goes on"
        yield from self.clock.sentences()

    def with_new_clock(self) -> Self:
        """Return a copy with a new clock."""
        return self._replace(clock=CausalClock(self.clock.rate, self.clock.times))

    def state(self) -> list[Any]:
        """Return the state in the types of JSON."""
        return [self.column, self.cells.state(), self.clock.state()]

    @classmethod
    def of_state(cls, rate: float, state: Sequence[Any]) -> Self:
        """Return the clock from a saved `state`; ValueError, TypeError or KeyError otherwise."""
        column, cells, clock = state
        return cls(
            check_count(column), StampCells.of_state(rate, cells), CausalClock.of_state(rate, clock)
        )


_NEXT_STEP: Final = Step(0, None, math.nan)


class TimedEngine(Engine):
    """Engine that can process its last samples again if later samples change a decision.

    While a decision on the clock or on a rate is open, the engine keeps these samples and the
    filter's earlier state. If the decision changes, the filter processes the corrected samples from
    that state. The result is then the same as with the right decision. Repeated rows, from a slower
    sensor or sent twice, are treated in the same way.

    Parameters
    ----------
    layout : Layout
        Layout of every line.
    samples : int
        Number of samples to date, including lost and garbled samples.
    stamp_clock : StampClock, optional
        Clock; without it, samples are one period apart.
    check : ImpossibleRateDetector, optional
        Test for rates that no gyro can measure.
    """

    def __init__(
        self,
        layout: Layout,
        samples: int = 0,
        stamp_clock: StampClock | None = None,
        check: ImpossibleRateDetector | None = None,
    ) -> None:
        super().__init__(layout, samples)
        self.stamp_clock, self._check = stamp_clock, check
        self._clock = None if stamp_clock is None else stamp_clock.clock
        self._seconds = None if stamp_clock is None else stamp_clock.cells.seconds
        self._column = 0 if stamp_clock is None else stamp_clock.column
        self._lost = 0
        self._undecided_rows: list[list[Any]] = []
        self._last_snapshot: Any = None
        self._held_rows = None if self._clock is None or samples else HeldRows(self._clock.rate)
        self._origin: list[Any] = []

    @abstractmethod
    def feed(self, row: Any, step: Step, left_out: bool) -> None:  # noqa: ANN401
        """Process the samples missing before this one, then this one."""

    @abstractmethod
    def texts(self) -> list[str]:
        """Return the texts of the answer after the last sample."""

    @abstractmethod
    def snapshot(self) -> list[int | bytes]:
        """Return the current state of the filter."""

    @abstractmethod
    def restore(self, saved: Sequence[Any]) -> None:
        """Restore an earlier state of the filter."""

    def stamp(self, cells: Sequence[str]) -> float | None:
        """Return the stamp of a line, s since the first stamp; None without a stamp."""
        if self._seconds is None:
            return None
        try:
            return self._seconds(cells[self._column])
        except LogError as error:
            raise LineError(str(error)) from None

    def miss(self, count: int) -> None:
        """Count missing samples, unless the stamps show them."""
        if self.stamp_clock is None or self.layout.sequence is not None:
            self._lost += count

    def answer(self, sample: tuple[Any, float | None]) -> list[str]:
        """Return the answer to a sample."""
        row, stamp = sample
        if self._held_rows is None:
            self._take(row, stamp)
        elif not self._held_rows.known:
            self._examine_row(self._held_rows, row, stamp)
        else:
            self._take_all(self._held_rows.take(row, stamp, self.numbers(row)))
        return self.texts()

    def numbers(self, row: Any) -> list[float]:  # noqa: ANN401
        """Return the numbers of a row that are compared with the row before."""
        return row  # type: ignore[no-any-return]

    def _examine_row(self, held: HeldRows, row: Any, stamp: float | None) -> None:  # noqa: ANN401
        """Process a row that may be no sample; once this is known, process the samples again."""
        if not self._origin:
            check = None if self._check is None else self._check.state()
            self._origin = [self.snapshot(), check]
        self._take(row, stamp)
        samples = held.look(row, stamp, self.numbers(row))
        if samples is not None:
            self._restart()
            self._take_all(samples)
        if not held.possible:
            self._held_rows = None
        if samples is not None or not held.possible:
            self._origin = []

    def _take_all(self, samples: Sequence[Any]) -> None:
        """Process the samples among repeated rows; omitted rows do not count as lost."""
        self._lost = 0
        for row, stamp in samples:
            self._take(row, stamp)

    def _restart(self) -> None:
        """Return to the state before the first row, with a new clock."""
        filter_, check = self._origin
        self.restore(filter_)
        self._undecided_rows, self._last_snapshot = [], None
        if self._check is not None:
            self._check.go_on(check)
        assert self.stamp_clock is not None
        self.stamp_clock = self.stamp_clock.with_new_clock()
        self._clock = self.stamp_clock.clock

    def _take(self, row: Any, stamp: float | None) -> None:  # noqa: ANN401
        """Process a sample at its time, or keep it while a decision is open."""
        lost, self._lost = self._lost, 0
        clock, check = self._clock, self._check
        if clock is not None:
            step = clock.take(stamp, lost)
        else:
            step = Step(lost, None, math.nan) if lost else _NEXT_STEP
        left_out = check is not None and check.take(row)
        if self._undecided_rows or left_out or (clock is not None and clock.undecided):
            self._take_undecided(row, step, left_out)
        else:
            self.feed(row, step, left_out)

    def _take_undecided(self, row: Any, step: Step, left_out: bool) -> None:  # noqa: ANN401
        if not self._undecided_rows:
            self._last_snapshot = self.snapshot()
        self._undecided_rows.append([row, step, left_out])
        if self._revise_undecided():
            self.restore(self._last_snapshot)
            for undecided in self._undecided_rows:
                self.feed(*undecided)
        else:
            self.feed(row, step, left_out)
        if not self._is_undecided:
            self._undecided_rows, self._last_snapshot = [], None

    @property
    def _is_undecided(self) -> bool:
        check_undecided = self._check is not None and self._check.undecided
        return check_undecided or (self._clock is not None and self._clock.undecided > 0)

    def _revise_undecided(self) -> bool:
        """Correct the kept state by the last sample; return True if it was wrong."""
        steps = None if self.stamp_clock is None else self.stamp_clock.clock.revised
        if steps is not None:
            for undecided, step in zip(self._undecided_rows[-len(steps) :], steps, strict=True):
                undecided[1] = step
        motion = self._check is not None and self._check.revised
        if motion:
            self._undecided_rows[-2][2] = False
        return motion or steps is not None

    def sentences(self) -> Iterator[str]:
        """Yield sentences on the whole stream."""
        if self.stamp_clock is not None:
            yield from self.stamp_clock.sentences()
        if self._held_rows is not None:
            yield from self._held_rows.sentences()
        if self._check is not None:
            yield from self._check.sentences()

    def timing(self) -> dict[str, Any]:
        """Return clock, check and undecided rows in the types of JSON; empty without a clock."""
        if self.stamp_clock is None and self._check is None:
            return {}
        snapshot = (
            None if self._last_snapshot is None else [_encode_bytes(x) for x in self._last_snapshot]
        )
        held = (
            {}
            if self._held_rows is None
            else {"held": self._held_rows.state(), "origin": self._origin_state()}
        )
        return {
            "clock": None if self.stamp_clock is None else self.stamp_clock.state(),
            "check": None if self._check is None else self._check.state(),
            "lost": self._lost,
            "kept": self._undecided_rows,
            "before": snapshot,
            **held,
        }

    def _origin_state(self) -> list[Any]:
        """Return the state before the first row for JSON."""
        if not self._origin:
            return []
        filter_, check = self._origin
        return [[_encode_bytes(x) for x in filter_], check]

    def go_on(self, saved: Mapping[str, Any]) -> None:
        """Continue from the result of `timing`; the clock must already be set."""
        self._lost = check_count(saved.get("lost", 0))
        if self._check is not None and saved.get("check") is not None:
            self._check.go_on(saved["check"])
        self._undecided_rows = [
            [row, Step(*step), left_out] for row, step, left_out in saved.get("kept", ())
        ]
        snapshot = saved.get("before")
        self._last_snapshot = None if snapshot is None else [_decode_bytes(x) for x in snapshot]
        self._held_rows = None
        if self._clock is not None and "held" in saved:
            self._held_rows = HeldRows.of_state(self._clock.rate, saved["held"])
            self._origin = (
                [[_decode_bytes(x) for x in saved["origin"][0]], saved["origin"][1]]
                if saved["origin"]
                else []
            )


def restore_stamp_clock(rate: float, saved: Mapping[str, Any]) -> StampClock | None:
    """Return the clock from a checkpoint; None if it has none."""
    state = saved.get("clock")
    return None if state is None else StampClock.of_state(rate, state)


def _encode_bytes(part: int | bytes | None) -> int | str | None:
    return base64.b64encode(part).decode() if isinstance(part, bytes) else part


def _decode_bytes(part: int | str | None) -> int | bytes | None:
    return base64.b64decode(part, validate=True) if isinstance(part, str) else part
