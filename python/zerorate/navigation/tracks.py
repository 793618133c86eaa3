"""Tracks as files for maps: GeoJSON and GPX."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from html import escape
from itertools import repeat
from typing import Any, Final, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.geometry.earth import wrap_degrees
from zerorate.record.atomic import atomic_path
from zerorate.record.runs import runs
from zerorate.texts import escape_line
from zerorate.types import Floats


class TrackLike(Protocol):
    """Object with times, s, shape (n,), and positions, deg, deg and m, shape (n, 3)."""

    @property
    def time(self) -> Floats:
        """Times, s, shape (n,)."""

    @property
    def position(self) -> Floats:
        """Latitude, deg, longitude, deg, and height, m, shape (n, 3)."""


_GPX_HEAD: Final = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<gpx version="1.1" creator="zerorate" xmlns="http://www.topografix.com/GPX/1/1">\n'
)

_FEATURE: Final = '{"type": "FeatureCollection", "features": [{"type": "Feature", '
_PIECE_ROWS: Final = 1 << 16
"""Number of rows that are formatted at once."""

_Values: TypeAlias = Floats | npt.NDArray[np.datetime64]
_Column: TypeAlias = tuple[str, _Values, str]
"""Text before a row's value, the values of all rows, and the text after the value."""


def write_geojson(
    path: str | os.PathLike[str],
    track: TrackLike,
    *,
    epoch: float | None = None,
    name: str | None = None,
    force: bool = False,
) -> None:
    """Write a track as GeoJSON: one feature, a LineString or a MultiLineString.

    Parameters
    ----------
    path
        File to write.
    track
        `Fixes`, or any object with ``time`` (s, shape (n,)) and ``position`` (latitude and
        longitude in deg, height in m, shape (n, 3)). A row without a position (NaN) ends a line.
        Heights may be missing.
    epoch : float, optional
        Unix time at which the track's time is zero. Default: ``track.epoch``, if any.
    name : str, optional
        Name of the track. Default: ``track.source``, or else "track".
    force : bool
        True replaces an existing file. Default False.

    Raises
    ------
    ValueError
        If the arrays differ in length, or no row has a position.
    TypeError
        If the track has no times or positions.
    OSError
        If the file exists and ``force`` is False, or the file cannot be written. No partial file
        remains.

    Notes
    -----
    The coordinates are longitude, latitude and height above the ellipsoid (RFC 7946, section
    3.1.1). A line across the meridian of 180 deg is cut in two (section 3.1.9). If there is an
    epoch, the property ``coordTimes`` has the time of each position. Its nesting is the same as in
    the coordinates.

    Examples
    --------
    >>> import json, tempfile
    >>> from pathlib import Path
    >>> import zerorate as zr
    >>> path = Path(tempfile.mkdtemp()) / "track.geojson"
    >>> fixes = zr.Fixes([0.0, 1.0], [[0.0, 179.5, 10.0], [1.0, -179.5, 20.0]])
    >>> zr.navigation.write_geojson(path, fixes)
    >>> whole = json.loads(path.read_text(), parse_int=float)
    >>> whole["features"][0]["geometry"]["coordinates"]
    [[[179.5, 0.0, 10.0], [180.0, 0.5, 15.0]], [[-180.0, 0.5, 15.0], [-179.5, 1.0, 20.0]]]
    """
    rows = _check_track(track, epoch, name)
    lines = [part for line in rows.lines() for part in _split_at_antimeridian(line)]
    kind = "MultiLineString" if len(lines) > 1 else "LineString"
    properties = f'"name": {json.dumps(rows.name)}'
    with atomic_path(path, force) as temporary, temporary.open("w", encoding="utf-8") as file:
        file.write(f'{_FEATURE}"properties": {{{properties}')
        if rows.epoch is not None:
            file.write(', "coordTimes": ')
            file.writelines(_nest_json(lines, partial(_json_times, epoch=rows.epoch)))
        file.write(f'}}, "geometry": {{"type": "{kind}", "coordinates": ')
        file.writelines(_nest_json(lines, _json_coordinates))
        file.write("}}]}\n")


