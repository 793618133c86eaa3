"""How sensors are mounted, as options and the metadata of files say."""

import math
import re
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from zerorate.cli.errors import UsageFault, require
from zerorate.cli.options import parse_words
from zerorate.io.mounting import read_mounting
from zerorate.types import Floats

_NONE: Final = "none"
_AUTO: Final = "auto"


def numbers(option: str, text: str, count: int, expected: str) -> list[float]:
    """Return what an option of some numbers says."""
    try:
        found = [float(word) for word in parse_words(option, text, expected)]
    except ValueError:
        found = []
    if len(found) != count or not np.isfinite(found).all():
        raise UsageFault(f"{option} takes {expected} with commas between, got '{text}'")
    return found


class Stated(NamedTuple):
    """What ``--mount`` says: of `zerorate.navigate`, with what else a file's metadata state."""

    mount: Floats | str
    antenna: Floats | None = None
    time_offset: float | None = None


def mounting_of(text: str | None) -> Stated:
    """Return what ``--mount`` says: nine numbers, a file with them or with metadata, or none."""
    if text is None or text == _NONE:
        return Stated(_AUTO if text is None else _NONE)
    path = Path(text)
    if path.is_file():
        stated = read_mounting(path)
        if stated.body_from_sensor is not None:
            return Stated(stated.body_from_sensor, stated.antenna, stated.time_offset)
    words = filter(None, re.split(r"[\s,\[\]]+", _content(path) if path.is_file() else text))
    try:
        found = [float(word) for word in words]
    except ValueError:
        found = []
    if len(found) != 9:
        raise UsageFault(
            "--mount takes nine numbers of a rotation with commas between, a file with them, or "
            f"'none', got '{text}'"
        )
    return Stated(np.reshape(found, (3, 3)))


def _content(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return ""


def antenna_of(text: str | None, stated: Stated) -> Floats | list[float] | None:
    """Return what ``--antenna`` says, or the file of ``--mount``."""
    return stated.antenna if text is None else numbers("--antenna", text, 3, "three numbers")


def offset_of(text: str | None, stated: Stated) -> float | str:
    """Return what ``--time-offset`` says, or the file of ``--mount``."""
    if text is None:
        return _AUTO if stated.time_offset is None else stated.time_offset
    if text == _AUTO:
        return text
    try:
        offset = float(text)
    except ValueError:
        offset = math.nan
    if not math.isfinite(offset):
        raise UsageFault(f"--time-offset takes seconds, or 'auto', got '{text}'")
    return offset


def place_with_field(text: str | None) -> tuple[float, ...] | None:
    """Return the place of ``--at``, of which the model of the earth's field is asked."""
    if text is None:
        return None
    place = numbers("--at", text, 2, "latitude and longitude, deg,")
    if abs(place[0]) > 90.0 or abs(place[1]) > 360.0:
        raise UsageFault(f"--at takes deg, latitude within 90 first, got '{text}'")
    require("pygeomag", "magnetic")
    return tuple(place)
