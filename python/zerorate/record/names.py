"""Columns' names: their sensors and units."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple

from zerorate.faults import keyword_argument, make_sentence
from zerorate.record.log import LogError
from zerorate.record.words import ParsedName, parse_name

UNKNOWN_UNIT = "unit"

_UNIT_SPELLINGS = {
    "rad/s": ("rad/s", "radps", "rad_s", "rads", "rad/sec", "rad s^-1", "rad*s^-1"),
    "deg/s": ("deg/s", "dps", "degps", "deg_s", "degs", "deg/sec", "°/s", "deg s^-1"),
    "deg/h": ("deg/h", "degph", "dph", "deg_h", "deg/hr", "°/h", "deg h^-1"),
    "g": ("g",),
    "m/s^2": ("m/s^2", "mps2", "m/s2", "m/s²", "m s^-2", "m*s^-2", "m/(s^2)", "m/s/s", "m/sec^2"),
}
_NAME_UNIT_SPELLINGS = {"deg": ("deg", "°"), "rad": ("rad",), "uT": ("ut", "µt")}
UNIT_SUFFIXES = {
    "rad/s": "radps",
    "deg/s": "dps",
    "deg/h": "degph",
    "g": "g",
    "m/s^2": "mps2",
    "deg": "deg",
    "rad": "rad",
    "uT": "ut",
}

_FOREIGN_UNITS: Final = {
    "mdps": ("deg/s", 1e-3, "mdps mdeg/s mdegps millideg/s"),
    "mrad/s": ("rad/s", 1e-3, "mrad/s mradps mrads mrad_s millirad/s"),
    "urad/s": ("rad/s", 1e-6, "urad/s uradps µrad/s"),
    "rpm": ("deg/s", 6.0, "rpm rev/min u/min"),
    "rev/s": ("deg/s", 360.0, "rev/s rps"),
    "deg/min": ("deg/s", 1 / 60, "deg/min degpm degpmin °/min"),
    "rad/min": ("rad/s", 1 / 60, "rad/min"),
    "rad/h": ("rad/s", 1 / 3600, "rad/h rad/hr"),
    "mg": ("g", 1e-3, "mg milli-g millig"),
    "ug": ("g", 1e-6, "ug µg"),
    "cm/s^2": ("m/s^2", 1e-2, "cm/s^2 cm/s2 cm/s² gal"),
    "mm/s^2": ("m/s^2", 1e-3, "mm/s^2 mm/s2 mm/s²"),
    "ft/s^2": ("m/s^2", 0.3048, "ft/s^2 ft/s2 ft/s²"),
}
"""Units that are converted on reading: target unit, factor, and spellings."""


class ForeignUnit(NamedTuple):
    """A unit that is converted on reading, and its factor into the target unit."""

    name: str
    unit: str
    factor: float


_FOREIGN_BY_SPELLING: Final = {
    spelling: ForeignUnit(name, unit, factor)
    for name, (unit, factor, spellings) in _FOREIGN_UNITS.items()
    for spelling in spellings.split()
}
_UNIT_BY_SPELLING = {spelling: unit for unit, all_ in _UNIT_SPELLINGS.items() for spelling in all_}
_NAME_UNIT_BY_SPELLING = _UNIT_BY_SPELLING | {
    s: unit for unit, all_ in _NAME_UNIT_SPELLINGS.items() for s in all_
}
_SPELLINGS_LONGEST_FIRST = sorted(_NAME_UNIT_BY_SPELLING, key=len, reverse=True)
_BRACKETED_UNIT = re.compile(r"^(.*?)[\s_]*[\[(]\s*([^\[\]()]+?)\s*[\])]$")


_PX4_UNITS: Final = {
    "rad": "rad/s",
    "rad_s": "rad/s",
    "radps": "rad/s",
    "deg_s": "deg/s",
    "dps": "deg/s",
    "m_s2": "m/s^2",
    "mps2": "m/s^2",
}
"""Units between a sensor's name and its axis, as in PX4: ``gyro_rad[0]`` is in rad/s."""
_PX4_UNIT_IN_NAME: Final = re.compile(
    rf"^(.*(?:gyro|accel|accelerometer))_({'|'.join(_PX4_UNITS)})(\[\d\]|_[xyz])$", re.IGNORECASE
)


