"""Reading of fixes from receivers' files and from tables, by the columns' names."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal, get_args

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.io.clocks.names import find_time_unit
from zerorate.io.clocks.stamps import convert_texts, to_seconds
from zerorate.io.clocks.units import DATE_RANGE_S, PER_SECOND
from zerorate.io.columns import Timing
from zerorate.io.damage import read_guarded
from zerorate.io.formats import (
    FORMATS,
    TEXT,
    LogSource,
    check_readable,
    find_binary_format,
    label_of,
    open_source,
)
from zerorate.io.readers import navsatfix, nmea, rtklib
from zerorate.io.remote import is_address
from zerorate.io.signatures import is_dataflash_text
from zerorate.io.table import Column, Content, Format, Table, to_numbers
from zerorate.io.timecolumns import time_of, with_clock
from zerorate.record.clock import count_noun
from zerorate.record.fixes import Fixes
from zerorate.record.log import LogError
from zerorate.record.names import to_snake_case
from zerorate.types import Booleans, Floats, Integers

FixFormat = Literal["nmea", "rtklib", "navsatfix", "table"]

_HEAD_BYTES: Final = 1 << 16
_MAX_FIX_STEP_S: Final = 60.0
"""Longest step between fixes, s; a longer step means another unit of time."""
_EARTH_M: Final = 6_371_000.0
_MAX_DISORDER_PART: Final = 0.1
"""Largest share of rows that are not later than the row before."""
_LEAP_SECOND_DAYS: Final = np.array(
    [
        "1981-07-01", "1982-07-01", "1983-07-01", "1985-07-01", "1988-01-01", "1990-01-01",
        "1991-01-01", "1992-07-01", "1993-07-01", "1994-07-01", "1996-01-01", "1997-07-01",
        "1999-01-01", "2006-01-01", "2009-01-01", "2012-07-01", "2015-07-01", "2017-01-01",
    ],
    dtype="datetime64[s]",
)  # fmt: skip
"""Days that follow a leap second since the start of GPS time."""

_DIRECTION_PATTERNS: Final = {"north": "north|n", "east": "east|e", "down": "down|d", "up": "up|u"}
_OTHER_SOURCES: Final = (
    r"(?:truth|true|ground_?truth|gt|ref|reference|base|home|origin|target|setpoint|waypoint)"
)
_NAME_START: Final = (
    rf"^(?!.*(?:sigma|std|cov|bias|(?:^|_)sd))(?!(?:.*_)?{_OTHER_SOURCES}_)(?:.*_)?"
)
"""Beginning of a quantity's name; it excludes names of standard deviations."""


def _quantity(words: str, units: str = "") -> re.Pattern[str]:
    """Return a pattern for names of a quantity, optionally with a unit at the end."""
    return re.compile(rf"{_NAME_START}(?:{words})(?:_(?:{units}))?$")


