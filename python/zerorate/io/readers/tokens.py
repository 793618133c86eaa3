"""Lines of names and numbers that are no table: one tokenizer for logs and live streams.

Lines of JSON, InfluxDB's line protocol, what ROS echoes, and the consoles of microcontrollers
(``gx: 0.1 gy=0.2``, ``GYR: x=0.1 y=0.2``, ``(0.1, 0.2) (0.3, 0.4)``).
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, TypeAlias

from zerorate.record.words import parse_name

Tokens: TypeAlias = dict[str, str]
"""Cells of a sample by their names, ``column_0`` and so on where there is none."""

_NUMBER: Final = r"(?:[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:nan|NaN|inf)\b)"
_NAME: Final = r"[A-Za-z_][\w.\[\]/-]*"
_PIECE: Final = re.compile(
    rf"(?:({_NAME})[ \t]*[:=][ \t]*)?(?<![\w.])({_NUMBER})(?![\d.])|({_NAME})"
)
_PAIR: Final = re.compile(rf"({_NAME})[ \t]*[:=][ \t]*({_NUMBER})")
_ESP: Final = re.compile(r"(?:\x1b\[[\d;]*m)?[EWIDV] \((\d+)\) [^:]*: ?")
_ZEPHYR: Final = re.compile(r"\[(\d+):(\d\d):(\d\d)[.,](\d{3})(?:,(\d{3}))?\] <\w+> [\w.]+: ?")
_WORD: Final = r"(?:[^\s,=\\]|\\.)+"
_FIELD: Final = r"[^\s,=]+=[^\s,=]+"
_INFLUX: Final = re.compile(
    rf"{_WORD}(?:,{_WORD}={_WORD})* ({_FIELD}(?:,{_FIELD})*)(?: (-?\d{{9,}}))?"
)
_LONGEST: Final = 1 << 11
"""Characters of a line of a console."""
_BRACKETS: Final = re.compile(r"[()\[\]{},;]+")
_YAML: Final = re.compile(r"([ ]*)(?:- )?([A-Za-z_]\w*):[ ]*(.*)")
_DECLARED: Final = {"angular_velocity": "radps", "linear_acceleration": "mps2"}
"""Units of messages of ROS."""
_AXES: Final = "xyz"
JSON, INFLUX, ECHO, PAIRS, TUPLES = "JSON", "InfluxDB", "ROS echo", "names and numbers", "tuples"


class Tokenizer:
    """Takes lines of one kind, and gives the cells of each sample by their names.

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
        """Return the cells of the sample that a line ends, None where it ends none."""
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
        path = "_".join(step for _, step in self._path)
        unit = _DECLARED.get(self._path[0][1]) if len(self._path) == 2 else None
        if re.fullmatch(_NUMBER, value):
            self._open[f"{path}_{unit}" if unit else path] = value
        return None


def tokenizer_of(lines: Sequence[str]) -> Tokenizer | None:
    """Return the tokenizer for the first lines of a text, None for those of a table."""
    body = [line for line in lines if line.strip()]
    for kind in (JSON, INFLUX, ECHO, TUPLES, PAIRS):
        fits = sum(_is_of(kind, line) for line in body)
        if kind == ECHO and not any(re.match(r"---|header:\s*$", line) for line in body):
            continue  # a preamble has names and values as well
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
    return len(_PAIR.findall(line)) > 1 or bool(_ESP.match(line) or _ZEPHYR.match(line))


def _is_number(cell: str) -> bool:
    return re.fullmatch(_NUMBER, cell) is not None


def _of_json(line: str) -> Tokens | None:
    try:
        found = json.loads(line.strip().rstrip(","))
    except (ValueError, RecursionError):
        return None
    if not isinstance(found, dict):
        return None
    cells = dict(_flat(found, ""))
    label = next((v for k, v in cells.items() if k and parse_name(f"{v} x").kind), None)
    if label is None:
        return cells
    # A row of one sensor of several, whose word names its axes.
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
    return {**({"timestamp_ns": found[2]} if found[2] else {}), **cells}


def _of_console(line: str) -> Tokens | None:
    """Return the numbers of a line by their names, each after the word of a sensor before it."""
    cells: Tokens = {}
    if len(line) > _LONGEST:
        return None
    if (esp := _ESP.match(line)) is not None:
        cells["time_ms"], line = esp[1], line[esp.end() :]
    elif (zephyr := _ZEPHYR.match(line)) is not None:
        hours, minutes, seconds, milli, micro = (int(part or 0) for part in zephyr.groups())
        whole = (hours * 60 + minutes) * 60 + seconds
        cells["time_us"] = str(whole * 1_000_000 + milli * 1000 + micro)
        line = line[zephyr.end() :]
    sensor = ""
    named = 0
    for name, value, word in _PIECE.findall(line):
        if word:
            sensor = word if parse_name(f"{word} x").kind else ""
            continue
        if name:
            named += 1
            key = f"{sensor}_{name}" if sensor and parse_name(name).kind == "" else name
        else:
            key = f"column_{len(cells)}"
        if key in cells:
            return None
        cells[key] = value
    return cells if named > 1 else None