def canonical_unit(text: object) -> str:
    """Return the standard spelling of a unit; ValueError for an unknown one."""
    unit = _UNIT_BY_SPELLING.get(text.strip().lower()) if isinstance(text, str) else None
    if unit is None:
        raise ValueError(f"unknown unit {text!r}; known: {', '.join(_UNIT_SPELLINGS)}")
    return unit


def is_unit(text: str) -> bool:
    """Return True if a text is a known unit, of a sensor or of another quantity."""
    return text.strip().lower() in _ALL_UNIT_SPELLINGS


@lru_cache(maxsize=4096)
def split_unit(name: str) -> tuple[str, str | None]:
    """Split a column's name into the name without unit, and the unit; None without a unit.

    The unit is at the end, after an underscore or blank or in brackets: ``gyro_x_dps``, ``wx [rad
    s^-1]``.
    """
    bracket = _BRACKETED_UNIT.match(name.strip())
    if bracket and bracket[2].lower() in _NAME_UNIT_BY_SPELLING:
        return bracket[1], _NAME_UNIT_BY_SPELLING[bracket[2].lower()]
    lower = name.lower()
    for spelling in _SPELLINGS_LONGEST_FIRST:
        if lower.endswith(("_" + spelling, " " + spelling)):
            return name[: -len(spelling) - 1], _NAME_UNIT_BY_SPELLING[spelling]
    px4_match = _PX4_UNIT_IN_NAME.match(name)
    if px4_match:
        return px4_match[1] + px4_match[3], _PX4_UNITS[px4_match[2].lower()]
    return _split_foreign_unit(name)[0], None


def _split_foreign_unit(name: str) -> tuple[str, ForeignUnit | None]:
    bracket = _BRACKETED_UNIT.match(name.strip())
    if bracket and bracket[2].lower() in _FOREIGN_BY_SPELLING:
        return bracket[1], _FOREIGN_BY_SPELLING[bracket[2].lower()]
    stem, mark, last = name.rpartition("_" if "_" in name else " ")
    foreign = _FOREIGN_BY_SPELLING.get(last.lower()) if mark and stem else None
    return (name, None) if foreign is None else (stem, foreign)


def foreign_unit(names: Sequence[str]) -> ForeignUnit | None:
    """Return the unit in columns' names if reading converts it; else None."""
    return next(
        (foreign for _, foreign in map(_split_foreign_unit, names) if foreign is not None), None
    )


def check_foreign(names: Sequence[str], unit: str | None, factor: float | None) -> None:
    """Raise LogError if the stated unit contradicts the columns' unit and no factor is given."""
    foreign = foreign_unit(names)
    if foreign is not None and unit is not None and factor is None:
        raise LogError(
            make_sentence(
                f"unit '{unit}' was given, but the columns {', '.join(names)} are in "
                f"{foreign.name}",
                "; ",
                keyword_argument("scale", f"{foreign.factor:.9g}"),
                f" makes {foreign.unit} of them",
            )
        )


def add_unit_suffix(name: str, unit: str) -> str:
    """Return the name with the unit's suffix; unchanged with a suffix, or if the unit has none."""
    if unit not in UNIT_SUFFIXES or split_unit(name)[1] is not None:
        return name
    return f"{name}_{UNIT_SUFFIXES[unit]}"