_ANGLE: Final = r"(?:_?(?:deg|degrees|rad|°|1e7|e7|wgs84))*$"
_LATITUDE: Final = re.compile(_NAME_START + r"lat(itude)?" + _ANGLE)
_LONGITUDE: Final = re.compile(_NAME_START + r"(lon|lng|long|longitude)" + _ANGLE)
_COORDINATE_END: Final = re.compile(r"_?(lat|lon|lng)[a-z]*" + _ANGLE)
_HEIGHT: Final = _quantity(
    "(?:height|altitude|alt|hgt|elevation|h_msl)(?:_(?:ellipsoid(?:al)?|hae|msl))?", "m|mm"
)
_VELOCITY: Final = _NAME_START + r"(velocity|vel|v)_?({way})(_(mps|m_s))?$"
_SPEED: Final = _quantity(
    "(?:g_|ground_?)?(?:speed|velocity|sog)",
    "(?P<unit>m_s|mps|km_h|kmh|kmph|kph|knots?|kn|kt|mph)",
)
_COURSE: Final = re.compile(
    _NAME_START
    + r"(?:(?:course|heading|bearing|cog|direction|head_mot)|(?:gps|location)_orientation)"
    r"(?:_(?:deg|degrees|°|true|over_ground))*$"
)
_PER_MPS: Final = {
    "km": 3.6,
    "kp": 3.6,
    "kn": 3600 / 1852,
    "kt": 3600 / 1852,
    "mph": 3600 / 1609.344,
}
"""Beginnings of units of speed, and their number per m/s."""
_ACCURACY: Final = {
    "horizontal": _quantity("(?:horizontal|h|position)_?acc(?:uracy)?|accuracy", "m|mm"),
    "vertical": _quantity("(?:vertical|v|altitude)_?acc(?:uracy)?", "m|mm"),
    "speed": _quantity("(?:s|speed|velocity)_?acc(?:uracy)?", "mps|m_s"),
}
_FULL_CIRCLE: Final = 360.0
_WHOLE_DEG: Final = 1e7
"""Counts per degree of receivers that send integers; their lengths are in mm."""
_FOREIGN_VELOCITY: Final = re.compile(
    _NAME_START + r"(velocity|vel|v)_?(north|east|down|up|n|e|d|u)_(?!mps$|m_s$)\w+$"
)
_SIGMA_WORD: Final = r"(sigma|std|sd)"
_POSITION_SIGMA: Final = (
    rf"(?<!velocity)(?<!vel)(^|_)((position|pos)_{_SIGMA_WORD}|{_SIGMA_WORD}(_?(position|pos))?)"
)
_VELOCITY_SIGMA: Final = rf"(^|_)((velocity|vel|v)_{_SIGMA_WORD}|{_SIGMA_WORD}_?(velocity|vel|v))"
_METRES, _SPEEDS = r"(_m)?$", r"(_(mps|m_s))?$"
_VARIANCE: Final = r"(^|_)position_covariance_?{index}$"
_COVARIANCE_TYPE: Final = re.compile(r"(^|_)position_covariance_type$")
_STATUS: Final = re.compile(r"(^|_)status_status$")
_QUALITY: Final = re.compile(r"^(fix|q|(fix_)?quality|fix_type|(field_)?status(_status)?)$")
_SATELLITES: Final = re.compile(
    r"(^|_)(satellites(_used)?|(num|n)_?(sats?|sv|satellites)|ns|sats)$"
)
_HEADER_STAMP: Final = re.compile(r"(^|_)header_stamp$")


def read_fixes(
    source: LogSource, format: FixFormat | None = None, *, topic: str | None = None
) -> Fixes:
    """Return the fixes of a receiver from a file or an object.

    Parameters
    ----------
    source
        File or object with fixes:

        - NMEA sentences (GGA, RMC, GST, VTG, ZDA); needs the extra ``nmea``
        - a solution of RTKLIB (``.pos``)
        - ROS messages of type NavSatFix, as JSON or CSV
        - a table in any format or object that `read_recording` reads, for example a PX4 ULog

        A table has columns such as ``time_s``, ``latitude_deg``, ``longitude_deg``, ``height_m``.
        ``docs/how-to/fixes.md`` lists them.
    format : {"nmea", "rtklib", "navsatfix", "table"}, optional
        Format of the file. Default: found from its content; the suffix does not matter.
    topic : str, optional
        Topic of a PX4 log. Default: the first topic with a latitude.

    Returns
    -------
    Fixes
        Fixes in order of time, in deg, m and m/s. Rows are left out if they have no position, or if
        the time does not increase. ``notes`` states the number of these rows, and assumptions.
        Times are on the file's own clock: Unix time if the file has dates, GPS time in some
        solutions of RTKLIB. ``epoch`` converts the times to UTC.

    Raises
    ------
    LogError
        If there is no fix, or the content is unexpected. The message names the file and the
        position.
    ValueError
        If the format is unknown.
    OSError
        If the file is missing or cannot be read.
    ImportError
        If the format needs a package that is not installed; the message names the extra.

    Notes
    -----
    Heights are above the ellipsoid. NMEA states the height above mean sea level and the geoid's
    height; their sum is used. If the geoid's height is missing, ``notes`` says so.

    Examples
    --------
    >>> import zerorate as zr
    >>> rows = {"time_s": [0.0, 0.2], "lat": [45.0, 45.00001], "lon": [7.0, 7.0], "alt": [9.0, 9.1]}
    >>> fixes = zr.read_fixes(rows)
    >>> fixes, fixes.position[1]
    (Fixes(2 in 0.2 s, positions), array([45.00001,  7.     ,  9.1    ]))
    """
    if format is not None and format not in get_args(FixFormat):
        known = ", ".join(repr(name) for name in get_args(FixFormat))
        raise ArgumentError("format", f"must be one of {known}, got {format!r}")
    label = label_of(source)
    try:
        return _make_fixes(_choose_table(_read_content(source, format), topic), label)
    except LogError as error:
        raise error.with_context(f"{label}: ") from None


