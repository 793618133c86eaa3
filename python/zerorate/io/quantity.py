"""Units: their spellings, and where a column's name ends in one."""

from __future__ import annotations

import re

from zerorate.io.errors import LogError

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
