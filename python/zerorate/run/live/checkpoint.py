"""The bytes of a stream: signature, length of the state, state as JSON, filter, CRC-32."""

import json
import zlib
from typing import Any

from zerorate._native import DriftFilter
from zerorate.run.live.settings import Settings

__all__ = ["CheckpointError", "SettingsError", "check_settings", "pack", "unpack"]

_SIGNATURE = b"ZRLINES1"
_LENGTH = 4
_CRC = 4


class CheckpointError(ValueError):
    """The bytes are no whole checkpoint, or one of other settings."""


class SettingsError(CheckpointError):
    """The checkpoint is of other settings."""


def pack(state: dict[str, Any], filter_: bytes) -> bytes:
    """Return a state and the bytes of a filter as one checkpoint."""
    text = json.dumps(state).encode()
    body = _SIGNATURE + len(text).to_bytes(_LENGTH, "little") + text + filter_
    return body + zlib.crc32(body).to_bytes(_CRC, "little")


def unpack(raw: bytes) -> tuple[dict[str, Any], DriftFilter]:
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


def check_settings(saved: Settings, now: Settings) -> None:
    """Raise SettingsError if a checkpoint was made with other settings."""
    theirs = saved.as_json()
    for name, ours in now.as_json().items():
        if ours != theirs[name]:
            then = _shown(theirs[name])
            raise SettingsError(f"it was made with {name}={then}, now it is {_shown(ours)}")


def _shown(value: object) -> str:
    if isinstance(value, list):
        return ",".join(map(str, value)) or "none"
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
