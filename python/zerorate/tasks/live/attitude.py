"""Attitude as the engine of a stream: answers are orientations."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, ClassVar, Final, Self

import numpy as np

from zerorate._native import Attitude
from zerorate.checks.impossible import ImpossibleRateDetector
from zerorate.faults import ArgumentError, keyword_argument, make_sentence
from zerorate.io.clocks.causal import Step
from zerorate.io.clocks.units import check_time_unit
from zerorate.io.counts import Scale, Scaling
from zerorate.record.names import Meaning, canonical_unit, meaning_of
from zerorate.tasks.live.checkpoint import (
    check_count,
    lists_to_tuples,
    restore_filter,
    tuples_to_lists,
)
from zerorate.tasks.live.engine import Engine
from zerorate.tasks.live.lines import (
    ColumnError,
    Layout,
    LineError,
    columns_of_sensor,
    format_numbers,
    header_names,
    position_of,
)
from zerorate.tasks.live.stamp_clock import StampClock, TimedEngine, restore_stamp_clock
from zerorate.tasks.live.view import View
from zerorate.tasks.source import units_of_sensors
from zerorate.units import UNITS, convert

_MAX_STEP_RATIO: Final = 30.0
"""Largest ratio between a step of the time and the period, unless lines are lost."""
_MAX_ODD_LINES: Final = 10
"""Largest number of consecutive lines with such steps."""
_CHECKED_LINES: Final = 1000
"""Number of lines in which the time is checked."""
_MISSING_BLOCK_SAMPLES: Final = 1 << 16
"""Largest number of missing samples given to the filter at once."""

_QUATERNION: Final = tuple(f"quat_{axis}" for axis in "wxyz")
_DEG_PER_RAD: Final = math.degrees(1.0)


# Half a turn about the first axis turns north, east, down into axes with the third axis up.
_TO_Z_UP: Final[Mapping[str, Callable[..., tuple[float, ...]]]] = {
    "enu": lambda w, x, y, z: (w, x, y, z),
    "nwu": lambda w, x, y, z: (w, x, y, z),
    "ned": lambda w, x, y, z: (-x, w, -z, y),
}


class AttitudeColumn(StrEnum):
    """Additional columns of an answer, after the quaternion; angles are in deg.

    Examples
    --------
    >>> from zerorate.tasks.live import AttitudeColumn
    >>> [column.value for column in AttitudeColumn]
    ['euler', 'heading', 'tilt_sigma', 'heading_sigma', 'at_rest', 'disturbed', 'linear', 'bias']
    """

    euler = "euler"
    heading = "heading"
    tilt_sigma = "tilt_sigma"
    heading_sigma = "heading_sigma"
    at_rest = "at_rest"
    disturbed = "disturbed"
    linear = "linear"
    bias = "bias"


_EXTRA_COLUMNS: Final[
    Mapping[AttitudeColumn, tuple[tuple[str, ...], Callable[[Attitude], Any]]]
] = {
    AttitudeColumn.euler: (("roll_deg", "pitch_deg", "yaw_deg"), lambda f: f.euler * _DEG_PER_RAD),
    AttitudeColumn.heading: (("heading_deg",), lambda f: f.heading * _DEG_PER_RAD),
    AttitudeColumn.tilt_sigma: (("tilt_sigma_deg",), lambda f: f.tilt_sigma * _DEG_PER_RAD),
    AttitudeColumn.heading_sigma: (
        ("heading_sigma_deg",),
        lambda f: f.heading_sigma * _DEG_PER_RAD,
    ),
    AttitudeColumn.at_rest: (("at_rest",), lambda f: f.at_rest),
    AttitudeColumn.disturbed: (("disturbed",), lambda f: f.disturbed),
    AttitudeColumn.linear: (
        tuple(f"linear_{axis}_mps2" for axis in "xyz"),
        lambda f: f.linear_acceleration,
    ),
    AttitudeColumn.bias: (
        tuple(f"bias_{axis}_dps" for axis in "xyz"),
        lambda f: f.bias * _DEG_PER_RAD,
    ),
}


@dataclass(frozen=True)
class AttitudeSettings:
    """Attitude filter and columns of a live stream; a restart needs the same settings.

    Parameters
    ----------
    rate : float
        Samples per second, Hz.
    frame : str
        Axes of the earth: ``"enu"``, ``"ned"`` or ``"nwu"``.
    mag : bool
        Use the magnetometer if the lines contain one.
    extra : tuple of str
        Extra columns of an answer, from `AttitudeColumn`.
    columns : tuple of str or int, optional
        Six or nine columns: gyro, accelerometer and optionally magnetometer, each x, y, z. Default:
        columns with such names in a header line. Without a header line: all columns except
        `sequence` and `time`.
    sequence, time : str or int, optional
        Column of the sequence number, and column of the time; None if there is none.
    time_unit : str, optional
        Unit of the time, as ``time_unit`` of `zerorate.read_log`, if the column's name does not
        state it.
    sequence_bits : int, optional
        Width of the sequence number, bits; None: found from the data.
    gyro_unit, accel_unit : str, optional
        Units, if the header line does not state them.
    gyro_scale, accel_scale : float, optional
        Factors of the samples; the units apply after the multiplication.
    bias_limit : float, optional
        Largest bias of the gyro, in its unit; default 10 deg/s.
    limit : float, optional
        End of the gyro's range, in its unit; samples beyond it count as missing. Default 4000
        deg/s.
    learn_magnetometer : bool
        Learn the magnetometer's hard iron from the motion.

    Raises
    ------
    ValueError
        If the rate is not valid, or the frame, an extra column or a unit is unknown.

    Examples
    --------
    >>> from zerorate.tasks.live import AttitudeSettings, LineStream
    >>> settings = AttitudeSettings(100.0, frame="ned", extra=("heading_sigma",))
    >>> LineStream(settings).take("t,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g")
    't,quat_w,quat_x,quat_y,quat_z,heading_sigma_deg'
    """

    kind: ClassVar[str] = "attitude"

    rate: float
    frame: str = "enu"
    mag: bool = True
    extra: tuple[str, ...] = ()
    columns: tuple[str | int, ...] | None = None
    sequence: str | int | None = None
    time: str | int | None = None
    sequence_bits: int | None = None
    gyro_unit: str | None = None
    accel_unit: str | None = None
    gyro_scale: float | None = None
    accel_scale: float | None = None
    bias_limit: float | None = None
    learn_magnetometer: bool = False
    time_unit: str | None = None
    limit: float | None = None

    @classmethod
    def of_reading(cls, rate: float, unit: str | None, data_scale: Scale, **asked: Any) -> Self:  # noqa: ANN401
        """Return settings for lines with the unit and scale of `zerorate.read_log`."""
        units, scaling = units_of_sensors(unit) or {}, Scaling.of(data_scale)
        return cls(
            rate,
            gyro_unit=scaling.unit("gyro", units.get("gyro")),
            accel_unit=scaling.unit("accel", units.get("accel")),
            gyro_scale=scaling.factor_for("gyro", first=True),
            accel_scale=scaling.factor_for("accel", first=False),
            **asked,
        )

    def __post_init__(self) -> None:
        """Check everything that does not depend on the lines."""
        object.__setattr__(self, "time_unit", check_time_unit(self.time_unit))
        if self.limit is not None and not 0.0 < self.limit < math.inf:
            raise ArgumentError("limit", f"must be a positive number, got {self.limit}")
        self.filter(True, "rad/s", "m/s^2")
        for name in self.extra:
            AttitudeColumn(name)
        if self.columns is not None and len(self.columns) not in (6, 9):
            raise ValueError(
                make_sentence(
                    keyword_argument("columns"),
                    " takes six columns, or nine with a magnetometer, of gyro and accelerometer, "
                    f"got {len(self.columns)}",
                )
            )
        for name, kind in (("gyro_unit", "rate"), ("accel_unit", "acceleration")):
            unit = getattr(self, name)
            if unit is not None:
                _check_unit(name, unit, kind)
                object.__setattr__(self, name, canonical_unit(unit))

    def open_engine(self, cells: Sequence[str], fields: int | None) -> Engine:
        """Return a new filter for lines like the first line; raise LineError or ColumnError."""
        first_line = _read_first_line(cells, self, fields)
        mag = len(first_line.layout.channels) == 9
        if self.learn_magnetometer and not mag:
            raise ColumnError("the lines have no magnetometer")
        filter_ = self.filter(mag, first_line.gyro_unit, first_line.accel_unit)
        layout = first_line.layout
        stamp_clock = StampClock.of(
            self.rate, self.time, self.time_unit, layout.names, layout.fields
        )
        return AttitudeEngine(first_line, self, filter_, stamp_clock=stamp_clock)

    def restore_engine(self, layout: Layout, saved: Mapping[str, Any], filter_: bytes) -> Engine:
        """Return the filter from a checkpoint; ValueError if its parts contradict each other."""
        attitude, samples = (
            restore_filter(Attitude.from_bytes, filter_),
            check_count(saved["samples"]),
        )
        if attitude.samples_seen != samples:
            raise ValueError("the parts of the state do not match")
        first_line = FirstLine(layout, **saved["opened"])
        engine = AttitudeEngine(
            first_line, self, attitude, samples, restore_stamp_clock(self.rate, saved)
        )
        engine.go_on(saved)
        return engine

    def as_json(self) -> dict[str, Any]:
        """Return the settings in the types of JSON."""
        return tuples_to_lists(asdict(self))

    def filter(self, mag: bool, gyro_unit: str, accel_unit: str) -> Attitude:
        """Return a new filter for samples in these units."""
        settings: Any = {"frame": self.frame, "gyro_unit": gyro_unit, "accel_unit": accel_unit}
        settings["bias_limit"] = self.bias_limit
        settings["learn_magnetometer"] = self.learn_magnetometer
        return Attitude(self.rate, mag=mag and self.mag, **settings)

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Return the settings from the output of `as_json`."""
        return cls(**lists_to_tuples(fields))


