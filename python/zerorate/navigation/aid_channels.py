"""Channels of aids: pressure, height, heading, baseline, with their units and conventions.

A channel is used if its name or the motion allows only one unit and convention. Otherwise it is
left out with an alarm. If the user requested the channel, an error is raised instead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np

from zerorate.faults import Sentence, keyword_argument, make_sentence
from zerorate.navigation.aids import Aid
from zerorate.navigation.heading import heading_of
from zerorate.navigation.track import Track
from zerorate.numerals import shorten
from zerorate.record.fixes import Fixes
from zerorate.record.log import Log, LogError
from zerorate.record.runs import runs
from zerorate.types import Booleans, Floats

AID_KINDS: Final = ("pressure", "height", "heading", "baseline")
"""Kinds of aids: arguments of ``NavigationFilter.process``."""

PRESSURE_UNITS: Final = {
    "Pa": 1.0,
    "hPa": 100.0,
    "kPa": 1000.0,
    "bar": 1e5,
    "inHg": 3386.39,
    "mmHg": 133.322,
    "psi": 6894.76,
}
"""Factors from units of pressure to Pa."""
_LENGTH_UNITS: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048}
_ANGLE_UNITS: Final = {"rad": 1.0, "deg": math.pi / 180.0}
_MAX_PRESSURE_RATIO: Final = 1.12
"""Largest ratio of a pressure to the standard atmosphere, by weather and height errors."""
_SCALE_HEIGHT_M: Final = 8400.0
_SEA_LEVEL_PA: Final = 101_325.0
_MAX_ANGLE_RAD: Final = 2.05 * math.pi
"""Largest angle that can be in rad; larger numbers are in deg."""
_MIN_FROZEN_S: Final = {"pressure": 10.0, "height": 10.0, "heading": 3.0}
_MIN_CHANGE: Final = {"pressure": 5.0, "height": 5.0, "heading": math.radians(5.0)}
"""A frozen channel repeats a value for this time, s, while the motion changes it, m or rad."""
_KNOWN_HEADING_RAD: Final = math.radians(8.0)
"""Largest standard deviation of a heading from motion that can show the convention, rad."""
_MIN_JUDGED: Final = 20
_MAX_MISFIT_RAD: Final = math.radians(20.0)
_MIN_TURN_RAD: Final = math.radians(30.0)
"""Largest misfit of a convention, rad, and smallest rotation that shows the sense, rad."""
_CONVENTIONS: Final = {
    (1.0, 0.0): "",
    (-1.0, 0.5 * math.pi): "counts anticlockwise from east",
    (1.0, math.pi): "is that to the rear",
    (-1.0, 0.0): "counts anticlockwise from north",
    (1.0, 0.5 * math.pi): "counts from east",
    (1.0, -0.5 * math.pi): "counts from west",
    (-1.0, math.pi): "counts anticlockwise from south",
    (-1.0, -0.5 * math.pi): "counts anticlockwise from west",
}
"""Sense and offset of headings that are not north over east, with their descriptions."""


class Channel(NamedTuple):
    """Readings of an aid, with times, unit and column name.

    Attributes
    ----------
    kind : str
        Kind of the aid, from `AID_KINDS`.
    time : ndarray, shape (k,)
        Times of the readings, s.
    values : ndarray, shape (k,) or (k, 3)
        Readings in `unit`. NaN if missing.
    unit : str
        Unit of the readings. Empty if unknown.
    name : str
        Name of the column, for messages.
    is_requested : bool
        True if the user named the channel. An unusable channel is then an error.
    sigma : ndarray, shape (k,), optional
        Standard deviations of the readings, SI units.
    """

    kind: str
    time: Floats
    values: Floats
    unit: str
    name: str
    is_requested: bool = False
    sigma: Floats | None = None

    @classmethod
    def of(cls, kind: str, log: Log, is_requested: bool = False) -> Channel:
        """Return the channel of a log, without missing readings."""
        values = log.data if kind == "baseline" else log.data[:, 0]
        present = np.isfinite(values.reshape(log.n, -1)).all(axis=1)
        unit = log.units[0] if len(set(log.units)) == 1 else ""
        known = unit if unit != "unit" else ""
        name = ", ".join(log.names)
        return cls(kind, log.sampled[present], values[present], known, name, is_requested)


@dataclass
class AidInputs:
    """Aids for ``NavigationFilter.process``, with alarms and notes.

    Attributes
    ----------
    aids : dict of str to Aid
        Readings by kind.
    heading_offset : float
        Median difference between the readings and the heading from motion, rad. 0 if unknown.
    alarms : list of str
        Sentences on contradictions.
    notes : list of str
        Sentences on assumptions.
    """

    aids: dict[str, Aid] = field(default_factory=dict)
    heading_offset: float = 0.0
    alarms: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def judge_channels(channels: list[Channel], fixes: Fixes, track: Track | None) -> AidInputs:
    """Return the aids from the channels with a known unit and convention.

    Parameters
    ----------
    channels : list of Channel
        Channels, at most one of each kind.
    fixes : Fixes
        Fixes of the receiver. Their height determines the unit of a pressure.
    track : Track or None
        Track without these aids. It determines the convention of a heading, and shows frozen
        readings.

    Raises
    ------
    LogError
        If a requested channel has no unambiguous unit or convention.
    """
    found = AidInputs()
    for channel in channels:
        try:
            judged = _JUDGES[channel.kind](channel, fixes, track, found)
            if not len(judged.time):
                raise LogError(f"{channel.name}: there is no reading")
            judged = _mask_frozen(judged, track, found)
        except LogError as fault:
            if channel.is_requested:
                raise
            found.alarms.append(make_sentence(*_parts(fault), "; it is not used"))
            continue
        if len(judged.time):
            found.aids[channel.kind] = Aid(judged.time, judged.values, judged.sigma)
    return found


def _parts(fault: LogError) -> tuple[str, ...]:
    sentence = fault.args[0]
    return (sentence if isinstance(sentence, Sentence) else str(sentence),)


def _judge_pressure(
    channel: Channel, fixes: Fixes, track: Track | None, found: AidInputs
) -> Channel:
    """Return a pressure in Pa. Its unit must fit the height of the fixes."""
    height = fixes.position[np.isfinite(fixes.position[:, 2]), 2]
    metres = float(np.median(height)) if height.size else 0.0
    expected = _SEA_LEVEL_PA * math.exp(-metres / _SCALE_HEIGHT_M)
    size = float(np.median(channel.values)) if len(channel.values) else 0.0
    limit = math.log(_MAX_PRESSURE_RATIO)
    fitting = [
        unit
        for unit, factor in PRESSURE_UNITS.items()
        if size > 0.0 and abs(math.log(size * factor / expected)) < limit
    ]
    option = keyword_argument("pressure_unit", "hPa", "pressure_unit='hPa'")
    if channel.unit:
        if channel.unit not in PRESSURE_UNITS:
            listed = ", ".join(PRESSURE_UNITS)
            raise LogError(
                f"{channel.name}: a pressure in {channel.unit}, expected one of {listed}"
            )
        if fitting and channel.unit not in fitting:
            better = keyword_argument("pressure_unit", fitting[0], f"pressure_unit='{fitting[0]}'")
            raise LogError(
                make_sentence(
                    f"{channel.name}: {shorten(size, 4)} {channel.unit} is no pressure at "
                    f"{metres:.0f} m; it would be one in {fitting[0]}: ",
                    better,
                    " says so",
                )
            )
        unit = channel.unit
    elif len(fitting) == 1:
        unit = fitting[0]
        found.notes.append(
            f"{channel.name}: {shorten(size, 4)} is a pressure in {unit} at {metres:.0f} m"
        )
    else:
        raise LogError(
            make_sentence(
                f"{channel.name}: {shorten(size, 4)} is no pressure at {metres:.0f} m in "
                f"{', '.join(PRESSURE_UNITS)}; ",
                option,
                " says its unit",
            )
        )
    return channel._replace(values=channel.values * PRESSURE_UNITS[unit], unit="Pa")


def _judge_length(channel: Channel, fixes: Fixes, track: Track | None, found: AidInputs) -> Channel:
    """Return a height or a baseline in m."""
    unit = channel.unit or "m"
    if unit not in _LENGTH_UNITS:
        raise LogError(
            f"{channel.name}: a length in {unit}, expected one of {', '.join(_LENGTH_UNITS)}"
        )
    return channel._replace(values=channel.values * _LENGTH_UNITS[unit], unit="m")


def _judge_heading(
    channel: Channel, fixes: Fixes, track: Track | None, found: AidInputs
) -> Channel:
    """Return a heading in rad from north over east."""
    unit = channel.unit or _find_angle_unit(channel, track)
    if unit not in _ANGLE_UNITS:
        raise LogError(f"{channel.name}: a heading in {unit}, expected deg or rad")
    if not channel.unit:
        found.notes.append(f"{channel.name}: a heading in {unit}, by its size")
    angle = channel.values * _ANGLE_UNITS[unit]
    if (np.abs(angle) > 4.0 * math.pi).any():
        option = keyword_argument("compass_unit", "deg", "compass_unit='deg'")
        raise LogError(
            make_sentence(
                f"{channel.name}: {shorten(float(np.abs(channel.values).max()), 4)} {unit} is no "
                "heading; ",
                option,
                " says its unit",
            )
        )
    try:
        angle, offset = _fit_convention(channel._replace(values=angle, unit="rad"), track, found)
    except LogError:
        _check_other_unit(channel, unit, track)
        raise
    found.heading_offset = offset
    return channel._replace(values=_wrap(angle), unit="rad")


def _check_other_unit(channel: Channel, unit: str, track: Track | None) -> None:
    """Raise LogError with the other unit, if the readings fit the motion in that unit."""
    other = "rad" if unit == "deg" else "deg"
    known, heading, _ = _motion_heading(channel, track)
    misfit = np.abs(_wrap(channel.values * _ANGLE_UNITS[other] - heading)[known])
    if float(np.median(misfit)) <= _MAX_MISFIT_RAD:
        option = keyword_argument("compass_unit", other, f"compass_unit='{other}'")
        text = f"{channel.name}: the readings fit the motion in {other}, not in {unit}; "
        raise LogError(make_sentence(text, option, " says so"))


def _find_angle_unit(channel: Channel, track: Track | None) -> str:
    """Return the unit of a heading, from its size or from its change in a rotation."""
    if len(channel.values) and float(np.abs(channel.values).max()) > _MAX_ANGLE_RAD:
        return "deg"
    known, heading, _ = _motion_heading(channel, track)
    if known.sum() >= _MIN_JUDGED:
        turned = np.unwrap(heading[known])
        if np.ptp(turned) > _MIN_TURN_RAD:
            change = np.ptp(np.unwrap(channel.values[known]))
            return "rad" if change > 0.2 * np.ptp(turned) else "deg"
    option = keyword_argument("compass_unit", "deg", "compass_unit='deg'")
    raise LogError(
        make_sentence(
            f"{channel.name}: a heading from {channel.values.min():.3g} to "
            f"{channel.values.max():.3g} may be in deg or in rad; ",
            option,
            " says it",
        )
    )


def _fit_convention(
    channel: Channel, track: Track | None, found: AidInputs
) -> tuple[Floats, float]:
    """Return the headings from north over east, and their median offset from the motion."""
    known, heading, _ = _motion_heading(channel, track)
    if known.sum() < _MIN_JUDGED:
        found.notes.append(
            f"{channel.name}: the motion does not show the heading, so the convention of the "
            "readings, north over east, is not checked"
        )
        return channel.values, 0.0
    truth, reading = heading[known], channel.values[known]
    misfits = {
        convention: float(np.median(np.abs(_wrap(convention[0] * reading + convention[1] - truth))))
        for convention in _CONVENTIONS
    }
    best = min(misfits, key=lambda one: misfits[one])
    turned = float(np.ptp(np.unwrap(truth)))
    usual = (1.0, 0.0)
    if misfits[usual] <= _MAX_MISFIT_RAD:
        offset = _wrap(reading - truth)
        return channel.values, float(np.median(offset))
    typed = keyword_argument("compass", "", "compass")
    if misfits[best] <= _MAX_MISFIT_RAD and turned > _MIN_TURN_RAD:
        sense, zero = best
        found.notes.append(
            f"{channel.name}: the heading {_CONVENTIONS[best]}, by the motion: it is converted to "
            "north over east"
        )
        offset = _wrap(sense * reading + zero - truth)
        return sense * channel.values + zero, float(np.median(offset))
    raise LogError(
        make_sentence(
            f"{channel.name}: the heading is {math.degrees(misfits[usual]):.0f} deg off the "
            "motion's in the median, and no other convention fits; ",
            typed,
            " names another column",
        )
    )


def _motion_heading(channel: Channel, track: Track | None) -> tuple[Booleans, Floats, Floats]:
    """Return a mask of known headings from motion, these headings, rad, and the heights, m."""
    n = len(channel.time)
    if track is None or not track.n:
        return np.zeros(n, dtype=np.bool_), np.full(n, np.nan), np.full(n, np.nan)
    at = np.clip(np.searchsorted(track.time, channel.time), 0, track.n - 1)
    near = np.abs(track.time[at] - channel.time) < 0.5
    known = track.navigating[at] & near & (track.sigma[at, 8] < _KNOWN_HEADING_RAD)
    return known, heading_of(track.quaternion[at]), track.position[at, 2]


def _mask_frozen(channel: Channel, track: Track | None, found: AidInputs) -> Channel:
    """Set readings to NaN that repeat one value while the vehicle turns or climbs."""
    if channel.kind not in _MIN_FROZEN_S:
        return channel
    _, heading, height = _motion_heading(channel, track)
    moved = np.unwrap(np.nan_to_num(heading)) if channel.kind == "heading" else height
    same = np.concatenate([[False], np.diff(channel.values) == 0.0])
    frozen = np.zeros(len(same), dtype=np.bool_)
    for first, last in runs(same):
        span = slice(max(int(first) - 1, 0), int(last))
        seconds = channel.time[last - 1] - channel.time[span.start]
        change = _range(moved[span])
        if seconds >= _MIN_FROZEN_S[channel.kind] and change > _MIN_CHANGE[channel.kind]:
            frozen[span] = True
    if not frozen.any():
        return channel
    rate = len(channel.time) / max(float(np.ptp(channel.time)), 1e-9)
    found.alarms.append(
        f"{channel.name}: one value for {frozen.sum() / rate:.1f} s while the vehicle "
        f"{'turns' if channel.kind == 'heading' else 'climbs'}: left out there"
    )
    sigma = None if channel.sigma is None else channel.sigma[~frozen]
    return channel._replace(time=channel.time[~frozen], values=channel.values[~frozen], sigma=sigma)


def _range(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(np.ptp(known)) if known.size else 0.0


def _wrap(angle: Floats) -> Floats:
    return np.asarray(np.remainder(angle + math.pi, 2.0 * math.pi) - math.pi)


_JUDGES: Final = {
    "pressure": _judge_pressure,
    "height": _judge_length,
    "heading": _judge_heading,
    "baseline": _judge_length,
}
