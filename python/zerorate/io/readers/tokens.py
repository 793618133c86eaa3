"""Tokenizer of lines with names and numbers, for logs and live streams.

It reads JSON, InfluxDB's line protocol, output of ``ros2 topic echo``, and consoles of
microcontrollers (``gx: 0.1 gy=0.2``, ``GYR: x=0.1 y=0.2``, ``(0.1, 0.2) (0.3, 0.4)``).
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, TypeAlias

from zerorate.io.clocks.names import UNIT_SPELLINGS
from zerorate.record.names import KIND_OF_UNIT, canonical_spelling, is_unit, meaning_of
from zerorate.record.words import parse_name

Tokens: TypeAlias = dict[str, str]
"""Cells of a sample by name; cells without a name are ``column_0`` and so on."""

_NUMBER: Final = r"(?:[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:nan|NaN|inf)\b)"
_NAME: Final = r"[A-Za-z_][\w.\[\]/-]*"
_UNIT: Final = r"[A-Za-zµ°℃][\w/^²°]*"
_PIECE: Final = re.compile(
    rf"(?:({_NAME})[ \t]*[:=][ \t]*)?(?<![\w.])({_NUMBER})(?![\d.])"
    rf"(?:[ \t]*({_UNIT})(?![\w/^²°]*[ \t]*[:=]))?|({_NAME})"
)
_OPENED: Final = re.compile(rf"(?<=\w)\[(?=\s*{_NUMBER}\s*[,;\s])")
_MARKS: Final = re.compile(r"['\"{}]|(?<!\w)[\[(](?=[-+\s.]*\d)")
_PAIR: Final = re.compile(rf"({_NAME})[ \t]*[:=][ \t]*({_NUMBER})")
_VECTOR: Final = re.compile(
    rf"({_NAME})[ \t]*[:=][ \t(\[]*{_NUMBER}(?:[,;\s]+{_NUMBER}){{2}}(?![,;\s]*[-+.\d])"
)
_STAMP: Final = re.compile(
    r"\W{0,3}(?:(\d{4}[-/]\d\d[-/]\d\d)[T ]|\d\d-\d\d |[A-Z][a-z]{2} +\d+ )?"
    r"(\d{1,2}:\d\d:\d\d(?:[.,]\d+)?)Z?\W"
)
"""Prefix of a console's line: a date, with or without year, and a time of day."""
SERIAL_STAMP: Final = re.compile(r"(?m)^\[?(\d{1,2}:\d\d:\d\d[.,]?\d*)(?: -> |\]:? *)")
"""Prefix of a serial monitor's line."""
_ESP: Final = re.compile(r"(?:\x1b\[[\d;]*m)?[EWIDV] \((\d+)\) [^:]*: ?")
_ZEPHYR: Final = re.compile(r"\[(\d+):(\d\d):(\d\d)[.,](\d{3})(?:,(\d{3}))?\] <\w+> [\w.]+: ?")
_WORD: Final = r"(?:[^\s,=\\]|\\.)+"
_FIELD: Final = r"[^\s,=]+=[^\s,=]+"
_INFLUX: Final = re.compile(
    rf"{_WORD}(?:,{_WORD}={_WORD})* ({_FIELD}(?:,{_FIELD})*)(?: (-?\d{{9,}}))?"
)
_LONGEST: Final = 1 << 11
"""Largest length of a console's line, characters."""
_BRACKETS: Final = re.compile(r"[()\[\]{},;]+")
_YAML: Final = re.compile(r"([ ]*)(?:- )?([A-Za-z_]\w*):[ ]*(.*)")
_DECLARED: Final = {"angular_velocity": "radps", "linear_acceleration": "mps2"}
"""Units in messages of ROS."""
_AXES: Final = "xyz"
JSON, INFLUX, ECHO, PAIRS, TUPLES = "JSON", "InfluxDB", "ROS echo", "names and numbers", "tuples"


