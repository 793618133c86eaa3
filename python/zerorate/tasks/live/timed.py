"""Samples on their clock: what a stream decides before later stamps come, and how it is mended."""

import base64
import math
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple, Self

from zerorate.checks.impossible import ImpossibleRates
from zerorate.io.clocks.causal import CausalClock, Step
from zerorate.io.clocks.held import HeldRows
from zerorate.io.clocks.stamp_cells import StampCells
from zerorate.record import LogError
from zerorate.tasks.live.checkpoint import whole
from zerorate.tasks.live.engine import Engine
from zerorate.tasks.live.lines import Layout, LineError, position_of


class Clocked(NamedTuple):
    """The column of the stamps, what reads them, and their clock."""

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
        """Return the clock of a column by name or position, None for none."""
        if time is None:
            return None
        column = position_of(time, names, fields)
        name = None if names is None else names[column]
        return cls(column, StampCells(rate, unit, name), CausalClock(rate, times))

    def sentences(self) -> Iterator[str]:
        """Yield what was mended, and how often."""
        if self.cells.wrap_count:
            yield f"clock: began anew {self.cells.wrap_count} times as counters do; it goes on"
        yield from self.clock.sentences()

    def anew(self) -> Self:
        """Return the same with a clock that has seen nothing."""
        return self._replace(clock=CausalClock(self.clock.rate, self.clock.times))

    def state(self) -> list[Any]:
        """Return all of it, as JSON keeps it."""
        return [self.column, self.cells.state(), self.clock.state()]

    @classmethod
    def of_state(cls, rate: float, state: Sequence[Any]) -> Self:
        """Return what `state` gave; ValueError, TypeError or KeyError if it is of another kind."""
        column, cells, clock = state
        return cls(
            whole(column), StampCells.of_state(rate, cells), CausalClock.of_state(rate, clock)
        )


_NEXT: Final = Step(0, None, math.nan)


