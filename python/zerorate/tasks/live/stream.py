"""Stream that answers each line with a line; it can be saved after any line."""

import json
from collections.abc import Iterator
from typing import Final, Self

from zerorate.io.readers.tokens import (
    ECHO,
    PAIRS,
    SERIAL_STAMP,
    TUPLES,
    Tokenizer,
    tokenizer_of,
)
from zerorate.record.names import looks_like_gyro, meaning_of
from zerorate.tasks.live.array import ArraySettings
from zerorate.tasks.live.attitude import AttitudeSettings
from zerorate.tasks.live.checkpoint import (
    FOREIGN_STATE_ERRORS,
    CheckpointError,
    StreamState,
    check_count,
    check_settings,
    pack_checkpoint,
    restore_sequence,
    sequence_state,
    unpack_checkpoint,
)
from zerorate.tasks.live.engine import Engine, EngineSettings
from zerorate.tasks.live.lines import LineError, split_cells
from zerorate.tasks.live.navigation import NavigationSettings
from zerorate.tasks.live.sequence import SequenceCount
from zerorate.tasks.live.settings import Settings
from zerorate.tasks.live.view import View

_KINDS: Final[dict[str, type[EngineSettings]]] = {
    kind.kind: kind for kind in (Settings, AttitudeSettings, ArraySettings, NavigationSettings)
}