def write_gpx(
    path: str | os.PathLike[str],
    track: TrackLike,
    *,
    epoch: float | None = None,
    name: str | None = None,
    force: bool = False,
) -> None:
    """Write a track as GPX 1.1: one track, with one segment for each unbroken part.

    The parameters and errors are the same as in `write_geojson`. ``<time>``, UTC to the
    millisecond, is written only if there is an epoch. ``<ele>`` is the track's height above the
    ellipsoid. GPX does not define the reference of a height.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import zerorate as zr
    >>> path = Path(tempfile.mkdtemp()) / "track.gpx"
    >>> zr.navigation.write_gpx(path, zr.Fixes([0.0], [[45.5, 7.5, 10.5]], epoch=1.7e9))
    >>> print(path.read_text().splitlines()[4])
    <trkpt lat="45.5" lon="7.5"><ele>10.5</ele><time>2023-11-14T22:13:20.000Z</time></trkpt>
    """
    rows = _check_track(track, epoch, name)
    with atomic_path(path, force) as temporary, temporary.open("w", encoding="utf-8") as file:
        file.write(f"{_GPX_HEAD}<trk><name>{escape(rows.name)}</name>\n")
        for line in rows.lines():
            file.write("<trkseg>\n")
            file.writelines(_gpx_points(part, rows.epoch) for part in _split_pieces(line))
            file.write("</trkseg>\n")
        file.write("</trk></gpx>\n")


@dataclass(frozen=True)
class _TrackRows:
    """Time, latitude, longitude and height, shape (n, 4), with name and source."""

    rows: Floats
    epoch: float | None
    name: str

    def lines(self) -> Iterator[Floats]:
        """Yield the lines: parts of the track without a missing position."""
        present = np.isfinite(self.rows[:, 1:3]).all(axis=1)
        for first, last in runs(np.asarray(present)):
            yield self.rows[first:last]


def _check_track(track: TrackLike, epoch: float | None, name: str | None) -> _TrackRows:
    try:
        time = np.asarray(track.time, dtype=np.float64)
        position = np.asarray(track.position, dtype=np.float64)
    except AttributeError:
        kind = type(track).__name__
        raise TypeError(f"a track must have time and position, {kind} has not") from None
    if time.ndim != 1 or position.shape != (time.size, 3):
        raise ValueError(
            f"time and position must be of shapes (n,) and (n, 3), got {time.shape} and "
            f"{position.shape}"
        )
    present = np.isfinite(position[:, :2]).all(axis=1)
    if not present.any():
        raise ValueError("no row of the track has a latitude and longitude")
    if (np.abs(position[present, 0]) > 90.0).any():
        raise ArgumentError("latitudes", "must be within 90 deg: are they in rad or scaled?")
    if epoch is None:
        epoch = getattr(track, "epoch", None)
    if epoch is not None and not (math.isfinite(epoch) and np.isfinite(time).all()):
        raise ArgumentError(
            "times", "must be finite where the epoch is known, and so must the epoch"
        )
    rows = np.column_stack([time, position[:, 0], wrap_degrees(position[:, 1]), position[:, 2]])
    return _TrackRows(rows, epoch, escape_line(name or str(getattr(track, "source", "track"))))


def _split_at_antimeridian(line: Floats) -> Iterator[Floats]:
    """Yield the parts of a line on each side of the meridian of 180 deg, with two rows or more."""
    begin, first = line[:0], 0
    for last in np.flatnonzero(np.abs(np.diff(line[:, 2])) > 180.0).tolist():
        before, row = line[last], line[last + 1]
        side = math.copysign(180.0, before[2])
        onward = wrap_degrees(row[2] - before[2])
        share = (side - before[2]) / onward if onward else 0.0
        meeting = before + share * (row - before)
        yield np.vstack((begin, line[first : last + 1], _with_longitude(meeting, side)))
        begin, first = _with_longitude(meeting, -side)[np.newaxis], last + 1
    part = np.concatenate((begin, line[first:]))
    # A line in GeoJSON needs two positions.
    yield part if len(part) > 1 else np.repeat(part, 2, axis=0)


def _with_longitude(row: Floats, longitude: float) -> Floats:
    row_copy = row.copy()
    row_copy[2] = longitude
    return row_copy


