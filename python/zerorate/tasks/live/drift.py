"""Drift filter as the engine of a stream."""

import base64
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final, TypeAlias

import numpy as np

from zerorate.io.clocks.causal import Step
from zerorate.io.counts import describe_counts
from zerorate.record.names import UNKNOWN_UNIT
from zerorate.tasks.exclusion_counts import ExclusionCounts
from zerorate.tasks.live.backlog import BacklogFilter
from zerorate.tasks.live.lines import Layout, number_or_nan
from zerorate.tasks.live.stamp_clock import StampClock, TimedEngine
from zerorate.tasks.live.view import View

_NEXT_STEP: Final = Step(0, None, math.nan)
_HEAD_SAMPLES: Final = 100
"""Number of samples tested for raw counts."""


Corrector: TypeAlias = Callable[[list[float], list[float]], list[float]]


class DriftEngine(TimedEngine):
    """Engine that answers each sample with its rate, in the columns of the channels.

    Parameters
    ----------
    layout : Layout
        Layout of every line.
    backlog : BacklogFilter
        The filter.
    scale, limit : float, optional
        Factor of the samples, and end of the sensor's range.
    samples : int
        Number of samples to date, including lost and garbled samples.
    accel : sequence of int
        Columns of an accelerometer, x, y, z; empty without one.
    stamp_clock : StampClock, optional
        Clock; its gaps count as missing samples.
    correct : callable, optional
        Function that corrects a gyro sample with a calibration; it also gets the force.
    """

    def __init__(
        self,
        layout: Layout,
        backlog: BacklogFilter,
        scale: float | None,
        limit: float | None,
        samples: int = 0,
        accel: Sequence[int] = (),
        stamp_clock: StampClock | None = None,
        correct: Corrector | None = None,
    ) -> None:
        super().__init__(layout, samples, stamp_clock)
        self._texts: list[str] = []
        self._backlog, self._scale, self._limit = backlog, scale, limit
        self._head: list[list[float]] = []
        self._gyro: list[float] | None = None
        self._accel = tuple(accel)
        self._correct = correct

    @property
    def columns(self) -> Sequence[str]:
        """Names of the channels, and of the extra columns."""
        extra_names = (
            f"{column}_{name}" for column in self._backlog.extra_columns for name in self._names
        )
        return [*self._names, *extra_names]

    @property
    def _names(self) -> list[str]:
        return self.layout.labels

    def miss(self, count: int) -> None:
        """Count this number of samples as missing."""
        if self.stamp_clock is None:
            self.samples += count
            self._backlog.miss(count)
        else:
            super().miss(count)

    def read(self, cells: Sequence[str]) -> tuple[Any, float | None]:
        """Return the sample of gyro and accelerometer, and the stamp; else LineError."""
        gyro, force = self.layout.row(cells), [number_or_nan(cells[i]) for i in self._accel]
        return (gyro, force), self.stamp(cells)

    def numbers(self, row: tuple[list[float], list[float]]) -> list[float]:
        """Return the numbers of a row that are compared with the row before."""
        return [*row[0], *row[1]]

    def feed(self, row: tuple[list[float], list[float]], step: Step, left_out: bool) -> None:
        """Process the samples missing before this one, then this one."""
        if step.missing:
            self.samples += step.missing
            self._backlog.miss(step.missing)
        self.samples += 1
        gyro, force = row
        if self._scale is not None:
            gyro = [value * self._scale for value in gyro]
        elif self.samples <= _HEAD_SAMPLES:
            self._head.append(gyro)
        if self._correct is not None:
            gyro = self._correct(gyro, force)
        self._gyro = gyro
        backlog = self._backlog
        self._texts = backlog.answer(gyro, force) if force else backlog.answer(gyro)

    def answer(self, sample: tuple[Any, float | None]) -> list[str]:
        """Return the answer to a sample."""
        if self.stamp_clock is not None:
            return super().answer(sample)
        self.feed(sample[0], _NEXT_STEP, False)
        return self._texts

    def texts(self) -> list[str]:
        """Return the rate of each channel, and the requested extra columns."""
        return self._texts

    def snapshot(self) -> list[Any]:
        """Return the current state of the filter."""
        return [self.samples, *self._backlog.snapshot()]

    def restore(self, saved: Sequence[Any]) -> None:
        """Restore an earlier state of the filter."""
        self.samples, *backlog_state = saved
        self._backlog.restore(backlog_state)
        del self._head[self.samples :]

    def format_answer(self, cells: Sequence[str], texts: Sequence[str]) -> str:
        """Return a line with its channels replaced by the texts, then the extra columns."""
        return self.layout.answer(cells, texts)

    def header(self, cells: Sequence[str]) -> str:
        """Return the names of an answer's columns."""
        return self.layout.header(cells, self._backlog.extra_columns)

    @property
    def opening(self) -> str | None:
        """Sentence on the filtered columns; None if a line has only a sample."""
        layout, passing = self.layout, self.layout.passthrough_labels
        if layout.names is None and not passing:
            count = layout.fields
            return f"no header: all {count} columns are filtered as gyros" if count > 1 else None
        times = "" if self._scale is None else f" times {self._scale:.6g}"
        unit = "" if layout.unit is None else f" in {layout.unit}"
        filters = f"filters {', '.join(layout.labels)}{times}{unit}"
        if self._accel:
            names = layout.names or tuple(f"column {i}" for i in range(layout.fields))
            filters += f", given motion by {', '.join(names[i] for i in self._accel)}"
        return f"{filters}; passes on {', '.join(passing)}" if passing else filters

    def notice(self) -> str | None:
        """Return a sentence, only once, if the first samples look like raw counts."""
        if self.samples < _HEAD_SAMPLES or not self._head:
            return None
        head, self._head = np.array(self._head), []
        return describe_counts(self._names, "gyro", self.layout.unit or UNKNOWN_UNIT, head)

    def sentences(self) -> Iterator[str]:
        """Yield sentences on the samples left out to date."""
        yield from super().sentences()
        filter_ = self._backlog.filter
        seen = filter_.samples_seen
        yield from ExclusionCounts.of(filter_).sentences(self._names, seen, self._limit)

    def view(self) -> View | None:
        """Return the last sample minus its bias, and the bias."""
        if self._gyro is None:
            return None
        filter_ = self._backlog.filter
        bias = np.atleast_1d(filter_.bias)
        status = filter_.status
        return View(
            seconds=self.samples / filter_.rate,
            names=tuple(self._names),
            unit=self.layout.unit or "",
            rate=tuple((np.array(self._gyro) - bias).tolist()),
            bias=tuple(bias.tolist()),
            bias_sigma=tuple(np.atleast_1d(filter_.bias_sigma).tolist()),
            status=status if isinstance(status, str) else ", ".join(dict.fromkeys(status)),
        )

    def state(self) -> dict[str, Any]:
        """Return the number of pending missing samples, and the detector's state."""
        motion = self._backlog.motion
        fields = {"owed": self._backlog.pending_count, **self.timing()}
        if motion is None:
            return fields
        motion_state = base64.b64encode(motion.to_bytes()).decode()
        return {**fields, "accel": list(self._accel), "motion": motion_state}

    def to_bytes(self) -> bytes:
        """Return the filter as bytes."""
        return self._backlog.filter.to_bytes()
