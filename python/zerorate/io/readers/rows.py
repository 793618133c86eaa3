"""Text tables with rows of several sensors, marked by message names, labels or numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest
from typing import Final

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.evidence import named_by_values
from zerorate.io.parts import split_table
from zerorate.io.readers.cells import is_comment, split_cells
from zerorate.io.readers.layouts import delimiter_of, find_layout, first_lines
from zerorate.io.readers.parsers import (
    Layout,
    decode_text,
    is_value,
    parse_columns,
    read_texts,
    without_torn,
)
from zerorate.io.table import Content, Metadata, Table
from zerorate.io.timecolumns import load_column, rises
from zerorate.record.log import LogError
from zerorate.record.names import meaning_of
from zerorate.record.words import parse_name, words_of

_KINDS: Final = ("gyro", "accel", "mag")
_LABEL: Final = re.compile(rb"[A-Z][A-Z0-9]{1,3}")
_FORMAT_LABEL: Final = b"FMT"
_DATAFLASH_COLUMNS: Final = {
    "IMU": "TimeUS I GyrX GyrY GyrZ AccX AccY AccZ EG EA T GH AH GHz AHz",
    "GYR": "TimeUS I SampleUS GyrX GyrY GyrZ",
    "ACC": "TimeUS I SampleUS AccX AccY AccZ",
    "MAG": "TimeUS I MagX MagY MagZ",
}
"""Columns of DataFlash messages, for a part of a log without the declarations."""
_MAG_FIRST: Final = (
    "mag_x mag_y mag_z accel_x_mps2 accel_y_mps2 accel_z_mps2 gyro_x_radps gyro_y_radps"
    " gyro_z_radps"
)
_IMU_WORDS: Final = {"imu", "pimu", "sensor", "mpu"}
"""Words that mark rows of a whole IMU; the values show the sensors."""
_SENTENCES: Final = {
    "VNYMR": f"sensor yaw pitch roll {_MAG_FIRST}",
    "VNIMU": f"sensor {_MAG_FIRST} temperature_degc pressure_kpa",
}
"""Columns of VectorNav's sentences with sensors."""
_AXES: Final = 3
_FEW_ROWS: Final = 2
_LINES: Final = 60
"""Number of lines tested for the structure of a text."""
_SENSOR_WORDS: Final = {"sensor", "type", "message", "name", "label", "kind", "channel", "stream"}
_INSTANCE_WORDS: Final = {
    "i",
    "id",
    "imu",
    "index",
    "instance",
    "device",
    "node",
    "num",
    "number",
    "unit",
    "sensor",
}
"""Words in the name of a column that distinguishes sensors."""
_ANDROID_SENSORS: Final = {
    "1": ("accelerometer", "mps2"),
    "2": ("magnetometer", "ut"),
    "4": ("gyroscope", "radps"),
    "16": ("gyroscope_uncalibrated", "radps"),
    "35": ("accelerometer_uncalibrated", "mps2"),
}
"""Numbers of Android's sensors, as in ``Sensor.TYPE_ACCELEROMETER``, with units."""
_GRAVITY: Final = 9.80665
_NEAR_GRAVITY: Final = 0.3
"""Largest relative difference between a phone's median acceleration and gravity."""
_MAX_INSTANCES: Final = 16
_MIN_TURN_PART: Final = 0.2
"""Smallest share of rows that follow another sensor's row, if sensors alternate."""


def make_content(tables: Mapping[str, Table]) -> Content:
    """Return the content of tables by sensor; the default is the first gyro."""

    def topic(wanted: str | None) -> str:
        if wanted is not None:
            if wanted not in tables:
                raise LogError(
                    f"there is no topic '{wanted}'; it has: {', '.join(tables)}", "topic"
                )
            return wanted
        return next((name for name, table in tables.items() if _has_kind(table, "gyro")), first)

    first = next(iter(tables))
    return Content(tables, topic)


def _has_kind(table: Table, *wanted: str) -> bool:
    meanings = map(meaning_of, table.names or ())
    return any(meaning is not None and meaning.kind in wanted for meaning in meanings)