def _check_unit(name: str, unit: str, kind: str) -> None:
    known = canonical_unit(unit)
    if known not in UNITS or UNITS[known].kind != kind:
        raise ValueError(f"{name} is no unit of {kind}: '{unit}'")


class AttitudeEngine(TimedEngine):
    """Engine that answers each sample with the quaternion w, x, y, z from sensor to earth.

    A line has three numbers each for gyro, accelerometer and optionally magnetometer. If a cell is
    empty or ``nan``, the sensor's sample is missing. Extra columns follow the quaternion.

    Parameters
    ----------
    first_line : FirstLine
        Contents of the first line.
    settings : AttitudeSettings
        Requested settings.
    filter : Attitude
        The filter.
    samples : int
        Number of samples to date, including lost and garbled samples.
    stamp_clock : StampClock, optional
        The clock.
    """

    def __init__(
        self,
        first_line: "FirstLine",
        settings: AttitudeSettings,
        filter: Attitude,  # what it is everywhere
        samples: int = 0,
        stamp_clock: StampClock | None = None,
    ) -> None:
        radian = convert(1.0, first_line.gyro_unit, "rad/s")
        limit = None if settings.limit is None else settings.limit * radian
        scale = radian * (settings.gyro_scale or 1.0)
        check = ImpossibleRateDetector(limit, settings.rate, scale)
        super().__init__(first_line.layout, samples, stamp_clock, check)
        self._first_line, self._settings, self._filter = first_line, settings, filter
        self._mag = settings.mag and len(first_line.layout.channels) == 9
        self._last, self._odd, self._unchecked = 0.0, 0, _CHECKED_LINES
        self._gyro: Any = None
        self._quaternion: Any = None
        self._extra_columns = [_EXTRA_COLUMNS[AttitudeColumn(name)] for name in settings.extra]

    @property
    def columns(self) -> Sequence[str]:
        """Names of the quaternion's numbers and of the extra columns."""
        return [*_QUATERNION, *(name for names, _ in self._extra_columns for name in names)]

    @property
    def opening(self) -> str:
        """A sentence on the columns of each sensor."""
        labels, first_line = self.layout.labels, self._first_line
        groups = [", ".join(labels[i : i + 3]) for i in range(0, len(labels), 3)]
        parts = [f"gyro {groups[0]} in {first_line.gyro_unit}"]
        parts.append(f"accelerometer {groups[1]} in {first_line.accel_unit}")
        if len(groups) == 3:
            unused = "" if self._settings.mag else " (not used)"
            parts.append(f"magnetometer {groups[2]}{unused}")
        passing = self.layout.passthrough_labels
        return "; ".join((*parts, *([f"passes on {', '.join(passing)}"] if passing else [])))

    def read(self, cells: Sequence[str]) -> tuple[list[float], float | None]:
        """Return the numbers of all sensors, and the stamp in s."""
        row, stamp = self.layout.row(cells), self.stamp(cells)
        if self._unchecked and stamp is not None:
            self._check_time(stamp)
        return row, stamp

    def feed(self, row: list[float], step: Step, left_out: bool) -> None:
        """Process the samples missing before this one, then this one."""
        if step.missing:
            self._miss(step.missing, step.dt)
        gyro, accel, mag = self._scale_row(row)
        if left_out:
            gyro = np.full(3, np.nan)
        self.samples += 1
        self._gyro = gyro
        self._quaternion = self._filter.update(gyro, accel, mag, dt=step.dt)

    def _miss(self, count: int, dt: float | None) -> None:
        """Process `count` missing samples."""
        self.samples += count
        while count > 0:
            n = min(count, _MISSING_BLOCK_SAMPLES)
            nothing = np.full((n, 3), np.nan)
            steps = None if dt is None else np.full(n, dt)
            self._filter.process(nothing, nothing, nothing if self._mag else None, dt=steps)
            count -= n

    def texts(self) -> list[str]:
        """Return the orientation, and the requested extra columns."""
        texts = format_numbers(self._quaternion)
        for _, read in self._extra_columns:
            texts += format_numbers(read(self._filter))
        return texts

    def snapshot(self) -> list[Any]:
        """Return the current state of the filter."""
        return [self.samples, self._filter.to_bytes()]

    def restore(self, saved: Sequence[Any]) -> None:
        """Restore an earlier state of the filter."""
        self.samples, raw = saved
        self._filter = Attitude.from_bytes(raw)

    def view(self) -> View | None:
        """Return the rate without its bias, the bias, and the orientation."""
        if self._gyro is None:
            return None
        filter_ = self._filter
        return View(
            seconds=self.samples / self._settings.rate,
            names=tuple(self.layout.labels[:3]),
            unit=self._first_line.gyro_unit,
            rate=tuple((self._gyro - filter_.bias).tolist()),
            bias=tuple(filter_.bias.tolist()),
            bias_sigma=tuple(filter_.bias_sigma.tolist()),
            status=str(filter_.status),
            quaternion=tuple(_TO_Z_UP[self._settings.frame](*filter_.quaternion.tolist())),
            euler_deg=tuple((filter_.euler * _DEG_PER_RAD).tolist()),
        )

    def sentences(self) -> Iterator[str]:
        """Yield the notes of the whole stream."""
        yield from super().sentences()
        if self._filter.status == "wrong unit":
            yield "what the accelerometer shows at rest is not gravity: is its unit right?"

    def state(self) -> dict[str, Any]:
        """Return the contents of the first line, and the state of the clock."""
        first_line = asdict(self._first_line)
        del first_line["layout"]
        return {"opened": first_line, **self.timing()}

    def to_bytes(self) -> bytes:
        """Return the filter as bytes."""
        return self._filter.to_bytes()

    def _check_time(self, stamp: float) -> None:
        """Raise an error if the time contradicts the rate in many lines, as with a wrong unit."""
        step, self._last = stamp - self._last, stamp
        self._unchecked -= 1
        rate = self._settings.rate
        odd = step > 0.0 and not 1.0 / _MAX_STEP_RATIO < step * rate < _MAX_STEP_RATIO
        self._odd = self._odd + 1 if odd else 0
        if self._odd >= _MAX_ODD_LINES:
            raise ColumnError(
                make_sentence(
                    "the time and ",
                    keyword_argument("rate"),
                    f" contradict: {_MAX_ODD_LINES} lines are {step:.4g} s apart, and at "
                    f"{rate:g} Hz they "
                    f"would be {1.0 / rate:.4g} s; name the column with its unit, time_ms for "
                    "instance, or leave out ",
                    keyword_argument("time"),
                )
            )

    def _scale_row(self, row: list[float]) -> list[Any]:
        """Return the samples of the sensors; None for a missing magnetometer."""
        gyro, accel = np.array(row[:3]), np.array(row[3:6])
        if self._settings.gyro_scale is not None:
            gyro = gyro * self._settings.gyro_scale
        if self._settings.accel_scale is not None:
            accel = accel * self._settings.accel_scale
        return [gyro, accel, np.array(row[6:]) if self._mag else None]


