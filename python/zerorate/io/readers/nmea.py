"""NMEA 0183: sentences GGA, RMC, GST, VTG and ZDA of a receiver, one row per fix."""

from __future__ import annotations

import datetime
import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from zerorate.io.table import Column, Content, Format, Metadata, Needs, Table
from zerorate.record.log import LogError
from zerorate.texts import describe_missing_extra

_SENTENCE: Final = re.compile(rb"\$[A-Z]{2}(GGA|RMC|GST|VTG|ZDA),[^$\r\n]*")
_ANY_SENTENCE: Final = re.compile(
    rb"^[^\r\n]{0,64}?\$(?:[A-Z]{2}[A-Z]{3}|P[A-Z]{3,}),", re.MULTILINE
)
_KNOT_M_S: Final = 1852.0 / 3600.0
_DAY_S: Final = 86_400.0
_YEAR_DAYS: Final = 365
_EPOCH_DAY: Final = datetime.date(1970, 1, 1).toordinal()

_COLUMNS: Final = (
    "latitude_deg",
    "longitude_deg",
    "height_m",
    "velocity_north_mps",
    "velocity_east_mps",
    "position_sigma_north_m",
    "position_sigma_east_m",
    "position_sigma_up_m",
    "quality",
    "satellites",
)


def looks_like_nmea(head: bytes) -> bool:
    """Return True if a line at the beginning of a file is a sentence of NMEA 0183."""
    return _ANY_SENTENCE.search(head) is not None


def _read(path: Path) -> Content:
    raw = path.read_bytes()
    if not looks_like_nmea(raw[: 1 << 16]):
        raise LogError("no line has an NMEA sentence such as $GNGGA, expected those of a receiver")
    reading = _SentenceCollector()
    sentences = [match[0].rstrip() for match in _SENTENCE.finditer(raw)]
    # Without any checksums, truncated sentences cannot be detected.
    has_checksums = any(b"*" in sentence for sentence in sentences)
    for sentence in sentences:
        reading.take(sentence, has_checksums)
    return Content.of(_make_table(reading))


FORMAT: Final = Format(
    "nmea", "NMEA sentences", (".nmea", ".nma"), (), _read, Needs("pynmeagps", "nmea")
)


@dataclass
class _Epoch:
    """Sentences of one moment: the time of day, s, and all other numbers in ``values``."""

    seconds: float
    day: int | None = None
    values: dict[str, float] = field(default_factory=dict)
    lacks_geoid: bool = False
    is_void: bool = False


class _SentenceCollector:
    """Collector of sentences, grouped by their time."""

    def __init__(self) -> None:
        try:
            from pynmeagps import NMEAReader
        except ImportError:
            raise ImportError(describe_missing_extra("pynmeagps", "nmea", "an NMEA file")) from None
        self._parse = NMEAReader.parse
        self.epochs: list[_Epoch] = []
        self.checksum_error_count = 0
        self.unreadable_count = 0
        self._handlers: dict[str, Callable[[_Epoch, Any], None]] = {
            "GGA": _take_position,
            "RMC": _take_minimum,
            "GST": _take_errors,
            "VTG": _take_course,
            "ZDA": _take_date,
        }

    def take(self, sentence: bytes, has_checksums: bool) -> None:
        """Add the data of a sentence; damaged sentences are counted."""
        content, _, checksum = sentence.partition(b"*")
        if has_checksums and not _is_checksum_right(content, checksum):
            self.checksum_error_count += 1
            return
        try:
            message = self._parse(content + b"*00\r\n", validate=0)
            epoch = self._find_epoch(message)
            if epoch is not None:
                self._handlers[message.msgID](epoch, message)
        except Exception:  # pynmea2 can raise any exception for damaged sentences
            self.unreadable_count += 1

    def _find_epoch(self, message: Any) -> _Epoch | None:  # noqa: ANN401
        """Return the moment of a sentence; without a time, the last moment."""
        if not hasattr(message, "time"):
            return self.epochs[-1] if self.epochs else None
        time = message.time
        if not isinstance(time, datetime.time):
            return None  # no time before the first fix
        seconds = 3600.0 * time.hour + 60.0 * time.minute + time.second + 1e-6 * time.microsecond
        if not self.epochs or self.epochs[-1].seconds != seconds:
            self.epochs.append(_Epoch(seconds))
        return self.epochs[-1]


def _is_checksum_right(content: bytes, checksum: bytes) -> bool:
    total = 0
    for byte in content[1:]:
        total ^= byte
    return checksum[:2].upper() == b"%02X" % total


def _take_position(epoch: _Epoch, message: Any) -> None:  # noqa: ANN401
    quality = _number(message.quality)
    if not quality > 0.0:
        epoch.is_void = True
        return
    above_sea, geoid = _number(message.alt), _number(message.sep)
    epoch.lacks_geoid = math.isnan(geoid) and not math.isnan(above_sea)
    epoch.values |= {
        "latitude_deg": _number(message.lat),
        "longitude_deg": _number(message.lon),
        "height_m": above_sea + (0.0 if epoch.lacks_geoid else geoid),
        "quality": quality,
        "satellites": _number(message.numSV),
    }


def _take_minimum(epoch: _Epoch, message: Any) -> None:  # noqa: ANN401
    if isinstance(message.date, datetime.date):
        epoch.day = _days(message.date)
    if message.status != "A":
        epoch.is_void = True
        return
    epoch.values.setdefault("latitude_deg", _number(message.lat))
    epoch.values.setdefault("longitude_deg", _number(message.lon))
    epoch.values |= _velocity(_KNOT_M_S * _number(message.spd), _number(message.cog))