class Tokenizer:
    """Reader of lines of one kind that returns the cells of each sample by name.

    Parameters
    ----------
    kind
        ``JSON``, ``INFLUX``, ``ECHO``, ``PAIRS`` or ``TUPLES``.
    """

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self._path: list[tuple[int, str]] = []
        self._open: Tokens = {}

    def take(self, line: str) -> Tokens | None:
        """Return the cells of the sample that this line completes; None if it completes none."""
        match self.kind:
            case "JSON":
                return _of_json(line)
            case "InfluxDB":
                return _of_influx(line)
            case "ROS echo":
                return self._of_echo(line)
            case "tuples":
                numbers = _BRACKETS.sub(" ", line).split()
                return {f"column_{i}": cell for i, cell in enumerate(numbers)} or None
        return _of_console(line)

    def _of_echo(self, line: str) -> Tokens | None:
        if line.startswith("---"):
            sample, self._open, self._path = self._open, {}, []
            return sample or None
        found = _YAML.fullmatch(line.rstrip())
        if found is None:
            return None
        indent, name, value = len(found[1]), found[2], found[3].strip("'\" ")
        self._path = [one for one in self._path if one[0] < indent] + [(indent, name)]
        steps = [step for _, step in self._path]
        path = "_".join(steps[1:] if steps[0] == "vector" and len(steps) > 1 else steps)
        unit = _DECLARED.get(self._path[0][1]) if len(self._path) == 2 else None
        if re.fullmatch(_NUMBER, value):
            self._open[f"{path}_{unit}" if unit else path] = value
        return None


def tokenizer_of(lines: Sequence[str]) -> Tokenizer | None:
    """Return the tokenizer for the first lines of a text; None for a table."""
    body = [line for line in lines if line.strip()]
    for kind in (JSON, INFLUX, ECHO, TUPLES, PAIRS):
        fits = sum(_is_of(kind, line) for line in body)
        if kind == ECHO and not any(re.match(r"---|header:\s*$", line) for line in body):
            continue  # a preamble also has names and values
        if body and fits >= (0.5 if kind in (PAIRS, ECHO) else 0.9) * len(body):
            return Tokenizer(kind)
    return None


def _is_of(kind: str, line: str) -> bool:
    if kind == JSON:
        return line.lstrip().startswith("{") and _of_json(line) is not None
    if kind == INFLUX:
        return len(line) <= _LONGEST and _INFLUX.fullmatch(line.strip()) is not None
    if kind == ECHO:
        found = _YAML.fullmatch(line.rstrip())
        return line.startswith("---") or (found is not None and ":" not in found[3])
    if kind == TUPLES:
        cells = _BRACKETS.sub(" ", line).split()
        return line.lstrip().startswith(("(", "[")) and all(map(_is_number, cells)) and any(cells)
    if len(line) > _LONGEST:
        return False
    if _ESP.match(line) or _ZEPHYR.match(line):
        return True
    line = _without_marks(line)
    vectors = (parse_name(f"{name} x").kind for name in _VECTOR.findall(line))
    return len(_PAIR.findall(line)) > 1 or any(vectors)


def _is_number(cell: str) -> bool:
    return re.fullmatch(_NUMBER, cell) is not None


