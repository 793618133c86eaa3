"""ULog, the format of PX4's logs: definitions, subscriptions, and rows of topics by their number.

Each message says its length, so the file is walked once and the rows of a topic are then taken all
together. Every step goes forward and each limit follows the size of the file, so no bytes can hold
the reader up. See https://docs.px4.io/main/en/dev_log/ulog_file_format.html.
"""

from __future__ import annotations

import re
import struct
from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from zerorate.io.table import Column

MAGIC: Final = b"ULog\x01\x12\x35"

_TYPES: Final = {
    "int8_t": "i1",
    "uint8_t": "u1",
    "int16_t": "<i2",
    "uint16_t": "<u2",
    "int32_t": "<i4",
    "uint32_t": "<u4",
    "int64_t": "<i8",
    "uint64_t": "<u8",
    "float": "<f4",
    "double": "<f8",
    "bool": "i1",
    "char": "i1",
}
_TIME: Final = _TYPES["uint64_t"]
_SIZES: Final = {name: np.dtype(kind).itemsize for name, kind in _TYPES.items()}


_HEAD: Final = struct.Struct("<HBH")
"""Bytes that follow the three of the header, the kind, and what a row begins with: its number."""
_FRAME: Final = 3
_START: Final = 16
_ROW: Final = ord("D")
_KINDS: Final = b"ABCDFILMOPQRS"
_KNOWN: Final = re.compile(b"[" + _KINDS + b"]")
_SYNC: Final = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
_FORMAT: Final = re.compile(rb"[\w/-]{1,255}:[ -~]*")
_PARAMETER: Final = re.compile(rb"(float|int32_t) (\w{1,64})")
_FIELD: Final = re.compile(r"([\w/-]{1,255})(?:\[(\d{1,5})\])? (\S{1,255})")

_MOST: Final = 0xFFFF
"""Bytes in a message, numbers of topics, and so formats that can be of use."""
_DEEPEST: Final = 16
_SURE: Final = 3
"""Messages one behind the other that show that damage is over."""
_OF_A_FIELD: Final = 256
"""Bytes of memory, about, that a field takes beside its name and its values."""
_FREE: Final = 1 << 23
"""Bytes that the fields of a log may take in any case; beyond, as many as the file has."""


@dataclass(frozen=True)
class Topic:
    """What one instance of a topic said: its fields, each (n,), by flat names such as ``q[0]``."""

    name: str
    instance: int
    fields: Mapping[str, Column]


@dataclass
class ULog:
    """Topics of a log, its parameters as they were last, its dropouts with their time in ms.

    ``lost`` are bytes that could not be read, ``cut`` those of a last message that the file ends
    within.
    """

    topics: list[Topic] = field(default_factory=list)
    parameters: dict[str, float] = field(default_factory=dict)
    dropouts: int = 0
    dropped: int = 0
    lost: int = 0
    cut: int = 0


def parsed(raw: bytes) -> ULog:
    """Return what is sound in the bytes of a log.

    Raises
    ------
    ValueError
        If the header is damaged, the log must be read in a way that is not known here, or it
        declares more than it can hold.
    """
    if len(raw) < _START or not raw.startswith(MAGIC):
        raise ValueError("the header is damaged")
    walk = _Walk(raw)
    for start, end in _stretches(raw):
        walk.over(start, end)
    walk.gather()
    return walk.log


def _stretches(raw: bytes) -> list[tuple[int, int]]:
    """Return where messages lie: a log says at which places others were appended to it."""
    offsets: list[int] = []
    first = raw[_START : _START + _FRAME + 40]
    if len(first) == _FRAME + 40 and first[2:3] == b"B":
        flags, told = first[11:19], struct.unpack_from("<3Q", first, 19)
        if flags[0] & ~1 or any(flags[1:]):
            raise ValueError("it has flags of a version that is not known")
        offsets = sorted({at for at in told if flags[0] and _START < at < len(raw)})
    return list(zip([_START, *offsets], [*offsets, len(raw)], strict=True))


class _Field(NamedTuple):
    """A field of a format: of a plain kind or another format, maybe several times."""

    kind: str
    times: int | None
    name: str