def _take_course(epoch: _Epoch, message: Any) -> None:  # noqa: ANN401
    if "velocity_north_mps" in epoch.values:
        return
    speed = _number(message.sogk) / 3.6
    if math.isnan(speed):
        speed = _KNOT_M_S * _number(message.sogn)
    epoch.values |= _velocity(speed, _number(message.cogt))


def _take_errors(epoch: _Epoch, message: Any) -> None:  # noqa: ANN401
    sigmas = {"north": message.stdLat, "east": message.stdLong, "up": message.stdAlt}
    epoch.values |= {f"position_sigma_{way}_m": _number(sigma) for way, sigma in sigmas.items()}


def _take_date(epoch: _Epoch, message: Any) -> None:  # noqa: ANN401
    if all(isinstance(part, int) for part in (message.year, message.month, message.day)):
        epoch.day = _days(datetime.date(message.year, message.month, message.day))


def _velocity(speed: float, course: float) -> dict[str, float]:
    """Return the north and east velocity, m/s; at rest, receivers omit the course."""
    if math.isnan(course):
        if speed != 0.0:
            return {}
        course = 0.0
    angle = math.radians(course)
    return {
        "velocity_north_mps": speed * math.cos(angle),
        "velocity_east_mps": speed * math.sin(angle),
    }


def _number(cell: object) -> float:
    """Return the number in a field, NaN if it is blank."""
    return float(cell) if isinstance(cell, (int, float)) else math.nan


def _days(date: datetime.date) -> int:
    return date.toordinal() - _EPOCH_DAY


def _assign_days(epochs: Sequence[_Epoch]) -> bool:
    """Set the day of each moment, counted across midnight; return True if a date is known.

    Without a date, the days count from the first.
    """
    dated = [i for i, epoch in enumerate(epochs) if epoch.day is not None]
    first = dated[0] if dated else 0
    if not dated and epochs:
        epochs[0].day = 0
    for before, epoch in zip(epochs[first:], epochs[first + 1 :], strict=False):
        if epoch.day is None:
            epoch.day = _day_of(before) + _midnights(before.seconds, epoch.seconds)
    for i in reversed(range(first)):
        following = epochs[i + 1]
        epochs[i].day = _day_of(following) - _midnights(epochs[i].seconds, following.seconds)
    return bool(dated)


def _check_days(epochs: Sequence[_Epoch]) -> None:
    """Raise LogError if the date jumps by a year or more, as after a receiver's week rollover."""
    for before, after in pairwise(epochs):
        if abs(_day_of(after) - _day_of(before)) >= _YEAR_DAYS:
            dates = [datetime.date.fromordinal(_day_of(e) + _EPOCH_DAY) for e in (before, after)]
            raise LogError(
                f"the date leaps from {dates[0]} to {dates[1]}: cut the file there, or at the "
                "first right date of a receiver that has just been switched on"
            )


def _day_of(epoch: _Epoch) -> int:
    assert epoch.day is not None
    return epoch.day


def _midnights(earlier: float, later: float) -> int:
    """Return the number of midnights between two times of day that differ by a few hours."""
    step = later - earlier
    return 1 if step < -0.5 * _DAY_S else -1 if step > 0.5 * _DAY_S else 0


def _make_table(reading: _SentenceCollector) -> Table:
    dated = _assign_days(reading.epochs)
    with_fix = [epoch for epoch in reading.epochs if _has_fix(epoch)]
    if not with_fix:
        reasons = ", ".join(_describe_faults(reading)) or "no sentence GGA or RMC has a position"
        raise LogError(f"there is no fix: {reasons}")
    _check_days(with_fix)
    without = sum(1 for epoch in reading.epochs if epoch.is_void and not _has_fix(epoch))
    time = _make_times(with_fix, dated)
    columns: list[Column] = [time]
    columns += [np.array([e.values.get(name, math.nan) for e in with_fix]) for name in _COLUMNS]
    notes = tuple(_list_notes(reading, with_fix, without, dated))
    return Table(
        width=len(columns),
        load=lambda wanted: [columns[i] for i in wanted],
        names=("time_utc" if dated else "time_s", *_COLUMNS),
        meta=Metadata(notes=notes),
        time=0,
    )


def _has_fix(epoch: _Epoch) -> bool:
    coordinates = (epoch.values.get(name, math.nan) for name in ("latitude_deg", "longitude_deg"))
    return not epoch.is_void and not any(map(math.isnan, coordinates))


def _make_times(epochs: Sequence[_Epoch], dated: bool) -> Column:
    """Return dates to the microsecond, or seconds since the first midnight."""
    if not dated:
        return np.array([_DAY_S * _day_of(epoch) + epoch.seconds for epoch in epochs])
    counts = [86_400_000_000 * _day_of(epoch) + round(1e6 * epoch.seconds) for epoch in epochs]
    return np.array(counts, dtype=np.int64).view("datetime64[us]")


def _describe_faults(reading: _SentenceCollector) -> Iterator[str]:
    for count, what in (
        (reading.checksum_error_count, "with a wrong checksum or none"),
        (reading.unreadable_count, "that cannot be read"),
    ):
        if count:
            yield f"{count} sentence{'' if count == 1 else 's'} {what}"


def _list_notes(
    reading: _SentenceCollector, with_fix: Sequence[_Epoch], without: int, dated: bool
) -> Iterator[str]:
    faults = list(_describe_faults(reading))
    if faults:
        yield f"left out: {', '.join(faults)}"
    if without:
        yield f"left out: {without} moment{'' if without == 1 else 's'} without a fix"
    if any(epoch.lacks_geoid for epoch in with_fix):
        yield "heights are above mean sea level: the receiver does not give the geoid's height"
    if not dated:
        yield "no sentence RMC or ZDA has the date: times are seconds since the first midnight"
