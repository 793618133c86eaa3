"""One log of a batch: its settings, the function that every engine runs, and what it leaves."""

import hashlib
import json
import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal, Self, Unpack

from zerorate._native import __version__
from zerorate.io import LogError, atomic_path, open_log
from zerorate.io.counts import Scale, Scaling
from zerorate.io.log import checked_rate, notes_of
from zerorate.io.names import canonical_unit
from zerorate.io.span import Span
from zerorate.options import StreamOptions, checked_options, with_limits
from zerorate.run.replay import Score, Summary, replay_to_file
from zerorate.run.replay.history import last_known
from zerorate.run.replay.result import unlearned
from zerorate.run.workers import on_threads

__all__ = ["OUTPUT_MARK", "Outcome", "Record", "Settings", "Task", "record_path", "run_task"]

Status = Literal["done", "skipped", "failed"]
Row = Mapping[str, str | float | int | None]

OUTPUT_MARK: Final = "-zerorate"
"""Ends the name of a filtered log, before its suffix."""

_READING: Final = ("rate", "columns", "unit", "topic", "start", "stop")
_FORMATS: Final = ("parquet", "csv", "npz")


@dataclass(frozen=True, init=False)
class Settings:
    """How each log of a batch is read, filtered and written.

    Parameters
    ----------
    rate : float, optional
        Samples per second, Hz, where the logs do not tell it.
    columns : tuple of str or int, optional
        Names or indices; by default the gyro columns.
    unit : str, optional
        Unit of the data, where the logs do not tell it.
    topic : str, optional
        Topic to read of ROS recordings and PX4 logs.
    data_scale, start, stop : optional
        As `scale`, `start` and `stop` of `zerorate.read_log`: what values are multiplied by, and
        the seconds between which each log is read.
    format : {"parquet", "csv", "npz"}
        Of the filtered logs; default Parquet.
    **options
        Arguments of `zerorate.DriftFilter`, with its defaults: method "auto", output
        "compensated". Of a log whose unit is known `rest_limit` is 3 deg/s and `bias_limit`
        20 deg/s unless they are given; None is no limit.

    Raises
    ------
    ValueError
        If a value is not valid, or the method does not use an option.
    """

    rate: float | None
    columns: tuple[str | int, ...] | None
    unit: str | None
    topic: str | None
    data_scale: Scale
    start: float | None
    stop: float | None
    format: str
    options: Mapping[str, Any]

    def __init__(
        self,
        *,
        rate: float | None = None,
        columns: tuple[str | int, ...] | None = None,
        unit: str | None = None,
        topic: str | None = None,
        data_scale: Scale = None,
        start: float | None = None,
        stop: float | None = None,
        format: str = "parquet",
        **options: Unpack[StreamOptions],
    ) -> None:
        # Refused here is what would otherwise fail in every log.
        if format not in _FORMATS:
            raise ValueError(f"format must be one of {', '.join(_FORMATS)}, got '{format}'")
        if rate is not None:
            checked_rate(rate)
        if unit is not None:
            canonical_unit(unit)
        Scaling.of(data_scale)
        Span(start, stop)
        chosen = checked_options(options)
        vars(self).update(
            rate=rate,
            columns=columns,
            unit=unit,
            topic=topic,
            data_scale=data_scale,
            start=start,
            stop=stop,
            format=format,
            options=chosen,
        )

    @property
    def reading(self) -> Mapping[str, Any]:
        """The arguments of `zerorate.io.open_log`."""
        named = {name: getattr(self, name) for name in _READING}
        return {**named, "scale": self.data_scale}

    def fingerprint(self, name: str, size: int, modified: int) -> str:
        """Return a hash that changes whenever the result of a log could.

        The input counts by its name, size and time of change, not by its content: to see that
        nothing is left to do must not cost a reading of all the data.
        """
        parts = {"version": __version__, "input": [name, size, modified], **asdict(self)}
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Outcome:
    """What became of one log; small, since it travels between machines.

    Parameters
    ----------
    name : str
        Path of the log under the folder that all logs share.
    status : {"done", "skipped", "failed"}
        A log is skipped if an earlier run has finished it with the same settings.
    seconds : float
        What reading, filtering and writing took; of a skipped log, in the earlier run.
    rows : tuple of mapping
        Measures, one row an axis.
    error : str or None
        Why it failed, in one sentence.
    notes : tuple of str
        Sentences on its clock, on what was assumed of it, and on axes of which nothing was learned.
    """

    name: str
    status: Status
    seconds: float = 0.0
    rows: tuple[Row, ...] = ()
    error: str | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Record:
    """How a filtered log was made, and that it is whole.

    It is a file of its own next to the log, not metadata of the log, which stays the same bytes as
    those of a single replay, in every format.
    """

    fingerprint: str
    output_bytes: int
    seconds: float
    rows: tuple[Row, ...]
    notes: tuple[str, ...]

    @classmethod
    def beside(cls, output: Path) -> Self | None:
        """Return the record of a filtered log if both are there and belong together."""
        try:
            fields = json.loads(record_path(output).read_bytes())
            listed = {name: tuple(fields[name]) for name in ("rows", "notes")}
            found = cls(**{**fields, **listed})
            return found if output.stat().st_size == found.output_bytes else None
        except (OSError, ValueError, TypeError, KeyError):
            return None

    @classmethod
    def of_either(cls, path: Path) -> Self | None:
        """Return the record that a path belongs to, as a filtered log or as the record itself."""
        if path.suffix != record_path(path).suffix:
            return cls.beside(path)
        found = (cls.beside(path.with_suffix(f".{suffix}")) for suffix in _FORMATS)
        return next(filter(None, found), None)

    def write(self, output: Path) -> None:
        """Write the record of a filtered log that is in its place."""
        with atomic_path(record_path(output), force=True) as temporary:
            text = json.dumps(vars(self), indent=1) + "\n"
            temporary.write_text(text, encoding="utf-8", newline="\n")

    @staticmethod
    def discard(output: Path) -> None:
        """Remove the record before another log takes the place of the one it speaks of."""
        record_path(output).unlink(missing_ok=True)


