"""A filter that takes lines and answers lines, its settings, and the bytes of its state."""

import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Self, Unpack

import numpy as np

from zerorate._native import DriftFilter
from zerorate.options import FILTER_OPTIONS, StreamOptions, checked_options, used_by
from zerorate.run.live.lines import (
    Beside,
    Layout,
    LineError,
    SequenceCount,
    Wanted,
    answer,
    cells_of,
    find_layout,
    header,
    no_answer,
)

__all__ = ["CheckpointError", "LineStream", "Settings", "SettingsError"]

_CHUNK: Final = 1 << 16
_COUNTS: Final = ("last", "lost", "late", "restarts")
_SIGNATURE: Final = b"ZRLINES1"
_LENGTH: Final = 4
_CRC: Final = 4


class CheckpointError(ValueError):
    """The bytes are no whole checkpoint, or one of other settings."""


class SettingsError(CheckpointError):
    """The checkpoint is of other settings."""


@dataclass(frozen=True, init=False)
class Settings:
    """The filter of a stream, and what its lines hold: the same after a restart.

    Parameters
    ----------
    rate : float
        Samples a second.
    beside : tuple of str
        Further columns of an answer: ``"bias"``, ``"bias_sigma"``, ``"at_rest"``.
    columns : tuple of str or int, optional
        Channels by name or position; None is all but the sequence number.
    sequence : str or int, optional
        Column of the sequence number; None for no such column.
    **options
        Arguments of `zerorate.DriftFilter`. By default the method is "auto" and the output
        "compensated".

    Raises
    ------
    ValueError
        If the filter refuses a value, or the method does not use an option.
    """

    rate: float
    beside: tuple[Beside, ...]
    columns: tuple[str | int, ...] | None
    sequence: str | int | None
    options: Mapping[str, Any]

    def __init__(
        self,
        rate: float,
        *,
        beside: tuple[Beside, ...] = (),
        columns: tuple[str | int, ...] | None = None,
        sequence: str | int | None = None,
        **options: Unpack[StreamOptions],
    ) -> None:
        given = checked_options({"method": "auto", "output": "compensated", **options})
        # Written out, so that it is the same setting whether given or not.
        params: Mapping[str, Any] = DriftFilter(rate, **given).params
        known = {name: params[name] for name in FILTER_OPTIONS if name in params}
        vars(self).update(
            rate=rate, beside=beside, columns=columns, sequence=sequence, options=known
        )

    def filter(self, channels: int) -> DriftFilter:
        """Return a new filter; for one channel it takes floats, the fastest way."""
        return DriftFilter(self.rate, channels=None if channels == 1 else channels, **self.options)

    def wanted(self, fields: int | None) -> Wanted:
        """Return which columns to look for in lines of so many cells, None for any number."""
        return Wanted(self.columns, self.sequence, fields)

    def as_json(self) -> dict[str, Any]:
        """Return the settings as JSON keeps them."""
        own = {"rate": self.rate, **self.options}
        own |= {"beside": self.beside, "columns": self.columns, "sequence": self.sequence}
        return {
            name: list(value) if isinstance(value, tuple) else value for name, value in own.items()
        }

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Return the settings that `as_json` gave."""
        given: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in fields.items()
        }
        own = {name: given.pop(name) for name in ("rate", "beside", "columns", "sequence")}
        # An earlier version wrote all options, those that its method does not use as well.
        return cls(**own, **used_by(given["method"], given))


class LineStream:
    """Answers each line with the rate of its sample, and can be saved between any two.

    A line holds one or several numbers with commas or blanks between; an empty cell or ``nan`` is
    a missing sample. The first line may name the columns, and the names may come again after a
    restart of the source; they are answered by the names of the answer's columns. Lines that
    begin with ``#`` are not answered.

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
    """

    def __init__(self, settings: Settings, fields: int | None = None) -> None:
        self.settings = settings
        self.samples = 0
        """Samples that the filter has seen, those lost or garbled among them."""
        self.sequence = SequenceCount(settings.rate)
        self._wanted = settings.wanted(fields)
        self._layout: Layout | None = None
        self._filter: DriftFilter | None = None
        self._lines = 0

    @property
    def position(self) -> int:
        """The sample to go on with: its sequence number, else how many lines came before it."""
        if self.settings.sequence is None:
            return self._lines
        return 0 if self.sequence.last is None else self.sequence.last + 1

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
        return self._header(cells) if self._known.is_header(cells) else self._sample(cells)

    @property
    def open(self) -> bool:
        """Whether the columns are known."""
        return self._layout is not None

    @property
    def no_answer(self) -> str:
        """The answer to a garbled line: as many ``nan`` as an answer has columns."""
        layout, beside = self._known, self.settings.beside
        # A column more for the number that could not be read.
        numbered = "" if layout.sequence is None else "nan,"
        return numbered + no_answer(len(layout.channels), beside)

    def to_bytes(self) -> bytes:
        """Return all that is needed to go on, with a checksum; the columns must be known."""
        layout = self._known
        state = {
            "settings": self.settings.as_json(),
            "layout": [layout.fields, layout.channels, layout.sequence, layout.names],
            "samples": self.samples,
            "lines": self._lines,
            "sequence": [getattr(self.sequence, name) for name in _COUNTS],
        }
        return _packed(state, self._running.to_bytes())

    @classmethod
    def from_bytes(cls, raw: bytes, settings: Settings | None = None) -> Self:
        """Return the stream that `to_bytes` saved; None takes its settings as they were.

        Raises
        ------
        CheckpointError
            The bytes are not whole.
        SettingsError
            They were saved with other settings.
        """
        state, filter_ = _unpacked(raw)
        saved = Settings.from_json(state["settings"])
        if settings is not None:
            _check_settings(saved, settings)
        return cls._restored(state, filter_, saved)

    @classmethod
    def _restored(cls, state: dict[str, Any], filter_: DriftFilter, settings: Settings) -> Self:
        fields, channels, sequence, names = state["layout"]
        stream = cls(settings, fields)
        stream._layout = Layout(fields, tuple(channels), sequence, names and tuple(names))
        stream._filter = filter_
        stream.samples, stream._lines = state["samples"], state["lines"]
        stream.sequence = SequenceCount(settings.rate, *state["sequence"])
        return stream

    def _open(self, layout: Layout) -> None:
        self._filter = self.settings.filter(len(layout.channels))
        self._layout = layout

    @property
    def _known(self) -> Layout:
        if self._layout is None:
            raise RuntimeError("no line has come yet, so the columns are not known")
        return self._layout

    @property
    def _running(self) -> DriftFilter:
        if self._filter is None:
            raise RuntimeError("no line has come yet, so there is no filter")
        return self._filter

    def _header(self, cells: list[str]) -> str:
        layout = self._known
        names = header([cells[i] for i in layout.channels], self.settings.beside)
        return (
            names if layout.sequence is None else f"{header([cells[layout.sequence]], ())},{names}"
        )

    def _sample(self, cells: list[str]) -> str:
        if self._known.sequence is not None:
            return self._numbered(self._known.sequence_number(cells), cells)
        self._lines += 1
        try:
            row = self._known.row(cells)
        except LineError:
            self._miss(1)
            raise
        return self._answer(row)

    def _numbered(self, number: int, cells: list[str]) -> str:
        row = self._known.row(cells)
        missing = self.sequence.step(number)
        if missing is None:
            return f"{number},{no_answer(len(row), self.settings.beside)}"
        self._miss(missing)
        return f"{number},{self._answer(row)}"

    def _answer(self, row: list[float]) -> str:
        self.samples += 1
        filter_ = self._running
        rate = filter_.update(row[0] if filter_.channels is None else row)
        return answer(rate, filter_, self.settings.beside)

    def _miss(self, count: int) -> None:
        self.samples += count
        channels = self._running.channels
        while count > 0:
            n = min(count, _CHUNK)
            self._running.process(np.full(n if channels is None else (n, channels), np.nan))
            count -= n


def _packed(state: dict[str, Any], filter_: bytes) -> bytes:
    """Return signature, length of the state, state as JSON, filter, and CRC-32."""
    text = json.dumps(state).encode()
    body = _SIGNATURE + len(text).to_bytes(_LENGTH, "little") + text + filter_
    return body + zlib.crc32(body).to_bytes(_CRC, "little")


def _unpacked(raw: bytes) -> tuple[dict[str, Any], DriftFilter]:
    """Return the state and the filter of a checkpoint.

    Raises
    ------
    CheckpointError
        If the bytes are not such a checkpoint, or not all of it.
    """
    if raw and not raw[: len(_SIGNATURE)] == _SIGNATURE[: len(raw)]:
        raise CheckpointError("it is no checkpoint of a stream in this version's format")
    body, found = raw[:-_CRC], raw[-_CRC:]
    if zlib.crc32(body).to_bytes(_CRC, "little") != found:
        raise CheckpointError("it is torn or damaged, its checksum does not fit")
    start = len(_SIGNATURE) + _LENGTH
    end = start + int.from_bytes(body[len(_SIGNATURE) : start], "little")
    try:
        return json.loads(body[start:end]), DriftFilter.from_bytes(body[end:])
    except ValueError as error:
        raise CheckpointError(str(error)) from None


def _check_settings(saved: Settings, now: Settings) -> None:
    """Raise SettingsError if a checkpoint was made with other settings."""
    theirs = saved.as_json()
    for name, ours in now.as_json().items():
        # Options that only one of two methods uses come after the method.
        if ours != theirs.get(name):
            then = _in_words(theirs.get(name))
            raise SettingsError(f"it was made with {name}={then}, now it is {_in_words(ours)}")


def _in_words(value: object) -> str:
    if isinstance(value, list):
        return ",".join(map(str, value)) or "none"
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
