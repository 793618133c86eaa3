"""DataFlash, the self-describing format of ArduPilot's logs, binary or text.

A message ``FMT`` declares each kind of message, with one letter per field. In newer firmware,
``FMTU``, ``UNIT`` and ``MULT`` add units. A binary log is scanned once, in Rust; then a field of
all rows is read on request. See
https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from zerorate._native import dataflash_index
from zerorate.io.readers.layouts import find_layout
from zerorate.io.readers.parsers import parse_columns
from zerorate.io.table import Column
from zerorate.types import Integers

MAGIC: Final = b"\xa3\x95"
_HEAD_BYTES: Final = 3

_DTYPES: Final = {
    "a": "<i2",
    "b": "i1",
    "B": "u1",
    "M": "u1",
    "h": "<i2",
    "H": "<u2",
    "c": "<i2",
    "C": "<u2",
    "g": "<f2",
    "i": "<i4",
    "I": "<u4",
    "e": "<i4",
    "E": "<u4",
    "L": "<i4",
    "f": "<f4",
    "d": "<f8",
    "q": "<i8",
    "Q": "<u8",
    "n": "S4",
    "N": "S16",
    "Z": "S64",
}
"""NumPy types for the letters of fields."""
_SIZES: Final = {name: np.dtype(kind).itemsize for name, kind in _DTYPES.items()} | {"a": 64}
_DIVISORS: Final = {"c": 1e2, "C": 1e2, "e": 1e2, "E": 1e2, "L": 1e7}
"""Divisors of integers for some letters."""
_NON_NUMBER_LETTERS: Final = "anNZ"
_WORD_LETTERS: Final = _NON_NUMBER_LETTERS + "M"
"""Letters of fields that are words in a text log."""
_NUMBER_BYTES: Final = b"0123456789+-.eE, \tnaifNAIF\r"


@dataclass(frozen=True)
class Message:
    """Rows of one kind of message; each field is read on request.

    ``letters`` has one letter per name in ``names``. ``multipliers`` convert fields to units
    without prefix, if the log states them: 1e-3 for milligauss.
    """

    name: str
    names: tuple[str, ...]
    letters: str
    rows: int
    read: Callable[[Sequence[int], Integers | None], list[Column]]
    multipliers: Mapping[str, float] = field(default_factory=dict)
    selected_rows: Integers | None = None

    def __contains__(self, name: object) -> bool:
        """Return True if there is a field with this name."""
        return name in self.names

    def __getitem__(self, name: str) -> Column:
        """Return a field of all rows, shape (n,), with the type of its letter."""
        return self.read([self.names.index(name)], self.selected_rows)[0]

    def select_rows(self, rows: Integers) -> Message:
        """Return the message with some of its rows."""
        return replace(self, rows=len(rows), selected_rows=rows)

    def load_numbers(self) -> Message:
        """Return the message with all numbers in memory."""
        indices = [self.names.index(name) for name in self.numbers()]
        columns = dict(zip(indices, self.read(indices, self.selected_rows), strict=True))

        def read(wanted: Sequence[int], _: Integers | None) -> list[Column]:
            return [columns[index] for index in wanted]

        return replace(self, read=read)

    def numbers(self) -> tuple[str, ...]:
        """Return the names of the numeric fields."""
        pairs = zip(self.names, self.letters, strict=True)
        return tuple(name for name, letter in pairs if letter not in _NON_NUMBER_LETTERS)


@dataclass
class DataFlash:
    """Messages of a log by name, and the amount of unreadable data.

    ``lost_count`` counts damaged bytes, ``cut_count`` the bytes of an incomplete last message. For
    a text log both count lines, as ``counted_unit`` states.
    """

    messages: dict[str, Message] = field(default_factory=dict)
    lost_count: int = 0
    cut_count: int = 0
    size: int = 0
    counted_unit: str = "bytes"

    def add(self, message: Message, length: int) -> None:
        """Add messages of a given length; the larger of two declarations with one name is kept."""
        before = self.messages.get(message.name)
        if before is None or before.rows < message.rows:
            self.messages[message.name] = message
            self.lost_count += 0 if before is None else length * before.rows
        else:
            self.lost_count += length * message.rows


def parse_binary(path: Path) -> DataFlash:
    """Return the messages of a binary log; the file is mapped, not loaded."""
    raw = _map_file(path)
    kinds, lost, cut = dataflash_index(raw)
    log = DataFlash(lost_count=lost, cut_count=cut, size=len(raw))
    numbers: dict[int, str] = {}
    for number, name, letters, columns, length, places in kinds:
        message = _make_message(path, name, letters, columns, places)
        if message is None:
            log.lost_count += length * len(places)
        else:
            numbers[number] = message.name
            log.add(message, length)
    _add_multipliers(log, numbers)
    return log


def _map_file(path: Path) -> Column:
    return np.asarray(np.memmap(path, np.uint8, "r"))


def _make_message(
    path: Path, name: bytes, letters: bytes, columns: bytes, places: Column
) -> Message | None:
    """Return the messages of a declaration; None if a letter is unknown."""
    names = tuple(_decode_ascii(columns).split(","))
    kinds = _decode_ascii(letters)
    if len(set(names)) < len(names) or len(names) != len(kinds) or not set(kinds) <= set(_DTYPES):
        return None
    sizes = [_SIZES[letter] for letter in kinds]
    offsets = np.cumsum([_HEAD_BYTES, *sizes])

    def read(wanted: Sequence[int], chosen: Integers | None) -> list[Column]:
        starts = places if chosen is None else places[chosen]
        # For several fields, whole messages are copied at once.
        is_single = len(wanted) == 1
        size = sizes[wanted[0]] if is_single else int(offsets[-1])
        windows = sliding_window_view(_map_file(path), size)
        rows = (
            windows[starts + np.uint64(offsets[wanted[0]] if is_single else 0)]
            if len(starts)
            else windows[:0]
        )
        fields = []
        for index in wanted:
            begin = 0 if is_single else int(offsets[index])
            raw = rows[:, begin : begin + sizes[index]]
            values = raw.view(np.dtype(_DTYPES[kinds[index]]))
            fields.append(_scale_field(values, kinds[index]))
        return fields

    return Message(_decode_ascii(name), names, kinds, len(places), read)


def _scale_field(values: Column, letter: str) -> Column:
    values = values if letter == "a" else values[:, 0]
    divisor = _DIVISORS.get(letter)
    return values if divisor is None else values / divisor


def _decode_ascii(raw: bytes) -> str:
    return raw.decode("ascii", "replace")


def parse_text(path: Path) -> DataFlash:
    """Return the messages of a text log with lines such as ``IMU, 1000, 0.1, ...``."""
    raw = path.read_bytes()
    rows: dict[bytes, list[bytes]] = {}
    for line in raw.splitlines():
        label, _, rest = line.partition(b",")
        rows.setdefault(label.strip(), []).append(rest)
    log = DataFlash(size=raw.count(b"\n"), counted_unit="lines")
    for name, letters, names in _parse_declarations(rows.pop(b"FMT", [])):
        lines = rows.pop(name.encode(), [])
        message, sound = _parse_lines(name, letters, names, lines)
        log.lost_count += len(lines) - sound
        if message is not None:
            log.add(message, 1)
    log.lost_count += sum(map(len, rows.values()))  # lines without a declaration
    return log


def _parse_declarations(lines: list[bytes]) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Yield name, letters and fields of each kind of message; the last declaration is used."""
    declared = {}
    for line in lines:
        _, _, name, letters, *names = (*map(str.strip, _decode_ascii(line).split(",")), "", "", "")
        names = [field_name for field_name in names if field_name]
        known = names and len(names) == len(letters) and set(letters) <= set(_DTYPES)
        if name and known and len(set(names)) == len(names):
            declared[name] = (name, letters, tuple(names))
    yield from declared.values()


