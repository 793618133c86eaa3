"""Text tables: comma, semicolon, tab or blanks between cells, with or without a header.

`zerorate.io.readers.layouts` finds the layout from the first lines, `zerorate.io.readers.parsers`
reads the rows, and `zerorate.io.readers.rows` knows tables whose rows are of several sensors.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from zerorate.io.readers.cells import make_inert
from zerorate.io.readers.layouts import find_layout, first_lines
from zerorate.io.readers.parsers import (
    Layout,
    decode_text,
    describe_lines,
    parse_columns,
    read_texts,
)
from zerorate.io.readers.rows import make_content, split_by_instance, split_by_label, split_messages
from zerorate.io.signatures import is_text
from zerorate.io.table import Content, Metadata, Table, apply_listed_names
from zerorate.record.log import LogError
from zerorate.record.names import meaning_of
from zerorate.record.words import STAGES, parse_name, words_of

_UTF_16_MARKS: Final = (b"\xff\xfe", b"\xfe\xff")
_SERIAL_STAMP: Final = rb"(?m)^(\d{1,2}:\d\d:\d\d[.,]?\d*) -> "
"""What the serial monitor of Arduino writes before a line."""
_PAIR: Final = r"([A-Za-z_][\w.\[\]]*)[ \t]*[:=][ \t]*([-+.\deE]+|nan)"
_LABEL: Final = rb"[A-Za-z_][\w.\[\]]*[ \t]*[:=][ \t]*"
_AXES: Final = (0, 1, 2)


def read(path: Path) -> Content:
    """Return the content of a text."""
    raw = _to_utf8(path.read_bytes())
    if not is_text(raw):
        raise LogError("the content is binary, expected a text table")
    _check_no_result(raw)
    raw, has_stamps = _strip_arrows(raw)
    content = split_messages(raw)
    if content is not None:
        return content
    table = _name_by_file(_read_table(raw), path.stem)
    if has_stamps:
        names = table.names and ("time", *table.names[1:])
        table = replace(table, names=names, time=0)
    return (
        split_by_label(table) or split_by_instance(table) or Content.of(apply_listed_names(table))
    )


def _check_no_result(raw: bytes) -> None:
    """Refuse what this package has saved: a mistaken argument, never a log."""
    match = re.match(rb'\{\s*"format": "zerorate ([\w -]+)"', raw.lstrip())
    if match is not None:
        raise LogError(f"the file holds a result of zerorate ({match[1].decode()}), expected a log")


def _to_utf8(raw: bytes) -> bytes:
    if not raw.startswith(_UTF_16_MARKS):
        return raw
    try:
        return raw.decode("utf-16").encode()
    except UnicodeDecodeError as error:
        raise LogError(f"damaged UTF-16: {error.reason}") from None


def _strip_arrows(raw: bytes) -> tuple[bytes, bool]:
    """Return the lines of a serial monitor with their times as cells, and whether they had any."""
    match = re.match(_SERIAL_STAMP + rb"(.*)", raw)
    if match is None:
        return raw, False
    mark = next((mark for mark in (b";", b"\t", b",") if mark in match[2]), b" ")
    return re.sub(_SERIAL_STAMP, rb"\1" + mark, raw), True


def _read_table(raw: bytes) -> Table:
    raw, names = _strip_labels(raw)
    layout, meta = find_layout(raw, names)
    return make_table(raw, layout, meta)


def make_table(raw: bytes, layout: Layout, meta: Metadata) -> Table:
    """Return the table of a layout in bytes."""
    return Table(
        width=layout.width,
        load=lambda wanted: parse_columns(raw, layout, list(wanted)),
        names=layout.names,
        labels=lambda index: read_texts(raw, layout, index),
        meta=replace(meta, notes=(*meta.notes, *describe_lines(raw, layout))),
    )


def _strip_labels(raw: bytes) -> tuple[bytes, tuple[str, ...] | None]:
    """Return rows of ``gx:0.1,gy:0.2`` without their labels, and these as names."""
    lines = first_lines(raw, 2)
    labels = [tuple(name for name, _ in re.findall(_PAIR, line.text)) for line in lines]
    rest = [re.sub(_PAIR, "", line.text).strip(" ,;\t") for line in lines]
    if not lines or len(set(labels)) > 1 or len(labels[0]) < 2 or any(rest):
        return raw, None
    row_labels = re.findall(rb"([A-Za-z_][\w.\[\]]*)[ \t]*[:=]", raw)
    if set(map(decode_text, row_labels)) != set(labels[0]):
        raise LogError(f"the rows name other values than the first, {', '.join(labels[0])}")
    return re.sub(_LABEL, b"", raw), labels[0]


def _name_by_file(table: Table, stem: str) -> Table:
    """Return the table with x, y, z named after the sensor that the file is named after."""
    parsed_names = [parse_name(name) for name in table.names or ()]
    bare = [i for i, own in enumerate(parsed_names) if own.kind == "" and own.axis is not None]
    axes = sorted(parsed_names[i].axis or 0 for i in bare)
    kinds = {meaning.kind for meaning in map(meaning_of, table.names or ()) if meaning}
    if tuple(axes) != _AXES or kinds & {"gyro", "accel", "mag"} or table.names is None:
        return table
    sensor_name = parse_name(f"{stem} x")
    if not sensor_name.kind:
        return table
    prefix = "_".join(filter(None, (sensor_name.kind, sensor_name.stage)))
    names = [
        f"{prefix}_{'xyz'[parsed_names[i].axis or 0]}" if i in bare else name
        for i, name in enumerate(table.names)
    ]
    old, new = (", ".join(listed[i] for i in bare) for listed in (table.names, names))
    note = f"{old} are {new}, for the file is named after that sensor"
    meta = replace(table.meta, notes=(*table.meta.notes, note))
    return replace(table, names=tuple(names), meta=meta)


def find_sensor_files(folder: Path) -> list[Path]:
    """Return the files of sensors, calibrated ones first, accelerations with gravity alone."""
    kinds = {file: parse_name(f"{file.stem} x") for file in sorted(folder.glob("*.csv"))}
    files = [
        file
        for file, sensor_name in kinds.items()
        if sensor_name.kind and sensor_name.stage != "linear"
    ]
    total = [file for file in files if "total" in words_of(file.stem)]
    if total:
        files = [file for file in files if kinds[file].kind != "accel" or file in total]
    return sorted(files, key=lambda file: STAGES.index(kinds[file].stage))


def read_folder(folder: Path) -> Content:
    """Return a table of each file of a sensor in a folder."""
    tables = {}
    for file in find_sensor_files(folder):
        try:
            table = _name_by_file(_read_table(_to_utf8(file.read_bytes())), file.stem)
        except LogError as error:
            raise error.with_context(f"{file.name}: ") from None
        tables[file.stem] = replace(table, meta=replace(table.meta, sensor=file.stem))
    return make_content(tables)


def make_text_header(names: Sequence[str], delimiter: str) -> str:
    """Return the header line of a text table, without its end."""
    line = io.StringIO()
    csv.writer(line, delimiter=delimiter, lineterminator="").writerow(map(make_inert, names))
    return line.getvalue()
