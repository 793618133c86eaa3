"""How sensors are mounted, as options and the metadata of files say."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from zerorate.cli.errors import UsageFault, as_usage, require
from zerorate.cli.options import parse_words
from zerorate.io.mounting import read_mounting
from zerorate.record.mounting import Mounting
from zerorate.types import Floats

_NONE: Final = "none"
_AUTO: Final = "auto"
_TOLD: Final = 0.05
_UNTOLD: Final = 1.0
"""How well an antenna is known that is told, and one of which nothing is told, m."""


def numbers(option: str, text: str, count: int, expected: str) -> list[float]:
    """Return what an option of some numbers says."""
    try:
        found = [float(word) for word in parse_words(option, text, expected)]
    except ValueError:
        found = []
    if len(found) != count or not np.isfinite(found).all():
        raise UsageFault(f"{option} takes {expected} with commas between, got '{text}'")
    return found


@dataclass(frozen=True)
class Mounted:
    """Where the sensors are, and a sentence on where that is known from.

    The offset is None where nothing tells it, and so is the matrix; `plain` is whether the axes of
    the sensors are said to be those of the body, `antenna_told` whether anything says where it is,
    `offset_typed` whether the offset is that of a person, not of a file.
    """

    matrix: Floats | None
    antenna: Sequence[float]
    time_offset: float | None
    note: str
    plain: bool = False
    antenna_told: bool = True
    offset_typed: bool = False

    @property
    def antenna_sigma(self) -> float:
        """How well it is known where the antenna is, m."""
        return _TOLD if self.antenna_told else _UNTOLD

    @classmethod
    def of(
        cls, log: Path, mount: str | None, antenna: str | None, time_offset: str | None
    ) -> "Mounted":
        """Return what options say, and metadata where options say nothing."""
        with as_usage():
            told = read_mounting(log) if log.is_file() else Mounting()
            given, source = (told, log) if mount is None else _mounting(mount)
        parts = {"mounting": given.body_from_sensor is not None}
        lever, knows = [0.0] * 3, True
        if antenna is not None:
            lever = numbers("--antenna", antenna, 3, "three numbers")
        elif given.antenna is not None or told.antenna is not None:
            own = given.antenna if given.antenna is not None else told.antenna
            lever = [float(x) for x in np.asarray(own)]
            parts["antenna"] = True
        else:
            knows = False
        offset = None
        if time_offset is not None:
            offset = _offset(time_offset)
        elif given.time_offset is not None or told.time_offset is not None:
            own_offset = given.time_offset if given.time_offset is not None else told.time_offset
            offset = own_offset
            parts["time offset"] = True
        named = [name for name, there in parts.items() if there]
        note = ""
        if named and source is not None:
            arm = ", ".join(f"{x:g}" for x in lever)
            values = f"antenna {arm} m" + ("" if offset is None else f", time offset {offset:g} s")
            listed = " and ".join(filter(None, (", ".join(named[:-1]), named[-1])))
            note = f"{listed} by the metadata of {source.name} ({values})"
        typed = time_offset is not None and offset is not None
        return cls(given.body_from_sensor, lever, offset, note, mount == _NONE, knows, typed)


def _mounting(text: str) -> tuple[Mounting, Path | None]:
    """Return what ``--mount`` says, and the file whose metadata say it."""
    if text == _NONE:
        return Mounting(), None
    words = re.split(r"[\s,\[\]]+", text)
    path = Path(text)
    if path.is_file():
        told = read_mounting(path)
        if told.body_from_sensor is not None:
            return told, path
        try:
            words = re.split(r"[\s,\[\]]+", path.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError):
            words = []
    try:
        found = [float(word) for word in filter(None, words)]
    except ValueError:
        found = []
    if len(found) != 9:
        raise UsageFault(
            "--mount takes nine numbers of a rotation with commas between, a file with them, or "
            f"'none', got '{text}'"
        )
    return Mounting(np.reshape(found, (3, 3))), None


def _offset(text: str) -> float | None:
    """Return what ``--time-offset`` says, None where it is to be found."""
    if text == _AUTO:
        return None
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
