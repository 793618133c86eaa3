"""What a stream is asked for: its filter, and what its lines hold."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Final, Self, Unpack

from zerorate._native import DriftFilter, MotionDetector
from zerorate.faults import ArgumentError, given, said
from zerorate.io.clocks.units import checked_time_unit
from zerorate.io.counts import Scale, Scaling
from zerorate.io.triads import accelerometer_of
from zerorate.options import FILTER_OPTIONS, LIMITS, StreamOptions, checked_options, with_limits
from zerorate.record.names import canonical_unit
from zerorate.tasks.live.checkpoint import as_lists, as_tuples, filter_of, whole
from zerorate.tasks.live.drift import DriftEngine
from zerorate.tasks.live.engine import Engine
from zerorate.tasks.live.lines import Beside, ColumnError, Layout, Wanted, find_layout, position_of
from zerorate.tasks.live.running import Running
from zerorate.tasks.live.sequence import MOST_BITS
from zerorate.tasks.live.timed import Clocked, clocked_in

_LINES: Final = (
    "beside",
    "columns",
    "unit",
    "data_scale",
    "sequence",
    "sequence_bits",
    "accel_columns",
    "time",
    "time_unit",
)
_AXES: Final = 3


@dataclass(frozen=True, init=False)
class Settings:
    """The filter of a stream, and what its lines hold: the same after a restart.

    Parameters
    ----------
    rate : float
        Samples a second.
    beside : tuple of str
        Further columns of an answer: ``"bias"``, ``"bias_sigma"``, ``"at_rest"``,
        ``"saturated"``, ``"stuck"``.
    columns : tuple of str or int, optional
        Channels by name or position. By default those that a header line names like gyros; without
        a header line all but the sequence number.
    unit : str, optional
        Of the channels, where a header line does not say it. If it is known, `rest_limit` is
        10 deg/s and `bias_limit` 20 deg/s unless they are given; None is no limit.
    data_scale : float, optional
        What samples are multiplied by, such as raw counts; the unit is the one they have then.
    sequence : str or int, optional
        Column of the sequence number; None for no such column.
    sequence_bits : int, optional
        Width of the counter that numbers the samples; None if it is to be learned.
    accel_columns : tuple of str or int, optional
        Those of an accelerometer, x, y, z, which tells the filter of motion, as in a replay, and
        passes through. By default those that a header line names like the one of the gyro; none if
        empty.
    time : str or int, optional
        Column of the time of each sample: samples that its gaps show are missing.
    time_unit : str, optional
        Its unit, as ``time_unit`` of `zerorate.read_log`, where its name does not say it.
    **options
        Arguments of `zerorate.DriftFilter`, with its defaults: method "auto", output
        "compensated".

    Raises
    ------
    ValueError
        If the filter refuses a value, the method does not use an option, or the width is none.

    Examples
    --------
    >>> from zerorate.tasks.live import LineStream, Settings
    >>> stream = LineStream(Settings(rate=100.0, beside=("bias", "at_rest")))
    >>> stream.take("t,gyro_z_dps"), stream.take("0.00,0.5")
    ('t,gyro_z_dps,bias_gyro_z_dps,at_rest_gyro_z_dps', '0.00,0.5,0.0,0')
    """

    kind: ClassVar[str] = "drift"

    rate: float
    beside: tuple[Beside, ...]
    columns: tuple[str | int, ...] | None
    unit: str | None
    data_scale: float | None
    sequence: str | int | None
    sequence_bits: int | None
    accel_columns: tuple[str | int, ...] | None
    time: str | int | None
    time_unit: str | None
    options: Mapping[str, Any]

    def __init__(
        self,
        rate: float,
        *,
        beside: tuple[Beside, ...] = (),
        columns: tuple[str | int, ...] | None = None,
        unit: str | None = None,
        data_scale: float | None = None,
        sequence: str | int | None = None,
        sequence_bits: int | None = None,
        accel_columns: tuple[str | int, ...] | None = None,
        time: str | int | None = None,
        time_unit: str | None = None,
        **options: Unpack[StreamOptions],
    ) -> None:
        if sequence_bits is not None:
            _check_bits(sequence_bits, sequence)
        if accel_columns and len(accel_columns) != _AXES:
            raise ArgumentError("accel_columns", f"takes three columns, got {len(accel_columns)}")
        asked = checked_options(options)
        # Written out, so that it is the same setting whether given or not, but for the limits: what
        # they are by default depends on the unit, which a header line may tell.
        params: Mapping[str, Any] = DriftFilter(rate, **asked).params
        settled = params.keys() - (LIMITS.keys() - asked.keys())
        known = {name: params[name] for name in FILTER_OPTIONS if name in settled}
        Scaling.of(data_scale)
        vars(self).update(
            rate=rate,
            beside=tuple(map(Beside, beside)),
            columns=columns,
            unit=None if unit is None else canonical_unit(unit),
            data_scale=data_scale,
            sequence=sequence,
            sequence_bits=sequence_bits,
            accel_columns=accel_columns,
            time=time,
            time_unit=checked_time_unit(time_unit),
            options=known,
        )

    @classmethod
    def of_reading(cls, rate: float, unit: str | None, scale: Scale, **asked: Any) -> Self:  # noqa: ANN401
        """Return settings of lines with this unit and scale, as `zerorate.read_log` takes them."""
        scaling = Scaling.of(scale)
        factor = scaling.of_kind("gyro", first=True)
        return cls(rate, unit=scaling.unit("gyro", unit), data_scale=factor, **asked)

    def filter(self, channels: int, unit: str | None = None) -> DriftFilter:
        """Return a new filter of samples of some unit; of one channel it takes floats."""
        options = with_limits(self.options, [self.options["method"]], unit)
        return DriftFilter(self.rate, channels=None if channels == 1 else channels, **options)

    def opened(self, cells: Sequence[str], fields: int | None) -> Engine:
        """Return a new filter for lines as the first one is; LineError or ColumnError if none."""
        wanted = Wanted(self.columns, self.sequence, fields, self.unit, self.time)
        layout = find_layout(cells, wanted)
        accel = self._accel(layout)
        motion = MotionDetector(self.rate) if accel else None
        running = Running(self._of(layout), self.beside, motion=motion)
        clocked = Clocked.of(self.rate, self.time, self.time_unit, layout.names, layout.fields)
        return self._engine(layout, running, 0, accel, clocked)

    def restored(self, layout: Layout, saved: Mapping[str, Any], filter_: bytes) -> Engine:
        """Return the filter of a checkpoint; ValueError if its parts do not belong together."""
        found = filter_of(DriftFilter.from_bytes, filter_)
        samples, owed, new = whole(saved["samples"]), whole(saved["owed"]), self._of(layout)
        if (found.channels, found.params) != (new.channels, new.params) or (
            found.samples_seen != samples - owed
        ):
            raise ValueError("the parts of the state do not belong together")
        accel = tuple(map(whole, saved.get("accel", ())))
        motion = _motion(saved, self.rate) if accel else None
        if accel and (accel != self._accel(layout) or motion is None):
            raise ValueError("the parts of the state do not belong together")
        running, clocked = Running(found, self.beside, owed, motion), clocked_in(self.rate, saved)
        engine = self._engine(layout, running, samples, accel, clocked)
        engine.go_on(saved)
        return engine

    def _of(self, layout: Layout) -> DriftFilter:
        return self.filter(len(layout.channels), layout.unit)

    def _accel(self, layout: Layout) -> tuple[int, ...]:
        """Return the columns of the accelerometer; ColumnError if one is not there."""
        if self.accel_columns is None:
            return accelerometer_of(layout.names or (), layout.channels)
        wanted = self.accel_columns
        places = tuple(position_of(one, layout.names, layout.fields) for one in wanted)
        if set(places) & {*layout.channels, layout.sequence}:
            raise ColumnError(
                said(given("accel_columns"), " names a column of a gyro or of the sequence number")
            )
        return places

    def _engine(
        self,
        layout: Layout,
        running: Running,
        samples: int,
        accel: tuple[int, ...],
        clocked: Clocked | None,
    ) -> DriftEngine:
        limit = self.options["limit"]
        return DriftEngine(layout, running, self.data_scale, limit, samples, accel, clocked)

    def as_json(self) -> dict[str, Any]:
        """Return the settings as JSON keeps them."""
        own = {name: getattr(self, name) for name in _LINES}
        return as_lists({"rate": self.rate, **self.options, **own})

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Return the settings that `as_json` gave."""
        kept = as_tuples(fields)
        own = {name: kept.pop(name) for name in ("rate", *_LINES) if name in kept}
        return cls(**own, **kept)


def _motion(saved: Mapping[str, Any], rate: float) -> MotionDetector[bool] | None:
    """Return what a checkpoint holds that sees motion; None if it is of another rate."""
    found = filter_of(MotionDetector.from_bytes, base64.b64decode(saved["motion"], validate=True))
    return found if found.rate == rate and found.channels is None else None


def _check_bits(bits: int, sequence: str | int | None) -> None:
    if sequence is None:
        raise ValueError("sequence_bits needs sequence, the column of the numbers")
    if not 1 <= bits <= MOST_BITS:
        raise ArgumentError("sequence_bits", f"must be 1 to {MOST_BITS}, got {bits}")
