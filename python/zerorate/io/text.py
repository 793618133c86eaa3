"""Text tables: comma, semicolon, tab or blanks between cells, with or without a header.

The layout is found from the first lines. Then the fastest road that takes the file is used:
pyarrow, NumPy, or line by line; all give the same numbers. The last road alone names the line
and column of a fault, so every failure of the others ends there.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

import numpy as np

from zerorate.io.errors import LogError
from zerorate.io.layout import MISSING, Layout, decoded, find_layout
from zerorate.io.table import Column, Table, listed_names

_Kinds = list[type[np.float64] | type[np.int64]]


def read_text(raw: bytes) -> Table:
    """Return the table in the bytes of a text file."""
    layout = find_layout(raw)
    return listed_names(
        Table(
            width=layout.width,
            load=lambda wanted: _load(raw, layout, list(wanted)),
            names=layout.names,
            meta=layout.meta,
        )
    )


def _load(raw: bytes, layout: Layout, wanted: list[int]) -> list[Column]:
    kinds = _kinds(layout, wanted)
    body = _body(raw, layout)
    for road in (_by_arrow, _by_numpy):
        columns = road(body, layout, wanted, kinds)
        if columns is not None:
            return columns
    return _by_line(raw, layout, wanted)


def _kinds(layout: Layout, wanted: list[int]) -> _Kinds:
    """Return int64 for columns of integers too long for a float64, such as nanoseconds."""
    cells = (layout.first_row[i].lstrip("+-") for i in wanted)
    return [np.int64 if cell.isdigit() and len(cell) > 15 else np.float64 for cell in cells]


def _body(raw: bytes, layout: Layout) -> bytes:
    body = raw[layout.offset :]
    if b"#" in body or b"%" in body:
        lines = body.splitlines(keepends=True)
        body = b"".join(line for line in lines if not line.lstrip().startswith((b"#", b"%")))
    return _single_blanks(body) if layout.delimiter is None else body


def _single_blanks(body: bytes) -> bytes:
    body = body.replace(b"\t", b" ").strip(b" ")
    while b"  " in body:
        body = body.replace(b"  ", b" ")
    return body.replace(b"\n ", b"\n").replace(b" \n", b"\n").replace(b" \r", b"\r")


def _by_arrow(body: bytes, layout: Layout, wanted: list[int], kinds: _Kinds) -> list[Column] | None:
    try:
        import pyarrow as pa
        from pyarrow import csv as arrow_csv
    except ImportError:
        return None
    labels = [str(i) for i in range(layout.width)]
    types = {
        labels[i]: pa.from_numpy_dtype(np.dtype(kind))
        for i, kind in zip(wanted, kinds, strict=True)
    }
    try:
        table = arrow_csv.read_csv(
            io.BytesIO(body),
            read_options=arrow_csv.ReadOptions(column_names=labels),
            parse_options=arrow_csv.ParseOptions(delimiter=layout.delimiter or " "),
            convert_options=arrow_csv.ConvertOptions(
                column_types=types,
                include_columns=[labels[i] for i in wanted],
                null_values=list(MISSING),
                decimal_point="," if layout.decimal_comma else ".",
            ),
        )
    except pa.ArrowException:
        return None
    return [table.column(i).to_numpy() for i in range(len(wanted))]


def _by_numpy(body: bytes, layout: Layout, wanted: list[int], kinds: _Kinds) -> list[Column] | None:
    # Every column is named, the unwanted ones as one byte, so that NumPy checks the row's width.
    types = dict(zip(wanted, kinds, strict=True))
    fields = [(f"c{i}", types.get(i, "S1")) for i in range(layout.width)]
    text = decoded(body.replace(b",", b".") if layout.decimal_comma else body)
    try:
        rows = np.loadtxt(
            io.StringIO(text),
            dtype=np.dtype(fields),
            delimiter=layout.delimiter,
            comments=None,
            quotechar='"',
            ndmin=1,
        )
    except (ValueError, OverflowError):
        return None
    return [np.ascontiguousarray(rows[f"c{i}"]) for i in wanted]


def _by_line(raw: bytes, layout: Layout, wanted: list[int]) -> list[Column]:
    columns: list[list[float]] = [[] for _ in wanted]
    lines = io.StringIO(decoded(raw), newline=None)
    for number, line in enumerate(lines, start=1):
        if number <= layout.lines_before or not line.strip() or line.lstrip()[0] in "#%":
            continue
        cells = layout.split(line)
        if len(cells) != layout.width:
            raise LogError(
                f"line {number} has {len(cells)} cells, expected {layout.width} "
                "as in the lines before it"
            )
        for values, index in zip(columns, wanted, strict=True):
            values.append(_number(cells[index], number, index, layout))
    return [_as_array(values) for values in columns]


def _number(cell: str, line: int, index: int, layout: Layout) -> float:
    text = cell.strip()
    if text in MISSING:
        return float("nan")
    try:
        if text.lstrip("+-").isdigit():
            return int(text)
        return float(text.replace(",", ".") if layout.decimal_comma else text)
    except ValueError:
        name = layout.names[index] if layout.names is not None else f"column_{index}"
        raise LogError(
            f"line {line}, column '{name}': '{_shortened(cell)}' is not a number"
        ) from None


def _shortened(cell: str) -> str:
    return cell if len(cell) <= 40 else cell[:37] + "..."


def _as_array(values: Sequence[float]) -> Column:
    long = max((abs(v) for v in values if isinstance(v, int)), default=0) >= 10**15
    if long and all(isinstance(v, int) and abs(v) < 2**63 for v in values):
        return np.array(values, dtype=np.int64)
    return np.array(values, dtype=np.float64)


def text_header(names: Sequence[str], delimiter: str) -> str:
    """Return the header line of a text table, without its end."""
    line = io.StringIO()
    csv.writer(line, delimiter=delimiter, lineterminator="").writerow(names)
    return line.getvalue()