def common_unit(names: list[str], stated: str | None, file_unit: str | None) -> str:
    """Return the common unit of columns: from their suffix, else as stated, else from the file.

    Raises
    ------
    LogError
        If the columns differ in unit, or the given unit contradicts a suffix.
    """
    suffixes = {name: split_unit(name)[1] for name in names}
    for name, unit in suffixes.items():
        if stated is not None and unit is not None and unit != stated:
            raise LogError(f"unit '{stated}' was given, but column '{name}' is in {unit}")
    # A unit in one column's name counts for all axes.
    written = {unit for unit in suffixes.values() if unit is not None}
    kinds = {_kind_of_imu(*split_unit(name)) for name in names}
    once = written.pop() if len(written) == len(kinds) == 1 and not (stated or file_unit) else ""
    fallback = stated or canonical_spelling(file_unit or "") or once or UNKNOWN_UNIT
    units = {name: unit or fallback for name, unit in suffixes.items()}
    if len(set(units.values())) > 1:
        listed = ", ".join(f"'{n}' {_describe_unit(u)}" for n, u in units.items())
        raise LogError(f"the columns differ in unit ({listed}); choose columns of one unit")
    return next(iter(units.values()))


def canonical_spelling(unit: str) -> str:
    """Return the standard spelling of a known unit, or an unknown unit unchanged."""
    return _UNIT_BY_SPELLING.get(unit.strip().lower(), unit.strip())


def _describe_unit(unit: str) -> str:
    return "of unknown unit" if unit == UNKNOWN_UNIT else f"in {unit}"


@lru_cache(maxsize=4096)
def to_snake_case(name: str) -> str:
    """Return the name in lower case with single underscores: ``GyroX [dps]`` -> ``gyro_x_dps``."""
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name)
    return re.sub(r"[^a-z0-9µ°]+", "_", words.lower()).strip("_")


_OTHER_UNIT_SPELLINGS: Final = ("deg c", "°c", "℃", "c", "degc", "nt", "mt", "gauss", "m", "hz")
_ALL_UNIT_SPELLINGS: Final = {
    *_NAME_UNIT_BY_SPELLING,
    *_FOREIGN_BY_SPELLING,
    *_OTHER_UNIT_SPELLINGS,
}


def looks_like_gyro(name: str) -> bool:
    """Return True if a column of this name holds an angular rate."""
    return _kind_of_imu(*split_unit(name)) == "gyro"


def looks_like_accelerometer(name: str) -> bool:
    """Return True if a column of this name holds an acceleration."""
    return _kind_of_imu(*split_unit(name)) == "accel"


def looks_like_sensor(name: str) -> bool:
    """Return True if a column of this name holds an angular rate or an acceleration."""
    return looks_like_gyro(name) or looks_like_accelerometer(name)


def _kind_of_imu(stem: str, unit: str | None) -> str | None:
    """Return the kind of an inertial sensor by the name, else by the unit."""
    kind = parse_name(stem).kind
    return KIND_OF_UNIT.get(unit or "") if kind == "" else kind


_QUATERNION = re.compile(r"quat(ernion)?_?[wxyz]$")


def is_quaternion(name: str) -> bool:
    """Return True if a column of this name holds a component of a quaternion."""
    return _QUATERNION.search(to_snake_case(name)) is not None


class Meaning(NamedTuple):
    """Meaning of a column's name: the kind of its sensor, the sensor, and the unit.

    Columns of one kind and one ``sensor`` are its axes. For gyros, accelerometers and
    magnetometers, ``words`` has the axis, the stage and the device.
    """

    kind: str
    sensor: str
    unit: str | None
    words: ParsedName | None = None


class _SensorKind(NamedTuple):
    """A kind of sensor: names that match, names that do not, units, and axes."""

    names: re.Pattern[str]
    excluded: re.Pattern[str]
    units: dict[str, str]
    axes: re.Pattern[str] | None


