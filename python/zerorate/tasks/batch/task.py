"""One log of a batch: settings, the function that all engines run, and output."""

import hashlib
import json
import os
import time
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, Self, Unpack

from zerorate._native import __version__
from zerorate.calibration.calibration import Calibration
from zerorate.faults import (
    ArgumentError,
    Sentence,
    bare_argument,
    make_sentence,
    pack_text,
    sentence_of,
    strip_prefix,
    unpack_text,
)
from zerorate.io.columns import TimeColumn, Timing
from zerorate.io.counts import Scale, Scaling
from zerorate.io.formats import label_of
from zerorate.options import StreamOptions, check_options
from zerorate.record import LogError, atomic_path
from zerorate.record.log import check_rate
from zerorate.record.names import canonical_unit
from zerorate.record.regular import read_regular
from zerorate.record.span import Span
from zerorate.tasks.batch.characterising import ALLAN
from zerorate.tasks.batch.checking import CHECK
from zerorate.tasks.batch.command import Command, LogPath, Row
from zerorate.tasks.batch.replaying import REPLAY
from zerorate.tasks.batch.reporting import REPORT
from zerorate.tasks.corrections import calibration_of
from zerorate.tasks.workers import limit_threads

Status = Literal["done", "skipped", "failed"]

COMMANDS: Final[Mapping[str, Command]] = {one.name: one for one in (REPLAY, ALLAN, REPORT, CHECK)}
"""Commands of a batch by name."""

_FORMATS: Final = ("parquet", "csv", "npz")


if TYPE_CHECKING:

    class BatchArguments(StreamOptions, total=False):
        """Arguments of `Settings`, except the command."""

        rate: float | None
        columns: tuple[str | int, ...] | None
        unit: str | None
        topic: str | None
        sensor: str | None
        data_scale: Scale
        start: float | None
        stop: float | None
        time: TimeColumn
        time_unit: str | None
        torn: str | None
        format: str | None
        calibration: Calibration | str | os.PathLike[str] | None
        accel: bool

else:
    # Only the stub lists the options of the filter.
    BatchArguments = dict


@dataclass(frozen=True, init=False)
class Settings:
    """Settings of a batch: the command on each log, and its reading and writing.

    Parameters
    ----------
    command : {"replay", "allan", "report", "check"}
        Command on each log. "replay", the default: filter the log. "allan": find the noise of gyros
        and accelerometers. "report": report on the IMU. "check": check units, signs and axes.
    rate : float, optional
        Samples per second, Hz, for logs without timestamps.
    columns : tuple of str or int, optional
        Names or indices of columns. Default for "replay": the gyro. Default for other commands: all
        sensors that they read.
    unit : str, optional
        Unit of the data, if the logs do not state it: ``"deg/s"``. Commands other than "replay"
        accept units of gyro and accelerometer, ``"deg/s,g"``.
    topic : str, optional
        Topic of ROS recordings and PX4 logs to read.
    sensor : str, optional
        Sensor to read if a table has several, as in `zerorate.read_log`. Default: all.
    data_scale, start, stop, time, time_unit, torn : optional
        Arguments of `zerorate.read_log`; `data_scale` is the argument `scale`.
    format : {"parquet", "csv", "npz"}, optional
        Format of the filtered logs, only for "replay"; default Parquet.
    calibration : Calibration or path, optional
        Calibration that corrects the gyro before filtering, only for "replay". Each log is then
        read completely, with its accelerometer.
    accel : bool
        If True (default), the gyro's accelerometer, if any, detects motion. Only for "replay".
    **options
        Arguments of `zerorate.DriftFilter`, only for "replay", with its defaults: method "auto",
        output "compensated". If the unit of a log is known, `rest_limit` defaults to 10 deg/s and
        `bias_limit` to 20 deg/s; None means no limit.

    Attributes
    ----------
    command, format, accel
        The arguments, or their defaults.
    calibration : str or None
        Calibration as JSON. Workers therefore need no file, and a changed calibration changes the
        fingerprint.
    reading : mapping
        Arguments of `zerorate.read_log`.
    options : mapping
        Arguments of `zerorate.DriftFilter`; empty for commands other than "replay".

    Raises
    ------
    ValueError
        If a value is not valid, or if the command or the method does not use an option.
    """

    command: str
    reading: Mapping[str, Any]
    format: str
    options: Mapping[str, Any]
    calibration: str | None
    accel: bool

    def __init__(
        self,
        *,
        command: str = "replay",
        rate: float | None = None,
        columns: tuple[str | int, ...] | None = None,
        unit: str | None = None,
        topic: str | None = None,
        sensor: str | None = None,
        data_scale: Scale = None,
        start: float | None = None,
        stop: float | None = None,
        time: TimeColumn = None,
        time_unit: str | None = None,
        torn: str | None = None,
        format: str | None = None,
        calibration: Calibration | str | os.PathLike[str] | None = None,
        accel: bool = True,
        **options: Unpack[StreamOptions],
    ) -> None:
        # Raise errors here that would otherwise occur in every log.
        if command not in COMMANDS:
            raise ArgumentError("command", f"must be {_join_or(COMMANDS)}, got '{command}'")
        if rate is not None:
            check_rate(rate)
        several = command != "replay" or calibration is not None
        units = () if unit is None else unit.split(",") if several else (unit,)
        for unit_name in units:
            canonical_unit(unit_name)
        Scaling.of(data_scale)
        Span(start, stop)
        Timing(time, time_unit, torn)
        filter_options: dict[str, Any] = {}
        if command == "replay":
            filter_options = check_options(options)
            if format not in (None, *_FORMATS):
                raise ArgumentError(
                    "format", f"must be one of {', '.join(_FORMATS)}, got '{format}'"
                )
        elif unused := [*options, *_given_names(format=format, calibration=calibration)]:
            raise ValueError(
                make_sentence(
                    bare_argument(unused[0]),
                    f" has no effect on command '{command}', only on 'replay'",
                )
            )
        output_format, loaded_calibration = format or _FORMATS[0], calibration_of(calibration)
        reading = {
            "rate": rate,
            "columns": columns,
            "unit": unit,
            "topic": topic,
            "sensor": sensor,
            "scale": data_scale,
            "start": start,
            "stop": stop,
            "time": time,
            "time_unit": time_unit,
            "torn": torn,
        }
        vars(self).update(
            command=command,
            reading=reading,
            format=output_format,
            options=filter_options,
            calibration=None if loaded_calibration is None else loaded_calibration.to_json(),
            accel=accel,
        )

    @property
    def operation(self) -> Command:
        """Command for each log."""
        return COMMANDS[self.command]

    def digest(self) -> str:
        """Return a hash of settings and version; logs with the same hash can share a summary."""
        parts = {"version": __version__, **asdict(self)}
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()

    def fingerprint(self, name: str, size: int, modified: int) -> str:
        """Return a hash that changes if the result of a log could change.

        The input is identified by name, size and time of change. The data of finished logs are not
        read.
        """
        parts = {"version": __version__, "input": [name, size, modified], **asdict(self)}
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Outcome:
    """Outcome of one log, without samples, because it is sent between machines.

    Parameters
    ----------
    name : str
        Path of the log below the common folder of all logs.
    status : {"done", "skipped", "failed"}
        A log is skipped if an earlier run has finished it with the same settings.
    seconds : float
        Time for reading, computing and writing, s; for a skipped log, the time of the earlier run.
    rows : tuple of mapping
        Measures, one row for each axis.
    error : str or None
        Reason of the failure, in one sentence.
    notes : tuple of str
        Sentences on the log's clock, on assumptions, and on doubtful results.
    """

    name: str
    status: Status
    seconds: float = 0.0
    rows: tuple[Row, ...] = ()
    error: str | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Record:
    """Record of how an output was made, which shows that it is complete.

    The record is a separate file next to the output. So the output has the same bytes as the output
    of the command for a single log, in every format.
    """

    fingerprint: str
    output_bytes: int
    seconds: float
    rows: tuple[Row, ...]
    notes: tuple[str, ...]

    @classmethod
    def read(cls, path: Path, output: Path) -> Self | None:
        """Return the record of an output if both files exist and belong together."""
        try:
            fields = json.loads(read_regular(path))
            listed = {
                "rows": tuple(fields["rows"]),
                "notes": tuple(map(unpack_text, fields["notes"])),
            }
            record = cls(**{**fields, **listed})
            return record if output.stat().st_size == record.output_bytes else None
        except (OSError, ValueError, TypeError, KeyError):
            return None

    def write(self, path: Path) -> None:
        """Write the record of a finished output."""
        with atomic_path(path, force=True) as temporary:
            fields = {**vars(self), "notes": [*map(pack_text, self.notes)]}
            text = json.dumps(fields, indent=1) + "\n"
            temporary.write_text(text, encoding="utf-8", newline="\n")