def split_messages(raw: bytes) -> Content | None:
    """Return the messages of a text with lines that begin with a message name, as in DataFlash.

    Lines that begin with FMT define the columns.
    """
    lines = first_lines(raw, 50)
    first = [split_cells(line.text, ",") for line in lines]
    named = [cells[0] for cells in first if len(cells) > 2 and _LABEL.fullmatch(cells[0].encode())]
    if len(named) < len(first) or not named or not all(map(is_value, (c[1] for c in first))):
        return None
    rows: dict[bytes, list[bytes]] = {}
    for line in raw.splitlines():
        label, _, rest = line.partition(b",")
        rows.setdefault(label.strip(), []).append(rest)
    columns = {**_DATAFLASH_COLUMNS, **_parse_formats(rows.get(_FORMAT_LABEL, []))}
    tables: dict[str, Table] = {}
    for label, message_rows in rows.items():
        name = label.decode("latin-1")
        if label == _FORMAT_LABEL or not name:
            continue
        table = _make_message_table(b"\n".join(message_rows), columns.get(name, "").split(), name)
        if table is not None:
            tables.update(
                _split_instances(table, name) if _has_kind(table, *_KINDS) else {name: table}
            )
    return make_content(tables) if any(_has_kind(t, *_KINDS) for t in tables.values()) else None