def _of_json(line: str) -> Tokens | None:
    text = line.strip().rstrip(",")
    try:
        # Python prints a dict with other quotes.
        found = json.loads(text.replace("'", '"') if text.startswith("{'") else text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(found, dict):
        return None
    cells = dict(_flat(found, ""))
    label = next((v for k, v in cells.items() if k and parse_name(f"{v} x").kind), None)
    return cells if label is None else _of_sensor(label, cells)


def _of_sensor(label: str, cells: Tokens) -> Tokens:
    """Return the cells of one of several sensors' rows, with axes named after its word."""
    bare = {k: parse_name(k) for k in cells}
    return {
        (f"{label}_{_AXES[own.axis]}" if own.kind == "" and own.axis is not None else k): cells[k]
        for k, own in bare.items()
        if cells[k] != label
    }


def _flat(value: Any, name: str) -> Iterator[tuple[str, str]]:  # noqa: ANN401  # what JSON holds
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _flat(inner, f"{name}_{key}" if name else str(key))
    elif isinstance(value, list):
        axes = _AXES if len(value) == len(_AXES) else map(str, range(len(value)))
        for axis, inner in zip(axes, value, strict=True):
            yield from _flat(inner, f"{name}_{axis}")
    else:
        yield name, "nan" if value is None else str(value)


def _of_influx(line: str) -> Tokens | None:
    found = _INFLUX.fullmatch(line.strip())
    if found is None:
        return None
    pairs = (field.split("=", 1) for field in found[1].split(","))
    cells = {name: value.removesuffix("i").removesuffix("u") for name, value in pairs}
    measurement = re.split(r"[, ]", line.strip(), maxsplit=1)[0]
    cells = {**({"timestamp": found[2]} if found[2] else {}), **cells}
    return _of_sensor(measurement, cells) if parse_name(f"{measurement} x").kind else cells


class _Group:
    """Numbers after a name or a sensor's word, and their unit."""

    def __init__(self, name: str, sensor: str) -> None:
        self.name, self.sensor = name, sensor
        self.values: list[str] = []
        self.unit = ""

    @property
    def is_axis(self) -> bool:
        """True if the name is only an axis."""
        return parse_name(self.name).kind == ""

    def cells(self, count: int) -> Iterator[tuple[str, str]]:
        """Yield names and numbers; ``count`` is the number of cells before them."""
        unit = f" [{self.unit}]" if self.unit else ""
        word = self.name or self.sensor
        if len(self.values) == len(_AXES) and parse_name(f"{word} x").kind:
            yield from ((f"{word}_{a}{unit}", v) for a, v in zip(_AXES, self.values, strict=True))
            return
        name = f"{self.sensor}_{self.name}" if self.sensor and self.is_axis else self.name
        for i, value in enumerate(self.values):
            yield (f"{name}{unit}" if name and i == 0 else f"column_{count + i}"), value


def _of_console(line: str) -> Tokens | None:
    """Return the numbers of a line by name, each with the sensor's word before it."""
    if len(line) > _LONGEST:
        return None
    cells, line = _stamp_of(line)
    stamped = bool(cells)
    groups: list[_Group] = []
    sensor = ""
    for name, value, unit, word in _PIECE.findall(_without_marks(line)):
        if value and (name or not groups or not (groups[-1].name or groups[-1].sensor)):
            groups.append(_Group(name, sensor))
        if value:
            groups[-1].values.append(value)
        if unit and _is_unit(unit):
            groups[-1].unit = unit
            groups[-1].name = groups[-1].name or ("time" if unit in UNIT_SPELLINGS else "")
            _tell_sensor(groups, unit)
        elif word or unit:
            sensor = (word or unit) if parse_name(f"{word or unit} x").kind else ""
            groups.append(_Group("", sensor))
    named = 0
    for group in groups:
        if stamped and not named and not group.name:
            continue  # the number of a process
        for key, value in group.cells(len(cells)):
            named += not key.startswith("column_")
            if key in cells:
                return None
            cells[key] = value
    return cells if named > 1 or (named and any(map(meaning_of, cells))) else None


def _without_marks(line: str) -> str:
    """Return a line without quotes and without brackets around numbers."""
    return _MARKS.sub(" ", _OPENED.sub(": ", line))


def _is_unit(text: str) -> bool:
    return is_unit(text) or text in UNIT_SPELLINGS


def _tell_sensor(groups: Sequence[_Group], unit: str) -> None:
    """Name axes without a sensor's word by their unit: ``X: 0, Y: 0, Z: 1 rad/s``."""
    kind = KIND_OF_UNIT.get(canonical_spelling(unit), "")
    for group in reversed(groups):
        if not group.name or not group.is_axis or group.sensor:
            return
        group.sensor = kind


def _stamp_of(line: str) -> tuple[Tokens, str]:
    """Return the time before a console's line, if any, and the rest of the line."""
    if (esp := _ESP.match(line)) is not None:
        return {"time_ms": esp[1]}, line[esp.end() :]
    if (zephyr := _ZEPHYR.match(line)) is not None:
        hours, minutes, seconds, milli, micro = (int(part or 0) for part in zephyr.groups())
        whole = (hours * 60 + minutes) * 60 + seconds
        microseconds = str(whole * 1_000_000 + milli * 1000 + micro)
        return {"time_us": microseconds}, line[zephyr.end() :]
    if (stamp := _STAMP.match(line)) is not None:
        date = f"{stamp[1].replace('/', '-')}T" if stamp[1] else ""
        return {"time": date + stamp[2].replace(",", ".")}, line[stamp.end() :]
    return {}, line
