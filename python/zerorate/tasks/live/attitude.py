"""Attitude as the engine of a stream: gyro, accelerometer, magnetometer in, orientations out."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, ClassVar, Final, Self

import numpy as np

from zerorate._native import Attitude
from zerorate.checks.impossible import ImpossibleRates
from zerorate.faults import ArgumentError, given, said
from zerorate.io.clocks.causal import Step
from zerorate.io.clocks.units import checked_time_unit
from zerorate.io.counts import Scale, Scaling
from zerorate.io.triads import places_of
from zerorate.record.names import Meaning, canonical_unit, meaning_of
from zerorate.tasks.live.checkpoint import as_lists, as_tuples, filter_of, whole
from zerorate.tasks.live.engine import Engine
from zerorate.tasks.live.lines import (
    ColumnError,
    Layout,
    LineError,
    names_in,
    position_of,
    texts_of,
)
from zerorate.tasks.live.timed import Clocked, ClockedEngine, clocked_in
from zerorate.tasks.live.view import View
from zerorate.tasks.source import units_of_sensors
from zerorate.units import UNITS, convert

_APART: Final = 30.0
"""Factor by which steps of the time may be off the rate, unless lines are lost."""
_ODD: Final = 10
"""Lines in a row that are."""
_LOOKED_AT: Final = 1000
"""Lines at the beginning that show whether they are."""
_PIECE: Final = 1 << 16
"""Missing samples that the filter is given at once."""

_QUATERNION: Final = tuple(f"quat_{axis}" for axis in "wxyz")
_DEG: Final = math.degrees(1.0)


# Half a turn about the first axis makes of north, east, down axes of which the third is up.
_UP: Final[Mapping[str, Callable[..., tuple[float, ...]]]] = {
    "enu": lambda w, x, y, z: (w, x, y, z),
    "nwu": lambda w, x, y, z: (w, x, y, z),
    "ned": lambda w, x, y, z: (-x, w, -z, y),
}


class WithAttitude(StrEnum):
    """Columns that may follow the quaternion in an answer, angles in deg.

    Examples
    --------
    >>> from zerorate.tasks.live import WithAttitude
    >>> [column.value for column in WithAttitude]
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
    time_unit : str, optional
        Unit of the time, as ``time_unit`` of `zerorate.read_log`, where its name does not say it.
    sequence_bits : int, optional
        Width of the counter that numbers the samples; None if it is to be learned.
    gyro_unit, accel_unit : str, optional
        Where a header line does not say them.
    gyro_scale, accel_scale : float, optional
        What samples are multiplied by; the units are those that they have then.
    bias_limit : float, optional
        Largest bias of the gyro, in its unit; default 10 deg/s.
    limit : float, optional
        End of the gyro's range, in its unit: a sample beyond it is missing. Default 4000 deg/s.
    learn_magnetometer : bool
        Whether to learn the magnetometer's hard iron from the motion.

    Raises
    ------
    ValueError
        If the rate, the frame, a column beside or a unit is not known.

    Examples
    --------
    >>> from zerorate.tasks.live import AttitudeSettings, LineStream
    >>> settings = AttitudeSettings(100.0, frame="ned", beside=("heading_sigma",))
    >>> LineStream(settings).take("t,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g")
    't,quat_w,quat_x,quat_y,quat_z,heading_sigma_deg'
    """

    kind: ClassVar[str] = "attitude"

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
    bias_limit: float | None = None
    learn_magnetometer: bool = False
    time_unit: str | None = None
    limit: float | None = None

    @classmethod
    def of_reading(cls, rate: float, unit: str | None, scale: Scale, **asked: Any) -> Self:  # noqa: ANN401
        """Return settings of lines with this unit and scale, as `zerorate.read_log` takes them."""
        units, scaling = units_of_sensors(unit) or {}, Scaling.of(scale)
        return cls(
            rate,
            gyro_unit=scaling.unit("gyro", units.get("gyro")),
            accel_unit=scaling.unit("accel", units.get("accel")),
            gyro_scale=scaling.of_kind("gyro", first=True),
            accel_scale=scaling.of_kind("accel", first=False),
            **asked,
        )

    def __post_init__(self) -> None:
        """Check all that does not depend on the lines."""
        object.__setattr__(self, "time_unit", checked_time_unit(self.time_unit))
        if self.limit is not None and not 0.0 < self.limit < math.inf:
            raise ArgumentError("limit", f"must be a positive number, got {self.limit}")
        self.filter(True, "rad/s", "m/s^2")
        for name in self.beside:
            WithAttitude(name)
        if self.columns is not None and len(self.columns) not in (6, 9):
            raise ValueError(
                said(
                    given("columns"),
                    " takes six columns, or nine with a magnetometer, of gyro and accelerometer, "
                    f"got {len(self.columns)}",
                )
            )
        for name, kind in (("gyro_unit", "rate"), ("accel_unit", "acceleration")):
            unit = getattr(self, name)
            if unit is not None:
                _check_unit(name, unit, kind)
                object.__setattr__(self, name, canonical_unit(unit))

    def opened(self, cells: Sequence[str], fields: int | None) -> Engine:
        """Return a new filter for lines as the first one is; LineError or ColumnError if none."""
        opened = _found(cells, self, fields)
        mag = len(opened.layout.channels) == 9
        if self.learn_magnetometer and not mag:
            raise ColumnError("the lines hold no magnetometer to be learned")
        filter_ = self.filter(mag, opened.gyro_unit, opened.accel_unit)
        layout = opened.layout
        clocked = Clocked.of(self.rate, self.time, self.time_unit, layout.names, layout.fields)
        return AttitudeEngine(opened, self, filter_, clocked=clocked)

    def restored(self, layout: Layout, saved: Mapping[str, Any], filter_: bytes) -> Engine:
        """Return the filter of a checkpoint; ValueError if its parts do not belong together."""
        found, samples = filter_of(Attitude.from_bytes, filter_), whole(saved["samples"])
        if found.samples_seen != samples:
            raise ValueError("the parts of the state do not belong together")
        opened = Opened(layout, **saved["opened"])
        engine = AttitudeEngine(opened, self, found, samples, clocked_in(self.rate, saved))
        engine.go_on(saved)
        return engine

    def as_json(self) -> dict[str, Any]:
        """Return the settings as JSON keeps them."""
        return as_lists(asdict(self))

    def filter(self, mag: bool, gyro_unit: str, accel_unit: str) -> Attitude:
        """Return a new filter of samples in these units."""
        settings: Any = {"frame": self.frame, "gyro_unit": gyro_unit, "accel_unit": accel_unit}
        settings["bias_limit"] = self.bias_limit
        settings["learn_magnetometer"] = self.learn_magnetometer
        return Attitude(self.rate, mag=mag and self.mag, **settings)

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Return the settings that `as_json` gave."""
        return cls(**as_tuples(fields))


