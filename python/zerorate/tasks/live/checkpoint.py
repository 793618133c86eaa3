"""The bytes of a stream's state, of any engine, and what they must hold."""

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Self, TypeVar

from zerorate.faults import given, said
from zerorate.options import LIMITS
from zerorate.record.names import canonical_unit
from zerorate.tasks.live.engine import EngineSettings
from zerorate.tasks.live.lines import Layout
from zerorate.tasks.live.sequence import SequenceCount

T = TypeVar("T")

_SIGNATURE: Final = b"ZRLINES2"
_LENGTH: Final = 4
_CRC: Final = 4
_NUMBERS: Final = (
    "last",
    "lost_count",
    "late_count",
    "restart_count",
    "turn",
    "wraps",
    "run",
    "lowest",
)
FOREIGN: Final = (
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    AttributeError,
    OverflowError,
    RecursionError,
)
"""What JSON of another kind raises where it is taken for a state."""


class CheckpointError(ValueError):
    """The bytes are no whole checkpoint, or one of other settings."""


class SettingsError(CheckpointError):
    """The checkpoint is of other settings."""


def sealed(text: bytes, filter_: bytes) -> bytes:
    """Return signature, length of the state, state as JSON, filter, and CRC-32."""
    body = _SIGNATURE + len(text).to_bytes(_LENGTH, "little") + text + filter_
    return body + zlib.crc32(body).to_bytes(_CRC, "little")


def unsealed(raw: bytes) -> tuple[bytes, bytes]:
    """Return state and filter of a checkpoint.

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
    return body[start:end], body[end:]


@dataclass(frozen=True)
class Saved:
    """What the state of any engine holds, and all its fields."""

    engine: str
    settings: Mapping[str, Any]
    layout: Layout
    fields: Mapping[str, Any]

    @classmethod
    def of(cls, fields: Mapping[str, Any]) -> Self:
        """Return it of JSON that was read; one of `FOREIGN` if it is of another kind."""
        width, channels, sequence, names, unit = fields["layout"]
        layout = Layout(
            whole(width),
            tuple(map(whole, channels)),
            None if sequence is None else whole(sequence),
            None if names is None else tuple(map(_text, names)),
            None if unit is None else canonical_unit(unit),
        )
        return cls(_text(fields.get("engine", "drift")), fields["settings"], layout, fields)

    def check(self, sequence: str | int | None, numbers: SequenceCount) -> None:
        """Raise ValueError if no stream could have come to these columns and numbers."""
        layout, places = self.layout, range(self.layout.fields)
        consistent = (
            layout.channels and all(place in places for place in layout.channels),
            len(set(layout.channels)) == len(layout.channels),
            layout.sequence is None or layout.sequence in places,
            (layout.sequence is None) == (sequence is None),
            layout.names is None or len(layout.names) == layout.fields,
            numbers.possible,
        )
        if not all(consistent):
            raise ValueError("the parts of the state do not belong together")


def filter_of(restore: Callable[[bytes], T], raw: bytes) -> T:
    """Return the filter that bytes hold; CheckpointError if they hold none."""
    try:
        return restore(raw)
    except ValueError as error:
        raise CheckpointError(str(error)) from None


def as_lists(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings as JSON keeps them, tuples as lists."""
    return {name: list(x) if isinstance(x, tuple) else x for name, x in fields.items()}


def as_tuples(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings that `as_lists` gave."""
    return {name: tuple(x) if isinstance(x, list) else x for name, x in fields.items()}


def check_settings(
    theirs: EngineSettings, width: int, now: EngineSettings, fields: int | None
) -> None:
    """Raise SettingsError if a checkpoint was made with other settings."""
    if theirs.kind != now.kind:
        raise SettingsError(f"it is of the engine '{theirs.kind}', not of '{now.kind}'")
    then = theirs.as_json() | {"fields": width}
    ours = now.as_json() | ({} if fields is None else {"fields": fields})
    # Limits that are not given are not there; options of one of two methods come after the method.
    for name in [*ours, *(LIMITS.keys() & then.keys() - ours.keys())]:
        if ours.get(name) != then.get(name):
            made = given(name, _in_words(then.get(name)))
            raise SettingsError(
                said("it was made with ", made, f", now it is {_in_words(ours.get(name))}")
            )


def numbers_of(sequence: SequenceCount) -> list[Any]:
    """Return what is counted of sequence numbers, as JSON keeps it."""
    return [getattr(sequence, name) for name in _NUMBERS]


def _in_words(value: object) -> str:
    if isinstance(value, list):
        return ",".join(map(str, value)) or "none"
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def sequence_of(settings: EngineSettings, saved: Sequence[Any]) -> SequenceCount:
    """Return what `numbers_of` gave; one of `FOREIGN` if it is of another kind."""
    given = dict(zip(_NUMBERS, saved, strict=True))
    for name in ("lost_count", "late_count", "restart_count", "run"):
        whole(given[name])
    _integer(given["lowest"])
    if given["last"] is not None:
        _integer(given["last"])
    if type(given["wraps"]) is not bool:
        raise TypeError("a flag was expected")
    if given["turn"] is not None:
        lowest, highest = given["turn"]
        given["turn"] = (_integer(lowest), _integer(highest))
    return SequenceCount(settings.rate, settings.sequence_bits, **given)


def _integer(value: object) -> int:
    if type(value) is not int:
        raise TypeError("an integer was expected")
    return value


def whole(value: object) -> int:
    """Return a count; TypeError or ValueError if it is none."""
    if _integer(value) < 0:
        raise ValueError("a count was expected")
    return _integer(value)


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError("a text was expected")
    return value
