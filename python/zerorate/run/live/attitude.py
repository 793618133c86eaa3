"""A stream of attitudes: lines of gyro, accelerometer and magnetometer in, orientations out."""

import json
import math
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, Final, Self

import numpy as np

from zerorate._native import Attitude
from zerorate.io.clocks.names import time_unit
from zerorate.io.names import Meaning, canonical_unit, meaning_of
from zerorate.io.triads import places_of
from zerorate.run.live.checkpoint import CheckpointError, SettingsError
from zerorate.run.live.lines import (
    ColumnError,
    Layout,
    LineError,
    cells_of,
    names_in,
    position_of,
    texts_of,
)
from zerorate.run.live.sequence import SequenceCount
from zerorate.units import UNITS

__all__ = ["AttitudeLines", "AttitudeSettings", "WithAttitude"]

_SIGNATURE: Final = b"ZRATTIT1"
_LENGTH: Final = 4
_CRC: Final = 4
_FOREIGN: Final = (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError)
_APART: Final = 30.0
"""Factor by which steps of the time may be off the rate, unless lines are lost."""
_ODD: Final = 10
"""Lines in a row that are."""
_COUNTED: Final = ("last", "lost", "late", "restarts", "turn", "wraps", "run", "lowest")

_QUATERNION: Final = tuple(f"quat_{axis}" for axis in "wxyz")
_SECONDS: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_DEG: Final = math.degrees(1.0)


class WithAttitude(StrEnum):
    """Columns that may follow the quaternion in an answer, angles in deg."""

    euler = "euler"
    heading = "heading"
    tilt_sigma = "tilt_sigma"
    heading_sigma = "heading_sigma"
    at_rest = "at_rest"
    disturbed = "disturbed"
    linear = "linear"
    bias = "bias"


_BESIDE: Final[Mapping[WithAttitude, tuple[tuple[str, ...], Callable[[Attitude], Any]]]] = {
    WithAttitude.euler: (("roll_deg", "pitch_deg", "yaw_deg"), lambda f: f.euler * _DEG),
    WithAttitude.heading: (("heading_deg",), lambda f: f.heading * _DEG),
    WithAttitude.tilt_sigma: (("tilt_sigma_deg",), lambda f: f.tilt_sigma * _DEG),
    WithAttitude.heading_sigma: (("heading_sigma_deg",), lambda f: f.heading_sigma * _DEG),
    WithAttitude.at_rest: (("at_rest",), lambda f: f.at_rest),
    WithAttitude.disturbed: (("disturbed",), lambda f: f.disturbed),
    WithAttitude.linear: (
        tuple(f"linear_{axis}_mps2" for axis in "xyz"),
        lambda f: f.linear_acceleration,
    ),
    WithAttitude.bias: (tuple(f"bias_{axis}_dps" for axis in "xyz"), lambda f: f.bias * _DEG),
}