_NO_SAMPLE_WORDS = r"bias|cov|sigma|std|status|valid|flag"
_AXIS_LETTER = re.compile(r"(^|_|(?<=[a-z]))[xyz](?=(_?\d+)?$)|roll|pitch|yaw")
_AXIS_LAST = re.compile(r"(.*)_([^_]+)(_[xyz])$")
_TRAILING_NUMBER = re.compile(r"_?\d+$")
_QUATERNION_LETTER = re.compile(r"(^|_|(?<=quat)|(?<=quaternion))[wxyz0-3]$")
_POSITION_WORDS = r"lat|latitude|lon|lng|long|longitude|alt|altitude|height"
_DIRECTION_WORDS = r"north|east|down|up"
_POSITION_AXIS = re.compile(
    rf"(^|_|(?<=v))({_POSITION_WORDS}|{_DIRECTION_WORDS}|[xyzned])(_(msl|ellipsoid))?$"
)
_GAUSS_UNITS = {"gauss": "gauss", "ga": "gauss", "g": "gauss"}
_MAG_UNITS = {"ut": "uT", "µt": "uT", "nt": "nT", "mt": "mT", **_GAUSS_UNITS}
KIND_OF_UNIT: Final = {
    "rad/s": "gyro",
    "deg/s": "gyro",
    "deg/h": "gyro",
    "g": "accel",
    "m/s^2": "accel",
    "uT": "mag",
}
_LENGTH_UNITS = {"m": "m", "km": "km", "cm": "cm", "mm": "mm", "deg": "deg", "rad": "rad"}

_NO_PRESSURE_WORDS = (
    r"diff|airspeed|dynamic|pitot|tire|tyre|oil|brake|fuel|coolant|manifold|boost|temp"
)
_PRESSURE_UNITS = {"pa": "Pa", "hpa": "hPa", "kpa": "kPa", "mbar": "hPa", "mb": "hPa", "bar": "bar"}
_ANGLE_UNITS = {"deg": "deg", "°": "deg", "degrees": "deg", "rad": "rad", "radians": "rad"}

_SENSOR_KINDS: Final = {
    "pressure": _SensorKind(
        re.compile(r"(^|_)(baro|press|pressure)$"),
        re.compile(f"{_NO_SAMPLE_WORDS}|{_NO_PRESSURE_WORDS}"),
        _PRESSURE_UNITS,
        None,
    ),
    "height": _SensorKind(
        re.compile(r"(^|_)baro(meter|metric)?_?(alt|altitude|height)$"),
        re.compile(_NO_SAMPLE_WORDS + r"|vel|target|setpoint"),
        {"m": "m", "meter": "m", "meters": "m", "ft": "ft", "feet": "ft"},
        None,
    ),
    "baseline": _SensorKind(
        re.compile(rf"(^|_)(baseline|rel_?pos)_?({_DIRECTION_WORDS}|[ned])$"),
        re.compile(_NO_SAMPLE_WORDS + r"|acc|vel"),
        {"m": "m", "cm": "cm", "mm": "mm"},
        _POSITION_AXIS,
    ),
    "temperature": _SensorKind(
        re.compile(r"(^|_)temp(erature)?s?\d*(_|$)"),
        re.compile(_NO_SAMPLE_WORDS + r"|target|setpoint|coef"),
        {
            "degc": "degC",
            "°c": "degC",
            "℃": "degC",
            "c": "degC",
            "celsius": "degC",
            "k": "K",
            "degf": "degF",
        },
        None,
    ),
    "velocity": _SensorKind(
        re.compile(
            rf"(^|_)vel(ocity)?_({_DIRECTION_WORDS}|[xyzned])$|(^|_)v_?({_DIRECTION_WORDS}|[ned])$|^velocity$"
        ),
        re.compile(_NO_SAMPLE_WORDS + r"|ang|wheel|delta"),
        {"mps": "m/s", "m_s": "m/s", "m/s": "m/s", "kmph": "km/h", "km/h": "km/h"},
        _POSITION_AXIS,
    ),
    "position": _SensorKind(
        re.compile(
            rf"(^|_)({_POSITION_WORDS})(_(msl|ellipsoid))?$|(^|_)pos(ition)?_?({_DIRECTION_WORDS}|[xyzned])$|^({_DIRECTION_WORDS})$"
        ),
        re.compile(_NO_SAMPLE_WORDS + r"|vel|acc|gyr|baro|target|setpoint"),
        _LENGTH_UNITS,
        _POSITION_AXIS,
    ),
    "gravity": _SensorKind(
        re.compile(r"(^|_)grav(ity)?_?[xyz]$"),
        re.compile(
            _NO_SAMPLE_WORDS + r"|acc|lin|user|free|comp|excl|minus|(^|_)(no|non|wo|without)_"
        ),
        {},
        _AXIS_LETTER,
    ),
    "reference": _SensorKind(
        re.compile(
            r"quat(ernion)?_?[wxyz0-3]$|(^|_)(encoder|ref|reference|truth|ground_?truth|true)(_|$)"
        ),
        re.compile(_NO_SAMPLE_WORDS + r"|time|stamp"),
        {},
        _QUATERNION_LETTER,
    ),
}
_HEADING = re.compile(r"^(compass|((compass|mag|magnetic|antenna|dual|gnss|gps)_)?(heading|hdg))$")
"""Names of a heading; they count only if the column has a unit of angles."""
_SIGMA_PREFIX = re.compile(r"^(?:(position|velocity)_)?(?:sigma|std)_")


