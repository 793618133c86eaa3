"""Navigation as the engine of a stream: answers are positions, velocities and orientations."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, ClassVar, Final, Self

import numpy as np

from zerorate._native import NavigationFilter
from zerorate.faults import ArgumentError, keyword_argument, make_sentence
from zerorate.io.clocks.causal import Step
from zerorate.io.clocks.units import check_time_unit
from zerorate.record.names import meaning_of
from zerorate.tasks.live.checkpoint import (
    check_count,
    lists_to_tuples,
    restore_filter,
    tuples_to_lists,
)
from zerorate.tasks.live.engine import Engine
from zerorate.tasks.live.lines import (
    ColumnError,
    ColumnRequest,
    Layout,
    LineError,
    find_layout,
    format_numbers,
    header_names,
    position_of,
)
from zerorate.tasks.live.stamp_clock import StampClock, TimedEngine, restore_stamp_clock

_NED: Final = ("north", "east", "down")
_POSITION_COLUMNS: Final = ("latitude_deg", "longitude_deg", "height_m")
_COLUMNS: Final = (
    *_POSITION_COLUMNS,
    *(f"velocity_{axis}_mps" for axis in _NED),
    *(f"quat_{axis}" for axis in "wxyz"),
)
_COLUMN_COUNTS: Final = (6, 9, 12)
_SENSOR_UNITS: Final = ("rad/s", "m/s^2")
_MAX_TIME_S: Final = 4e9
"""Largest time with a resolution of a microsecond, s."""
_MAX_MISSING_SAMPLES: Final = 1 << 14
"""Largest number of missing samples processed one by one."""


class NavigationColumn(StrEnum):
    """Additional columns of an answer, after position, velocity and orientation.

    Examples
    --------
    >>> from zerorate.tasks.live import NavigationColumn
    >>> [column.value for column in NavigationColumn]
    ['status', 'sigma', 'verdict']
    """

    status = "status"
    sigma = "sigma"
    verdict = "verdict"


_EXTRA_COLUMNS: Final[Mapping[NavigationColumn, tuple[str, ...]]] = {
    NavigationColumn.status: ("status",),
    NavigationColumn.sigma: tuple(f"sigma_{axis}_m" for axis in _NED),
    NavigationColumn.verdict: ("verdict",),
}


@dataclass(frozen=True)
class NavigationSettings:
    """Navigation filter and columns of a live stream; a restart needs the same settings.

    Parameters
    ----------
    filter : NavigationFilter
        A new filter without samples; its state is copied.
    rate : float
        Samples per second, Hz. It determines the duration of a lost sample.
    time : str or int
        Column of the time of each sample.
    time_unit : str, optional
        Unit of the time, as ``time_unit`` of `zerorate.read_log`, if the column's name does not
        state it.
    extra : tuple of str
        Extra columns of an answer, from `NavigationColumn`: ``"status"``, ``"sigma"`` of the
        position, ``"verdict"`` on a fix.
    columns : tuple of str or int, optional
        Six columns: gyro x, y, z (rad/s) and accelerometer x, y, z (m/s^2). Nine columns:
        additionally latitude and longitude (deg) and height (m) of a fix at this time. Twelve
        columns: additionally the fix's velocity north, east, down (m/s). The cells are empty if
        there is no fix. Default: all columns except `time` and `sequence`.
    sequence : str or int, optional
        Column of the sequence number; None if there is none.
    sequence_bits : int, optional
        Width of the sequence number, bits; None: found from the data.
    position_sigma, velocity_sigma : float
        Standard deviations of fixes, m and m/s.

    Raises
    ------
    ValueError
        If the filter has processed samples, or an extra column is unknown.

    Examples
    --------
    >>> import zerorate as zr
    >>> from zerorate.tasks.live import LineStream, NavigationSettings
    >>> drive = zr.simulate_drive(duration=60.0, seed=1)
    >>> start = zr.align(drive.recording(), latitude=48.0, heading=0.3)
    >>> settings = NavigationSettings(zr.NavigationFilter(start), rate=100.0, time="t")
    >>> LineStream(settings).take("t,gx,gy,gz,ax,ay,az").split(",")[:4]
    ['t', 'latitude_deg', 'longitude_deg', 'height_m']
    """

    kind: ClassVar[str] = "navigation"

    filter: NavigationFilter
    rate: float
    time: str | int
    extra: tuple[str, ...] = ()
    columns: tuple[str | int, ...] | None = None
    sequence: str | int | None = None
    sequence_bits: int | None = None
    position_sigma: float = 2.0
    velocity_sigma: float = 0.1
    time_unit: str | None = None

    def __post_init__(self) -> None:
        """Check everything that does not depend on the lines."""
        seen = self.filter.samples_seen
        if seen:
            raise ArgumentError(
                "filter", f"must be one that has seen no sample, got {seen} samples"
            )
        object.__setattr__(self, "filter", self.filter.copy())
        object.__setattr__(self, "time_unit", check_time_unit(self.time_unit))
        for name in self.extra:
            NavigationColumn(name)
        for name in ("rate", "position_sigma", "velocity_sigma"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise ArgumentError(name, f"must be a positive number, got {getattr(self, name)}")

    def open_engine(self, cells: Sequence[str], fields: int | None) -> Engine:
        """Return a new filter for lines like the first line; raise LineError or ColumnError."""
        names = header_names(cells) if list(cells) != [""] else None
        time = position_of(self.time, names, len(cells))
        columns = self.columns
        if columns is None:
            sequence = self.sequence
            sequence_position = (
                None if sequence is None else position_of(sequence, names, len(cells))
            )
            columns = tuple(i for i in range(len(cells)) if i not in (time, sequence_position))
        layout = find_layout(cells, ColumnRequest(columns, self.sequence, fields, mixed=True))
        _check_units([names[i] for i in layout.channels[:6]] if names else [])
        stamp_clock = StampClock.of(
            self.rate, self.time, self.time_unit, names, len(cells), times=True
        )
        assert stamp_clock is not None
        return self._make_engine(layout, stamp_clock, self.filter.copy(), 0)

    def restore_engine(self, layout: Layout, saved: Mapping[str, Any], filter_: bytes) -> Engine:
        """Return the filter from a checkpoint; ValueError if its parts contradict each other."""
        nav, samples = (
            restore_filter(NavigationFilter.from_bytes, filter_),
            check_count(saved["samples"]),
        )
        if nav.samples_seen != samples:
            raise ValueError("the parts of the state do not match")
        stamp_clock = restore_stamp_clock(self.rate, saved)
        if stamp_clock is None:
            raise ValueError("the parts of the state do not match")
        engine = self._make_engine(layout, stamp_clock, nav, samples)
        engine.go_on(saved)
        return engine

    def _make_engine(
        self, layout: Layout, stamp_clock: StampClock, nav: NavigationFilter, samples: int
    ) -> "NavigationEngine":
        time = stamp_clock.column
        if len(layout.channels) not in _COLUMN_COUNTS:
            raise ColumnError(
                make_sentence(
                    "navigation needs six, nine or twelve columns, got "
                    f"{len(layout.channels)}: choose with ",
                    keyword_argument("columns"),
                    " x, y, z of gyro and accelerometer, then optionally latitude, longitude, "
                    "height, and velocity north, east, down of a fix",
                )
            )
        if time in layout.channels or time >= layout.fields:
            raise ColumnError("the column of the time is also the column of a sensor")
        return NavigationEngine(layout, self, nav, stamp_clock, samples)

    def as_json(self) -> dict[str, Any]:
        """Return the settings in the types of JSON."""
        raw = base64.b64encode(self.filter.to_bytes()).decode()
        return {
            "filter": raw,
            **tuples_to_lists({name: getattr(self, name) for name in _SETTING_FIELDS}),
        }

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Return the settings from the output of `as_json`."""
        arguments = lists_to_tuples(fields)
        raw = base64.b64decode(arguments.pop("filter"))
        return cls(restore_filter(NavigationFilter.from_bytes, raw), **arguments)