class _Row(NamedTuple):
    """Bytes that a row has, with and without what pads its end."""

    least: int
    most: int


class _Formats:
    """Formats by name, each looked into when a topic of it is subscribed to."""

    def __init__(self) -> None:
        self._texts: dict[str, bytes] = {}
        self._rows: dict[str, _Row | None] = {}

    def add(self, data: bytes) -> None:
        """Take a definition; the first of a name holds."""
        name, _, text = data.partition(b":")
        if len(self._texts) < _MOST:
            fields = b";".join(filter(None, text.split(b";")))
            self._texts.setdefault(name.decode("ascii", "replace"), fields)

    def row(self, name: str, depth: int = 0) -> _Row | None:
        """Return what a row of a format holds, None where that is unknown or damaged."""
        if name not in self._rows and name in self._texts and depth < _DEEPEST:
            self._rows[name] = None  # for a format within itself
            try:
                self._rows[name] = self._measured(name, depth)
            except ValueError:
                return None
        return self._rows.get(name)

    def _measured(self, name: str, depth: int) -> _Row | None:
        least = most = 0
        for kind, times, label in self._fields(name):
            inner = None if kind in _SIZES else self.row(kind, depth + 1)
            size = inner.most if inner is not None else _SIZES.get(kind, 0)
            most += size * (1 if times is None else times)
            if not size or times == 0 or most > _MOST:
                return None
            if not label.startswith("_padding"):
                least = most
        return _Row(least, most) if least else None

    def _fields(self, name: str) -> Iterator[_Field]:
        for part in self._texts[name].decode("ascii").split(";"):
            found = _FIELD.fullmatch(part)
            if found is None:
                raise ValueError(f"'{part}' is no field")
            kind, times, label = found.groups()
            yield _Field(kind, None if times is None else int(times), label)

    def plain(self, name: str, size: int, free: int) -> dict[str, str]:
        """Return the plain fields in the first bytes of a row, empty if two have one name.

        Raises
        ------
        ValueError
            If they take more memory than is free.
        """
        found: dict[str, str] = {}
        for label, kind in self._flat(name, ""):
            size -= _SIZES[kind]
            free -= _OF_A_FIELD + len(label)
            if free < 0:
                raise ValueError("it declares more fields than a log of its size can hold")
            if size < 0:
                break  # what is left pads the row
            if label in found:
                return {}
            found[label] = _TYPES[kind]
        return found

    def _flat(self, name: str, prefix: str) -> Iterator[tuple[str, str]]:
        for kind, times, label in self._fields(name):
            for index in [""] if times is None else (f"[{i}]" for i in range(times)):
                if kind in _TYPES:
                    yield f"{prefix}{label}{index}", kind
                else:
                    yield from self._flat(kind, f"{prefix}{label}{index}.")


class _Rows(NamedTuple):
    """Where the rows of a topic lie, and the bytes that a message of it may have."""

    least: int
    most: int
    places: array[int]


