"""Tracks as files for maps: GeoJSON and GPX."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from typing import Any, Final, Protocol

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.geometry.earth import wrapped
from zerorate.io.atomic import atomic_path
from zerorate.texts import one_line
from zerorate.types import Floats


class Track(Protocol):
    """What has times, s, shape (n,), and positions, deg, deg and m, shape (n, 3)."""

    @property
    def time(self) -> Floats:
        """Seconds, shape (n,)."""

    @property
    def position(self) -> Floats:
        """Latitude deg, longitude deg, height m, shape (n, 3)."""


_GPX_HEAD: Final = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<gpx version="1.1" creator="zerorate" xmlns="http://www.topografix.com/GPX/1/1">\n'
)


def write_geojson(
    path: str | os.PathLike[str],
    track: Track,
    *,
    epoch: float | None = None,
    name: str | None = None,
    force: bool = False,
) -> None:
    """Write a track as GeoJSON: one feature, a LineString or a MultiLineString.

    Parameters
    ----------
    path
        The file to write.
    track
        `Fixes`, or whatever has ``time`` (n,) and ``position`` (n, 3) in deg, deg and m. Rows
        without a place (NaN) divide it into lines; a height may be missing.
    epoch : float, optional
        Unix time, UTC, at which the track's time is zero. Default: ``track.epoch``, if it has one.
    name : str, optional
        Of the track; default ``track.source``, else "track".
    force : bool
        Whether an existing file may be replaced; default no.

    Raises
    ------
    ValueError
        If the arrays do not go together, or no row has a place.
    TypeError
        If the track has no times or positions.
    OSError
        If the file exists (without ``force``) or cannot be written. Nothing is left half-written.

    Notes
    -----
    As RFC 7946 has it: longitude, latitude, height above the ellipsoid (section 3.1.1), and a line
    that crosses the meridian of 180 deg is cut there in two (3.1.9). With an epoch the property
    ``coordTimes`` holds the time of each position, in the structure of the coordinates.

    Examples
    --------
    >>> import json, tempfile
    >>> from pathlib import Path
    >>> import zerorate as zr
    >>> path = Path(tempfile.mkdtemp()) / "track.geojson"
    >>> fixes = zr.Fixes([0.0, 1.0], [[0.0, 179.5, 10.0], [1.0, -179.5, 20.0]])
    >>> zr.navigation.write_geojson(path, fixes)
    >>> json.loads(path.read_text())["features"][0]["geometry"]["coordinates"]
    [[[179.5, 0.0, 10.0], [180.0, 0.5, 15.0]], [[-180.0, 0.5, 15.0], [-179.5, 1.0, 20.0]]]
    """
    rows = _checked(track, epoch, name)
    lines = [part for line in rows.lines() for part in _cut(line)]
    coordinates: list[Any] = [[_coordinates(row) for row in line] for line in lines]
    properties: dict[str, Any] = {"name": rows.name}
    if rows.epoch is not None:
        times: list[Any] = [_dates(line[:, 0], rows.epoch) for line in lines]
        properties["coordTimes"] = times if len(lines) > 1 else times[0]
    kind = "MultiLineString" if len(lines) > 1 else "LineString"
    geometry = {"type": kind, "coordinates": coordinates if len(lines) > 1 else coordinates[0]}
    feature = {"type": "Feature", "properties": properties, "geometry": geometry}
    text = json.dumps({"type": "FeatureCollection", "features": [feature]}, allow_nan=False)
    with atomic_path(path, force) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def write_gpx(
    path: str | os.PathLike[str],
    track: Track,
    *,
    epoch: float | None = None,
    name: str | None = None,
    force: bool = False,
) -> None:
    """Write a track as GPX 1.1: one track, a segment a line.

    Parameters and errors are those of `write_geojson`. ``<time>`` stands there only with an epoch,
    in UTC to the millisecond. ``<ele>`` is the height above the ellipsoid, as in the track; GPX
    itself says only that it is in metres.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import zerorate as zr
    >>> path = Path(tempfile.mkdtemp()) / "track.gpx"
    >>> zr.navigation.write_gpx(path, zr.Fixes([0.0], [[45.0, 7.0, 10.0]], epoch=1.7e9))
    >>> print(path.read_text().splitlines()[4])
    <trkpt lat="45.0" lon="7.0"><ele>10.0</ele><time>2023-11-14T22:13:20.000Z</time></trkpt>
    """
    rows = _checked(track, epoch, name)
    with atomic_path(path, force) as temporary, temporary.open("w", encoding="utf-8") as file:
        file.write(f"{_GPX_HEAD}<trk><name>{escape(rows.name)}</name>\n")
        for line in rows.lines():
            file.write("<trkseg>\n")
            file.writelines(_points(line, rows.epoch))
            file.write("</trkseg>\n")
        file.write("</trk></gpx>\n")


@dataclass(frozen=True)
class _Rows:
    """Time, latitude, longitude and height, shape (n, 4), and what is told of them."""

    rows: Floats
    epoch: float | None
    name: str

    def lines(self) -> Iterator[Floats]:
        """Yield the rows between those without a place."""
        there = np.isfinite(self.rows[:, 1:3]).all(axis=1)
        ends = np.flatnonzero(np.diff(there, prepend=False, append=False))
        for first, last in ends.reshape(-1, 2):
            yield self.rows[first:last]


def _checked(track: Track, epoch: float | None, name: str | None) -> _Rows:
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
    there = np.isfinite(position[:, :2]).all(axis=1)
    if not there.any():
        raise ValueError("no row of the track has a latitude and longitude")
    if (np.abs(position[there, 0]) > 90.0).any():
        raise ArgumentError("latitudes", "must be within 90 deg: are they in rad or scaled?")
    if epoch is None:
        epoch = getattr(track, "epoch", None)
    if epoch is not None and not (math.isfinite(epoch) and np.isfinite(time).all()):
        raise ArgumentError(
            "times", "must be finite where the epoch is known, and so must the epoch"
        )
    rows = np.column_stack([time, position[:, 0], wrapped(position[:, 1]), position[:, 2]])
    return _Rows(rows, epoch, one_line(name or str(getattr(track, "source", "track"))))


def _cut(line: Floats) -> Iterator[Floats]:
    """Yield the parts of a line on either side of the meridian of 180 deg, of two rows or more."""
    part = [line[0]]
    for before, row in pairwise(line):
        if abs(row[2] - before[2]) > 180.0:
            side = math.copysign(180.0, before[2])
            onward = wrapped(row[2] - before[2])
            share = (side - before[2]) / onward if onward else 0.0
            meeting = before + share * (row - before)
            yield np.array([*part, _at(meeting, side)])
            part = [_at(meeting, -side)]
        part.append(row)
    # A line of GeoJSON has two positions or more.
    yield np.array(part if len(part) > 1 else 2 * part)


def _at(row: Floats, longitude: float) -> Floats:
    moved = row.copy()
    moved[2] = longitude
    return moved


def _coordinates(row: Floats) -> list[float]:
    _, latitude, longitude, height = row.tolist()
    return [longitude, latitude, height] if math.isfinite(height) else [longitude, latitude]


def _points(line: Floats, epoch: float | None) -> Iterator[str]:
    times = [None] * len(line) if epoch is None else _dates(line[:, 0], epoch)
    for (_, latitude, longitude, height), time in zip(line.tolist(), times, strict=True):
        # GPX has no longitude of 180.
        east = -180.0 if longitude == 180.0 else longitude
        inside = f"<ele>{height!r}</ele>" if math.isfinite(height) else ""
        inside += f"<time>{time}</time>" if time is not None else ""
        yield f'<trkpt lat="{latitude!r}" lon="{east!r}">{inside}</trkpt>\n'


def _dates(time: npt.NDArray[np.float64], epoch: float) -> list[str]:
    """Return times in UTC, to the millisecond."""
    counts = np.rint(1e3 * (time + epoch)).astype(np.int64).view("datetime64[ms]")
    return [f"{text}Z" for text in np.datetime_as_string(counts, unit="ms").tolist()]