def _check_unit(name: str, unit: str, kind: str) -> None:
    known = canonical_unit(unit)
    if known not in UNITS or UNITS[known].kind != kind:
        raise ValueError(f"{name} is no unit of {kind}: '{unit}'")


class AttitudeEngine(ClockedEngine):
    """Answers each sample with the quaternion w, x, y, z from sensor to earth, and what is beside.

    A line holds gyro, accelerometer and maybe magnetometer, three numbers each; an empty cell or
    ``nan`` is missing, and so is all of its sensor.

    Parameters
    ----------
    opened : Opened
        What the first line told.
    settings : AttitudeSettings
        What was asked for.
    filter : Attitude
        The filter.
    samples : int
        Samples that it has seen, those lost or garbled among them.
    clocked : Clocked, optional
        The clock.
    """

    def __init__(
        self,
        opened: "Opened",
        settings: AttitudeSettings,
        filter: Attitude,  # what it is everywhere
        samples: int = 0,
        clocked: Clocked | None = None,
    ) -> None:
        radian = convert(1.0, opened.gyro_unit, "rad/s")
        limit = None if settings.limit is None else settings.limit * radian
        scale = radian * (settings.gyro_scale or 1.0)
        check = ImpossibleRates(limit, settings.rate, scale)
        super().__init__(opened.layout, samples, clocked, check)
        self._opened, self._settings, self._filter = opened, settings, filter
        self._mag = settings.mag and len(opened.layout.channels) == 9
        self._last, self._odd, self._unchecked = 0.0, 0, _LOOKED_AT
        self._gyro: Any = None
        self._quaternion: Any = None
        self._beside = [_BESIDE[WithAttitude(name)] for name in settings.beside]

    @property
    def columns(self) -> Sequence[str]:
        """Names of the quaternion's numbers and of what stands beside them."""
        return [*_QUATERNION, *(name for names, _ in self._beside for name in names)]

    @property
    def opening(self) -> str:
        """A sentence on which columns are of which sensor."""
        labels, opened = self.layout.labels, self._opened
        groups = [", ".join(labels[i : i + 3]) for i in range(0, len(labels), 3)]
        told = [f"gyro {groups[0]} in {opened.gyro_unit}"]
        told.append(f"accelerometer {groups[1]} in {opened.accel_unit}")
        if len(groups) == 3:
            unused = "" if self._settings.mag else " (not used)"
            told.append(f"magnetometer {groups[2]}{unused}")
        passing = self.layout.passing
        return "; ".join((*told, *([f"passes on {', '.join(passing)}"] if passing else [])))

    def read(self, cells: Sequence[str]) -> tuple[list[float], float | None]:
        """Return the numbers of all sensors, and the stamp in s."""
        row, stamp = self.layout.row(cells), self.stamp(cells)
        if self._unchecked and stamp is not None:
            self._check_time(stamp)
        return row, stamp

    def feed(self, row: list[float], step: Step, left_out: bool) -> None:
        """Give a sample to the filter, after those that are missing before it."""
        if step.missing:
            self._miss(step.missing, step.dt)
        gyro, accel, mag = self._scaled(row)
        if left_out:
            gyro = np.full(3, np.nan)
        self.samples += 1
        self._gyro = gyro
        self._quaternion = self._filter.update(gyro, accel, mag, dt=step.dt)

    def _miss(self, count: int, dt: float | None) -> None:
        """Give so many missing samples to the filter."""
        self.samples += count
        while count > 0:
            n = min(count, _PIECE)
            nothing = np.full((n, 3), np.nan)
            steps = None if dt is None else np.full(n, dt)
            self._filter.process(nothing, nothing, nothing if self._mag else None, dt=steps)
            count -= n

    def texts(self) -> list[str]:
        """Return the orientation, and what was asked for beside it."""
        texts = texts_of(self._quaternion)
        for _, read in self._beside:
            texts += texts_of(read(self._filter))
        return texts

    def saved(self) -> list[Any]:
        """Return the filter as it is."""
        return [self.samples, self._filter.to_bytes()]

    def restore(self, saved: Sequence[Any]) -> None:
        """Take the filter as it was."""
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
            unit=self._opened.gyro_unit,
            rate=tuple((self._gyro - filter_.bias).tolist()),
            bias=tuple(filter_.bias.tolist()),
            bias_sigma=tuple(filter_.bias_sigma.tolist()),
            status=str(filter_.status),
            quaternion=tuple(_UP[self._settings.frame](*filter_.quaternion.tolist())),
            euler_deg=tuple((filter_.euler * _DEG).tolist()),
        )

    def sentences(self) -> Iterator[str]:
        """Yield what there is to say at the end."""
        yield from super().sentences()
        if self._filter.status == "wrong unit":
            yield "what the accelerometer shows at rest is not gravity: is its unit right?"

    def state(self) -> dict[str, Any]:
        """Return what the first line told, and how the time goes on."""
        opened = asdict(self._opened)
        del opened["layout"]
        return {"opened": opened, **self.timing()}

    def to_bytes(self) -> bytes:
        """Return the filter."""
        return self._filter.to_bytes()

    def _check_time(self, stamp: float) -> None:
        """Refuse a time that contradicts the rate in many lines, as one in another unit does."""
        step, self._last = stamp - self._last, stamp
        self._unchecked -= 1
        rate = self._settings.rate
        odd = step > 0.0 and not 1.0 / _APART < step * rate < _APART
        self._odd = self._odd + 1 if odd else 0
        if self._odd >= _ODD:
            raise ColumnError(
                said(
                    "the time and ",
                    given("rate"),
                    f" contradict: {_ODD} lines are {step:.4g} s apart, and at {rate:g} Hz they "
                    f"would be {1.0 / rate:.4g} s; name the column with its unit, time_ms for "
                    "instance, or leave out ",
                    given("time"),
                )
            )

    def _scaled(self, row: list[float]) -> list[Any]:
        """Return the samples of the sensors, None for a magnetometer that is not there."""
        gyro, accel = np.array(row[:3]), np.array(row[3:6])
        if self._settings.gyro_scale is not None:
            gyro = gyro * self._settings.gyro_scale
        if self._settings.accel_scale is not None:
            accel = accel * self._settings.accel_scale
        return [gyro, accel, np.array(row[6:]) if self._mag else None]