class _Walk:
    """One walk over the messages of a log."""

    def __init__(self, raw: bytes) -> None:
        self.log = ULog()
        self._raw = raw
        self._end = len(raw)
        self._formats = _Formats()
        self._rows: dict[tuple[str, int], _Rows] = {}
        self._numbered: dict[int, _Rows] = {}

    def over(self, at: int, end: int) -> None:
        """Take the messages between two places."""
        self._end = end
        raw, unpack, numbered = self._raw, _HEAD.unpack_from, self._numbered
        while at + _HEAD.size <= end:
            size, kind, number = unpack(raw, at)
            after = at + _FRAME + size
            rows = numbered.get(number) if kind == _ROW else None
            if rows is not None and rows.least <= size <= rows.most and after <= end:
                rows.places.append(at + _HEAD.size)
            elif self._is_sound(at):
                self._take(kind, at + _FRAME, after)
            else:
                after = self._behind_damage(at, after)
            at = after
        if end == len(raw):
            self.log.cut += end - at

    def _take(self, kind: int, at: int, after: int) -> None:
        match chr(kind):
            case "F":
                self._formats.add(self._raw[at:after])
            case "A":
                self._subscribe(at, after)
            case "P":
                self._parameter(self._raw[at:after])
            case "O":
                self.log.dropouts += 1
                self.log.dropped += int.from_bytes(self._raw[at:after], "little")

    def _parameter(self, raw: bytes) -> None:
        found = _PARAMETER.fullmatch(raw[1 : 1 + raw[0]])
        if found is not None and len(raw) == 5 + raw[0]:
            kind = "<f" if found[1] == b"float" else "<i"
            (value,) = struct.unpack_from(kind, raw, 1 + raw[0])
            self.log.parameters[found[2].decode("ascii")] = float(value)

    def _subscribe(self, at: int, after: int) -> None:
        name, row = self._subscribed(at, after)
        if row is not None and len(self._rows) < _MOST:
            new = _Rows(row.least + 2, row.most + 2, array("Q"))
            rows = self._rows.setdefault((name, self._raw[at]), new)
            self._numbered[int.from_bytes(self._raw[at + 1 : at + 3], "little")] = rows

    def _subscribed(self, at: int, after: int) -> tuple[str, _Row | None]:
        name = self._raw[at + 3 : after].decode("ascii", "replace")
        return name, self._formats.row(name)

    def _is_sound(self, at: int) -> bool:
        """Whether a message can be what it says, and all of it is there."""
        size, kind, number = _HEAD.unpack_from(self._raw, at)
        at, after = at + _FRAME, at + _FRAME + size
        if after > self._end:
            return False
        match chr(kind):
            case "D":
                rows = self._numbered.get(number)
                return rows is not None and bool(rows.least <= size <= rows.most)
            case "A":
                return 3 < size < 256 and self._subscribed(at, after)[1] is not None
            case "F":
                return _FORMAT.fullmatch(self._raw, at, after) is not None
            case "S":
                return self._raw.startswith(_SYNC, at)
            case "R" | "O":
                return bool(size == 2)
            case "B" | "I" | "M" | "P" | "Q" | "L" | "C":
                # Their form says little; one that lost its true length ends anywhere.
                return size > 1 and self._begins(after, _SURE)
        return False

    def _behind_damage(self, at: int, after: int) -> int:
        """Return where to go on behind a message that cannot be read."""
        known = after <= self._end and self._begins(after, _SURE)  # but for its kind or number
        there = after if known else self._next(at)
        if there < self._end or after <= self._end or self._raw[at + 2] not in _KINDS:
            self.log.lost += there - at
        elif self._end == len(self._raw):  # and not what another part was appended to
            self.log.cut = self._end - at
        return there

    def _next(self, at: int) -> int:
        """Return where a message begins again behind a place, or where all ends."""
        for known in _KNOWN.finditer(self._raw, at + _FRAME, self._end - 2):
            there = known.start() - 2
            after = there + _FRAME + _HEAD.unpack_from(self._raw, there)[0]
            if self._is_sound(there) and self._begins(after, _SURE - 1):
                return there
        return self._end

    def _begins(self, at: int, messages: int) -> bool:
        """Whether so many messages may follow each other from a place on, or up to the end."""
        for _ in range(messages):
            if at + _HEAD.size > self._end:
                break
            size, kind, _ = _HEAD.unpack_from(self._raw, at)
            if kind not in _KINDS or not size:
                return False
            at += _FRAME + size
        return True

    def gather(self) -> None:
        """Take the rows of each topic together, its fields as views of them."""
        free = _FREE + len(self._raw)
        for (name, instance), rows in self._rows.items():
            size = rows.least - 2
            fields = self._formats.plain(name, size, free) if rows.places else {}
            free -= sum(_OF_A_FIELD + len(label) for label in fields)
            if fields.get("timestamp") == _TIME:
                windows = sliding_window_view(np.frombuffer(self._raw, np.uint8), size)
                table = windows[np.frombuffer(rows.places, np.uint64)]
                values = table.view(np.dtype(list(fields.items())))[:, 0]
                topic = Topic(name, instance, {label: values[label] for label in fields})
                self.log.topics.append(topic)
            else:
                self.log.lost += len(rows.places) * (_HEAD.size + size)
