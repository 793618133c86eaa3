"""Settings of a stream: filter and contents of the lines."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Final, Self, Unpack

from zerorate._native import DriftFilter, MotionDetector
from zerorate.calibration.calibration import Calibration
from zerorate.faults import ArgumentError, keyword_argument, make_sentence
from zerorate.io.clocks.units import check_time_unit
from zerorate.io.counts import Scale, Scaling
from zerorate.io.sensors import find_accelerometer
from zerorate.options import (
    FILTER_OPTIONS,
    REST_LIMITS,
    StreamOptions,
    add_rest_limits,
    check_options,
)
from zerorate.record.names import UNKNOWN_UNIT, canonical_unit, common_unit
from zerorate.tasks.live.backlog import BacklogFilter
from zerorate.tasks.live.checkpoint import (
    check_count,
    lists_to_tuples,
    restore_filter,
    tuples_to_lists,
)
from zerorate.tasks.live.drift import Corrector, DriftEngine
from zerorate.tasks.live.engine import Engine
from zerorate.tasks.live.lines import (
    ColumnError,
    ColumnRequest,
    DriftColumn,
    Layout,
    find_layout,
    position_of,
)
from zerorate.tasks.live.sequence import MAX_BITS
from zerorate.tasks.live.stamp_clock import StampClock, restore_stamp_clock

_LINE_FIELDS: Final = (
    "extra",
    "columns",
    "unit",
    "data_scale",
    "sequence",
    "sequence_bits",
    "accel_columns",
    "time",
    "time_unit",
    "calibration",
)
_AXES: Final = 3


@dataclass(frozen=True, init=False)
class Settings:
    """Filter and columns of a live stream; a restart needs the same settings.

    Parameters
    ----------
    rate : float
        Samples per second, Hz.
    extra : tuple of str
        Further columns of an answer: ``"bias"``, ``"bias_sigma"``, ``"at_rest"``,
        ``"saturated"``, ``"stuck"``.
    columns : tuple of str or int, optional
        Channels by name or position. Default: columns with names of gyros in a header line. Without
        a header line: all columns except the sequence number.
    unit : str, optional
        Unit of the channels, if the header line does not state it. If it is known, `rest_limit`
        defaults to 10 deg/s and `bias_limit` to 20 deg/s; None means no limit.
    data_scale : float, optional
        Factor of the samples, for example of raw counts. The unit applies after the multiplication.
    sequence : str or int, optional
        Column of the sequence number; None if there is none.
    sequence_bits : int, optional
        Width of the sequence number, bits; None: found from the data.
    accel_columns : tuple of str or int, optional
        Columns of an accelerometer, x, y, z. The accelerometer detects motion for the filter, as in
        a replay. The answer contains its cells unchanged. Default: the accelerometer of the gyro's
        device in the header line; empty for none.
    time : str or int, optional
        Column of the time of each sample; a gap counts as missing samples.
    time_unit : str, optional
        Unit of the time, as ``time_unit`` of `zerorate.read_log`, if the column's name does not
        state it.
    calibration : Calibration or str, optional
        Calibration that corrects the gyro, or the calibration's JSON. If the lines have an
        accelerometer, the correction also uses the specific force.
    **options
        Arguments of `zerorate.DriftFilter`, with its defaults: method "auto", output
        "compensated".

    Raises
    ------
    ValueError
        If a value is not valid for the filter, the method does not use an option, or
        `sequence_bits` is not valid.

    Examples
    --------
    >>> from zerorate.tasks.live import LineStream, Settings
    >>> stream = LineStream(Settings(rate=100.0, extra=("bias", "at_rest")))
    >>> stream.take("t,gyro_z_dps"), stream.take("0.00,0.5")
    ('t,gyro_z_dps,bias_gyro_z_dps,at_rest_gyro_z_dps', '0.00,0.5,0.0,0')
    """

    kind: ClassVar[str] = "drift"

    rate: float
    extra: tuple[DriftColumn, ...]
    columns: tuple[str | int, ...] | None
    unit: str | None
    data_scale: float | None
    sequence: str | int | None
    sequence_bits: int | None
    accel_columns: tuple[str | int, ...] | None
    time: str | int | None
    time_unit: str | None
    calibration: str | None
    options: Mapping[str, Any]

    def __init__(
        self,
        rate: float,
        *,
        extra: tuple[DriftColumn, ...] = (),
        columns: tuple[str | int, ...] | None = None,
        unit: str | None = None,
        data_scale: float | None = None,
        sequence: str | int | None = None,
        sequence_bits: int | None = None,
        accel_columns: tuple[str | int, ...] | None = None,
        time: str | int | None = None,
        time_unit: str | None = None,
        calibration: Calibration | str | None = None,
        **options: Unpack[StreamOptions],
    ) -> None:
        if sequence_bits is not None:
            _check_bits(sequence_bits, sequence)
        if accel_columns and len(accel_columns) != _AXES:
            raise ArgumentError("accel_columns", f"takes three columns, got {len(accel_columns)}")
        filter_options = check_options(options)
        # Defaults are written out, so a setting is the same if given or not. Limits are not,
        # because their defaults depend on the unit, which a header line may state.
        params: Mapping[str, Any] = DriftFilter(rate, **filter_options).params
        settled = params.keys() - (REST_LIMITS.keys() - filter_options.keys())
        stored_options = {name: params[name] for name in FILTER_OPTIONS if name in settled}
        Scaling.of(data_scale)
        calibration_text = (
            calibration if isinstance(calibration, str | None) else calibration.to_json()
        )
        vars(self).update(
            rate=rate,
            extra=tuple(map(DriftColumn, extra)),
            columns=columns,
            unit=None if unit is None else canonical_unit(unit),
            data_scale=data_scale,
            sequence=sequence,
            sequence_bits=sequence_bits,
            accel_columns=accel_columns,
            time=time,
            time_unit=check_time_unit(time_unit),
            calibration=calibration_text,
            options=stored_options,
        )

    @classmethod
    def of_reading(cls, rate: float, unit: str | None, data_scale: Scale, **asked: Any) -> Self:  # noqa: ANN401
        """Return settings for lines with the unit and scale of `zerorate.read_log`."""
        scaling = Scaling.of(data_scale)
        factor = scaling.factor_for("gyro", first=True)
        return cls(rate, unit=scaling.unit("gyro", unit), data_scale=factor, **asked)

    def filter(self, channels: int, unit: str | None = None) -> DriftFilter:
        """Return a new filter for samples in a unit; a filter of one channel accepts floats."""
        options = add_rest_limits(self.options, [self.options["method"]], unit)
        return DriftFilter(self.rate, channels=None if channels == 1 else channels, **options)

    def open_engine(self, cells: Sequence[str], fields: int | None) -> Engine:
        """Return a new filter for lines like the first line; raise LineError or ColumnError."""
        request = ColumnRequest(self.columns, self.sequence, fields, self.unit, self.time)
        layout = find_layout(cells, request)
        accel = self._find_accel_columns(layout)
        motion = MotionDetector(self.rate) if accel else None
        backlog = BacklogFilter(self._make_filter(layout), self.extra, motion=motion)
        stamp_clock = StampClock.of(
            self.rate, self.time, self.time_unit, layout.names, layout.fields
        )
        return self._make_engine(layout, backlog, 0, accel, stamp_clock)

    def restore_engine(self, layout: Layout, saved: Mapping[str, Any], filter_: bytes) -> Engine:
        """Return the filter from a checkpoint; ValueError if its parts contradict each other."""
        drift_filter = restore_filter(DriftFilter.from_bytes, filter_)
        samples, pending_count, fresh_filter = (
            check_count(saved["samples"]),
            check_count(saved["owed"]),
            self._make_filter(layout),
        )
        if (drift_filter.channels, drift_filter.params) != (
            fresh_filter.channels,
            fresh_filter.params,
        ) or (drift_filter.samples_seen != samples - pending_count):
            raise ValueError("the parts of the state do not match")
        accel = tuple(map(check_count, saved.get("accel", ())))
        motion = _restore_motion(saved, self.rate) if accel else None
        if accel and (accel != self._find_accel_columns(layout) or motion is None):
            raise ValueError("the parts of the state do not match")
        backlog, stamp_clock = (
            BacklogFilter(drift_filter, self.extra, pending_count, motion),
            restore_stamp_clock(self.rate, saved),
        )
        engine = self._make_engine(layout, backlog, samples, accel, stamp_clock)
        engine.go_on(saved)
        return engine

    def _make_filter(self, layout: Layout) -> DriftFilter:
        return self.filter(len(layout.channels), layout.unit)

    def _find_accel_columns(self, layout: Layout) -> tuple[int, ...]:
        """Return the columns of the accelerometer; ColumnError if one is missing."""
        if self.accel_columns is None:
            return find_accelerometer(layout.names or (), layout.channels)
        requested = self.accel_columns
        positions = tuple(position_of(column, layout.names, layout.fields) for column in requested)
        if set(positions) & {*layout.channels, layout.sequence}:
            raise ColumnError(
                make_sentence(
                    keyword_argument("accel_columns"),
                    " names a column of a gyro or of the sequence number",
                )
            )
        return positions

    def _make_engine(
        self,
        layout: Layout,
        backlog: BacklogFilter,
        samples: int,
        accel: tuple[int, ...],
        stamp_clock: StampClock | None,
    ) -> DriftEngine:
        limit = self.options["limit"]
        correct = self._make_corrector(layout, accel)
        return DriftEngine(
            layout, backlog, self.data_scale, limit, samples, accel, stamp_clock, correct
        )

    def _make_corrector(self, layout: Layout, accel: tuple[int, ...]) -> Corrector | None:
        """Return the corrector of samples; ColumnError for other sensors than the calibration's."""
        if self.calibration is None:
            return None
        if len(layout.channels) != _AXES:
            raise ColumnError(
                f"a calibration needs a gyro of three axes, the lines have {len(layout.channels)}"
            )
        if layout.unit is None:
            raise ColumnError(
                make_sentence(
                    "a calibration needs the unit of the gyro, which the lines lack: give ",
                    keyword_argument("unit"),
                )
            )
        force_unit = _unit_of_accel(layout, accel)
        calibration = Calibration.from_json(self.calibration).in_units(
            gyro=layout.unit, accel=force_unit
        )
        if force_unit is None:
            gyro_alone = calibration.corrector(inputs=3)
            return lambda gyro, force: gyro_alone.update(gyro).tolist()
        both = calibration.corrector()
        return lambda gyro, force: both.update([*gyro, *force])[0].tolist()

    def as_json(self) -> dict[str, Any]:
        """Return the settings in the types of JSON."""
        line_fields = {name: getattr(self, name) for name in _LINE_FIELDS}
        return tuples_to_lists({"rate": self.rate, **self.options, **line_fields})

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Return the settings from the output of `as_json`."""
        options = lists_to_tuples(fields)
        line_fields = {
            name: options.pop(name) for name in ("rate", *_LINE_FIELDS) if name in options
        }
        return cls(**line_fields, **options)


def _unit_of_accel(layout: Layout, accel: tuple[int, ...]) -> str | None:
    """Return the unit of the accelerometer from its columns' names; None if unknown."""
    if not accel or layout.names is None:
        return None
    unit = common_unit([layout.names[i] for i in accel], None, None)
    return None if unit == UNKNOWN_UNIT else unit


def _restore_motion(saved: Mapping[str, Any], rate: float) -> MotionDetector[bool] | None:
    """Return the motion detector of a checkpoint; None if it has another rate."""
    detector = restore_filter(
        MotionDetector.from_bytes, base64.b64decode(saved["motion"], validate=True)
    )
    return detector if detector.rate == rate and detector.channels is None else None


def _check_bits(bits: int, sequence: str | int | None) -> None:
    if sequence is None:
        raise ValueError("sequence_bits needs sequence, the column of the sequence numbers")
    if not 1 <= bits <= MAX_BITS:
        raise ArgumentError("sequence_bits", f"must be 1 to {MAX_BITS}, got {bits}")