class ClockedEngine(Engine):
    """An engine whose samples may be seen again in the light of later ones.

    While the clock or the check of rates is undecided, samples are kept next to what the filter was
    before them. If a decision is reversed, the filter takes them again as they should have been: it
    is then the one that knew it at once. The same holds for rows that may repeat the one before
    because the sensor is slower than the rate of the rows.

    Parameters
    ----------
    layout : Layout
        How every line is laid out.
    samples : int
        Samples that the filter has seen, those lost or garbled among them.
    clocked : Clocked, optional
        The clock; without one samples are a period of the rate apart.
    check : ImpossibleRates, optional
        Finds rates that no gyro measures.
    """

    def __init__(
        self,
        layout: Layout,
        samples: int = 0,
        clocked: Clocked | None = None,
        check: ImpossibleRates | None = None,
    ) -> None:
        super().__init__(layout, samples)
        self.clocked, self._check = clocked, check
        self._clock = None if clocked is None else clocked.clock
        self._seconds = None if clocked is None else clocked.cells.seconds
        self._column = 0 if clocked is None else clocked.column
        self._lost = 0
        self._kept: list[list[Any]] = []
        self._before: Any = None
        self._held = None if self._clock is None or samples else HeldRows(self._clock.rate)
        self._origin: list[Any] = []

    @abstractmethod
    def feed(self, row: Any, step: Step, left_out: bool) -> None:  # noqa: ANN401
        """Give a sample to the filter, after those that are missing before it."""

    @abstractmethod
    def texts(self) -> list[str]:
        """Return what there is to say after the last sample."""

    @abstractmethod
    def saved(self) -> list[int | bytes]:
        """Return the filter as it is."""

    @abstractmethod
    def restore(self, saved: Sequence[Any]) -> None:
        """Take the filter as it was."""

    def stamp(self, cells: Sequence[str]) -> float | None:
        """Return the stamp of a line, s since the first, None where there is none."""
        if self._seconds is None:
            return None
        try:
            return self._seconds(cells[self._column])
        except LogError as error:
            raise LineError(str(error)) from None

    def miss(self, count: int) -> None:
        """Take so many samples as missing; where no numbers count them, the stamps do."""
        if self.clocked is None or self.layout.sequence is not None:
            self._lost += count

    def answer(self, sample: tuple[Any, float | None]) -> list[str]:
        """Return what there is to say after a sample."""
        row, stamp = sample
        if self._held is None:
            self._take(row, stamp)
        elif self._held.period is None:
            self._look(self._held, row, stamp)
        else:
            self._take_all(self._held.take(row, stamp, self.numbers(row)))
        return self.texts()

    def numbers(self, row: Any) -> list[float]:  # noqa: ANN401
        """Return the numbers that all are the same where a row repeats the one before."""
        return row  # type: ignore[no-any-return]

    def _look(self, held: HeldRows, row: Any, stamp: float | None) -> None:  # noqa: ANN401
        """Take a row that may hold a sample of a slower sensor; if it does, take all anew."""
        if not self._origin:
            check = None if self._check is None else self._check.state()
            self._origin = [self.saved(), check]
        self._take(row, stamp)
        samples = held.look(row, stamp, self.numbers(row))
        if samples is not None:
            self._begin_anew()
            self._take_all(samples)
        if not held.possible:
            self._held = None
        if samples is not None or not held.possible:
            self._origin = []

    def _take_all(self, samples: Sequence[Any]) -> None:
        """Take the samples of a slower sensor: of the rows between, none counts as lost."""
        self._lost = 0
        for row, stamp in samples:
            self._take(row, stamp)

    def _begin_anew(self) -> None:
        """Go back to the first row, with a new clock."""
        filter_, check = self._origin
        self.restore(filter_)
        self._kept, self._before = [], None
        if self._check is not None:
            self._check.go_on(check)
        assert self.clocked is not None
        self.clocked = self.clocked.anew()
        self._clock = self.clocked.clock

    def _take(self, row: Any, stamp: float | None) -> None:  # noqa: ANN401
        """Give a sample to the filter at its time, or with doubt."""
        lost, self._lost = self._lost, 0
        clock, check = self._clock, self._check
        if clock is not None:
            step = clock.take(stamp, lost)
        else:
            step = Step(lost, None, math.nan) if lost else _NEXT
        left_out = check is not None and check.take(row)
        if self._kept or left_out or (clock is not None and clock.undecided):
            self._with_doubt(row, step, left_out)
        else:
            self.feed(row, step, left_out)

    def _with_doubt(self, row: Any, step: Step, left_out: bool) -> None:  # noqa: ANN401
        if not self._kept:
            self._before = self.saved()
        self._kept.append([row, step, left_out])
        if self._revised():
            self.restore(self._before)
            for kept in self._kept:
                self.feed(*kept)
        else:
            self.feed(row, step, left_out)
        if not self._undecided:
            self._kept, self._before = [], None

    @property
    def _undecided(self) -> bool:
        later = self._check is not None and self._check.undecided
        return later or (self._clock is not None and self._clock.undecided > 0)

    def _revised(self) -> bool:
        """Correct what is kept by what the last sample has shown; return True if that was wrong."""
        steps = None if self.clocked is None else self.clocked.clock.revised
        if steps is not None:
            for kept, step in zip(self._kept[-len(steps) :], steps, strict=True):
                kept[1] = step
        motion = self._check is not None and self._check.revised
        if motion:
            self._kept[-2][2] = False
        return motion or steps is not None

    def sentences(self) -> Iterator[str]:
        """Yield what there is to say at the end."""
        if self.clocked is not None:
            yield from self.clocked.sentences()
        if self._held is not None:
            yield from self._held.sentences()
        if self._check is not None:
            yield from self._check.sentences()

    def timing(self) -> dict[str, Any]:
        """Return clock and check, and what is undecided, as JSON keeps it; nothing without."""
        if self.clocked is None and self._check is None:
            return {}
        before = None if self._before is None else [_packed(x) for x in self._before]
        held = {} if self._held is None else {"held": self._held.state(), "origin": self._first()}
        return {
            "clock": None if self.clocked is None else self.clocked.state(),
            "check": None if self._check is None else self._check.state(),
            "lost": self._lost,
            "kept": self._kept,
            "before": before,
            **held,
        }

    def _first(self) -> list[Any]:
        """Return what was known before the first row, as JSON keeps it."""
        if not self._origin:
            return []
        filter_, check = self._origin
        return [[_packed(x) for x in filter_], check]

    def go_on(self, saved: Mapping[str, Any]) -> None:
        """Go on from what `timing` gave, the clock already being there."""
        self._lost = whole(saved.get("lost", 0))
        if self._check is not None and saved.get("check") is not None:
            self._check.go_on(saved["check"])
        self._kept = [[row, Step(*step), left_out] for row, step, left_out in saved.get("kept", ())]
        before = saved.get("before")
        self._before = None if before is None else [_unpacked(x) for x in before]
        self._held = None
        if self._clock is not None and "held" in saved:
            self._held = HeldRows.of_state(self._clock.rate, saved["held"])
            self._origin = (
                [[_unpacked(x) for x in saved["origin"][0]], saved["origin"][1]]
                if saved["origin"]
                else []
            )


def clocked_in(rate: float, saved: Mapping[str, Any]) -> Clocked | None:
    """Return the clock of a checkpoint, None where there is none."""
    state = saved.get("clock")
    return None if state is None else Clocked.of_state(rate, state)


def _packed(part: int | bytes | None) -> int | str | None:
    return base64.b64encode(part).decode() if isinstance(part, bytes) else part


def _unpacked(part: int | str | None) -> int | bytes | None:
    return base64.b64decode(part, validate=True) if isinstance(part, str) else part