def find_fixes(source: LogSource, timing: Timing, content: Content | None = None) -> Fixes | None:
    """Return the fixes in a source of sensors; None without positions; errors as in `read_fixes`.

    `content` is the content of an open source; without it, the file is opened again.
    """
    label = label_of(source)
    try:
        content = _read_content(source, None) if content is None else content
        if _find_fix_table(content.tables.values()) is None:
            return None
        table = _find_fix_table(timing.apply_to_all([*content.tables.values()]))
        assert table is not None
        return _make_fixes(table, label)
    except LogError as error:
        raise error.with_context(f"{label}: ") from None


RECEIVERS: Final[Mapping[str, Format]] = {
    form.kind: form for form in (nmea.FORMAT, rtklib.FORMAT, navsatfix.FORMAT)
}


def _read_content(source: LogSource, format: FixFormat | None) -> Content:
    if not isinstance(source, (str, os.PathLike)) or is_address(source):
        return open_source(source)[1]
    file = Path(source)
    check_readable(file)
    form = _find_format(file, format)
    return open_source(source)[1] if form is None else read_guarded(form, file)


def _find_format(file: Path, format: FixFormat | None) -> Format | None:
    """Return the format of a text file; None if the suffix determines the format."""
    if file.is_dir():
        return None
    with file.open("rb") as opened_file:
        head = opened_file.read(_HEAD_BYTES)
    if not head:
        raise LogError("the file is empty, expected fixes")
    if format in ("nmea", "rtklib"):
        return RECEIVERS[format]
    if find_binary_format(head) is not None or is_dataflash_text(head):
        return None
    suffix = file.suffix.lower()
    table_format = None if any(suffix in form.suffixes for form in FORMATS) else TEXT
    if format == "table":
        return table_format
    if navsatfix.looks_like_json(head):
        return navsatfix.FORMAT
    if format == "navsatfix":
        return table_format
    if nmea.looks_like_nmea(head):
        return nmea.FORMAT
    if rtklib.looks_like_rtklib(head):
        return rtklib.FORMAT
    return next((form for form in RECEIVERS.values() if suffix in form.suffixes), table_format)


def _choose_table(content: Content, topic: str | None) -> Table:
    """Return the table of the requested topic, or the first table with positions."""
    if topic is not None:
        return content.choose_table(topic)
    tables = content.tables.values()
    table = _find_fix_table(tables)
    if table is None:
        names = [table.label(i) for table in tables for i in range(table.width)]
        shown = ", ".join(names[:40]) or "none"
        raise LogError(f"no column is a latitude, such as latitude_deg; the columns are: {shown}")
    return table


def _find_fix_table(tables: Iterable[Table]) -> Table | None:
    return next((table for table in tables if _find_column(table, _LATITUDE) is not None), None)


def _find_column(table: Table, wanted: re.Pattern[str]) -> int | None:
    names = table.names or ()
    return next((i for i, name in enumerate(names) if wanted.search(to_snake_case(name))), None)