@dataclass(frozen=True)
class Opened:
    """What the first line tells: where everything stands, and the units."""

    layout: Layout
    gyro_unit: str
    accel_unit: str


def _found(cells: Sequence[str], settings: AttitudeSettings, fields: int | None) -> Opened:
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
            said(
                f"an attitude needs six or nine columns, got {len(channels)}: choose with ",
                given("columns"),
                " gyro x,y,z, accelerometer x,y,z and maybe magnetometer x,y,z",
            )
        )
    if {sequence, time} & set(channels):
        raise ColumnError("the column of the time or of the sequence number is one of a sensor too")
    meanings = [None if names is None else meaning_of(names[i]) for i in channels]
    return Opened(
        Layout(width, tuple(channels), sequence, names),
        _unit("gyro", "rad/s or deg/s", settings.gyro_unit, meanings[0]),
        _unit("accelerometer", "g or m/s^2", settings.accel_unit, meanings[3]),
    )


def _sensors(names: Sequence[str]) -> list[int]:
    """Return the columns of one sensor of each kind, in the order x, y, z."""
    kinds = [places_of(names, kind) for kind in ("gyro", "accel", "mag")]
    return [place for places in kinds if len(places) == 3 for place in places]


def _unit(sensor: str, known: str, asked: str | None, meaning: Meaning | None) -> str:
    own = None if meaning is None else meaning.unit
    if own is not None and asked is not None and own != asked:
        raise ColumnError(
            said(f"the {sensor} is named in {own}, but ", given("unit"), f" is {asked}")
        )
    found = own or asked
    if found is None:
        raise ColumnError(
            said(f"the unit of the {sensor} is not known; ", given("unit"), f" gives it: {known}")
        )
    return found
