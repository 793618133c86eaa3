"""A filter that takes lines and answers lines, and can be saved between any two."""

from collections.abc import Iterator
from typing import Final, Self

import numpy as np

from zerorate.io.counts import note_on_counts
from zerorate.io.names import UNKNOWN
from zerorate.run.left_out import LeftOut
from zerorate.run.live.checkpoint import State, check_settings, packed, unpacked
from zerorate.run.live.lines import Layout, LineError, cells_of, find_layout
from zerorate.run.live.running import Running
from zerorate.run.live.sequence import SequenceCount
from zerorate.run.live.settings import Settings

__all__ = ["LineStream"]

_HEAD: Final = 100
"""Samples that tell whether they look like raw counts."""


class LineStream:
    """Answers each line with the rate of its sample, and can be saved between any two.

    A line holds one or several numbers with commas or blanks between; an empty cell or ``nan`` is
    a missing sample. The first line may name the columns; then those named like gyros are filtered,
    and all others, such as the time, pass through unchanged in their place. Without names all
    columns are filtered. The names may come again after a restart of the source; they are answered
    by the names of the answer's columns. Lines that begin with ``#`` are not answered.

    Parameters
    ----------
    settings : Settings
        The filter, and what the lines hold.
    fields : int, optional
        Numbers in a line; None is as many as in the first line, which must be whole then.

    Examples
    --------
    >>> from zerorate.live import LineStream, Settings
    >>> stream = LineStream(Settings(rate=100.0, method="kf", output="estimate"))
    >>> stream.take("0.5"), stream.take("nan"), stream.samples
    ('0.5', '0.5', 2)
    >>> stream = LineStream(Settings(rate=100.0))
    >>> stream.take("millis,gx,gy"), stream.take("120,0.5,0.25")
    ('millis,gx,gy', '120,0.0,0.0')
    """

    def __init__(self, settings: Settings, fields: int | None = None) -> None:
        self.settings = settings
        self.samples = 0
        """Samples that the filter has seen, those lost or garbled among them."""
        self.sequence = SequenceCount(settings.rate, settings.sequence_bits)
        self._wanted = settings.wanted(fields)
        self._layout: Layout | None = None
        self._filter: Running | None = None
        self._lines = 0
        self._scale = settings.data_scale
        self._head: list[list[float]] = []

    @property
    def position(self) -> int:
        """The sample to go on with: its sequence number, else how many lines came before it."""
        if self.settings.sequence is None:
            return self._lines
        return self.sequence.next

    def take(self, line: str) -> str | None:
        """Return the answer to a line, without a line end; None for a comment.

        Raises
        ------
        LineError
            The line is garbled. Where the lines are not numbered it stands for a missing sample;
            either way `no_answer` is its answer. Before the first good line there is none.
        ColumnError
            The columns are others than before, or than was asked for: the stream cannot go on.
        """
        text = line.strip(" \t\r\n")
        if text.startswith("#"):
            return None
        cells = cells_of(text)
        if self._layout is None:
            self._open(find_layout(cells, self._wanted))
        if self._known.is_header(cells):
            return self._known.header(cells, self.settings.beside)
        return self._sample(cells)

    @property
    def open(self) -> bool:
        """Whether the columns are known."""
        return self._layout is not None

    @property
    def no_answer(self) -> str:
        """The answer to a garbled line: as many ``nan`` as an answer has columns."""
        layout = self._known
        return ",".join(["nan"] * (layout.fields + self._further))

    @property
    def opening(self) -> str | None:
        """A sentence on which columns are filtered, None if a line holds nothing but a sample."""
        layout, passing = self._known, self._known.passing
        if layout.names is None and not passing:
            count = layout.fields
            return f"no header: all {count} columns are filtered as gyros" if count > 1 else None
        scale = self.settings.data_scale
        times = "" if scale is None else f" times {scale:.6g}"
        unit = "" if layout.unit is None else f" in {layout.unit}"
        filters = f"filters {', '.join(layout.labels)}{times}{unit}"
        return f"{filters}; passes on {', '.join(passing)}" if passing else filters

    def to_bytes(self) -> bytes:
        """Return all that is needed to go on, with a checksum; the columns must be known."""
        state = State(
            settings=self.settings,
            layout=self._known,
            samples=self.samples,
            lines=self._lines,
            sequence=self.sequence,
            filter=self._running.filter,
            owed=self._running.owed,
        )
        return packed(state)

    @classmethod
    def from_bytes(
        cls, raw: bytes, settings: Settings | None = None, fields: int | None = None
    ) -> Self:
        """Return the stream that `to_bytes` saved; None takes settings and fields as they were.

        Raises
        ------
        CheckpointError
            The bytes are not whole, or hold what no stream has saved.
        SettingsError
            They were saved with other settings.
        """
        state = unpacked(raw)
        if settings is not None:
            check_settings(state, settings, fields)
        stream = cls(state.settings, state.layout.fields)
        stream._layout, stream.sequence = state.layout, state.sequence
        stream.samples, stream._lines = state.samples, state.lines
        stream._filter = Running(state.filter, state.settings.beside, state.owed)
        return stream

    def sentences(self) -> Iterator[str]:
        """Yield what there is to say of the samples that the filter has left out so far."""
        if self._layout is None:
            return
        names, filter_ = self._known.labels, self._running.filter
        limit = self.settings.options["limit"]
        yield from LeftOut.of(filter_).sentences(names, filter_.samples_seen, limit)

    def notice(self) -> str | None:
        """Return a sentence on the first samples if they look like raw counts, once."""
        if self.samples < _HEAD or not self._head:
            return None
        layout, head, self._head = self._known, np.array(self._head), []
        return note_on_counts(layout.labels, "gyro", layout.unit or UNKNOWN, head)

    def _open(self, layout: Layout) -> None:
        filter_ = self.settings.filter(len(layout.channels), layout.unit)
        self._filter = Running(filter_, self.settings.beside)
        self._layout = layout

    @property
    def _known(self) -> Layout:
        if self._layout is None:
            raise RuntimeError("no line has come yet, so the columns are not known")
        return self._layout

    @property
    def _running(self) -> Running:
        if self._filter is None:
            raise RuntimeError("no line has come yet, so there is no filter")
        return self._filter

    def _sample(self, cells: list[str]) -> str:
        if self._known.sequence is not None:
            return self._numbered(self._known.sequence_number(cells), cells)
        self._lines += 1
        try:
            row = self._known.row(cells)
        except LineError:
            self._miss(1)
            raise
        return self._answer(row, cells)

    def _numbered(self, number: int, cells: list[str]) -> str:
        row = self._known.row(cells)
        missing = self.sequence.step(number)
        if missing is None:
            return self._known.answer(cells, ["nan"] * (len(row) + self._further))
        self._miss(missing)
        return self._answer(row, cells)

    def _answer(self, row: list[float], cells: list[str]) -> str:
        self.samples += 1
        if self._scale is not None:
            row = [value * self._scale for value in row]
        elif self.samples <= _HEAD:
            self._head.append(row)
        return self._known.answer(cells, self._running.answer(row))

    @property
    def _further(self) -> int:
        """Columns of an answer beside those of the line."""
        return len(self._known.channels) * len(self.settings.beside)

    def _miss(self, count: int) -> None:
        self.samples += count
        self._running.miss(count)
