"""Text tables: cells separated by comma, semicolon, tab or blanks, with or without a header.

`zerorate.io.readers.layouts` finds the layout from the first lines, and
`zerorate.io.readers.parsers` reads the rows. `zerorate.io.readers.rows` reads tables with rows of
several sensors.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from zerorate.io.evidence import named_by_values
from zerorate.io.readers.cells import make_inert
from zerorate.io.readers.foreign_numbers import plain_numbers
from zerorate.io.readers.layouts import find_layout, first_lines
from zerorate.io.readers.parsers import (
    Layout,
    decode_text,
    describe_lines,
    without_torn,
    without_torn_end,
)
from zerorate.io.readers.rows import (
    labelled,
    make_content,
    split_by_instance,
    split_by_label,
    split_messages,
    table_of_rows,
    with_android_names,
)
from zerorate.io.readers.tokens import ECHO, SERIAL_STAMP, tokenizer_of
from zerorate.io.signatures import is_text
from zerorate.io.table import Content, Metadata, Table, apply_listed_names
from zerorate.record.clock import count_noun
from zerorate.record.log import LogError
from zerorate.record.names import meaning_of
from zerorate.record.words import STAGES, parse_name, words_of

_MINUS: Final = "\N{MINUS SIGN}".encode()
_UTF_16_MARKS: Final = (b"\xff\xfe", b"\xfe\xff")
_SERIAL_STAMP: Final = SERIAL_STAMP.pattern.encode()
_AXES: Final = (0, 1, 2)
_PART: Final = 0.1
"""Smallest share of a sensor's rows, relative to the most frequent set of names."""
_ZEROS: Final = re.compile(rb"\0+")
_FEW_BLOCKS: Final = 0.05
"""Largest share of zero blocks, relative to the lines, in a text with gaps."""
_LISTED: Final = 8
"""Number of torn lines that a note lists."""


def read(path: Path) -> Content:
    """Return the content of a text file."""
    raw = _without_zeros(_to_utf8(path.read_bytes()).rstrip(b"\0"))
    if not is_text(raw):
        raise LogError("the content is binary, expected a text table")
    _check_no_result(raw)
    raw, notes = plain_numbers(raw)
    content = _track(raw) or tokenized(raw, path.stem) or _read_rows(raw, path.stem)
    tables = {name: table.noted(*notes) for name, table in content.tables.items()}
    return replace(content, tables=tables)


def _read_rows(raw: bytes, stem: str) -> Content:
    """Return the content of a text with rows; `stem` is the name of the file."""
    raw, has_stamps = _strip_arrows(_with_one_mark(raw))
    content = split_messages(raw) or labelled(raw)
    if content is not None:
        return content
    table = _named(with_android_names(_read_table(raw)), stem)
    if has_stamps:
        names = table.names and ("time", *table.names[1:])
        table = replace(table, names=names, time=0)
    return (
        split_by_label(table) or split_by_instance(table) or Content.of(apply_listed_names(table))
    )


def _track(raw: bytes) -> Content | None:
    """Return the points of a GPX file as a table; None for other texts."""
    if b"<gpx" not in raw[: 1 << 12]:
        return None
    names = ("time", "latitude_deg", "longitude_deg", "height_m", "speed_mps", "course_deg")
    rows = [",".join(names)]
    for point in re.finditer(
        r"<(trkpt|wpt|rtept)\b([^>]*)>(.*?)</\1>", decode_text(raw), re.DOTALL
    ):
        place = dict(re.findall(r"(lat|lon)\s*=\s*[\"']([^\"']+)", point[2]))
        fields = dict(re.findall(r"<(?:\w+:)?(ele|time|speed|course)>\s*([^<]*?)\s*<", point[3]))
        cells = {**place, **fields}
        keys = ("time", "lat", "lon", "ele", "speed", "course")
        rows.append(",".join(cells.get(key, "") for key in keys))
    return Content.of(_read_table("\n".join(rows).encode()))


def tokenized(raw: bytes, stem: str = "") -> Content | None:
    """Return the content of lines with names and numbers: a table per set of names.

    ``stem`` is the name of the file, which may name a sensor.
    """
    raw = _listed_lines(raw)
    head = [line.text for line in first_lines(raw, 60)]
    tokenizer = tokenizer_of(head)
    if tokenizer is None:
        return None
    groups: dict[tuple[str, ...], list[str]] = {}
    left = 0
    for line in decode_text(raw).splitlines():
        cells = tokenizer.take(line)
        if cells:
            row = ",".join(cell.replace(",", ";") for cell in cells.values())
            groups.setdefault(tuple(cells), []).append(row)
        left += cells is None and tokenizer.kind != ECHO and bool(line.strip())
    if (last := tokenizer.take("---")) is not None:
        groups.setdefault(tuple(last), []).append(",".join(last.values()))
    most = max(map(len, groups.values()), default=0)
    used = {names: rows for names, rows in groups.items() if len(rows) >= _PART * most}
    left += sum(map(len, groups.values())) - sum(map(len, used.values()))
    notes = [f"read as lines of {tokenizer.kind}"]
    notes += [f"left out: {count_noun(left, 'line')} without a sample"] if left else []
    tables = {}
    for names, rows in used.items():
        table = _named(_read_table("\n".join([",".join(names), *rows]).encode()), stem)
        meta = replace(table.meta, notes=(*notes, *table.meta.notes))
        tables[f"rows of {names[-1]}" if len(used) > 1 else ""] = replace(table, meta=meta)
    if not tables:
        return None
    return make_content(tables) if len(tables) > 1 else Content.of(*tables.values())