@dataclass
class _FixColumns:
    """Columns of a table by the meaning of their names, with notes."""

    table: Table
    notes: list[str] = field(default_factory=list)
    whole: bool = False

    def numbers(self, wanted: re.Pattern[str]) -> Floats | None:
        """Return the column with a matching name; None if there is none."""
        index = _find_column(self.table, wanted)
        return None if index is None else self.load_numbers(index)

    def load_numbers(self, index: int) -> Floats:
        (column,) = self.table.load([index])
        return np.asarray(to_numbers(column, self.table.label(index)), dtype=np.float64)

    def load_coordinates(self) -> list[Floats]:
        """Return latitude and longitude, deg: the first two columns with the same prefix."""
        latitudes = self._columns_by_prefix(_LATITUDE, "latitude")
        longitudes = self._columns_by_prefix(_LONGITUDE, "longitude")
        pairs = [(i, j) for p, i in latitudes.items() for q, j in longitudes.items() if p == q]
        if not pairs:
            label = self.table.label(next(iter(latitudes.values())))
            others = ", ".join(map(self.table.label, longitudes.values()))
            raise LogError(f"no longitude belongs to '{label}': there is {others}")
        return [self._load_degrees(index) for index in pairs[0]]

    def _columns_by_prefix(self, wanted: re.Pattern[str], what: str) -> dict[str, int]:
        """Return the columns with a matching name, by prefix."""
        columns: dict[str, int] = {}
        for index, name in enumerate(map(to_snake_case, self.table.names or ())):
            if wanted.search(name):
                columns.setdefault(_COORDINATE_END.sub("", name), index)
        if not columns:
            raise LogError(f"no column is a {what}, such as {what}_deg")
        return columns

    def _load_degrees(self, index: int) -> Floats:
        values, label = self.load_numbers(index), self.table.label(index)
        named = to_snake_case(label).endswith("e7")
        has_unit = to_snake_case(label).endswith(("_deg", "_degrees", "_rad"))
        if named or (not has_unit and np.nanmax(np.abs(values), initial=0.0) > _FULL_CIRCLE):
            self.whole = True
            why = "as its name says" if named else "as whole numbers of that size are"
            self.notes.append(f"'{label}' is read in 1e-7 deg, {why}")
            return values / _WHOLE_DEG
        return np.degrees(values) if to_snake_case(label).endswith("_rad") else values

    def lengths(self, wanted: re.Pattern[str], scale: float = 1e3) -> Floats | None:
        """Return a column in m or m/s; its integers can be mm, by name or by coordinates."""
        index = _find_column(self.table, wanted)
        if index is None:
            return None
        values, name = self.load_numbers(index), to_snake_case(self.table.label(index))
        known = values[np.isfinite(values)]
        metric = name.endswith(("_m", "_mps", "_m_s"))
        if name.endswith("_mm") or (self.whole and not metric and (known == np.rint(known)).all()):
            self.notes.append(f"'{self.table.label(index)}' is read in 1/{scale:g} m")
            return values / scale
        return values

    def over_ground(self) -> Floats | None:
        """Return velocities from speed and course; NaN where one of them is missing."""
        speed, course = _find_column(self.table, _SPEED), self.numbers(_COURSE)
        if speed is None or course is None:
            return None
        label = self.table.label(speed)
        match = _SPEED.search(to_snake_case(label))
        unit = (match and match["unit"]) or ""
        per = next((per for start, per in _PER_MPS.items() if unit.startswith(start)), 1.0)
        values = self.load_numbers(speed) / per
        if not np.isfinite(values * course).any():
            return None
        self.notes.append(
            f"velocities are those of '{label}', read in {unit or 'm/s'}, and the course"
        )
        values = np.where((values < 0.0) | (course < 0.0), np.nan, values)
        angle = np.radians(course)
        return np.column_stack([values * np.cos(angle), values * np.sin(angle), values * np.nan])

    def vector(self, pattern: str) -> Floats | None:
        """Return north, east and down of a quantity; NaN for a direction without a column.

        A column of the upward component is inverted.
        """
        components = {
            way: self.numbers(re.compile(pattern.format(way=spelled)))
            for way, spelled in _DIRECTION_PATTERNS.items()
        }
        up = components.pop("up")
        if components["down"] is None and up is not None:
            components["down"] = -up
        present = [column for column in components.values() if column is not None]
        if not present:
            return None
        unknown = np.full(len(present[0]), np.nan)
        return np.column_stack([unknown if c is None else c for c in components.values()])

    def note_on_units(self) -> None:
        """Add a note on velocities that are left out because of their unit."""
        names = self.table.names or ()
        others = [name for name in names if _FOREIGN_VELOCITY.search(to_snake_case(name))]
        if others:
            self.notes.append(f"{', '.join(others)}: left out, for velocities are read in m/s")

    def time(self) -> tuple[Floats, float | None]:
        """Return the times, s, and the Unix time at which they are zero."""
        table = with_clock(self.table)
        self.notes = [*table.meta.notes, *self.notes]
        index = _find_column(table, _HEADER_STAMP) if table.time is None else table.time
        if index is None:
            index = time_of(table, [i for i in (_find_column(table, _LATITUDE),) if i is not None])
        if index is None:
            raise LogError("no column is the time, such as time_s or timestamp_ns")
        name = table.label(index)
        column = convert_texts(table.load([index])[0], name)
        unit = table.time_unit or _unit_of_fixes(name, column)
        stamps = to_seconds(column, name, None, unit)
        if stamps.note is not None:
            self.notes.append(stamps.note)
        time = stamps.start + stamps.seconds
        return time, _find_epoch(time, name, dated=column.dtype.kind == "M")


