"""Text tables whose rows are of several sensors: messages, labels of a kind, numbers of a unit."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.parts import split_table
from zerorate.io.readers.cells import split_cells
from zerorate.io.readers.layouts import find_layout, first_lines, is_value
from zerorate.io.readers.parsers import parse_columns, read_texts
from zerorate.io.table import Content, Metadata, Table
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
"""Columns of messages of ArduPilot's DataFlash log, of which a part may lack the formats."""
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
"""Words that the name of a column consists of which tells sensors apart."""
_MAX_INSTANCES: Final = 16
_MIN_TURN_PART: Final = 0.2
"""Part of the rows that follow one of another sensor, at least, where sensors take turns."""


def make_content(tables: Mapping[str, Table]) -> Content:
    """Return the content of tables by the names of their sensors, the first gyro's being chosen."""

    def topic(asked: str | None) -> str:
        if asked is not None:
            if asked not in tables:
                raise LogError(f"there is no topic '{asked}'; it has: {', '.join(tables)}", "topic")
            return asked
        return next((name for name, table in tables.items() if _has_kind(table, "gyro")), first)

    first = next(iter(tables))
    return Content(tables, topic)


def _has_kind(table: Table, *wanted: str) -> bool:
    meanings = map(meaning_of, table.names or ())
    return any(meaning is not None and meaning.kind in wanted for meaning in meanings)


def split_messages(raw: bytes) -> Content | None:
    """Return the messages of a text whose lines begin with their name, as of DataFlash logs.

    Their columns are named by lines that begin with FMT.
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


def _parse_formats(formats: list[bytes]) -> dict[str, str]:
    """Return the columns of messages by name: ``FMT, type, length, name, format, columns``."""
    columns = {}
    for line in formats:
        cells = [cell.strip() for cell in line.decode("latin-1").split(",")]
        if len(cells) > 4:
            columns[cells[2]] = " ".join(cells[4:])
    return columns


def _make_message_table(raw: bytes, names: list[str], label: str) -> Table | None:
    """Return the table of a message; None if its rows are not what the names are of."""
    layout, _ = find_layout(raw)
    own_names = names if len(names) == layout.width else _guess_names(label, layout.width)
    if own_names is None:
        return None
    layout = replace(layout, names=tuple(own_names), offset=0, lines_before=0)
    assumed = f"rows of {label} have no names: they are taken as {', '.join(own_names)}"
    return Table(
        width=layout.width,
        load=lambda wanted: parse_columns(raw, layout, list(wanted)),
        names=layout.names,
        labels=lambda index: read_texts(raw, layout, index),
        meta=Metadata(sensor=label, notes=() if own_names is names else (assumed,)),
    )


def _guess_names(label: str, width: int) -> list[str] | None:
    """Return the names of a sensor's three axes, maybe after a time; None for anything else."""
    if not parse_name(f"{label} x").kind or width not in (3, 4):
        return None
    return [*["time"][: width - 3], *(f"{label}_{axis}" for axis in "xyz")]


def split_by_label(table: Table) -> Content | None:
    """Return the sensors of a table whose column of texts says of which one a row is."""
    if table.names is None or table.labels is None or _has_kind(table, *_KINDS):
        return None
    axes = [i for i, name in enumerate(table.names) if parse_name(name).kind == ""]
    label_columns = [i for i, name in enumerate(table.names) if _SENSOR_WORDS & set(words_of(name))]
    for column in label_columns if len(axes) == 3 else ():
        try:
            parts = split_table(table, column)
        except LogError:
            continue
        known = {name: part for name, part in parts.items() if parse_name(f"{name} x").kind}
        if known:
            renamed = {name: _rename_axes(part, axes, name) for name, part in known.items()}
            return make_content(renamed)
    return None


def _rename_axes(table: Table, axes: list[int], label: str) -> Table:
    names = list(table.names or ())
    for index in axes:
        names[index] = f"{label}_{'xyz'[parse_name(names[index]).axis or 0]}"
    return replace(table, names=tuple(names), meta=replace(table.meta, sensor=label))


def split_by_instance(table: Table) -> Content | None:
    """Return the sensors of a table whose column of small numbers tells them apart."""
    parts = _split_instances(table, "") if _has_kind(table, *_KINDS) else {}
    return make_content(parts) if len(parts) > 1 else None


def _split_instances(table: Table, label: str) -> dict[str, Table]:
    """Return the rows of each instance by its number, or the whole under its own name."""
    names = table.names or ()
    column = next((i for i, name in enumerate(names) if _is_instance_column(table, i, name)), None)
    if column is None:
        return {label: table}
    tables = split_table(table, column)
    parts = {name: tables[name] for name in sorted(tables, key=_natural_key)}
    others = ", ".join([*parts][1:])
    note = make_sentence(
        f"column '{names[column]}' tells {len(parts)} sensors apart, of which {next(iter(parts))} "
        "is the first; ",
        keyword_argument("topic"),
        f" reads another: {others}",
    )
    meta = replace(table.meta, notes=(*table.meta.notes, note))
    named = {f"{label}_{name}" if label else name: part for name, part in parts.items()}
    return {name: replace(part, meta=replace(meta, sensor=name)) for name, part in named.items()}


def _is_instance_column(table: Table, index: int, name: str) -> bool:
    """Whether a column of this name holds the numbers of sensors that take turns."""
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
