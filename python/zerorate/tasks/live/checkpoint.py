"""Bytes of a stream's state for all engines, with their checks."""

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Self, TypeVar

from zerorate.faults import keyword_argument, make_sentence
from zerorate.options import REST_LIMITS
from zerorate.record.names import canonical_unit
from zerorate.tasks.live.engine import EngineSettings
from zerorate.tasks.live.lines import Layout
from zerorate.tasks.live.sequence import SequenceCount

T = TypeVar("T")

_SIGNATURE: Final = b"ZRLINES2"
_LENGTH_BYTES: Final = 4
_CRC_BYTES: Final = 4
_SEQUENCE_FIELDS: Final = (
    "last",
    "lost_count",
    "late_count",
    "restart_count",
    "turn",
    "wraps",
    "run",
    "lowest",
)
FOREIGN_STATE_ERRORS: Final = (
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    AttributeError,
    OverflowError,
    RecursionError,
)
"""Errors for JSON that is not a valid state."""


class CheckpointError(ValueError):
    """Error for bytes that are no complete checkpoint, or for wrong settings."""


class SettingsError(CheckpointError):
    """Error for a checkpoint with settings that differ from the stream's settings."""


def pack_checkpoint(text: bytes, filter_: bytes) -> bytes:
    """Return signature, length of the state, state as JSON, filter, and CRC-32."""
    body = _SIGNATURE + len(text).to_bytes(_LENGTH_BYTES, "little") + text + filter_
    return body + zlib.crc32(body).to_bytes(_CRC_BYTES, "little")


def unpack_checkpoint(raw: bytes) -> tuple[bytes, bytes]:
    """Return state and filter of a checkpoint.

    Raises
    ------
    CheckpointError
        If the bytes are no checkpoint, or not complete.
    """
    if raw and not raw[: len(_SIGNATURE)] == _SIGNATURE[: len(raw)]:
        raise CheckpointError("it is not a checkpoint of a stream in this version's format")
    body, checksum = raw[:-_CRC_BYTES], raw[-_CRC_BYTES:]
    if zlib.crc32(body).to_bytes(_CRC_BYTES, "little") != checksum:
        raise CheckpointError("it is truncated or damaged: its checksum is wrong")
    start = len(_SIGNATURE) + _LENGTH_BYTES
    end = start + int.from_bytes(body[len(_SIGNATURE) : start], "little")
    return body[start:end], body[end:]


@dataclass(frozen=True)
class StreamState:
    """State of any engine, with all its fields."""

    engine: str
    settings: Mapping[str, Any]
    layout: Layout
    fields: Mapping[str, Any]

    @classmethod
    def of(cls, fields: Mapping[str, Any]) -> Self:
        """Return the state from JSON; raises one of `FOREIGN_STATE_ERRORS` for other content."""
        width, channels, sequence, names, unit = fields["layout"]
        layout = Layout(
            check_count(width),
            tuple(map(check_count, channels)),
            None if sequence is None else check_count(sequence),
            None if names is None else tuple(map(_check_text, names)),
            None if unit is None else canonical_unit(unit),
        )
        return cls(_check_text(fields.get("engine", "drift")), fields["settings"], layout, fields)

    def check(self, sequence: str | int | None, numbers: SequenceCount) -> None:
        """Raise ValueError if no stream can have these columns and numbers."""
        layout, positions = self.layout, range(self.layout.fields)
        consistent = (
            layout.channels and all(position in positions for position in layout.channels),
            len(set(layout.channels)) == len(layout.channels),
            layout.sequence is None or layout.sequence in positions,
            (layout.sequence is None) == (sequence is None),
            layout.names is None or len(layout.names) == layout.fields,
            numbers.is_possible,
        )
        if not all(consistent):
            raise ValueError("the parts of the state do not match")


def restore_filter(restore: Callable[[bytes], T], raw: bytes) -> T:
    """Return the filter from its bytes; CheckpointError if they contain no filter."""
    try:
        return restore(raw)
    except ValueError as error:
        raise CheckpointError(str(error)) from None


def tuples_to_lists(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with lists in place of tuples, as in JSON."""
    return {name: list(x) if isinstance(x, tuple) else x for name, x in fields.items()}


def lists_to_tuples(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with tuples again, from the output of `tuples_to_lists`."""
    return {name: tuple(x) if isinstance(x, list) else x for name, x in fields.items()}


def check_settings(
    saved: EngineSettings, width: int, current: EngineSettings, fields: int | None
) -> None:
    """Raise SettingsError if a checkpoint was made with other settings."""
    if saved.kind != current.kind:
        raise SettingsError(f"it is of the engine '{saved.kind}', not of '{current.kind}'")
    saved_fields = saved.as_json() | {"fields": width}
    current_fields = current.as_json() | ({} if fields is None else {"fields": fields})
    # Limits that are not set are absent; options of only one method follow the method.
    for name in [
        *current_fields,
        *(REST_LIMITS.keys() & saved_fields.keys() - current_fields.keys()),
    ]:
        if current_fields.get(name) != saved_fields.get(name):
            setting = keyword_argument(name, _format_value(saved_fields.get(name)))
            raise SettingsError(
                make_sentence(
                    "it was made with ",
                    setting,
                    f", now it is {_format_value(current_fields.get(name))}",
                )
            )


def sequence_state(sequence: SequenceCount) -> list[Any]:
    """Return the counts of sequence numbers in the types of JSON."""
    return [getattr(sequence, name) for name in _SEQUENCE_FIELDS]


def _format_value(value: object) -> str:
    if isinstance(value, list):
        return ",".join(map(str, value)) or "none"
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def restore_sequence(settings: EngineSettings, saved: Sequence[Any]) -> SequenceCount:
    """Return the counts from `sequence_state`; raises one of `FOREIGN_STATE_ERRORS` otherwise."""
    counts = dict(zip(_SEQUENCE_FIELDS, saved, strict=True))
    for name in ("lost_count", "late_count", "restart_count", "run"):
        check_count(counts[name])
    _check_integer(counts["lowest"])
    if counts["last"] is not None:
        _check_integer(counts["last"])
    if type(counts["wraps"]) is not bool:
        raise TypeError("a flag was expected")
    if counts["turn"] is not None:
        lowest, highest = counts["turn"]
        counts["turn"] = (_check_integer(lowest), _check_integer(highest))
    return SequenceCount(settings.rate, settings.sequence_bits, **counts)


def _check_integer(value: object) -> int:
    if type(value) is not int:
        raise TypeError("an integer was expected")
    return value


def check_count(value: object) -> int:
    """Return a count; TypeError or ValueError if the argument is no count."""
    if _check_integer(value) < 0:
        raise ValueError("a count was expected")
    return _check_integer(value)


def _check_text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError("a text was expected")
    return value