@lru_cache(maxsize=4096)
def meaning_of(name: str) -> Meaning | None:
    """Return the meaning of a column's name; None for an unknown sensor.

    The kinds are ``gyro``, ``accel``, ``mag``, ``temperature``, ``velocity``, ``position``,
    ``gravity``, ``reference``, ``pressure``, ``height``, ``heading`` and ``baseline``. Standard
    deviations have the kinds ``velocity_sigma`` and ``position_sigma``.
    """
    stem, unit = _split_unit_of_kind(name, _ANGLE_UNITS)
    if unit in ("deg", "rad") and _HEADING.match(to_snake_case(stem)):
        return Meaning("heading", to_snake_case(stem), unit)
    stem, unit = split_unit(name)
    kind = _kind_of_imu(stem, unit)
    if kind == "mag":
        stem, unit = _split_unit_of_kind(name, _MAG_UNITS)
    if kind:
        return Meaning(kind, _strip_axis(to_snake_case(stem), _AXIS_LETTER), unit, parse_name(stem))
    match = _SIGMA_PREFIX.match(to_snake_case(name))
    if match is not None:
        prefix = f"{match[1]}_" if match[1] else ""
        base = meaning_of(prefix + name[match.end() :])
        known = base is not None and base.kind in ("velocity", "position")
        return base._replace(kind=f"{base.kind}_sigma") if known and base is not None else None
    for kind, row in _SENSOR_KINDS.items():
        stem, unit = _split_unit_of_kind(name, row.units)
        if row.names.search(to_snake_case(stem)) and not row.excluded.search(to_snake_case(stem)):
            if kind == "height" and unit is None:
                return None
            return Meaning(kind, _strip_axis(to_snake_case(stem), row.axes), unit)
    return None


def _split_unit_of_kind(name: str, units: dict[str, str]) -> tuple[str, str | None]:
    """Return name and unit like `split_unit`, with additional units of one kind of sensor."""
    bracket = _BRACKETED_UNIT.match(name.strip())
    if bracket and bracket[2].lower() in units:
        return bracket[1], units[bracket[2].lower()]
    lower = name.lower()
    for spelling in sorted(units, key=len, reverse=True):
        if lower.endswith(("_" + spelling, " " + spelling)):
            return name[: -len(spelling) - 1], units[spelling]
    stem, unit = split_unit(name)
    axis = _AXIS_LAST.match(name)
    if unit is None and axis is not None and axis[2].lower() in units:
        return axis[1] + axis[3], units[axis[2].lower()]
    return stem, unit


def _strip_axis(stem: str, axes: re.Pattern[str] | None) -> str:
    """Return a name without its axis letter; if it has none, without its number."""
    if axes is None:
        return stem
    bare = axes.sub("", stem)
    return bare if bare != stem else _TRAILING_NUMBER.sub("", stem)
