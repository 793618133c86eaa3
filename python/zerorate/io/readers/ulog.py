"""ULog, the format of PX4's logs: definitions, subscriptions, and rows of numbered topics.

Each message states its length. The file is scanned once, then the rows of each topic are read
together. Every step moves forward and all limits depend on the size of the file, so no file can
block the reader. See https://docs.px4.io/main/en/dev_log/ulog_file_format.html.
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


_MESSAGE_HEAD: Final = struct.Struct("<HBH")
"""Struct of a message header (length, kind) and the topic number at the beginning of a row."""
_FRAME_BYTES: Final = 3
_HEADER_BYTES: Final = 16
_DATA_KIND: Final = ord("D")
_MESSAGE_KINDS: Final = b"ABCDFILMOPQRS"
_KNOWN_KIND: Final = re.compile(b"[" + _MESSAGE_KINDS + b"]")
_SYNC: Final = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
_FORMAT: Final = re.compile(rb"[\w/-]{1,255}:[ -~]*")
_PARAMETER: Final = re.compile(rb"(float|int32_t) (\w{1,64})")
_FIELD: Final = re.compile(r"([\w/-]{1,255})(?:\[(\d{1,5})\])? (\S{1,255})")

_UINT16_MAX: Final = 0xFFFF
"""Largest length of a message, topic number, and number of usable formats."""
_MAX_DEPTH: Final = 16
_RESYNC_MESSAGES: Final = 3
"""Number of consecutive valid messages that end a damaged part."""
_FIELD_BYTES: Final = 256
"""Approximate memory for a field without its name and values, bytes."""
_FREE_BYTES: Final = 1 << 23
"""Memory that the fields of any log may use, bytes; larger files may use their size."""


@dataclass(frozen=True)
class Topic:
    """Fields of one instance of a topic, each (n,), with flat names such as ``q[0]``."""

    name: str
    instance: int
    fields: Mapping[str, Column]


@dataclass
class ULog:
    """Topics of a log, last values of its parameters, and dropouts with their times, ms.

    ``lost_bytes`` is the number of unreadable bytes, ``cut_bytes`` the size of an incomplete last
    message.
    """

    topics: list[Topic] = field(default_factory=list)
    parameters: dict[str, float] = field(default_factory=dict)
    dropouts: int = 0
    dropped_ms: int = 0
    lost_bytes: int = 0
    cut_bytes: int = 0


def parse_log(raw: bytes) -> ULog:
    """Return the valid parts of a log.

    Raises
    ------
    ValueError
        If the header is damaged, the log needs an unknown way of reading, or it declares more data
        than it contains.
    """
    if len(raw) < _HEADER_BYTES or not raw.startswith(MAGIC):
        raise ValueError("the header is damaged")
    walk = _LogWalker(raw)
    for start, end in _find_parts(raw):
        walk.read_part(start, end)
    walk.gather_topics()
    return walk.log


def _find_parts(raw: bytes) -> list[tuple[int, int]]:
    """Return the spans of messages; a log lists the offsets of appended data."""
    offsets: list[int] = []
    first = raw[_HEADER_BYTES : _HEADER_BYTES + _FRAME_BYTES + 40]
    if len(first) == _FRAME_BYTES + 40 and first[2:3] == b"B":
        flags, stated_offsets = first[11:19], struct.unpack_from("<3Q", first, 19)
        if flags[0] & ~1 or any(flags[1:]):
            raise ValueError("it has flags of a version that is not known")
        offsets = sorted(
            {at for at in stated_offsets if flags[0] and _HEADER_BYTES < at < len(raw)}
        )
    return list(zip([_HEADER_BYTES, *offsets], [*offsets, len(raw)], strict=True))


class _Field(NamedTuple):
    """Field of a format: a plain type or another format, possibly an array."""

    kind: str
    times: int | None
    name: str


class _RowSize(NamedTuple):
    """Bytes of a row, with and without padding at its end."""

    min_bytes: int
    max_bytes: int


class _Formats:
    """Formats by name, each parsed when one of its topics is subscribed."""

    def __init__(self) -> None:
        self._texts: dict[str, bytes] = {}
        self._rows: dict[str, _RowSize | None] = {}

    def add(self, data: bytes) -> None:
        """Add a definition; the first definition of a name is used."""
        name, _, text = data.partition(b":")
        if len(self._texts) < _UINT16_MAX:
            fields = b";".join(filter(None, text.split(b";")))
            self._texts.setdefault(name.decode("ascii", "replace"), fields)

    def row_size(self, name: str, depth: int = 0) -> _RowSize | None:
        """Return the size and fields of a format's row; None if unknown or damaged."""
        if name not in self._rows and name in self._texts and depth < _MAX_DEPTH:
            self._rows[name] = None  # for a format that contains itself
            try:
                self._rows[name] = self._measure(name, depth)
            except ValueError:
                return None
        return self._rows.get(name)

    def _measure(self, name: str, depth: int) -> _RowSize | None:
        min_bytes = max_bytes = 0
        for kind, times, label in self._fields(name):
            inner = None if kind in _SIZES else self.row_size(kind, depth + 1)
            size = inner.max_bytes if inner is not None else _SIZES.get(kind, 0)
            max_bytes += size * (1 if times is None else times)
            if not size or times == 0 or max_bytes > _UINT16_MAX:
                return None
            if not label.startswith("_padding"):
                min_bytes = max_bytes
        return _RowSize(min_bytes, max_bytes) if min_bytes else None

    def _fields(self, name: str) -> Iterator[_Field]:
        for part in self._texts[name].decode("ascii").split(";"):
            match = _FIELD.fullmatch(part)
            if match is None:
                raise ValueError(f"'{part}' is no field")
            kind, times, label = match.groups()
            yield _Field(kind, None if times is None else int(times), label)

    def plain_fields(self, name: str, size: int, free: int) -> dict[str, str]:
        """Return the plain fields in the first bytes of a row; empty if two have the same name.

        Raises
        ------
        ValueError
            If the fields need more memory than `free`.
        """
        fields: dict[str, str] = {}
        for label, kind in self._flatten(name, ""):
            size -= _SIZES[kind]
            free -= _FIELD_BYTES + len(label)
            if free < 0:
                raise ValueError("it declares more fields than a log of its size can hold")
            if size < 0:
                break  # the rest is padding
            if label in fields:
                return {}
            fields[label] = _TYPES[kind]
        return fields

    def _flatten(self, name: str, prefix: str) -> Iterator[tuple[str, str]]:
        for kind, times, label in self._fields(name):
            for index in [""] if times is None else (f"[{i}]" for i in range(times)):
                if kind in _TYPES:
                    yield f"{prefix}{label}{index}", kind
                else:
                    yield from self._flatten(kind, f"{prefix}{label}{index}.")