@dataclass(frozen=True)
class Task:
    """A log to process: absolute paths, and the contents of its record."""

    name: str
    source: LogPath
    output: Path
    record: Path
    settings: Settings
    fingerprint: str
    force: bool = False
    version: str = __version__

    def read_outcome(self, status: Status) -> Outcome | None:
        """Return the recorded outcome if this log was finished with these settings."""
        record = None if self.force else Record.read(self.record, self.output)
        if record is None or record.fingerprint != self.fingerprint:
            return None
        return Outcome(self.name, status, record.seconds, record.rows, notes=record.notes)


def run_task(task: Task) -> Outcome:
    """Process one log and write output and record; an error becomes a failed outcome.

    Repeated runs, even two at the same time, leave the same files.
    """
    begin = time.perf_counter()
    try:
        _check_version(task.version)
        # A worker may have died between the record and its answer.
        if (earlier := task.read_outcome("done")) is not None:
            return earlier
        task.output.parent.mkdir(parents=True, exist_ok=True)
        # Gone before another output takes the place of the one that it speaks of.
        task.record.unlink(missing_ok=True)
        with limit_threads(1):
            result = task.settings.operation.work(task.settings, task.source, task.output)
        seconds = time.perf_counter() - begin
        size = task.output.stat().st_size
        Record(task.fingerprint, size, seconds, result.rows, result.notes).write(task.record)
        return Outcome(task.name, "done", seconds, result.rows, notes=result.notes)
    except Exception as error:
        # Whatever is wrong with one log must not stop the others.
        message = _describe_error(error, task.source)
        return Outcome(task.name, "failed", time.perf_counter() - begin, error=message)


def _check_version(expected: str) -> None:
    if __version__ != expected:
        raise RuntimeError(f"the worker has zerorate {__version__}, expected {expected}")


def _describe_error(error: Exception, source: LogPath) -> str:
    """Return one line without the log's path, with the kind of an error that needs it."""
    text = sentence_of(error)
    line = text if isinstance(text, Sentence) else " ".join(text.split())
    line = strip_prefix(line, f"{label_of(source)}: ")
    is_user_error = isinstance(error, LogError | OSError | ArgumentError)
    return line if is_user_error else make_sentence(f"{type(error).__name__}: ", line)


def _given_names(**arguments: object) -> list[str]:
    """Return the names of values that are not None."""
    return [name for name, value in arguments.items() if value is not None]


def _join_or(words: Iterable[str]) -> str:
    return " or ".join(f"'{word}'" for word in words)