def _check_units(names: Sequence[str]) -> None:
    """Raise ColumnError if the names state other units than the filter's."""
    for i, name in enumerate(names):
        meaning, expected = meaning_of(name), _SENSOR_UNITS[i // 3]
        unit = None if meaning is None else meaning.unit
        if unit not in (None, expected):
            raise ColumnError(f"'{name}' is in {unit}, a navigation takes {expected}")


_SETTING_FIELDS: Final = (
    "rate",
    "time",
    "extra",
    "columns",
    "sequence",
    "sequence_bits",
    "position_sigma",
    "velocity_sigma",
    "time_unit",
)


class NavigationEngine(TimedEngine):
    """Engine that answers each sample with position, velocity, orientation and extra columns.

    Parameters
    ----------
    layout : Layout
        Layout of every line.
    settings : NavigationSettings
        Requested settings.
    nav : NavigationFilter
        The filter.
    stamp_clock : StampClock
        The clock.
    samples : int
        Number of samples to date, including lost samples.
    """

    def __init__(
        self,
        layout: Layout,
        settings: NavigationSettings,
        nav: NavigationFilter,
        stamp_clock: StampClock,
        samples: int = 0,
    ) -> None:
        super().__init__(layout, samples, stamp_clock)
        self._settings, self._nav = settings, nav
        self._status_and_verdict = ("", "")
        if len(layout.channels) > _COLUMN_COUNTS[0]:
            self._held_rows = None  # only one of several repeated rows has the fix
        self._extra_columns = [NavigationColumn(name) for name in settings.extra]

    @property
    def columns(self) -> Sequence[str]:
        """Names of the columns of an answer."""
        return [
            *_COLUMNS,
            *(name for column in self._extra_columns for name in _EXTRA_COLUMNS[column]),
        ]

    def read(self, cells: Sequence[str]) -> tuple[list[float], float | None]:
        """Return the numbers of a line and its stamp; LineError for a garbled line."""
        row, stamp = self.layout.row(cells), self.stamp(cells)
        if stamp is None or abs(self._start + stamp) > _MAX_TIME_S:
            raise LineError("its time is missing or invalid")
        return row, stamp

    @property
    def _start(self) -> float:
        return self.stamp_clock.cells.start if self.stamp_clock is not None else 0.0

    def feed(self, row: list[float], step: Step, left_out: bool) -> None:
        """Process the samples missing before this one, then this one and its fix."""
        time, nav, settings = self._start + step.time, self._nav, self._settings
        if step.missing:
            self._miss(step, time)
        self.samples += 1
        numbers = np.array(row)
        status, verdict = nav.update(time, numbers[:3], numbers[3:6]), "none"
        if len(numbers) > 6 and np.isfinite(numbers[6:]).any():
            verdict = nav.update_gnss(
                time,
                numbers[6:9],
                numbers[9:] if len(numbers) > 9 else None,
                settings.position_sigma,
                settings.velocity_sigma,
            )
            status = nav.status
        self._status_and_verdict = status, verdict

    def _miss(self, step: Step, time: float) -> None:
        """Process missing samples; for a long gap, only the time."""
        dt = 1.0 / self._settings.rate if step.dt is None else step.dt
        nothing = np.full(3, np.nan)
        for i in range(min(step.missing, _MAX_MISSING_SAMPLES), 0, -1):
            self.samples += 1
            self._nav.update(time - i * dt, nothing, nothing)

    def texts(self) -> list[str]:
        """Return position, velocity and orientation, and the requested extra columns."""
        nav, (status, verdict) = self._nav, self._status_and_verdict
        texts = [
            text
            for part in (nav.position, nav.velocity, nav.quaternion)
            for text in format_numbers(part)
        ]
        for column in self._extra_columns:
            if column is NavigationColumn.sigma:
                texts += format_numbers(nav.sigma[:3])
            else:
                texts.append(status if column is NavigationColumn.status else verdict)
        return texts

    def state(self) -> dict[str, Any]:
        """Return the state of the clock; the filter holds all other state."""
        return self.timing()

    def snapshot(self) -> list[Any]:
        """Return the current state of the filter."""
        return [self.samples, self._nav.to_bytes()]

    def restore(self, saved: Sequence[Any]) -> None:
        """Restore an earlier state of the filter."""
        self.samples, raw = saved
        self._nav = NavigationFilter.from_bytes(raw)

    def to_bytes(self) -> bytes:
        """Return the filter as bytes."""
        return self._nav.to_bytes()