class _TopicRows(NamedTuple):
    """Offsets of a topic's rows, and the possible bytes of its messages."""

    min_bytes: int
    max_bytes: int
    offsets: array[int]


class _LogWalker:
    """Scanner of a log's messages."""

    def __init__(self, raw: bytes) -> None:
        self.log = ULog()
        self._raw = raw
        self._end = len(raw)
        self._formats = _Formats()
        self._rows: dict[tuple[str, int], _TopicRows] = {}
        self._numbered: dict[int, _TopicRows] = {}

    def read_part(self, at: int, end: int) -> None:
        """Read the messages between two offsets."""
        self._end = end
        raw, unpack, numbered = self._raw, _MESSAGE_HEAD.unpack_from, self._numbered
        while at + _MESSAGE_HEAD.size <= end:
            size, kind, number = unpack(raw, at)
            after = at + _FRAME_BYTES + size
            rows = numbered.get(number) if kind == _DATA_KIND else None
            if rows is not None and rows.min_bytes <= size <= rows.max_bytes and after <= end:
                rows.offsets.append(at + _MESSAGE_HEAD.size)
            elif self._is_sound(at):
                self._handle(kind, at + _FRAME_BYTES, after)
            else:
                after = self._skip_damage(at, after)
            at = after
        if end == len(raw):
            self.log.cut_bytes += end - at

    def _handle(self, kind: int, at: int, after: int) -> None:
        match chr(kind):
            case "F":
                self._formats.add(self._raw[at:after])
            case "A":
                self._subscribe(at, after)
            case "P":
                self._parameter(self._raw[at:after])
            case "O":
                self.log.dropouts += 1
                self.log.dropped_ms += int.from_bytes(self._raw[at:after], "little")

    def _parameter(self, raw: bytes) -> None:
        match = _PARAMETER.fullmatch(raw[1 : 1 + raw[0]])
        if match is not None and len(raw) == 5 + raw[0]:
            kind = "<f" if match[1] == b"float" else "<i"
            (value,) = struct.unpack_from(kind, raw, 1 + raw[0])
            self.log.parameters[match[2].decode("ascii")] = float(value)

    def _subscribe(self, at: int, after: int) -> None:
        name, row = self._parse_subscription(at, after)
        if row is not None and len(self._rows) < _UINT16_MAX:
            new = _TopicRows(row.min_bytes + 2, row.max_bytes + 2, array("Q"))
            rows = self._rows.setdefault((name, self._raw[at]), new)
            self._numbered[int.from_bytes(self._raw[at + 1 : at + 3], "little")] = rows

    def _parse_subscription(self, at: int, after: int) -> tuple[str, _RowSize | None]:
        name = self._raw[at + 3 : after].decode("ascii", "replace")
        return name, self._formats.row_size(name)

    def _is_sound(self, at: int) -> bool:
        """Return True if a message agrees with its declaration and is complete."""
        size, kind, number = _MESSAGE_HEAD.unpack_from(self._raw, at)
        at, after = at + _FRAME_BYTES, at + _FRAME_BYTES + size
        if after > self._end:
            return False
        match chr(kind):
            case "D":
                rows = self._numbered.get(number)
                return rows is not None and bool(rows.min_bytes <= size <= rows.max_bytes)
            case "A":
                return 3 < size < 256 and self._parse_subscription(at, after)[1] is not None
            case "F":
                return _FORMAT.fullmatch(self._raw, at, after) is not None
            case "S":
                return self._raw.startswith(_SYNC, at)
            case "R" | "O":
                return bool(size == 2)
            case "B" | "I" | "M" | "P" | "Q" | "L" | "C":
                # Such messages have little structure; with a damaged length, their end is
                # arbitrary.
                return size > 1 and self._has_messages(after, _RESYNC_MESSAGES)
        return False

    def _skip_damage(self, at: int, after: int) -> int:
        """Return the offset at which to continue after an unreadable message."""
        is_framed = after <= self._end and self._has_messages(
            after, _RESYNC_MESSAGES
        )  # except for its kind or number
        resume = after if is_framed else self._find_next(at)
        if resume < self._end or after <= self._end or self._raw[at + 2] not in _MESSAGE_KINDS:
            self.log.lost_bytes += resume - at
        elif self._end == len(self._raw):  # nothing was appended after this part
            self.log.cut_bytes = self._end - at
        return resume

    def _find_next(self, at: int) -> int:
        """Return the offset of the next message after an offset, or the end."""
        for known in _KNOWN_KIND.finditer(self._raw, at + _FRAME_BYTES, self._end - 2):
            start = known.start() - 2
            after = start + _FRAME_BYTES + _MESSAGE_HEAD.unpack_from(self._raw, start)[0]
            if self._is_sound(start) and self._has_messages(after, _RESYNC_MESSAGES - 1):
                return start
        return self._end

    def _has_messages(self, at: int, messages: int) -> bool:
        """Return True if a number of messages can follow from an offset on, or up to the end."""
        for _ in range(messages):
            if at + _MESSAGE_HEAD.size > self._end:
                break
            size, kind, _ = _MESSAGE_HEAD.unpack_from(self._raw, at)
            if kind not in _MESSAGE_KINDS or not size:
                return False
            at += _FRAME_BYTES + size
        return True

    def gather_topics(self) -> None:
        """Collect the rows of each topic, with fields as views of them."""
        free = _FREE_BYTES + len(self._raw)
        for (name, instance), rows in self._rows.items():
            size = rows.min_bytes - 2
            fields = self._formats.plain_fields(name, size, free) if rows.offsets else {}
            free -= sum(_FIELD_BYTES + len(label) for label in fields)
            if fields.get("timestamp") == _TIME:
                windows = sliding_window_view(np.frombuffer(self._raw, np.uint8), size)
                table = windows[np.frombuffer(rows.offsets, np.uint64)]
                values = table.view(np.dtype(list(fields.items())))[:, 0]
                topic = Topic(name, instance, {label: values[label] for label in fields})
                self.log.topics.append(topic)
            else:
                self.log.lost_bytes += len(rows.offsets) * (_MESSAGE_HEAD.size + size)
