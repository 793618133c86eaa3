"""Logs: uniformly sampled channels with rate, names and unit."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Any, ClassVar, Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError, Sentence, make_sentence, sentence_of
from zerorate.numerals import shorten
from zerorate.record.missing import floats, real_numbers
from zerorate.texts import escape_line
from zerorate.types import Booleans, Floats
from zerorate.views import OneArray, Shown

FORWARD_RIGHT_DOWN: Final = "forward, right, down"
"""Axes of a body, as in autopilots."""
_UNIT_SEPARATOR: Final = ", "
_MAX_GRID_ERROR: Final = 0.5
"""Largest rounding of times of a uniform clock, in periods."""
_CHUNK_ROWS: Final = 1 << 18
_STEP_TOLERANCE: Final = 1e-3
"""Largest difference between steps of a uniform clock, in periods."""


class LogError(ValueError):
    """Error for unexpected content of a log; the message says what and where.

    Attributes
    ----------
    argument : str or None
        Keyword of the argument with a request that the log does not meet; None if the log itself is
        wrong.
    """

    def __init__(self, message: str, argument: str | None = None) -> None:
        """Reduce the message to one line, whatever names and cells it quotes."""
        line = (
            message.map_texts(escape_line)
            if isinstance(message, Sentence)
            else escape_line(message)
        )
        super().__init__(line)
        self.argument = argument

    def with_context(self, before: str = "", after: str = "") -> LogError:
        """Return the error with more text, such as the log's name in front."""
        return LogError(make_sentence(before, sentence_of(self), after), self.argument)


def check_rate(rate: object) -> float:
    """Return the rate in Hz as a float; ValueError if it is not positive and finite."""
    try:
        value = float(rate) if isinstance(rate, Real) and not isinstance(rate, bool) else math.nan
    except OverflowError:
        value = math.inf
    if not 0 < value < math.inf:
        raise ArgumentError(
            "rate", f"must be a positive finite number of Hz, got {reprlib.repr(rate)}"
        )
    return value