@dataclass(frozen=True)
class FirstLine:
    """Contents of the first line: the columns' positions, and the units."""

    layout: Layout
    gyro_unit: str
    accel_unit: str


def _read_first_line(
    cells: Sequence[str], settings: AttitudeSettings, fields: int | None
) -> FirstLine:
    """Return the contents of the first line, a header or a sample."""
    if list(cells) == [""]:
        raise LineError("it is empty, expected names or numbers")
    if fields not in (None, len(cells)):
        raise LineError(f"it has {len(cells)} cells, expected {fields}")
    names, width = header_names(cells, settings.columns), len(cells)
    sequence, time = (
        None if column is None else position_of(column, names, width)
        for column in (settings.sequence, settings.time)
    )
    if settings.columns is not None:
        channels = [position_of(column, names, width) for column in settings.columns]
    elif names is not None:
        channels = _find_sensors(names)
    else:
        channels = [i for i in range(width) if i not in (sequence, time)]
    if len(channels) not in (6, 9) or len(set(channels)) < len(channels):
        raise ColumnError(
            make_sentence(
                f"an attitude needs six or nine columns, got {len(channels)}: choose with ",
                keyword_argument("columns"),
                " x, y, z of gyro, accelerometer and optionally magnetometer",
            )
        )
    if {sequence, time} & set(channels):
        raise ColumnError(
            "the column of the time or of the sequence number is also the column of a sensor"
        )
    meanings = [None if names is None else meaning_of(names[i]) for i in channels]
    return FirstLine(
        Layout(width, tuple(channels), sequence, names),
        _choose_unit("gyro", "rad/s or deg/s", settings.gyro_unit, meanings[0]),
        _choose_unit("accelerometer", "g or m/s^2", settings.accel_unit, meanings[3]),
    )


def _find_sensors(names: Sequence[str]) -> list[int]:
    """Return the columns of one sensor of each kind, in the order x, y, z."""
    kinds = [columns_of_sensor(names, kind) for kind in ("gyro", "accel", "mag")]
    return [column for columns in kinds if len(columns) == 3 for column in columns]


def _choose_unit(sensor: str, examples: str, stated: str | None, meaning: Meaning | None) -> str:
    named_unit = None if meaning is None else meaning.unit
    if named_unit is not None and stated is not None and named_unit != stated:
        raise ColumnError(
            make_sentence(
                f"the {sensor} is named in {named_unit}, but ",
                keyword_argument("unit"),
                f" is {stated}",
            )
        )
    unit = named_unit or stated
    if unit is None:
        raise ColumnError(
            make_sentence(
                f"the unit of the {sensor} is not known; ",
                keyword_argument("unit"),
                f" gives it: {examples}",
            )
        )
    return unit