def labelled(raw: bytes) -> Content | None:
    """Return the rows of a text by the sensor word in a fixed column.

    A header names the columns. Without a header, the values show the clock and the three axes.
    """
    lines = first_lines(raw, _LINES)
    body = [line for line in lines if re.search(r"\d", line.text)]
    if not body:
        return None
    delimiter = delimiter_of(body[len(body) // 2].text)
    rows = [split_cells(line.text, delimiter) for line in body]
    width = min(map(len, rows))
    header = lines[0] is not body[0] and len(split_cells(lines[0].text, delimiter)) == width
    at = next((i for i in range(width) if _words_of_sensors([row[i] for row in rows])), None)
    if any(line.text.startswith("$COL,") for line in lines):
        at, delimiter, header = 0, ",", False
    if at is None or header:
        return None
    groups: dict[str, list[bytes]] = {}
    declared: list[list[str]] = []
    units: dict[str, list[str]] = {}
    mark = None if delimiter is None else delimiter.encode()
    for line in raw.splitlines():
        if is_comment(decode_text(line)):
            declared.append(split_cells(decode_text(line).strip("'\" "), delimiter))
            continue
        if re.match(rb"\$(?:COL|UNIT),", line):
            kind, word, *cells_told = split_cells(decode_text(line), ",")
            if kind == "$COL":
                declared.append([f"${word}", *cells_told])
            else:
                units[f"${word}"] = ["", *cells_told]
            continue
        cells = re.sub(rb"\*[0-9A-Fa-f]{2}\s*$", b"", line).split(mark)
        if len(cells) > at:
            groups.setdefault(decode_text(cells[at]).strip(), []).append((mark or b" ").join(cells))
    tables = {}
    for word, own in groups.items():
        stated = next((names for names in declared if names[at].endswith(word)), [])
        if (stated or _kind_of(word)) and len(own) > _FEW_ROWS:
            pairs = zip_longest(stated, units.get(word, ())[: len(stated)], fillvalue="")
            stated = [f"{name} ({unit})" if unit else name for name, unit in pairs]
            tables[word] = _of_word(b"\n".join(own), word.strip("$:<>[]"), at, stated)
    return make_content(tables) if tables else None


def _words_of_sensors(cells: list[str]) -> bool:
    """Return True if the cells have few different words, with a sensor among them."""
    words = set(cells)
    texts = all(re.match(r"[$<\[]?[A-Za-z]", cell) and not is_value(cell) for cell in words)
    return texts and len(words) <= _MAX_INSTANCES and any(map(_kind_of, words))


def _kind_of(word: str) -> str | None:
    bare = word.strip("$:<>[]")
    if bare in _SENTENCES or bare.lower() in _IMU_WORDS:
        return "gyro"
    return parse_name(f"{bare} x").kind


def _of_word(raw: bytes, word: str, at: int, stated: list[str]) -> Table:
    """Return the table of a sensor's rows; `word` is in column `at`.

    ``stated`` are the names of the columns in a comment, if any.
    """
    layout, _ = find_layout(raw)
    layout = replace(layout, offset=0, lines_before=0, header=None, names=None)
    raw, torn = without_torn(raw, layout)
    notes = [f"{len(torn)} rows of {word} are torn; left out"] if torn else []
    table = table_of_rows(raw, layout)
    names = _SENTENCES[word].split() if word in _SENTENCES else stated
    if len(names) != layout.width:
        names = _names_by_values(table, word, at)
        listed = ", ".join(name for i, name in enumerate(names) if i != at)
        notes += [f"rows of {word} have no names: they are taken as {listed}"] if names else []
    names = ["sensor" if i == at else name for i, name in enumerate(names)]
    layout = replace(layout, names=tuple(names) or None)
    time = names.index("time") if "time" in names else None
    meta = Metadata(sensor=word, notes=tuple(notes))
    return named_by_values(replace(table_of_rows(raw, layout), time=time, meta=meta))


def _names_by_values(table: Table, word: str, at: int) -> list[str]:
    """Return names of the increasing clocks and the three axes after them; empty if unsure."""
    numbers = {
        i: column for i in range(table.width) if (column := load_column(table, i)) is not None
    }
    clocks = [i for i, column in numbers.items() if rises(column)]
    rest = [i for i in range(table.width) if i > max(clocks, default=-1) and i != at]
    if not _AXES <= len(rest) <= _AXES + 2:
        return []
    names = {i: f"{word}_{axis}" for i, axis in zip(rest[:_AXES], "xyz", strict=True)}
    names |= {i: "time" if i == clocks[-1] else f"time_{i}" for i in clocks}
    return [names.get(i, f"column_{i}") for i in range(table.width)]


def table_of_rows(raw: bytes, layout: Layout) -> Table:
    """Return the table of rows with one layout."""
    return Table(
        width=layout.width,
        load=lambda wanted: parse_columns(raw, layout, list(wanted)),
        names=layout.names,
        labels=lambda index: read_texts(raw, layout, index),
    )


def _parse_formats(formats: list[bytes]) -> dict[str, str]:
    """Return the columns by message from lines ``FMT, type, length, name, format, columns``."""
    columns = {}
    for line in formats:
        cells = [cell.strip() for cell in line.decode("latin-1").split(",")]
        if len(cells) > 4:
            columns[cells[2]] = " ".join(cells[4:])
    return columns


def _make_message_table(raw: bytes, names: list[str], label: str) -> Table | None:
    """Return the table of a message; None if its rows do not match the names."""
    layout, _ = find_layout(raw)
    if len(names) != layout.width:
        return None
    layout = replace(layout, names=tuple(names), offset=0, lines_before=0)
    return replace(table_of_rows(raw, layout), meta=Metadata(sensor=label))


def split_by_label(table: Table) -> Content | None:
    """Return the sensors of a table with a column that names the sensor of each row.

    The names are texts, or Android's numbers of sensors.
    """
    if table.names is None or table.labels is None or _has_kind(table, *_KINDS):
        return None
    axes = _find_bare_axes(table.names)
    label_columns = [i for i, name in enumerate(table.names) if _SENSOR_WORDS & set(words_of(name))]
    for column in label_columns if axes else ():
        try:
            parts = split_table(table, column)
        except LogError:
            continue
        words = {name: (name, "") for name in parts}
        if _are_android(parts, axes):
            words = {name: own for name, own in _ANDROID_SENSORS.items() if name in parts}
            listed = ", ".join(f"{name} for the {word}" for name, (word, _) in words.items())
            note = f"sensors are distinguished by their numbers in Android: {listed}"
            parts = {name: parts[name].noted(note) for name in words}
        known = {words[name]: part for name, part in parts.items() if _kind_of(words[name][0])}
        if known:
            own = {
                word: _rename_axes(part, axes, word, unit) for (word, unit), part in known.items()
            }
            return make_content(own)
    return None


def with_android_names(table: Table) -> Table:
    """Return the table with names, if rows are a time, Android's sensor number and three axes."""
    if table.names is not None or table.width != 2 + _AXES or table.labels is None:
        return table
    axes = [2, 3, 4]
    for number in (0, 1):
        try:
            parts = split_table(table, number)
        except LogError:
            continue
        if len(parts) <= _MAX_INSTANCES and _are_android(parts, axes):
            names = ["time", "sensor"] if number else ["sensor", "time"]
            return replace(table, names=(*names, "x", "y", "z"))
    return table


def _find_bare_axes(names: Sequence[str]) -> list[int]:
    """Return the three columns of axes without a sensor: x, y, z or numbered values."""
    letters = [i for i, name in enumerate(names) if parse_name(name).kind == ""]
    values = [
        i for i, name in enumerate(names) if re.fullmatch(r"values?\W*[0-3]\W*", name.lower())
    ]
    return next((own for own in (letters, values) if len(own) == _AXES), [])


def _are_android(parts: Mapping[str, Table], axes: list[int]) -> bool:
    """Return True if labels are Android's numbers: rows with label 1 have about 1 g."""
    if "1" not in parts or not all(name.isdigit() for name in parts):
        return False
    columns = [load_column(parts["1"], index) for index in axes]
    size = np.sqrt(sum(np.square(c.astype(float)) for c in columns if c is not None))
    return bool(abs(np.nanmedian(size) / _GRAVITY - 1.0) < _NEAR_GRAVITY)


def _rename_axes(table: Table, axes: list[int], label: str, unit: str) -> Table:
    names = list(table.names or ())
    for axis, index in zip("xyz", axes, strict=True):
        own = parse_name(names[index]).axis
        name = f"{label}_{axis if own is None else 'xyz'[own]}"
        names[index] = f"{name}_{unit}" if unit else name
    return replace(table, names=tuple(names), meta=replace(table.meta, sensor=label))


def split_by_instance(table: Table) -> Content | None:
    """Return the sensors of a table, distinguished by a column of small numbers."""
    parts = _split_instances(table, "") if _has_kind(table, *_KINDS) else {}
    return make_content(parts) if len(parts) > 1 else None


def _split_instances(table: Table, label: str) -> dict[str, Table]:
    """Return the rows of each instance by number, or the whole table under its own name."""
    names = table.names or ()
    column = next((i for i, name in enumerate(names) if _is_instance_column(table, i, name)), None)
    if column is None:
        return {label: table}
    tables = split_table(table, column)
    parts = {name: tables[name] for name in sorted(tables, key=_natural_key)}
    others = ", ".join([*parts][1:])
    note = make_sentence(
        f"column '{names[column]}' distinguishes {len(parts)} sensors, the first of which is "
        f"{next(iter(parts))}; ",
        keyword_argument("topic"),
        f" reads another: {others}",
    )
    meta = replace(table.meta, notes=(*table.meta.notes, note))
    named = {f"{label}_{name}" if label else name: part for name, part in parts.items()}
    return {name: replace(part, meta=replace(meta, sensor=name)) for name, part in named.items()}


def _is_instance_column(table: Table, index: int, name: str) -> bool:
    """Return True if a column of this name contains the numbers of alternating sensors."""
    words = set(words_of(name))
    if not words or not words <= _INSTANCE_WORDS:
        return False
    try:
        (values,) = table.load([index])
    except LogError:
        return False
    changes = np.count_nonzero(values[1:] != values[:-1])
    return 1 < len(np.unique(values)) <= _MAX_INSTANCES and bool(
        changes >= _MIN_TURN_PART * len(values)
    )


def _natural_key(name: str) -> tuple[float, str]:
    return (float(name), name) if name.lstrip("-").isdigit() else (math.inf, name)