def _parse_lines(
    name: str, letters: str, names: tuple[str, ...], lines: list[bytes]
) -> tuple[Message | None, int]:
    """Return the messages in lines, and the number of valid lines."""
    commas = len(names) - 1
    if not set(letters) & set(_WORD_LETTERS):
        sound = [line for line in lines if _is_sound(line, commas)]
    else:
        sound = [line for line in lines if line.count(b",") == commas]
    if not sound:
        return None, 0
    raw = b"\n".join(sound)
    layout, _ = find_layout(raw, names)
    if layout.width != len(names):
        return None, 0

    def read(wanted: Sequence[int], chosen: Integers | None) -> list[Column]:
        numbers = [index for index in wanted if letters[index] not in _WORD_LETTERS]
        columns = dict(
            zip(numbers, parse_columns(raw, layout, numbers) if numbers else (), strict=True)
        )
        for index in set(wanted) - set(numbers):
            columns[index] = np.array([line.split(b",")[index].strip() for line in sound])
        return [columns[index] if chosen is None else columns[index][chosen] for index in wanted]

    return Message(name, names, letters, len(sound), read), len(sound)


def _is_sound(line: bytes, commas: int) -> bool:
    return line.count(b",") == commas and not line.translate(None, _NUMBER_BYTES)


def _add_multipliers(log: DataFlash, numbers: Mapping[int, str]) -> None:
    """Set the factors of the messages' fields that the log states."""
    factor_message, unit_message = log.messages.get("MULT"), log.messages.get("FMTU")
    if factor_message is None or unit_message is None:
        return
    if not {"Id", "Mult"} <= set(factor_message.names) or not {"FmtType", "MultIds"} <= set(
        unit_message.names
    ):
        return
    pairs = zip(factor_message["Id"].tolist(), factor_message["Mult"].tolist(), strict=True)
    # These doubles were stored as floats.
    factors = {chr(int(key) & 0x7F): float(f"{value:.7g}") for key, value in pairs}
    factors = {key: value for key, value in factors.items() if key not in "-?" and 0 < value < 1e12}
    for number, ids in zip(
        unit_message["FmtType"].tolist(), unit_message["MultIds"].tolist(), strict=True
    ):
        message = log.messages.get(numbers.get(int(number), ""))
        if message is not None:
            multipliers = {
                name: factors[letter]
                for name, kind, letter in zip(
                    message.names, message.letters, _decode_ascii(ids), strict=False
                )
                if kind not in _DIVISORS and letter in factors
            }
            log.messages[message.name] = replace(message, multipliers=multipliers)
