"""Array of gyros as the engine of a stream: answers are the rate of the body."""

import base64
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, ClassVar, Final, Self

import numpy as np

from zerorate._native import GyroArray
from zerorate.faults import ArgumentError, keyword_argument, make_sentence
from zerorate.io.clocks.causal import Step
from zerorate.io.clocks.units import check_time_unit
from zerorate.record.names import looks_like_gyro
from zerorate.tasks.live.checkpoint import check_count, lists_to_tuples, restore_filter
from zerorate.tasks.live.engine import Engine
from zerorate.tasks.live.lines import (
    ColumnError,
    ColumnRequest,
    Layout,
    find_layout,
    format_numbers,
    header_names,
)
from zerorate.tasks.live.stamp_clock import StampClock, TimedEngine, restore_stamp_clock

_AXES: Final = ("x", "y", "z")
_MISSING_BLOCK_SAMPLES: Final = 1 << 14
"""Largest number of missing samples given to the array at once."""


class ArrayColumn(StrEnum):
    """Additional columns of an answer, after the rate.

    Examples
    --------
    >>> from zerorate.tasks.live import ArrayColumn
    >>> [column.value for column in ArrayColumn]
    ['at_rest', 'health']
    """

    at_rest = "at_rest"
    health = "health"


@dataclass(frozen=True)
class ArraySettings:
    """Array and columns of a live stream; a restart needs the same settings.

    Parameters
    ----------
    array : GyroArray
        A new array without samples; its state is copied.
    extra : tuple of str
        Extra columns of an answer, from `ArrayColumn`: ``"at_rest"`` for each axis, ``"health"``
        for each sensor.
    columns : tuple of str or int, optional
        Columns of the axes, sensor by sensor. Default: columns with names of gyros, in the order of
        the header line. Without a header line: all columns except `sequence` and `time`.
    sequence : str or int, optional
        Column of the sequence number; None if there is none.
    sequence_bits : int, optional
        Width of the sequence number, bits; None: found from the data.
    time : str or int, optional
        Column of the time of each sample; a gap counts as missing samples.
    time_unit : str, optional
        Unit of the time, if the column's name does not state it.

    Raises
    ------
    ValueError
        If the array has processed samples, or an extra column is unknown.

    Examples
    --------
    >>> import zerorate as zr
    >>> from zerorate.tasks.live import ArraySettings, LineStream
    >>> stream = LineStream(ArraySettings(zr.GyroArray(100.0, 2, axes=1), extra=("health",)))
    >>> stream.take("t,gyro0_z,gyro1_z"), stream.take("0.0,0.5,0.7")
    ('t,rate,health_1,health_2', '0.0,0.0,good,good')
    """

    kind: ClassVar[str] = "array"

    array: GyroArray
    extra: tuple[str, ...] = ()
    columns: tuple[str | int, ...] | None = None
    sequence: str | int | None = None
    sequence_bits: int | None = None
    time: str | int | None = None
    time_unit: str | None = None

    def __post_init__(self) -> None:
        """Check everything that does not depend on the lines."""
        if self.array.samples_seen:
            raise ArgumentError(
                "array",
                f"must be one that has seen no sample, got {self.array.samples_seen} samples",
            )
        object.__setattr__(self, "array", self.array.copy())
        object.__setattr__(self, "time_unit", check_time_unit(self.time_unit))
        for name in self.extra:
            ArrayColumn(name)

    @property
    def rate(self) -> float:
        """Samples per second, Hz."""
        return self.array.rate

    def open_engine(self, cells: Sequence[str], fields: int | None) -> Engine:
        """Return a new array for lines like the first line; raise LineError or ColumnError."""
        names = header_names(cells) if any(cells) else None
        gyros = tuple(i for i, name in enumerate(names or ()) if looks_like_gyro(name))
        columns = self.columns or gyros or None
        layout = find_layout(cells, ColumnRequest(columns, self.sequence, fields, time=self.time))
        self._check(layout)
        stamp_clock = StampClock.of(
            self.rate, self.time, self.time_unit, layout.names, layout.fields
        )
        return ArrayEngine(layout, self.array.copy(), self.extra, stamp_clock=stamp_clock)

    def restore_engine(self, layout: Layout, saved: Mapping[str, Any], filter_: bytes) -> Engine:
        """Return the array from a checkpoint; ValueError if its parts contradict each other."""
        array, samples = (
            restore_filter(GyroArray.from_bytes, filter_),
            check_count(saved["samples"]),
        )
        self._check(layout)
        if repr(array) != repr(self.array) or array.samples_seen != samples:
            raise ValueError("the parts of the state do not match")
        stamp_clock = restore_stamp_clock(self.rate, saved)
        engine = ArrayEngine(layout, array, self.extra, samples, stamp_clock)
        engine.go_on(saved)
        return engine

    def as_json(self) -> dict[str, Any]:
        """Return the settings in the types of JSON."""
        return {
            "array": base64.b64encode(self.array.to_bytes()).decode(),
            "extra": list(self.extra),
            "columns": None if self.columns is None else list(self.columns),
            "sequence": self.sequence,
            "sequence_bits": self.sequence_bits,
            "time": self.time,
            "time_unit": self.time_unit,
        }

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Return the settings from the output of `as_json`."""
        arguments = lists_to_tuples(fields)
        raw = base64.b64decode(arguments.pop("array"))
        return cls(restore_filter(GyroArray.from_bytes, raw), **arguments)

    def _check(self, layout: Layout) -> None:
        sensors, axes = self.array.sensors, self.array.axes
        if len(layout.channels) != sensors * axes:
            raise ColumnError(
                make_sentence(
                    f"an array of {sensors} sensors needs {sensors * axes} columns, got "
                    f"{len(layout.channels)}: choose with ",
                    keyword_argument("columns"),
                    " sensor by sensor",
                )
            )


class ArrayEngine(TimedEngine):
    """Engine that answers each sample with the rate of the body, and extra columns.

    Parameters
    ----------
    layout : Layout
        Layout of every line.
    array : GyroArray
        The array.
    extra_columns : sequence of str
        Extra columns.
    samples : int
        Number of samples to date, including lost and garbled samples.
    stamp_clock : StampClock, optional
        Clock; its gaps count as missing samples.
    """

    def __init__(
        self,
        layout: Layout,
        array: GyroArray,
        extra_columns: Sequence[str],
        samples: int = 0,
        stamp_clock: StampClock | None = None,
    ) -> None:
        super().__init__(layout, samples, stamp_clock)
        self._array, self._extra_columns = array, [ArrayColumn(name) for name in extra_columns]
        self._rate: Any = math.nan
        self._shape = (array.sensors, 3) if array.axes == 3 else (array.sensors,)

    @property
    def columns(self) -> Sequence[str]:
        """Names of the rate's axes, and of the extra columns."""
        axes = [f"_{axis}" for axis in _AXES] if self._array.axes == 3 else [""]
        names = [f"rate{axis}" for axis in axes]
        extra_names = {
            ArrayColumn.at_rest: [f"at_rest{axis}" for axis in axes],
            ArrayColumn.health: [f"health_{label}" for label in self._array.labels],
        }
        return names + [name for column in self._extra_columns for name in extra_names[column]]

    def miss(self, count: int) -> None:
        """Count this number of samples as missing."""
        if self.stamp_clock is None:
            self._predict(count)
        else:
            super().miss(count)

    def _predict(self, count: int) -> None:
        self.samples += count
        while count > 0:
            n = min(count, _MISSING_BLOCK_SAMPLES)
            self._array.process(np.full((n, *self._shape), np.nan))
            count -= n

    def read(self, cells: Sequence[str]) -> tuple[list[float], float | None]:
        """Return the numbers of all sensors, and the stamp."""
        return self.layout.row(cells), self.stamp(cells)

    def feed(self, row: list[float], step: Step, left_out: bool) -> None:
        """Process the samples missing before this one, then this one."""
        if step.missing:
            self._predict(step.missing)
        self.samples += 1
        self._rate = self._array.update(np.reshape(row, self._shape))

    def snapshot(self) -> list[Any]:
        """Return the current state of the array."""
        return [self.samples, self._array.to_bytes()]

    def restore(self, saved: Sequence[Any]) -> None:
        """Restore an earlier state of the array."""
        self.samples, raw = saved
        self._array = GyroArray.from_bytes(raw)

    def texts(self) -> list[str]:
        """Return the rate of the body, and the requested extra columns."""
        texts = format_numbers(self._rate)
        for column in self._extra_columns:
            value = getattr(self._array, column)
            texts += value if column is ArrayColumn.health else format_numbers(value)
        return texts

    def state(self) -> dict[str, Any]:
        """Return the state of the clock; the array holds all other state."""
        return self.timing()

    def to_bytes(self) -> bytes:
        """Return the array as bytes."""
        return self._array.to_bytes()