def record_path(output: Path) -> Path:
    """Return where the record of a filtered log lies."""
    return output.with_suffix(".json")


@dataclass(frozen=True)
class Task:
    """A log to filter: absolute paths, and what its record will say."""

    name: str
    source: Path
    output: Path
    settings: Settings
    fingerprint: str
    force: bool = False
    version: str = __version__

    def finished(self, status: Status) -> Outcome | None:
        """Return what the record says, if this log is finished with these settings."""
        found = None if self.force else Record.beside(self.output)
        if found is None or found.fingerprint != self.fingerprint:
            return None
        return Outcome(self.name, status, found.seconds, found.rows, notes=found.notes)


def run_task(task: Task) -> Outcome:
    """Filter one log and write it with its record; a fault becomes a failed outcome.

    Running it again, even twice at once, leaves the same files.
    """
    begin = time.perf_counter()
    try:
        _check_version(task.version)
        # A worker may have died between the record and its answer.
        if (earlier := task.finished("done")) is not None:
            return earlier
        with on_threads(1):
            result = _filter(task)
        seconds = time.perf_counter() - begin
        rows, notes = _rows(result), (*notes_of(result.header), *unlearned(result))
        size = task.output.stat().st_size
        Record(task.fingerprint, size, seconds, rows, notes).write(task.output)
        return Outcome(task.name, "done", seconds, rows, notes=notes)
    except Exception as error:
        # Whatever is wrong with one log must not stop the others.
        return Outcome(task.name, "failed", time.perf_counter() - begin, error=_told(error))


def _filter(task: Task) -> Summary:
    settings = task.settings
    recording = open_log(task.source, **settings.reading)
    task.output.parent.mkdir(parents=True, exist_ok=True)
    Record.discard(task.output)
    options = dict(settings.options)
    method = options.pop("method")
    options = with_limits(options, [method], recording.header.unit)
    return replay_to_file(recording, task.output, methods=[method], force=True, **options)


def _check_version(expected: str) -> None:
    if __version__ != expected:
        raise RuntimeError(f"the worker has zerorate {__version__}, expected {expected}")


def _told(error: Exception) -> str:
    """Return one line, with the kind of an error that does not explain itself."""
    line = " ".join(str(error).split())
    return line if isinstance(error, LogError | OSError) else f"{type(error).__name__}: {line}"


def _rows(result: Summary) -> tuple[Row, ...]:
    """Return one row an axis; None where a number means nothing."""
    scores = {(score.axis, score.method): score for score in result.scores}
    history = result.history
    noise, drift = last_known(history.angle_random_walk), last_known(history.rate_random_walk)
    return tuple(
        {
            "axis": axis,
            "unit": result.header.unit,
            "rate": result.header.rate,
            "samples": result.header.n,
            "missing": int(result.seen.missing[i]),
            **{name: int(counts[i]) for name, counts in vars(result.left_out).items()},
            **_scores("raw", scores[axis, "raw"], result.horizons),
            **_scores("drift", scores[axis, result.method], result.horizons),
            "reduction": _number(scores[axis, result.method].reduction),
            "angle_random_walk": _number(noise[i]),
            "rate_random_walk": _number(drift[i]),
            "bias": _number(history.bias[-1, i]),
            "bias_sigma": _number(history.bias_sigma[-1, i]),
            "time_at_rest": _rest(result, i),
        }
        for i, axis in enumerate(result.header.names)
    )


def _scores(of: str, score: Score, horizons: tuple[float, ...]) -> dict[str, float | None]:
    measures = [("mean", score.mean), ("deviation", score.deviation), *_coasting(score, horizons)]
    return {f"{of}_{name}": _number(value) for name, value in measures}


def _coasting(score: Score, horizons: tuple[float, ...]) -> Iterator[tuple[str, float]]:
    for horizon, value in zip(horizons, score.coasting, strict=True):
        yield f"coasting_{horizon:g}s", value


def _rest(result: Summary, i: int) -> float | None:
    rested = result.seen.at_rest
    return None if rested is None else int(rested[i]) / result.header.rate


def _number(value: float) -> float | None:
    # JSON knows neither NaN nor infinity.
    return float(value) if math.isfinite(value) else None