def _listed_lines(raw: bytes) -> bytes:
    """Return the objects of a JSON document as lines; other texts unchanged.

    The document is a list of objects, alone or within an object. Or it has lists of equal length by
    column.
    """
    if not raw.lstrip().startswith((b"[", b"{")):
        return raw
    try:
        document = json.loads(raw)
    except (ValueError, RecursionError):
        return raw
    found = _find_objects(document)
    return raw if found is None else b"\n".join(json.dumps(one).encode() for one in found)


def _find_objects(document: Any) -> Sequence[Any] | None:  # noqa: ANN401  # what JSON holds
    if isinstance(document, list):
        return document
    if not isinstance(document, dict):
        return None
    columns = {name: own for name, own in document.items() if isinstance(own, list)}
    inner = [_find_objects(one) for one in document.values() if isinstance(one, dict)]
    nested = [*columns.values(), *(one for one in inner if one is not None)]
    objects = [own for own in nested if own and all(isinstance(one, dict) for one in own)]
    if objects:
        return max(objects, key=len)
    if len(columns) < 2 or len({len(own) for own in columns.values()}) > 1:
        return None
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _without_zeros(raw: bytes) -> bytes:
    """Return a text with gaps of zero bytes replaced by a mark that makes these lines torn."""
    if b"\0" not in raw or len(runs := _ZEROS.findall(raw)) > _FEW_BLOCKS * raw.count(b"\n"):
        return raw
    return _ZEROS.sub(b"?", raw) if runs else raw


def _check_no_result(raw: bytes) -> None:
    """Raise LogError for a file that zerorate has saved, because it is no log."""
    match = re.match(rb'\{\s*"format": "zerorate ([\w -]+)"', raw.lstrip())
    if match is not None:
        raise LogError(f"the file holds a result of zerorate ({match[1].decode()}), expected a log")


def _to_utf8(raw: bytes) -> bytes:
    if not raw.startswith(_UTF_16_MARKS):
        return raw.replace(_MINUS, b"-") if _MINUS in raw else raw
    try:
        return raw.decode("utf-16").encode()
    except UnicodeDecodeError as error:
        raise LogError(f"damaged UTF-16: {error.reason}") from None


def _with_one_mark(raw: bytes) -> bytes:
    """Return rows with a comma and a tab between cells with tabs only."""
    lines = first_lines(raw, 20)
    both = lines and all(0 < line.text.count("\t") <= line.text.count(",\t") for line in lines)
    return raw.replace(b",\t", b"\t") if both else raw


def _strip_arrows(raw: bytes) -> tuple[bytes, bool]:
    """Return a serial monitor's lines with their times as cells, and True if they had times."""
    match = re.match(_SERIAL_STAMP + rb"(.*)", raw)
    if match is None:
        return raw, False
    mark = next((mark for mark in (b";", b"\t", b",") if mark in match[2]), b" ")
    return re.sub(_SERIAL_STAMP, rb"\1" + mark, raw), True


def _read_table(raw: bytes) -> Table:
    layout, meta = find_layout(raw)
    return make_table(raw, layout, meta)


def make_table(raw: bytes, layout: Layout, meta: Metadata) -> Table:
    """Return the table of bytes with a layout, without an incomplete last line."""
    raw, cut = without_torn_end(raw, layout)
    notes = [*meta.notes, *describe_lines(raw, layout)]
    if cut is not None:
        notes.append(f"line {cut}, the last one, is cut; left out")

    def whole() -> Table:
        rest, torn = without_torn(raw, layout)
        listed = ", ".join(map(str, torn[:_LISTED])) + (" and more" if len(torn) > _LISTED else "")
        torn_notes = [f"torn, left out: line{'s' * (len(torn) > 1)} {listed}"] if torn else []
        found = replace(meta, notes=(*notes, *torn_notes))
        return replace(table_of_rows(rest, layout), meta=found)

    return replace(table_of_rows(raw, layout), meta=replace(meta, notes=tuple(notes)), whole=whole)


def _named(table: Table, stem: str) -> Table:
    """Return the table with columns named by the file's name or by values."""
    whole = table.whole
    named = named_by_values(_name_by_file(table, stem))
    return named if whole is None else replace(named, whole=lambda: _named(whole(), stem))


def _name_by_file(table: Table, stem: str) -> Table:
    """Return the table with x, y, z named after the sensor in the file's name."""
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
    return replace(table, names=tuple(names)).noted(note)


def find_sensor_files(folder: Path) -> list[Path]:
    """Return the files of sensors, calibrated first; accelerations without gravity are excluded."""
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
    """Return a table for each file of a sensor in a folder."""
    tables = {}
    for file in find_sensor_files(folder):
        try:
            table = _named(_read_table(_to_utf8(file.read_bytes())), file.stem)
        except LogError as error:
            raise error.with_context(f"{file.name}: ") from None
        tables[file.stem] = replace(table, meta=replace(table.meta, sensor=file.stem))
    return make_content(tables)


def make_text_header(names: Sequence[str], delimiter: str) -> str:
    """Return the header line of a text table, without a line end."""
    line = io.StringIO()
    csv.writer(line, delimiter=delimiter, lineterminator="").writerow(map(make_inert, names))
    return line.getvalue()
