"""RTKLIB's solution files: fixes with latitude, longitude and height."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from zerorate.io.clocks.iso8601 import parse_dates
from zerorate.io.readers.parsers import decode_text
from zerorate.io.table import Column, Content, Format, Metadata, Table
from zerorate.record.log import LogError

_HEADER: Final = re.compile(r"^%\s*(GPST|UTC|JST)\b(.*)$")
_ROW: Final = (
    r"(?:\d{4}/\d\d/\d\d[ ,]+\d\d:\d\d:\d\d(?:\.\d+)?|\d{3,4}[ ,]+\d{1,6}\.\d{1,9})"
    r"(?:[ ,\t]+[-+.\deE]+){5,}\s*$"
)
_SOLUTION_START: Final = re.compile(
    rf"^%\s*(?:GPST|UTC|JST)\b.*\(|\A(?:%[^\n]*\n|[ \t\r]*\n)*{_ROW}".encode(), re.MULTILINE
)
"""Pattern for the beginning of a file; in other tables, later rows may look similar."""
_DATE: Final = re.compile(r"(\d{4})/(\d\d)/(\d\d)$")
_WEEK_S: Final = 604_800
_GPS_EPOCH_DAYS: Final = 3657
"""Days from 1970 to the first week of GPS, 6 January 1980."""

_STANDARD_COLUMNS: Final = (
    "latitude(deg)", "longitude(deg)", "height(m)", "Q", "ns", "sdn(m)", "sde(m)", "sdu(m)",
    "sdne(m)", "sdeu(m)", "sdun(m)", "age(s)", "ratio", "vn(m/s)", "ve(m/s)", "vu(m/s)",
)  # fmt: skip
"""Columns of a file without a header."""

_COLUMN_NAMES: Final = {
    "latitude": "latitude_deg",
    "longitude": "longitude_deg",
    "height": "height_m",
    "q": "quality",
    "ns": "satellites",
    "sdn": "position_sigma_north_m",
    "sde": "position_sigma_east_m",
    "sdu": "position_sigma_up_m",
    "vn": "velocity_north_mps",
    "ve": "velocity_east_mps",
    "vu": "velocity_up_mps",
    "sdvn": "velocity_sigma_north_mps",
    "sdve": "velocity_sigma_east_mps",
    "sdvu": "velocity_sigma_up_mps",
}
_UNSUPPORTED: Final = {
    "e-baseline": "baselines between two receivers (e/n/u)",
    "x-ecef": "earth-centred coordinates (x/y/z)",
    "latitude(d'\")": "degrees, minutes and seconds",
}


def looks_like_rtklib(head: bytes) -> bool:
    """Return True if a file begins with the header or a row of a solution."""
    return _SOLUTION_START.search(head) is not None


def _read(path: Path) -> Content:
    lines = decode_text(path.read_bytes()).splitlines()
    scale, names = _find_header(lines)
    rows = list(_read_rows(lines, names))
    if not rows:
        raise LogError("the file holds no fix, expected rows of a solution")
    times = _parse_times([row[:2] for row in rows])
    values = np.array([row[2] for row in rows], dtype=np.float64)
    known = [
        (i, _COLUMN_NAMES[name])
        for i, name in enumerate(map(_strip_unit, names))
        if name in _COLUMN_NAMES
    ]
    columns: list[Column] = [times, *(values[:, i] for i, _ in known)]
    return Content.of(
        Table(
            width=len(columns),
            load=lambda wanted: [columns[i] for i in wanted],
            names=(f"time_{scale}", *(name for _, name in known)),
            meta=Metadata(notes=tuple(_list_notes(lines, scale))),
            time=0,
        )
    )


FORMAT: Final = Format("rtklib", "a solution of RTKLIB", (".pos",), (), _read)


def _strip_unit(name: str) -> str:
    return name.partition("(")[0].lower()


def _find_header(lines: Sequence[str]) -> tuple[str, tuple[str, ...]]:
    """Return the time scale, and the names of the columns after the time."""
    for line in lines:
        match = _HEADER.match(line)
        if match is None:
            continue
        names = tuple(match[2].replace(",", " ").split())
        first = names[0].partition("(m)")[0] if names else ""
        if first in _UNSUPPORTED:
            raise LogError(
                f"the solution is in {_UNSUPPORTED[first]}, expected latitude, longitude "
                "and height "
                "in degrees and metres: set out-solformat=llh and out-degform=deg"
            )
        if first != "latitude(deg)":
            raise LogError(f"the header '{line[:60]}' does not begin with a latitude")
        return {"GPST": "gps", "UTC": "utc", "JST": "jst"}[match[1]], names
    return "gps", _STANDARD_COLUMNS


def _read_rows(
    lines: Sequence[str], names: Sequence[str]
) -> Iterator[tuple[str, str, list[float]]]:
    """Yield the two cells of the time, and the numbers after them."""
    width = 0
    for number, line in enumerate(lines, start=1):
        if not line.strip() or line.startswith(("%", "#")):
            continue
        cells = re.split(r"\s*,\s*|\s+", line.strip())
        width = width or len(cells)
        if len(cells) != width or len(cells) < 5:
            # The last line is incomplete if RTKLIB is still running or was killed.
            if number == len(lines) and width:
                return
            raise LogError(f"line {number} has {len(cells)} cells, expected {max(width, 5)}")
        try:
            values = [float(cell) for cell in cells[2:]]
        except ValueError:
            raise LogError(f"line {number} holds a cell that is no number") from None
        values = values[: len(names)]
        yield cells[0], cells[1], values + [math.nan] * (len(names) - len(values))


def _parse_times(rows: Sequence[tuple[str, ...]]) -> Column:
    """Return dates to the nanosecond, from dates or from GPS weeks and seconds."""
    if _DATE.match(rows[0][0]):
        date_times = parse_dates([f"{day.replace('/', '-')}T{clock}" for day, clock in rows])
        if date_times is None:
            raise LogError("a time is no date such as 2024/05/01 12:00:00.000")
        return date_times
    try:
        counts = [
            1_000_000_000 * (_WEEK_S * int(week) + 86_400 * _GPS_EPOCH_DAYS)
            + round(1e9 * float(seconds))
            for week, seconds in rows
        ]
    except ValueError:
        raise LogError("a time is neither a date nor a week of GPS and its seconds") from None
    return np.array(counts, dtype=np.int64).view("datetime64[ns]")


def _list_notes(lines: Sequence[str], scale: str) -> Iterator[str]:
    head = [line for line in lines if line.startswith("%")]
    if not any(_HEADER.match(line) for line in head):
        yield "there is no header: the columns are assumed to be RTKLIB's default, in GPS time"
    if any("/geodetic" in line for line in head):
        yield "heights are above the geoid, as RTKLIB was set to write them"
    if scale == "gps":
        yield "times are of GPS, which is ahead of UTC by the leap seconds"
