"""What the name of a column says: its unit, and what it measures."""

from __future__ import annotations

import re

from zerorate.io.log import LogError

__all__ = [
    "UNKNOWN",
    "canonical_unit",
    "common_unit",
    "looks_like_accelerometer",
    "looks_like_gyro",
    "looks_like_sensor",
    "looks_like_time",
    "plain",
    "spelled",
    "split_unit",
    "with_suffix",
]

UNKNOWN = "unit"

_SPELLINGS = {
    "rad/s": ("rad/s", "radps", "rad_s", "rads", "rad/sec", "rad s^-1", "rad*s^-1"),
    "deg/s": ("deg/s", "dps", "degps", "deg_s", "degs", "deg/sec", "°/s", "deg s^-1"),
    "deg/h": ("deg/h", "degph", "dph", "deg_h", "deg/hr", "°/h", "deg h^-1"),
    "g": ("g",),
    "m/s^2": ("m/s^2", "mps2", "m/s2", "m/s²", "m s^-2", "m*s^-2"),
}
_ONLY_IN_NAMES = {"deg": ("deg", "°"), "rad": ("rad",), "uT": ("ut", "µt")}
SUFFIXES = {
    "rad/s": "radps",
    "deg/s": "dps",
    "deg/h": "degph",
    "g": "g",
    "m/s^2": "mps2",
    "deg": "deg",
    "rad": "rad",
    "uT": "ut",
}

_UNIT = {spelling: unit for unit, all_ in _SPELLINGS.items() for spelling in all_}
_UNIT_IN_NAME = _UNIT | {s: unit for unit, all_ in _ONLY_IN_NAMES.items() for s in all_}
_LONGEST_FIRST = sorted(_UNIT_IN_NAME, key=len, reverse=True)
_BRACKET = re.compile(r"^(.*?)[\s_]*[\[(]\s*([^\[\]()]+?)\s*[\])]$")


def canonical_unit(text: object) -> str:
    """Return the unit in its one spelling; ValueError listing the known ones otherwise."""
    unit = _UNIT.get(text.strip().lower()) if isinstance(text, str) else None
    if unit is None:
        raise ValueError(f"unknown unit {text!r}; known: {', '.join(_SPELLINGS)}")
    return unit


def split_unit(name: str) -> tuple[str, str | None]:
    """Return a column's name without its unit, and the unit (None where it carries none).

    The unit stands at the end, after an underscore or blank or in brackets:
    ``gyro_x_dps``, ``wx [rad s^-1]``.
    """
    bracket = _BRACKET.match(name.strip())
    if bracket and bracket[2].lower() in _UNIT_IN_NAME:
        return bracket[1], _UNIT_IN_NAME[bracket[2].lower()]
    lower = name.lower()
    for spelling in _LONGEST_FIRST:
        if lower.endswith(("_" + spelling, " " + spelling)):
            return name[: -len(spelling) - 1], _UNIT_IN_NAME[spelling]
    return name, None


def with_suffix(name: str, unit: str) -> str:
    """Return the name ending in the unit's suffix, unless it carries a unit or none is known."""
    if unit not in SUFFIXES or split_unit(name)[1] is not None:
        return name
    return f"{name}_{SUFFIXES[unit]}"


def common_unit(names: list[str], given: str | None, file_unit: str | None) -> str:
    """Return the one unit of the columns: their suffix, else the given one, else the file's.

    Raises
    ------
    LogError
        If the columns differ in unit, or the given unit contradicts a suffix.
    """
    suffixes = {name: split_unit(name)[1] for name in names}
    for name, unit in suffixes.items():
        if given is not None and unit is not None and unit != given:
            raise LogError(f"unit '{given}' was given, but column '{name}' is in {unit}")
    fallback = given or spelled(file_unit or "") or UNKNOWN
    units = {name: unit or fallback for name, unit in suffixes.items()}
    if len(set(units.values())) > 1:
        listed = ", ".join(f"'{n}' {_described(u)}" for n, u in units.items())
        raise LogError(f"the columns differ in unit ({listed}); choose columns of one unit")
    return next(iter(units.values()))


def spelled(unit: str) -> str:
    """Return the unit in its one spelling where it is known, else as it stands."""
    return _UNIT.get(unit.strip().lower(), unit.strip())


def _described(unit: str) -> str:
    return "of unknown unit" if unit == UNKNOWN else f"in {unit}"


_GYRO = re.compile(
    r"gyr|angular_?(vel|rate)|ang_?vel|omega|(rotation|turn|yaw|pitch|roll)_?rate"
    r"|(^|_)(w|g|rate)(_rs_s)?_?[xyz]$|^rate$"
)
_NOT_GYRO = re.compile(r"temp|bias|acc|cov|sigma|std|status|valid|flag|mag|at_rest")
_ACCELEROMETER = re.compile(r"acc|(^|_)specific_force|(^|_)a(_m_s_s)?_?[xyz]$")
_NOT_ACCELEROMETER = re.compile(r"temp|bias|gyr|ang|cov|sigma|std|status|valid|flag|mag")
_TIME = re.compile(
    r"^(t|(.*_)?(times?|time_?stamps?|stamps?))"
    r"(_(s|secs?|seconds?|ms|msecs?|millis|us|usecs?|micros|µs|ns|nsecs?|nanos))?$"
)


def plain(name: str) -> str:
    """Return the name in lower case with single underscores: ``GyroX [dps]`` -> ``gyro_x_dps``."""
    split = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name)
    return re.sub(r"[^a-z0-9µ°]+", "_", split.lower()).strip("_")


def looks_like_gyro(name: str) -> bool:
    """Whether a column of this name holds an angular rate."""
    stem = plain(split_unit(name)[0])
    return bool(_GYRO.search(stem)) and not _NOT_GYRO.search(stem)


def looks_like_accelerometer(name: str) -> bool:
    """Whether a column of this name holds an acceleration."""
    stem = plain(split_unit(name)[0])
    return bool(_ACCELEROMETER.search(stem)) and not _NOT_ACCELEROMETER.search(stem)


def looks_like_sensor(name: str) -> bool:
    """Whether a column of this name holds an angular rate or an acceleration."""
    return looks_like_gyro(name) or looks_like_accelerometer(name)


def looks_like_time(name: str) -> bool:
    """Whether a column of this name holds timestamps."""
    return bool(_TIME.match(plain(name)))