@dataclass(frozen=True)
class AttitudeSettings:
    """The filter of a stream of attitudes, and what its lines hold: the same after a restart.

    Parameters
    ----------
    rate : float
        Samples a second.
    frame : str
        Axes of the earth: ``"enu"``, ``"ned"`` or ``"nwu"``.
    mag : bool
        Whether to use a magnetometer, if the lines hold one.
    beside : tuple of str
        Further columns of an answer, of `WithAttitude`.
    columns : tuple of str or int, optional
        Six or nine columns: gyro, accelerometer and maybe magnetometer, each x, y, z. By default
        those that a header line names so; without a header line all but the next two.
    sequence, time : str or int, optional
        Columns of a sequence number, and of the time of each sample; None for none.
    sequence_bits : int, optional
        Width of the counter that numbers the samples; None if it is to be learned.
    gyro_unit, accel_unit : str, optional
        Where a header line does not say them.
    gyro_scale, accel_scale : float, optional
        What samples are multiplied by; the units are those that they have then.

    Raises
    ------
    ValueError
        If the rate, the frame, a column beside or a unit is not known.
    """

    rate: float
    frame: str = "enu"
    mag: bool = True
    beside: tuple[str, ...] = ()
    columns: tuple[str | int, ...] | None = None
    sequence: str | int | None = None
    time: str | int | None = None
    sequence_bits: int | None = None
    gyro_unit: str | None = None
    accel_unit: str | None = None
    gyro_scale: float | None = None
    accel_scale: float | None = None

    def __post_init__(self) -> None:
        """Check all that does not depend on the lines."""
        self.filter(True, "rad/s", "m/s^2")
        for name in self.beside:
            WithAttitude(name)
        if self.columns is not None and len(self.columns) not in (6, 9):
            raise ValueError(
                "columns= takes six columns, or nine with a magnetometer, of gyro and "
                f"accelerometer, got {len(self.columns)}"
            )
        for name, kind in (("gyro_unit", "rate"), ("accel_unit", "acceleration")):
            unit = getattr(self, name)
            if unit is not None:
                _check_unit(name, unit, kind)
                object.__setattr__(self, name, canonical_unit(unit))

    def filter(self, mag: bool, gyro_unit: str, accel_unit: str) -> Attitude:
        """Return a new filter of samples in these units."""
        settings: Any = {"frame": self.frame, "gyro_unit": gyro_unit, "accel_unit": accel_unit}
        return Attitude(self.rate, mag=mag and self.mag, **settings)

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Return the settings of what `dataclasses.asdict` gave, after JSON."""
        given: Any = {k: tuple(v) if isinstance(v, list) else v for k, v in fields.items()}
        return cls(**given)


def _check_unit(name: str, unit: str, kind: str) -> None:
    known = canonical_unit(unit)
    if known not in UNITS or UNITS[known].kind != kind:
        raise ValueError(f"{name} is no unit of {kind}: '{unit}'")


@dataclass(frozen=True)
class _Opened:
    """What the first line tells: where everything stands, and the units."""

    layout: Layout
    time: int | None
    seconds: float
    gyro_unit: str
    accel_unit: str

    @property
    def passing(self) -> list[int]:
        """Columns that pass through."""
        return [i for i in range(self.layout.fields) if i not in self.layout.channels]


class AttitudeLines:
    """Answers each line of samples with the orientation, and can be saved between any two.

    A line holds gyro, accelerometer and maybe magnetometer, three numbers each; an empty cell or
    ``nan`` is missing, and so is all of its sensor. The answer is all other cells of the line, the
    quaternion w, x, y, z from sensor to earth, and what was asked for beside it.

    Parameters
    ----------
    settings : AttitudeSettings
        The filter, and what the lines hold.
    fields : int, optional
        Numbers in a line; None is as many as in the first line, which must be whole then.

    Examples
    --------
    >>> from zerorate.live import AttitudeLines, AttitudeSettings
    >>> settings = AttitudeSettings(100.0, gyro_unit="rad/s", accel_unit="g", beside=("at_rest",))
    >>> stream = AttitudeLines(settings)
    >>> stream.take("t,gx,gy,gz,ax,ay,az")
    't,quat_w,quat_x,quat_y,quat_z,at_rest'
    >>> stream.take("0.01,0,0,0,0,0,1")
    '0.01,1.0,0.0,0.0,0.0,0'
    """

    def __init__(self, settings: AttitudeSettings, fields: int | None = None) -> None:
        self.settings = settings
        self.samples = 0
        """Lines that the filter was given."""
        self.sequence = SequenceCount(settings.rate, settings.sequence_bits)
        self._fields = fields
        self._lines = 0
        self._lost = 0
        self._odd = 0
        self._last: float | None = None
        self._opened: _Opened | None = None
        self._filter: Attitude | None = None
        self._beside = [_BESIDE[WithAttitude(name)] for name in settings.beside]

    @property
    def open(self) -> bool:
        """Whether the columns are known."""
        return self._opened is not None

    @property
    def position(self) -> int:
        """The sample to go on with: its sequence number, else how many lines came before it."""
        return self._lines if self.settings.sequence is None else self.sequence.next

    @property
    def no_answer(self) -> str:
        """The answer to a garbled line: as many ``nan`` as an answer has columns."""
        further = sum(len(names) for names, _ in self._beside)
        return ",".join(["nan"] * (len(self._known.passing) + 4 + further))

    @property
    def opening(self) -> str | None:
        """A sentence on which columns are of which sensor."""
        known = self._known
        labels = known.layout.labels
        groups = [", ".join(labels[i : i + 3]) for i in range(0, len(labels), 3)]
        told = [f"gyro {groups[0]} in {known.gyro_unit}"]
        told.append(f"accelerometer {groups[1]} in {known.accel_unit}")
        if len(groups) == 3:
            unused = "" if self.settings.mag else " (not used)"
            told.append(f"magnetometer {groups[2]}{unused}")
        passing = known.layout.passing
        return "; ".join((*told, *([f"passes on {', '.join(passing)}"] if passing else [])))

    def take(self, line: str) -> str | None:
        """Return the answer to a line, without a line end; None for a comment.

        Raises
        ------
        LineError
            The line is garbled; its sample is lost, and the time goes on. `no_answer` is its
            answer, but before the first good line there is none.
        ColumnError
            The columns are others than before, or than was asked for: the stream cannot go on.
        """
        text = line.strip(" \t\r\n")
        if text.startswith("#"):
            return None
        cells = cells_of(text)
        if self._opened is None:
            self._open(_found(cells, self.settings, self._fields))
        if self._known.layout.is_header(cells):
            return ",".join(self._header(cells))
        return self._sample(cells)

    def sentences(self) -> Iterator[str]:
        """Yield what there is to say at the end."""
        if self._filter is not None and self._filter.status == "wrong unit":
            yield "what the accelerometer shows at rest is not gravity: is its unit right?"

    def notice(self) -> str | None:
        """Return None: nothing is said in between."""
        return None

    def _open(self, opened: _Opened) -> None:
        mag = len(opened.layout.channels) == 9
        self._filter = self.settings.filter(mag, opened.gyro_unit, opened.accel_unit)
        self._opened = opened

    @property
    def _known(self) -> _Opened:
        if self._opened is None:
            raise RuntimeError("no line has come yet, so the columns are not known")
        return self._opened

    def _header(self, cells: Sequence[str]) -> Iterator[str]:
        yield from (cells[i] for i in self._known.passing)
        yield from _QUATERNION
        for names, _ in self._beside:
            yield from names

    def _sample(self, cells: list[str]) -> str:
        numbered = self._known.layout.sequence is not None
        missing = 0
        if not numbered:
            self._lines += 1
        try:
            number = self._known.layout.sequence_number(cells) if numbered else 0
            row, seconds = self._known.layout.row(cells), self._seconds(cells)
        except LineError:
            # What is numbered shows as a gap when the next one comes.
            self._lost += not numbered
            raise
        if numbered:
            late = self.sequence.step(number)
            if late is None:
                return self._placed(cells, self.no_answer.split(",")[len(self._known.passing) :])
            missing = late
        return self._placed(cells, self._answer(row, missing, seconds))

    def _answer(self, row: list[float], missing: int, seconds: float | None) -> list[str]:
        step = (missing + self._lost + 1) / self.settings.rate
        if seconds is not None:
            if self._last is not None and seconds > self._last:
                step = seconds - self._last
                self._check_time(step)
            self._last = seconds
        self._lost = 0
        self.samples += 1
        filter_ = self._filter
        assert filter_ is not None
        quaternion = filter_.update(*self._scaled(row), dt=step)
        texts = texts_of(quaternion)
        for _, read in self._beside:
            texts += texts_of(read(filter_))
        return texts

    def _check_time(self, step: float) -> None:
        """Refuse a time that contradicts the rate in many lines, as one in another unit does."""
        ratio = step * self.settings.rate
        self._odd = 0 if 1.0 / _APART < ratio < _APART else self._odd + 1
        if self._odd >= _ODD:
            raise ColumnError(
                f"the time and rate= contradict: {_ODD} lines are {step:.4g} s apart, and at "
                f"{self.settings.rate:g} Hz they would be {1.0 / self.settings.rate:.4g} s; name "
                "the column with its unit, time_ms for instance, or leave out --time"
            )

    def _scaled(self, row: list[float]) -> list[Any]:
        """Return the samples of the sensors, None for a magnetometer that is not there."""
        gyro, accel = np.array(row[:3]), np.array(row[3:6])
        if self.settings.gyro_scale is not None:
            gyro = gyro * self.settings.gyro_scale
        if self.settings.accel_scale is not None:
            accel = accel * self.settings.accel_scale
        mag = np.array(row[6:]) if len(row) == 9 and self.settings.mag else None
        return [gyro, accel, mag]

    def _seconds(self, cells: Sequence[str]) -> float | None:
        if self._known.time is None:
            return None
        cell = cells[self._known.time]
        try:
            found = float(cell) * self._known.seconds
        except ValueError:
            raise LineError("its time is not a number") from None
        return found if math.isfinite(found) else None

    def _placed(self, cells: Sequence[str], texts: Sequence[str]) -> str:
        return ",".join((*(cells[i] for i in self._known.passing), *texts))

    def to_bytes(self) -> bytes:
        """Return all that is needed to go on, with a checksum; the columns must be known."""
        known, filter_ = self._known, self._filter
        assert filter_ is not None
        fields = {
            "settings": asdict(self.settings),
            "opened": asdict(known),
            "counts": [self.samples, self._lines, self._lost, self._last],
            "sequence": [getattr(self.sequence, name) for name in _COUNTED],
        }
        text = json.dumps(fields).encode()
        body = _SIGNATURE + len(text).to_bytes(_LENGTH, "little") + text + filter_.to_bytes()
        return body + zlib.crc32(body).to_bytes(_CRC, "little")

    @classmethod
    def from_bytes(
        cls, raw: bytes, settings: AttitudeSettings | None = None, fields: int | None = None
    ) -> Self:
        """Return the stream that `to_bytes` saved; None takes settings and fields as they were.

        Raises
        ------
        CheckpointError
            The bytes are not whole, or hold what no stream of attitudes has saved.
        SettingsError
            They were saved with other settings.
        """
        text, filter_ = _unpacked(raw)
        try:
            saved = json.loads(text)
            stream = cls(AttitudeSettings.from_json(saved["settings"]))
            opened = dict(saved["opened"])
            layout = Layout(**{k: _tuple(v) for k, v in opened.pop("layout").items()})
            stream._opened = _Opened(layout, **opened)
            stream.samples, stream._lines, stream._lost, stream._last = saved["counts"]
            counted = dict(zip(_COUNTED, map(_tuple, saved["sequence"]), strict=True))
            stream.sequence = SequenceCount(
                stream.settings.rate, stream.settings.sequence_bits, **counted
            )
            stream._filter = filter_
            if not stream.sequence.possible or filter_.samples_seen != stream.samples:
                raise ValueError("the parts of the state do not belong together")
        except _FOREIGN:
            raise CheckpointError(
                "its checksum fits, but it holds no stream of attitudes"
            ) from None
        if settings is not None:
            _check_settings(stream, settings, fields)
        return stream


def _tuple(value: Any) -> Any:  # noqa: ANN401  # JSON knows no tuples
    return tuple(value) if isinstance(value, list) else value


def _unpacked(raw: bytes) -> tuple[bytes, Attitude]:
    if raw and not raw[: len(_SIGNATURE)] == _SIGNATURE[: len(raw)]:
        raise CheckpointError("it is no checkpoint of a stream of attitudes")
    body, found = raw[:-_CRC], raw[-_CRC:]
    if zlib.crc32(body).to_bytes(_CRC, "little") != found:
        raise CheckpointError("it is torn or damaged, its checksum does not fit")
    start = len(_SIGNATURE) + _LENGTH
    end = start + int.from_bytes(body[len(_SIGNATURE) : start], "little")
    try:
        return body[start:end], Attitude.from_bytes(body[end:])
    except ValueError as error:
        raise CheckpointError(str(error)) from None


def _check_settings(stream: AttitudeLines, now: AttitudeSettings, fields: int | None) -> None:
    then = asdict(stream.settings) | {"fields": stream._known.layout.fields}
    ours = asdict(now) | ({} if fields is None else {"fields": fields})
    for name, value in ours.items():
        if then[name] != value:
            raise SettingsError(f"it was made with {name}={then[name]}, now it is {value}")


def _found(cells: Sequence[str], settings: AttitudeSettings, fields: int | None) -> _Opened:
    """Return what the first line shows, be it a header or a sample."""
    if list(cells) == [""]:
        raise LineError("it is empty, expected names or numbers")
    if fields not in (None, len(cells)):
        raise LineError(f"it has {len(cells)} cells, expected {fields}")
    names, width = names_in(cells), len(cells)
    sequence, time = (
        None if column is None else position_of(column, names, width)
        for column in (settings.sequence, settings.time)
    )
    if settings.columns is not None:
        channels = [position_of(column, names, width) for column in settings.columns]
    elif names is not None:
        channels = _sensors(names)
    else:
        channels = [i for i in range(width) if i not in (sequence, time)]
    if len(channels) not in (6, 9) or len(set(channels)) < len(channels):
        raise ColumnError(
            f"an attitude needs six or nine columns, got {len(channels)}: choose with columns= "
            "gyro x,y,z, accelerometer x,y,z and maybe magnetometer x,y,z"
        )
    if {sequence, time} & set(channels):
        raise ColumnError("the column of the time or of the sequence number is one of a sensor too")
    meanings = [None if names is None else meaning_of(names[i]) for i in channels]
    stamps = None if names is None or time is None else time_unit(names[time])
    return _Opened(
        Layout(width, tuple(channels), sequence, names),
        time,
        _SECONDS[stamps or "s"],
        _unit("gyro", "rad/s or deg/s", settings.gyro_unit, meanings[0]),
        _unit("accelerometer", "g or m/s^2", settings.accel_unit, meanings[3]),
    )


def _sensors(names: Sequence[str]) -> list[int]:
    """Return the columns of one sensor of each kind, in the order x, y, z."""
    kinds = [places_of(names, kind) for kind in ("gyro", "accel", "mag")]
    return [place for places in kinds if len(places) == 3 for place in places]


def _unit(sensor: str, known: str, given: str | None, meaning: Meaning | None) -> str:
    own = None if meaning is None else meaning.unit
    if own is not None and given is not None and own != given:
        raise ColumnError(f"the {sensor} is named in {own}, but unit= is {given}")
    found = own or given
    if found is None:
        raise ColumnError(f"the unit of the {sensor} is not known; unit= gives it: {known}")
    return found
