"""The bytes of a stream's state, and what they must hold."""

import json
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from zerorate._native import DriftFilter
from zerorate.io.names import canonical_unit
from zerorate.options import LIMITS
from zerorate.run.live.lines import Layout
from zerorate.run.live.sequence import SequenceCount
from zerorate.run.live.settings import Settings

__all__ = ["CheckpointError", "SettingsError", "State", "check_settings", "packed", "unpacked"]

_SIGNATURE: Final = b"ZRLINES2"
_LENGTH: Final = 4
_CRC: Final = 4
_NUMBERS: Final = ("last", "lost", "late", "restarts", "turn", "wraps", "run", "lowest")
# What JSON of another kind raises where it is taken for a state.
_FOREIGN: Final = (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError)


class CheckpointError(ValueError):
    """The bytes are no whole checkpoint, or one of other settings."""


class SettingsError(CheckpointError):
    """The checkpoint is of other settings."""


@dataclass(frozen=True)
class State:
    """All that a stream needs to go on; `owed` of its samples the filter has not been given."""

    settings: Settings
    layout: Layout
    samples: int
    lines: int
    sequence: SequenceCount
    filter: DriftFilter
    owed: int

    def check(self) -> None:
        """Raise ValueError if no stream could have come to this state."""
        layout, places = self.layout, range(self.layout.fields)
        channels = None if len(layout.channels) == 1 else len(layout.channels)
        new = self.settings.filter(len(layout.channels) or 1, layout.unit)
        consistent = (
            layout.channels and all(place in places for place in layout.channels),
            len(set(layout.channels)) == len(layout.channels),
            layout.sequence is None or layout.sequence in places,
            (layout.sequence is None) == (self.settings.sequence is None),
            layout.names is None or len(layout.names) == layout.fields,
            (self.filter.channels, self.filter.params) == (channels, new.params),
            self.filter.samples_seen == self.samples - self.owed,
            self.sequence.possible,
        )
        if not all(consistent):
            raise ValueError("the parts of the state do not belong together")


def packed(state: State) -> bytes:
    """Return signature, length of the state, state as JSON, filter, and CRC-32."""
    layout, sequence = state.layout, state.sequence
    fields = {
        "settings": state.settings.as_json(),
        "layout": [layout.fields, layout.channels, layout.sequence, layout.names, layout.unit],
        "samples": state.samples,
        "lines": state.lines,
        "sequence": [getattr(sequence, name) for name in _NUMBERS],
        "owed": state.owed,
    }
    text = json.dumps(fields).encode()
    body = _SIGNATURE + len(text).to_bytes(_LENGTH, "little") + text + state.filter.to_bytes()
    return body + zlib.crc32(body).to_bytes(_CRC, "little")


def unpacked(raw: bytes) -> State:
    """Return the state in a checkpoint.

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
        filter_ = DriftFilter.from_bytes(body[end:])
    except ValueError as error:
        raise CheckpointError(str(error)) from None
    try:
        state = _state(json.loads(body[start:end]), filter_)
        state.check()
    except _FOREIGN:
        raise CheckpointError("its checksum fits, but it holds no state of a stream") from None
    return state


def check_settings(saved: State, now: Settings, fields: int | None) -> None:
    """Raise SettingsError if a checkpoint was made with other settings."""
    theirs = saved.settings.as_json() | {"fields": saved.layout.fields}
    ours = now.as_json() | ({} if fields is None else {"fields": fields})
    # Limits that are not given are not there; options of one of two methods come after the method.
    for name in [*ours, *(LIMITS.keys() & theirs.keys() - ours.keys())]:
        then, value = theirs.get(name), ours.get(name)
        if value != then:
            raise SettingsError(
                f"it was made with {name}={_in_words(then)}, now it is {_in_words(value)}"
            )


def _in_words(value: object) -> str:
    if isinstance(value, list):
        return ",".join(map(str, value)) or "none"
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def _state(fields: dict[str, Any], filter_: DriftFilter) -> State:
    settings = Settings.from_json(fields["settings"])
    width, channels, sequence, names, unit = fields["layout"]
    layout = Layout(
        _whole(width),
        tuple(map(_whole, channels)),
        None if sequence is None else _whole(sequence),
        None if names is None else tuple(map(_text, names)),
        None if unit is None else canonical_unit(unit),
    )
    return State(
        settings=settings,
        layout=layout,
        samples=_whole(fields["samples"]),
        lines=_whole(fields["lines"]),
        sequence=_numbers(settings, fields["sequence"]),
        filter=filter_,
        owed=_whole(fields["owed"]),
    )


def _numbers(settings: Settings, saved: Sequence[Any]) -> SequenceCount:
    given = dict(zip(_NUMBERS, saved, strict=True))
    for name in ("lost", "late", "restarts", "run"):
        _whole(given[name])
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


def _whole(value: object) -> int:
    if _integer(value) < 0:
        raise ValueError("a count was expected")
    return _integer(value)


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError("a text was expected")
    return value