@dataclass(frozen=True, eq=False)
class Log(OneArray, Shown):
    """Channels of one recording on a uniform time grid.

    Parameters
    ----------
    time
        Seconds, shape (n,), uniform: sample i has the time ``time[0] + i / rate``.
    rate
        Samples per second, Hz.
    data
        Shape (n,) or (n, k), in ``unit``; NaN marks a missing sample. Stored as a C-contiguous
        float64 array of shape (n, k).
    names
        Names of the channels, all different.
    unit
        ``"deg/s"``, ``"rad/s"``, ``"deg/h"`` and others; ``"unit"`` if unknown. A list gives one
        unit per channel: ``("deg", "deg", "m")`` becomes ``"deg, deg, m"``.
    meta
        Further metadata. ``read_log`` fills ``source``, ``format``, ``clock`` (a `ClockReport`),
        ``notes`` (a tuple of sentences) and, if given, ``sensor``.
    stamps
        Time of each sample, s, shape (n,), if the rate of the clock changes; else None. Use
        `sampled`, not ``time``, for integration and for alignment with another clock.
    extra
        Further columns by name: numbers or flags of shape (n,), with the unit in the name
        (``bias_sigma_gyro_z_dps``). They are saved with the channels; filters ignore them.

    Raises
    ------
    LogError
        If the shapes disagree, the log is empty, names repeat, or the time is not uniform.
    ValueError
        If the rate is not a positive finite number.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.record import Log
    >>> log = Log(np.arange(4) / 2.0, 2.0, [0.1, 0.2, np.nan, 0.1], ["gyro_z_dps"], "deg/s")
    >>> log.n, log.channels, log.duration, log.missing_count
    (4, 1, 2.0, 1)
    """

    time: Floats
    rate: float
    data: Floats
    names: tuple[str, ...]
    unit: str = "unit"
    meta: Mapping[str, Any] = field(default_factory=dict)
    stamps: Floats | None = None
    extra: Mapping[str, Floats | Booleans] = field(default_factory=dict)
    _array_field: ClassVar[str] = "data"

    def __post_init__(self) -> None:
        """Convert the fields to their types and check their shapes."""
        object.__setattr__(self, "rate", check_rate(self.rate))
        object.__setattr__(self, "data", _to_channels(self.data))
        object.__setattr__(self, "names", _check_channel_names(self.names, self.channels))
        object.__setattr__(self, "time", _check_time(self.time, self.n, self.rate))
        if self.stamps is not None:
            object.__setattr__(self, "stamps", _check_stamps(self.stamps, self.n))
        if self.extra:
            object.__setattr__(self, "extra", _check_extra_columns(self.extra, self.names, self.n))
        if not isinstance(self.unit, str):
            object.__setattr__(self, "unit", _join_units(self.unit, self.channels))
        if not self.unit.strip():
            raise LogError(f"unit must be a non-empty string, got {self.unit!r}")

    @classmethod
    def at(
        cls,
        times: Floats,
        rate: float,
        data: Floats,
        names: Sequence[str],
        unit: str,
        meta: Mapping[str, Any],
        extra: Mapping[str, Floats | Booleans] | None = None,
    ) -> Log:
        """Return the log of samples taken at given times, shape (n,), uniform or not."""
        grid = times[0] + np.arange(len(times)) / rate
        even = np.abs(times - grid).max() * rate <= _MAX_GRID_ERROR
        time, stamps = (times, None) if even else (grid, times)
        return cls(time, rate, data, tuple(names), unit, meta, stamps, extra or {})

    def __repr__(self) -> str:
        """Return the size, rate, length, unit and names."""
        return (
            f"Log({self.n} samples at {self.rate:g} Hz, {self.duration:g} s, "
            f"{self.unit}: {', '.join(self.names)})"
        )

    @property
    def n(self) -> int:
        """Number of samples on the grid, missing ones included."""
        return int(self.data.shape[0])

    @property
    def channels(self) -> int:
        """Number of channels."""
        return int(self.data.shape[1])

    @property
    def duration(self) -> float:
        """Length in seconds, ``n / rate``: each sample counts for one period."""
        return self.n / self.rate

    @property
    def sampled(self) -> Floats:
        """Time of each sample, s, shape (n,): `stamps`, or `time` if there are no stamps."""
        return self.time if self.stamps is None else self.stamps

    @property
    def steps(self) -> Floats | None:
        """Time since the previous sample, s, shape (n,); None if it is always ``1 / rate``."""
        steps = np.diff(self.sampled, prepend=self.sampled[0] - 1.0 / self.rate)
        # Stamps may be large numbers in which only the last bits change.
        parts = (steps[a : a + _CHUNK_ROWS] for a in range(0, len(steps), _CHUNK_ROWS))
        if max(float(np.abs(part * self.rate - 1.0).max()) for part in parts) <= _STEP_TOLERANCE:
            return None
        return np.maximum(steps, 0.0, out=steps)

    @property
    def units(self) -> tuple[str, ...]:
        """The unit of each channel."""
        return units_of(self.unit, self.channels)

    @property
    def missing_count(self) -> int:
        """Number of samples with at least one channel missing (NaN)."""
        return int(np.isnan(self.data).any(axis=1).sum())

    def with_data(self, data: npt.ArrayLike) -> Log:
        """Return this log with new values of the same shape, such as a filter's output.

        Stamps, extra columns and all other fields stay.

        Parameters
        ----------
        data
            Shape (n, k), or (n,) for one channel, in the log's unit.

        Raises
        ------
        LogError
            If the shape differs from the log's.
        """
        values = _to_channels(data)
        if values.shape != self.data.shape:
            raise LogError(f"data must have the log's shape {self.data.shape}, got {values.shape}")
        return replace(self, data=values)

    def part(self, inside: slice) -> Log:
        """Return the samples of a slice, with their stamps and extra columns."""
        return replace(
            self,
            time=self.time[inside],
            data=self.data[inside],
            stamps=None if self.stamps is None else self.stamps[inside],
            extra={name: column[inside] for name, column in self.extra.items()},
        )


def drop_empty_channels(log: Log) -> Log:
    """Return the log without channels that have no sample; unchanged if none or all have none."""
    present = np.flatnonzero(np.isfinite(log.data).any(axis=0))
    if present.size in (0, log.channels):
        return log
    names, units = (tuple(values[i] for i in present) for values in (log.names, log.units))
    return replace(log, data=log.data[:, present], names=names, unit=_join_units(units, len(units)))


def drop_empty_logs(logs: Sequence[Log]) -> list[Log]:
    """Return the logs that have samples, without empty channels; all logs if none has samples."""
    present = [drop_empty_channels(log) for log in logs if np.isfinite(log.data).any()]
    return present or list(logs)


def units_of(unit: str, channels: int) -> tuple[str, ...]:
    """Return the unit of each channel of a log, from a list of units or one unit for all."""
    listed = tuple(unit.split(_UNIT_SEPARATOR))
    return listed if len(listed) == channels else (unit,) * channels


def _join_units(units: object, channels: int) -> str:
    """Return the common unit of all channels, or the list of their units."""
    listed = tuple(units) if isinstance(units, Iterable) else (units,)
    if len(listed) != channels or not all(isinstance(unit, str) and unit for unit in listed):
        raise LogError(f"unit must be a non-empty string, or one a channel, got {units!r}")
    return listed[0] if len(set(listed)) == 1 else _UNIT_SEPARATOR.join(listed)


