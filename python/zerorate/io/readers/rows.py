"""Text tables whose rows are of several sensors: messages, labels of a kind, numbers of a unit."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.faults import given, said
from zerorate.io.parts import parts_of
from zerorate.io.readers.cells import split
from zerorate.io.readers.layouts import find_layout, first_lines, is_value
from zerorate.io.readers.parsers import parsed, texts
from zerorate.io.table import Content, Metadata, Table
from zerorate.record.log import LogError
from zerorate.record.names import meaning_of
from zerorate.record.words import parsed_name, words_of

_KINDS: Final = ("gyro", "accel", "mag")
_LABEL: Final = re.compile(rb"[A-Z][A-Z0-9]{1,3}")
_FORMATS: Final = b"FMT"
_DATAFLASH: Final = {
    "IMU": "TimeUS I GyrX GyrY GyrZ AccX AccY AccZ EG EA T GH AH GHz AHz",
    "GYR": "TimeUS I SampleUS GyrX GyrY GyrZ",
    "ACC": "TimeUS I SampleUS AccX AccY AccZ",
    "MAG": "TimeUS I MagX MagY MagZ",
}
"""Columns of messages of ArduPilot's DataFlash log, of which a part may lack the formats."""
_TELLS_SENSOR: Final = {"sensor", "type", "message", "name", "label", "kind", "channel", "stream"}
_INSTANCE: Final = {
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
_MOST: Final = 16
_TURN_BY_TURN: Final = 0.2
"""Part of the rows that follow one of another sensor, at least, where sensors take turns."""


def content_of(tables: Mapping[str, Table]) -> Content:
    """Return the content of tables by the names of their sensors, the first gyro's being chosen."""

    def topic(asked: str | None) -> str:
        if asked is not None:
            if asked not in tables:
                raise LogError(f"there is no topic '{asked}'; it has: {', '.join(tables)}", "topic")
            return asked
        return next((name for name, table in tables.items() if _kinds(table, "gyro")), first)

    first = next(iter(tables))
    return Content(tables, topic)


def _kinds(table: Table, *wanted: str) -> bool:
    meanings = map(meaning_of, table.names or ())
    return any(meaning is not None and meaning.kind in wanted for meaning in meanings)


def messages(raw: bytes) -> Content | None:
    """Return the messages of a text whose lines begin with their name, as of DataFlash logs.

    Their columns are named by lines that begin with FMT.
    """
    lines = first_lines(raw, 50)
    first = [split(line.text, ",") for line in lines]
    named = [cells[0] for cells in first if len(cells) > 2 and _LABEL.fullmatch(cells[0].encode())]
    if len(named) < len(first) or not named or not all(map(is_value, (c[1] for c in first))):
        return None
    rows: dict[bytes, list[bytes]] = {}
    for line in raw.splitlines():
        label, _, rest = line.partition(b",")
        rows.setdefault(label.strip(), []).append(rest)
    columns = {**_DATAFLASH, **_stated(rows.get(_FORMATS, []))}
    tables: dict[str, Table] = {}
    for label, found in rows.items():
        name = label.decode("latin-1")
        if label == _FORMATS or not name:
            continue
        table = _of_message(b"\n".join(found), columns.get(name, "").split(), name)
        if table is not None:
            tables.update(_parts(table, name) if _kinds(table, *_KINDS) else {name: table})
    return content_of(tables) if any(_kinds(t, *_KINDS) for t in tables.values()) else None


def _stated(formats: list[bytes]) -> dict[str, str]:
    """Return the columns of messages by name: ``FMT, type, length, name, format, columns``."""
    found = {}
    for line in formats:
        cells = [cell.strip() for cell in line.decode("latin-1").split(",")]
        if len(cells) > 4:
            found[cells[2]] = " ".join(cells[4:])
    return found


def _of_message(raw: bytes, names: list[str], label: str) -> Table | None:
    """Return the table of a message; None if its rows are not what the names are of."""
    layout, _ = find_layout(raw)
    own = names if len(names) == layout.width else _by_width(label, layout.width)
    if own is None:
        return None
    layout = replace(layout, names=tuple(own), offset=0, lines_before=0)
    assumed = f"rows of {label} have no names: they are taken as {', '.join(own)}"
    return Table(
        width=layout.width,
        load=lambda wanted: parsed(raw, layout, list(wanted)),
        names=layout.names,
        labels=lambda index: texts(raw, layout, index),
        meta=Metadata(sensor=label, notes=() if own is names else (assumed,)),
    )


def _by_width(label: str, width: int) -> list[str] | None:
    """Return the names of a sensor's three axes, maybe after a time; None for anything else."""
    if not parsed_name(f"{label} x").kind or width not in (3, 4):
        return None
    return [*["time"][: width - 3], *(f"{label}_{axis}" for axis in "xyz")]


def by_label(table: Table) -> Content | None:
    """Return the sensors of a table whose column of texts says of which one a row is."""
    if table.names is None or table.labels is None or _kinds(table, *_KINDS):
        return None
    axes = [i for i, name in enumerate(table.names) if parsed_name(name).kind == ""]
    tells = [i for i, name in enumerate(table.names) if _TELLS_SENSOR & set(words_of(name))]
    for column in tells if len(axes) == 3 else ():
        try:
            parts = parts_of(table, column)
        except LogError:
            continue
        known = {name: part for name, part in parts.items() if parsed_name(f"{name} x").kind}
        if known:
            named = {name: _renamed(part, axes, name) for name, part in known.items()}
            return content_of(named)
    return None


def _renamed(table: Table, axes: list[int], label: str) -> Table:
    names = list(table.names or ())
    for index in axes:
        names[index] = f"{label}_{'xyz'[parsed_name(names[index]).axis or 0]}"
    return replace(table, names=tuple(names), meta=replace(table.meta, sensor=label))


def by_instance(table: Table) -> Content | None:
    """Return the sensors of a table whose column of small numbers tells them apart."""
    parts = _parts(table, "") if _kinds(table, *_KINDS) else {}
    return content_of(parts) if len(parts) > 1 else None


def _parts(table: Table, label: str) -> dict[str, Table]:
    """Return the rows of each instance by its number, or the whole under its own name."""
    names = table.names or ()
    column = next((i for i, name in enumerate(names) if _tells_instance(table, i, name)), None)
    if column is None:
        return {label: table}
    found = parts_of(table, column)
    parts = {name: found[name] for name in sorted(found, key=_natural)}
    others = ", ".join([*parts][1:])
    note = said(
        f"column '{names[column]}' tells {len(parts)} sensors apart, of which {next(iter(parts))} "
        "is the first; ",
        given("topic"),
        f" reads another: {others}",
    )
    meta = replace(table.meta, notes=(*table.meta.notes, note))
    named = {f"{label}_{name}" if label else name: part for name, part in parts.items()}
    return {name: replace(part, meta=replace(meta, sensor=name)) for name, part in named.items()}


def _tells_instance(table: Table, index: int, name: str) -> bool:
    """Whether a column of this name holds the numbers of sensors that take turns."""
    words = set(words_of(name))
    if not words or not words <= _INSTANCE:
        return False
    try:
        (values,) = table.load([index])
    except LogError:
        return False
    turns = np.count_nonzero(values[1:] != values[:-1])
    return 1 < len(np.unique(values)) <= _MOST and bool(turns >= _TURN_BY_TURN * len(values))


def _natural(name: str) -> tuple[float, str]:
    return (float(name), name) if name.lstrip("-").isdigit() else (math.inf, name)