def _unit_of_fixes(name: str, column: Column) -> str | None:
    """Return the unit of numeric times if neither the name nor the values show it; else None.

    The interval between fixes is a few milliseconds to a minute. Logs of inertial sensors have
    shorter intervals; `to_seconds` finds their unit.
    """
    if column.dtype.kind not in "fiu" or len(column) < 2 or find_time_unit(name) is not None:
        return None
    numbers = column.astype(np.float64)
    units = ("s", "ms", "us", "ns")
    if any(DATE_RANGE_S[0] < numbers[0] / PER_SECOND[unit] < DATE_RANGE_S[1] for unit in units):
        return None
    with np.errstate(invalid="ignore"):
        step = float(np.median(np.diff(numbers)))
    return next((u for u in units if step < _MAX_FIX_STEP_S * PER_SECOND[u]), "ns")


def _find_epoch(time: Floats, name: str, dated: bool) -> float | None:
    if name == "time_gps":
        return (
            -float(np.count_nonzero(_LEAP_SECOND_DAYS.astype(np.int64) < time[0]))
            if time.size
            else None
        )
    if name == "time_jst":
        return -9.0 * 3600.0
    return 0.0 if dated else _find_unix_epoch(time)


def _find_unix_epoch(time: Floats) -> float | None:
    inside = time.size and DATE_RANGE_S[0] < time[0] < DATE_RANGE_S[1]
    return 0.0 if inside else None


def _make_fixes(table: Table, label: str) -> Fixes:
    columns = _FixColumns(table)
    time, epoch = columns.time()
    coordinates = columns.load_coordinates()
    height = columns.lengths(_HEIGHT)
    index = _find_column(table, _HEIGHT)
    if index is not None and "msl" in to_snake_case(table.label(index)).split("_"):
        columns.notes.append("heights are above mean sea level, as their column says")
    if height is None:
        columns.notes.append("no column is a height, such as height_m: it is missing")
    position = np.column_stack(
        [*coordinates, np.full(len(time), np.nan) if height is None else height]
    )
    is_fix = _select_fixes(columns, time, position)
    columns.note_on_units()
    arrays = {
        "velocity": _velocity(columns, time, position),
        "position_sigma": _find_position_sigmas(columns),
        "velocity_sigma": _sigma_velocity(columns),
    }
    chosen = {
        name: None if a is None else _none_if_unknown(a[is_fix]) for name, a in arrays.items()
    }
    try:
        return Fixes(
            time[is_fix],
            position[is_fix],
            **chosen,
            quality=_load_whole_numbers(columns, _QUALITY, is_fix),
            satellites=_load_whole_numbers(columns, _SATELLITES, is_fix),
            epoch=epoch,
            source=label,
            notes=tuple(dict.fromkeys(columns.notes)),
        )
    except ValueError as error:
        raise LogError(str(error)) from None


def _velocity(columns: _FixColumns, time: Floats, position: Floats) -> Floats | None:
    """Return velocities in m/s from the columns; the positions determine the scale of integers."""
    found = columns.vector(_VELOCITY)
    if found is None:
        return columns.over_ground()
    if not columns.whole or not (found[np.isfinite(found)] % 1.0 == 0.0).all():
        return found
    north = np.radians(np.diff(position[:, 0])) * _EARTH_M
    east = np.radians(np.diff(position[:, 1])) * _EARTH_M * np.cos(np.radians(position[1:, 0]))
    moved = np.column_stack([north, east]) / np.diff(time)[:, None]
    # Positions are noisy, velocities are not. So the slope of positions over velocities is
    # unbiased.
    slope = float(np.nansum(moved * found[1:, :2]) / max(np.nansum(found[1:, :2] ** 2), 1e-9))
    scale = min((1.0, 1e2, 1e3), key=lambda one: abs(np.log(max(slope, 1e-9) * one)))
    columns.notes.append(f"velocities are read in 1/{scale:g} m/s, as the positions show")
    return found / scale