def _to_channels(data: npt.ArrayLike) -> Floats:
    values = _numbers(data, "data")
    if values.ndim == 1:
        values = values[:, np.newaxis]
    if values.ndim != 2 or 0 in values.shape:
        raise LogError(
            "data must have shape (n,) or (n, k) with at least one sample and one channel, "
            f"got {values.shape}"
        )
    return np.ascontiguousarray(values)


def _numbers(values: npt.ArrayLike, name: str) -> Floats:
    try:
        return floats(values, name)
    except (TypeError, ValueError) as error:
        raise LogError(str(error)) from None


def _check_channel_names(names: str | Iterable[str], channels: int) -> tuple[str, ...]:
    listed = (names,) if isinstance(names, str) else tuple(names)
    for name in listed:
        _check_name(name, "a channel")
    if len(listed) != channels:
        raise LogError(f"names must have one entry a channel: {channels}, got {len(listed)}")
    repeated = sorted({name for name in listed if listed.count(name) > 1})
    if repeated:
        raise LogError(f"names must differ, repeated: {', '.join(repeated)}")
    return tuple(str(name) for name in listed)


def _check_name(name: object, of: str) -> None:
    if not isinstance(name, str) or not name.isprintable() or name != name.strip() or not name:
        raise LogError(f"{of}'s name must be printable text, got {name!r}")


def _check_extra_columns(
    extra: Mapping[str, npt.ArrayLike], names: Sequence[str], n: int
) -> dict[str, npt.NDArray[Any]]:
    columns = {}
    for name, values in extra.items():
        _check_name(name, "an extra column")
        if name in names:
            raise LogError(f"extra column '{name}' has the name of a channel")
        try:
            column = real_numbers(values, f"extra column '{name}'")
        except (TypeError, ValueError) as error:
            raise LogError(str(error)) from None
        if column.shape != (n,):
            raise LogError(f"extra column '{name}' must have shape ({n},), got {column.shape}")
        columns[name] = column
    return columns


def _check_time(time: npt.ArrayLike, n: int, rate: float) -> Floats:
    seconds = np.ascontiguousarray(_numbers(time, "time"))
    if seconds.shape != (n,):
        raise LogError(f"time must have shape ({n},) as data has {n} samples, got {seconds.shape}")
    if not np.isfinite(seconds).all():
        raise LogError("time must be finite")
    error = _max_grid_error(seconds, rate)
    if error > _MAX_GRID_ERROR:
        raise LogError(
            f"time must be uniform at {rate:g} Hz, but leaves that grid by {shorten(error, 3)} "
            "samples"
        )
    return seconds


def _max_grid_error(seconds: Floats, rate: float) -> float:
    """Return the largest distance of times from a uniform grid, in samples."""
    starts = range(0, len(seconds), _CHUNK_ROWS)
    return max(
        float(np.abs(part - seconds[0] - np.arange(a, a + len(part)) / rate).max()) * rate
        for a, part in ((a, seconds[a : a + _CHUNK_ROWS]) for a in starts)
    )


def _check_stamps(stamps: npt.ArrayLike, n: int) -> Floats:
    seconds = np.ascontiguousarray(_numbers(stamps, "stamps"))
    if seconds.shape != (n,):
        raise LogError(
            f"stamps must have shape ({n},) as data has {n} samples, got {seconds.shape}"
        )
    if not np.isfinite(seconds).all() or (np.diff(seconds) < 0.0).any():
        raise LogError("stamps must be finite, none before the one of the sample before")
    return seconds


@dataclass(frozen=True)
class Header:
    """Length, rate (Hz), names, unit and metadata of a log, as in `Log`."""

    n: int
    rate: float
    names: tuple[str, ...]
    unit: str
    meta: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, log: Log) -> Header:
        """Return the header of a log in memory."""
        return cls(log.n, log.rate, log.names, log.unit, log.meta)

    def with_notes(self, sentences: Iterable[str]) -> Header:
        """Return the header with further notes, without duplicates."""
        notes = dict.fromkeys((*self.meta.get("notes", ()), *sentences))
        return replace(self, meta={**self.meta, "notes": tuple(notes)}) if notes else self

    @property
    def channels(self) -> int:
        """Number of channels."""
        return len(self.names)

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return self.n / self.rate


def notes_of(log: Log | Header, evenly_spaced: bool = False) -> tuple[str, ...]:
    """Return the sentences on a log: on a clock with faults, and on assumptions.

    With ``evenly_spaced``, a note warns that the task ignores the wander of a clock.
    """
    clock = log.meta.get("clock")
    clock_notes = [] if clock is None or clock.regular or clock.as_stated else [clock.summary()]
    if evenly_spaced and clock is not None and clock.wander:
        error = max(clock.fastest / log.rate, log.rate / clock.slowest) - 1.0
        clock_notes.append(
            f"this task assumes samples 1/{log.rate:.6g} s apart, which is wrong by up to "
            f"{shorten(100.0 * error)} % for some time"
        )
    return (*clock_notes, *log.meta.get("notes", ()))