class LineStream:
    """Stream that answers each line with the engine's result; it can be saved after any line.

    A line has one or several numbers, separated by commas or blanks. An empty cell or ``nan`` is a
    missing sample. The first line may name the columns. Then columns with names of sensors are
    filtered, and all other columns, such as the time, pass through. Without names, all columns are
    filtered. The answer to a line of names is the names of the answer's columns. A source may
    repeat its names after a restart. Lines that begin with ``#`` get no answer.

    Parameters
    ----------
    settings : Settings, AttitudeSettings, ArraySettings or NavigationSettings
        Engine and contents of the lines. With `Settings`, an answer has rates in place of the
        gyro's samples. With other settings, an answer has the cells that are no samples, followed
        by the engine's result. This is the orientation of a body, the rate of an array, or
        position, velocity and orientation of a vehicle.
    fields : int, optional
        Number of cells in a line. Default: from the first line, which must be complete.

    Examples
    --------
    >>> from zerorate.tasks.live import AttitudeSettings, LineStream, Settings
    >>> stream = LineStream(Settings(rate=100.0, method="kf", output="estimate"))
    >>> stream.take("0.5"), stream.take("nan"), stream.samples
    ('0.5', '0.5', 2)
    >>> stream = LineStream(Settings(rate=100.0))
    >>> stream.take("millis,gx,gy"), stream.take("120,0.5,0.25")
    ('millis,gx,gy', '120,0.0,0.0')
    >>> settings = AttitudeSettings(100.0, gyro_unit="rad/s", accel_unit="g", extra=("at_rest",))
    >>> stream = LineStream(settings)
    >>> stream.take("t,gx,gy,gz,ax,ay,az")
    't,quat_w,quat_x,quat_y,quat_z,at_rest'
    >>> stream.take("0.01,0,0,0,0,0,1")
    '0.01,1.0,0.0,0.0,0.0,0'
    """

    def __init__(self, settings: EngineSettings, fields: int | None = None) -> None:
        self.settings = settings
        self.sequence = SequenceCount(settings.rate, settings.sequence_bits)
        self._fields = fields
        self._lines = 0
        self._engine: Engine | None = None
        self._tokenizer: Tokenizer | None = None
        self._looked = False
        self._names: tuple[str, ...] | None = None

    @property
    def samples(self) -> int:
        """Number of samples that the engine has processed."""
        return 0 if self._engine is None else self._engine.samples

    @property
    def position(self) -> int:
        """Sequence number of the next sample, or else the number of lines before this sample."""
        return self._lines if self.settings.sequence is None else self.sequence.next

    @property
    def open(self) -> bool:
        """True once the columns are known."""
        return self._engine is not None

    @property
    def no_answer(self) -> str:
        """Answer to a garbled line: one ``nan`` per column of an answer."""
        return self._require_engine.no_answer

    @property
    def opening(self) -> str | None:
        """Sentence on the columns; None if there is nothing to say."""
        return self._require_engine.opening

    def take(self, line: str) -> str | None:
        """Return the answer to a line, without a line end; None for a comment.

        Raises
        ------
        LineError
            If the line is garbled. Without sequence numbers, the line counts as a missing sample.
            Its answer is `no_answer`. Before the first good line there is no answer.
        ColumnError
            If the columns differ from earlier or requested columns: the stream cannot continue.
        """
        if line.lstrip(" \t").startswith("#"):
            return None
        cells = self._cells(line.rstrip("\r\n"))
        if cells is None:
            return None
        if self._engine is None:
            self._engine = self.settings.open_engine(self._names or cells, self._fields)
        if self._engine.layout.is_header(cells):
            return self._engine.header(cells)
        return self._answer_sample(self._engine, cells)

    def _cells(self, line: str) -> list[str] | None:
        """Return the cells of a line; None if it completes no sample.

        Lines of names and numbers are read as in a log; the first sample defines the names.
        """
        line = SERIAL_STAMP.sub("", line)  # samples are 1/rate apart
        text = line.strip(" \t\r\n")
        if not self._looked:
            self._tokenizer, self._looked = tokenizer_of([line]), bool(text)
        if self._tokenizer is None:
            return split_cells(text)
        if not text:
            return None
        cells = self._tokenizer.take(line)
        if cells is None:
            return None if self._tokenizer.kind in (ECHO, PAIRS) else [text]
        names = self._engine.layout.names if self._engine is not None else None
        sensors = {name for name in cells if meaning_of(name)}
        if names is None and self._tokenizer.kind != TUPLES:
            if sensors and not any(map(looks_like_gyro, sensors)):
                return None  # a line of another sensor
            names = self._names = tuple(cells)
        if names is not None and tuple(cells) != tuple(names):
            return None if sensors.isdisjoint(names) else [*cells.values(), ""]
        return [*cells.values()]

    def take_damaged(self) -> str:
        """Return the answer to a damaged sample; the columns must be known.

        Without sequence numbers, it counts as a missing sample.
        """
        engine = self._require_engine
        if engine.layout.sequence is None:
            self._lines += 1
            engine.miss(1)
        return engine.no_answer

    def notice(self) -> str | None:
        """Return a sentence on the first samples, once; None if there is nothing to say."""
        return None if self._engine is None else self._engine.notice()

    def view(self) -> View | None:
        """Return the view after the last sample; None before the first."""
        return None if self._engine is None else self._engine.view()

    def sentences(self) -> Iterator[str]:
        """Yield sentences on the whole stream."""
        if self._engine is not None:
            yield from self._engine.sentences()

    def to_bytes(self) -> bytes:
        """Return the full state as bytes with a checksum; the columns must be known."""
        engine = self._require_engine
        layout = engine.layout
        kind = self.settings.kind
        fields = {
            **({} if kind == Settings.kind else {"engine": kind}),
            "settings": self.settings.as_json(),
            "layout": [layout.fields, layout.channels, layout.sequence, layout.names, layout.unit],
            "samples": engine.samples,
            "lines": self._lines,
            "sequence": sequence_state(self.sequence),
            **engine.state(),
        }
        return pack_checkpoint(json.dumps(fields).encode(), engine.to_bytes())

    @classmethod
    def from_bytes(
        cls, raw: bytes, settings: EngineSettings | None = None, fields: int | None = None
    ) -> Self:
        """Return the stream saved by `to_bytes`; by default with its settings and fields.

        Raises
        ------
        CheckpointError
            If the bytes are incomplete, or are no saved stream.
        SettingsError
            If the stream was saved with other settings.
        """
        text, filter_ = unpack_checkpoint(raw)
        try:
            saved = StreamState.of(json.loads(text))
            kind = _KINDS[saved.engine]
            stream = cls(kind.from_json(saved.settings), saved.layout.fields)
            stream._lines = check_count(saved.fields["lines"])
            stream.sequence = restore_sequence(stream.settings, saved.fields["sequence"])
            saved.check(stream.settings.sequence, stream.sequence)
        except FOREIGN_STATE_ERRORS:
            raise CheckpointError(
                "its checksum is right, but it has no state of a stream"
            ) from None
        stream._engine = _restore_engine(stream.settings, saved, filter_)
        if settings is not None:
            check_settings(stream.settings, saved.layout.fields, settings, fields)
        return stream

    @property
    def _require_engine(self) -> Engine:
        if self._engine is None:
            raise RuntimeError("no line was received yet, so the columns are unknown")
        return self._engine

    def _answer_sample(self, engine: Engine, cells: list[str]) -> str:
        if engine.layout.sequence is not None:
            number, sample = engine.layout.sequence_number(cells), engine.read(cells)
            missing = self.sequence.step(number)
            if missing is None:
                return engine.format_answer(cells, engine.nan_texts)
            engine.miss(missing)
            return engine.format_answer(cells, engine.answer(sample))
        self._lines += 1
        try:
            sample = engine.read(cells)
        except LineError:
            engine.miss(1)
            raise
        return engine.format_answer(cells, engine.answer(sample))


def _restore_engine(settings: EngineSettings, saved: StreamState, filter_: bytes) -> Engine:
    try:
        return settings.restore_engine(saved.layout, saved.fields, filter_)
    except CheckpointError:
        raise
    except FOREIGN_STATE_ERRORS:
        raise CheckpointError("its checksum is right, but it has no state of a stream") from None