def _split_pieces(line: Floats) -> Iterator[Floats]:
    """Yield parts of a line that are small enough for memory and for one Arrow array."""
    for first in range(0, len(line), _PIECE_ROWS):
        yield line[first : first + _PIECE_ROWS]


def _nest_json(lines: Sequence[Floats], text: Callable[[Floats], str]) -> Iterator[str]:
    """Yield the text of a JSON list with one list per line; a single line gives one flat list.

    `text` returns the text of some rows, with ", " before each row.
    """
    many = len(lines) > 1
    for i, line in enumerate(lines):
        yield ", [" if i else "[[" if many else "["
        for k, piece in enumerate(_split_pieces(line)):
            yield text(piece) if k else text(piece)[2:]
        yield "]"
    yield "]" if many else ""


def _json_coordinates(rows: Floats) -> str:
    _, latitude, longitude, height = rows.T
    return _join_columns((", [", longitude, ""), (", ", latitude, ""), (", ", height, ""), "]")


def _json_times(rows: Floats, epoch: float) -> str:
    return _join_columns((', "', _utc_dates(rows[:, 0], epoch), 'Z"'))


def _gpx_points(rows: Floats, epoch: float | None) -> str:
    time, latitude, longitude, height = rows.T
    # GPX does not allow the longitude 180.
    east = np.where(longitude == 180.0, -180.0, longitude)
    columns: list[_Column | str] = [
        ('<trkpt lat="', latitude, '" lon="'),
        ("", east, '">'),
        ("<ele>", height, "</ele>"),
    ]
    if epoch is not None:
        columns.append(("<time>", _utc_dates(time, epoch), "Z</time>"))
    return _join_columns(*columns, "</trkpt>\n")


def _join_columns(*columns: _Column | str) -> str:
    """Return the concatenated text of all rows. NaN gives no text."""
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        texts = [
            repeat(column) if isinstance(column, str) else _format_values(*column)
            for column in columns
        ]
        return "".join(map("".join, zip(*texts, strict=False)))
    from pyarrow.compute import binary_join_element_wise

    parts: list[Any] = [
        _constant(column) if isinstance(column, str) else _format_arrow(*column)
        for column in columns
    ]
    whole: Any = binary_join_element_wise(*parts, _constant(""))
    return str(memoryview(whole.buffers()[2]), "utf-8")


def _format_values(before: str, values: _Values, after: str) -> list[str]:
    if values.dtype.kind == "M":
        dates: Any = values
        return [f"{before}{x}{after}" for x in np.datetime_as_string(dates).tolist()]
    return [f"{before}{x}{after}" if math.isfinite(x) else "" for x in values.tolist()]


def _format_arrow(before: str, values: _Values, after: str) -> Any:  # noqa: ANN401
    """Return the formatted values as an Arrow array. Buffers avoid the need for pandas."""
    import pyarrow as pa
    import pyarrow.compute as pc

    dates = values.dtype.kind == "M"
    kind: Any = pa.timestamp("ms") if dates else pa.float64()
    raw: Any = np.ascontiguousarray(values).view(np.int64)
    numbers: Any = pa.Array.from_buffers(kind, len(values), [None, pa.py_buffer(raw)])
    texts = numbers.cast(pa.string())
    if dates:
        texts = pc.replace_substring(texts, " ", "T")
    nothing = _constant("")
    parts: list[Any] = [_constant(before), texts, _constant(after), nothing]
    each: Any = pc.binary_join_element_wise(*parts)
    return each if dates else pc.if_else(pc.is_finite(numbers), each, nothing)


def _constant(text: str) -> Any:  # noqa: ANN401
    import pyarrow as pa

    letters = text.encode()
    ends: Any = np.array([0, len(letters)], np.int32)
    buffers = [None, pa.py_buffer(ends), pa.py_buffer(letters)]
    return pa.Array.from_buffers(pa.string(), 1, buffers)[0]


def _utc_dates(time: Floats, epoch: float) -> npt.NDArray[np.datetime64]:
    """Return the times as text in UTC, to the millisecond."""
    return np.rint(1e3 * (time + epoch)).astype(np.int64).view("datetime64[ms]")