def _select_fixes(columns: _FixColumns, time: Floats, position: Floats) -> Booleans:
    """Return the mask of rows with a fix that is later than all fixes before."""
    latitude, longitude = position[:, 0], position[:, 1]
    # Loggers write zeros before the first fix.
    has_position = (
        np.isfinite(latitude) & np.isfinite(longitude) & ~((latitude == 0) & (longitude == 0))
    )
    status = columns.numbers(_STATUS)
    if status is not None:
        has_position &= ~(status < 0.0)
    if not has_position.any():
        raise LogError("there is no fix: no row has a position")
    if not has_position.all():
        columns.notes.append(
            f"left out: {count_noun(int(np.count_nonzero(~has_position)), 'row')} without a fix"
        )
    is_fix: Booleans = has_position.copy()
    before = np.maximum.accumulate(np.where(has_position, time, -np.inf))
    is_fix[1:] &= time[1:] > before[:-1]
    late = has_position & ~is_fix
    late_rows = count_noun(int(np.count_nonzero(late)), "row")
    if np.count_nonzero(late) > _MAX_DISORDER_PART * np.count_nonzero(has_position):
        raise LogError(f"{late_rows} of {len(time)} do not come later than those before")
    if late.any():
        columns.notes.append(f"left out: {late_rows} that do not come later than those before")
    return is_fix


def _find_position_sigmas(columns: _FixColumns) -> Floats | None:
    sigmas = _find_sigmas(columns, _POSITION_SIGMA, _METRES)
    if sigmas is not None:
        return sigmas
    across = columns.lengths(_ACCURACY["horizontal"])
    if across is not None:
        up = columns.lengths(_ACCURACY["vertical"])
        wide = np.column_stack([across, across, across * np.nan if up is None else up])
        columns.notes.append("accuracies are used as standard deviations")
        return np.where(wide > 0.0, wide, np.nan)
    # The covariance matrix is stored row by row, in the order east, north, up.
    east, north, up = (
        columns.numbers(re.compile(_VARIANCE.format(index=index))) for index in (0, 4, 8)
    )
    if east is None or north is None or up is None:
        return None
    kind = columns.numbers(_COVARIANCE_TYPE)
    variances = np.column_stack([north, east, up])
    is_known = (variances > 0.0) & (True if kind is None else (kind != 0.0)[:, None])
    return np.sqrt(np.where(is_known, variances, np.nan))


def _sigma_velocity(columns: _FixColumns) -> Floats | None:
    found = _find_sigmas(columns, _VELOCITY_SIGMA, _SPEEDS)
    one = columns.lengths(_ACCURACY["speed"]) if found is None else None
    return found if one is None else np.repeat(np.where(one > 0.0, one, np.nan)[:, None], 3, axis=1)


def _find_sigmas(columns: _FixColumns, words: str, unit: str) -> Floats | None:
    sigmas = columns.vector(words + "_?({way})" + unit)
    if sigmas is None:
        single = columns.numbers(re.compile(words + unit))
        sigmas = None if single is None else np.repeat(single[:, None], 3, axis=1)
    if sigmas is None:
        return None
    # A standard deviation of the upward component was inverted like its velocity.
    sigmas = np.abs(sigmas)
    zero = sigmas == 0.0
    if zero.any():
        columns.notes.append("standard deviations of zero count as unknown")
    return np.where(zero, np.nan, sigmas)


def _none_if_unknown(values: Floats) -> Floats | None:
    return None if np.isnan(values).all() else values


def _load_whole_numbers(
    columns: _FixColumns, wanted: re.Pattern[str], is_fix: Booleans
) -> Integers | None:
    try:
        values = columns.numbers(wanted)
    except LogError as error:  # texts such as "RTK"
        columns.notes.append(f"not read: {error}")
        return None
    if values is None or np.isnan(values[is_fix]).all():
        return None
    return np.where(np.isnan(values[is_fix]), -1.0, values[is_fix]).astype(np.int64)
