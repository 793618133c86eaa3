"""``zerorate stream``: immediate answers to lines of samples."""

import math
import signal
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final

from zerorate.calibration.calibration import Calibration
from zerorate.cli.errors import DataFault, UsageFault, as_usage, of_a_file, sentence
from zerorate.cli.filter_options import FilterOptions, check_filter_options, flag, own_flag
from zerorate.cli.options import NoAccel
from zerorate.cli.parameters import Argument, AsTyped, Option, Typed, option
from zerorate.cli.process import BROKEN_PIPE, drop_stdout, notify
from zerorate.cli.reading import PANEL, Reading, ReadingOptions
from zerorate.cli.sources import Origin
from zerorate.cli.values import parse_choices, parse_column, parse_columns
from zerorate.cli.watching import Watched
from zerorate.faults import render_text, use_argument_names
from zerorate.geometry.frames import Frame
from zerorate.options import FILTER_OPTIONS
from zerorate.record import LogError, check_writable
from zerorate.record.regular import read_regular
from zerorate.tasks.corrections import calibration_of
from zerorate.tasks.interrupts import Interrupts, SignalInterrupt
from zerorate.tasks.live import (
    AttitudeColumn,
    AttitudeSettings,
    CheckpointError,
    DriftColumn,
    LineError,
    LineStream,
    Settings,
    SettingsError,
)
from zerorate.tasks.live.header import stated_in_header
from zerorate.tasks.live.sequence import MAX_BITS
from zerorate.tasks.live.serving import Saver, Server
from zerorate.tasks.saving import make_folders

_SIGNAL_CODE: Final = 128
"""Offset of the exit code for a signal; the signal's number is added."""
_OF_BOTH: Final = ("bias_limit", "limit")
"""Options of the drift filter that also apply with --attitude."""
_OF_ATTITUDE: Final = ("frame", "no_mag", "learn_magnetometer")
"""Options that require --attitude."""

_READING: Final = ReadingOptions(
    without=("topic", "group_by", "start", "stop", "sensor", "torn"),
    help={
        "rate": "Samples per second; required unless the first line states it, as in "
        "# rate: 100 Hz, unit: deg/s.",
        "time": "Column of the timestamps, by name or position. Gaps count as missing samples; "
        "equal stamps of a block are spread. Default: samples are 1/--rate s apart.",
        "columns": "Columns to filter: names, or positions counted from 0 over all columns, e.g. "
        "gx,gy,gz. Default: the columns named like a gyro in the header line; without a header "
        "line all. Other columns pass through.",
        "unit": "Unit of the gyro columns if the header line lacks it: rad/s, deg/s or deg/h. auto "
        "needs it to recognise rest. Values are not converted. With --attitude also that of the "
        "accelerometer: deg/s,g.",
    },
)


@dataclass(frozen=True)
class _Numbers:
    """Options on the numbers in a line."""

    sequence: str | int | None = option(
        None,
        "Column of a sequence number. Lost samples are counted and treated as missing; without "
        "this column they are not noticed.",
        metavar="COLUMN",
        parse=parse_column,
    )
    sequence_bits: int | None = option(
        None,
        "Bits of the --sequence counter. Default: learned from the data.",
        min=1,
        max=MAX_BITS,
    )
    fields: int | None = option(
        None, "Number of values in a line; needed if the first line may be cut off.", min=1
    )

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of the settings of a stream."""
        if self.sequence_bits is not None and self.sequence is None:
            raise UsageFault("--sequence-bits needs --sequence")
        return {"sequence": self.sequence, "sequence_bits": self.sequence_bits}


@dataclass(frozen=True)
class _Accelerometer:
    """Options on the accelerometer that detects motion."""

    panel: ClassVar = PANEL

    accel_columns: Sequence[str | int] | None = option(
        None,
        "Accelerometer columns x,y,z, to detect motion. By name or position. Default: those of "
        "the gyro's device in the header line.",
        metavar="NAMES",
        parse=parse_columns,
    )
    no_accel: NoAccel = False

    def columns(self) -> tuple[str | int, ...] | None:
        """Return the columns; empty if the accelerometer is ignored."""
        if not self.no_accel:
            return None if self.accel_columns is None else tuple(self.accel_columns)
        if self.accel_columns is not None:
            raise UsageFault("give either --accel-columns or --no-accel, not both")
        return ()


@dataclass(frozen=True)
class _Attitude:
    """Options for attitudes."""

    panel: ClassVar = "Attitude"

    attitude: bool = option(
        False,
        "Answer with the orientation. Lines have gyro, accelerometer and optionally magnetometer, "
        "x, y, z each.",
    )
    frame: Frame = option(
        "enu",
        "Axes of the earth. enu (default): east, north, up; ned: north, east, down; nwu: north, "
        "west, up.",
        shown="",
    )
    no_mag: bool = option(False, "Ignore the magnetometer of the lines.")
    learn_magnetometer: bool = option(False, "Learn the magnetometer's hard iron from the motion.")

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of `AttitudeSettings`."""
        return {
            "frame": self.frame,
            "mag": not self.no_mag,
            "learn_magnetometer": self.learn_magnetometer,
        }


@dataclass(frozen=True)
class _Saves:
    """Options for saving the state."""

    checkpoint: Path | None = option(
        None, "Save the state to this file; the next start continues from it.", metavar="FILE"
    )
    every: float = option(1.0, "Interval between saves, s.")
    position: bool = option(False, "Print the sample number of the checkpoint.")
    force: bool = option(False, "Start again if the checkpoint cannot be used.")

    def printed_position(self) -> int:
        """Return the number of the next sample after the checkpoint."""
        if self.checkpoint is None:
            raise UsageFault("--position needs --checkpoint")
        saved = _read(self.checkpoint)
        return 0 if saved is None else saved.position

    def saver(self, rate: float) -> Saver | None:
        """Return the saver of the state; None without --checkpoint."""
        if self.checkpoint is None:
            return None
        count = self.every * rate
        if not 0.0 < count < math.inf:
            raise UsageFault("--every takes a positive number of seconds")
        with as_usage():
            check_writable(self.checkpoint, force=True, make_folders=True)
            make_folders([self.checkpoint])
        return Saver(self.checkpoint, max(1, round(count)), notify)

    def resumed(self, settings: Settings | AttitudeSettings, cells: int | None) -> LineStream:
        """Return the stream of the checkpoint; without a usable one, a new stream."""
        new = LineStream(settings, cells)
        if self.checkpoint is None:
            return new
        try:
            return _read(self.checkpoint, settings, cells) or new
        except (DataFault, UsageFault) as fault:
            if self.force:
                return new
            raise type(fault)(f"{fault}; --force starts again") from None


def stream(
    *,
    source: Annotated[Path | None, Argument("Device, FIFO or file; stdin without it.")] = None,
    reading: Annotated[Reading, _READING],
    numbers: _Numbers,
    options: FilterOptions,
    accelerometer: _Accelerometer,
    extra: Annotated[
        str | None,
        Option(
            f"More columns: {','.join(DriftColumn)}; with --attitude: {','.join(AttitudeColumn)}.",
            "--with",
        ),
    ] = None,
    orientation: _Attitude,
    origin: Origin,
    calibration: Annotated[
        Path | None,
        Option(
            "Correct the gyro by this calibration first (JSON of zerorate calibrate), including "
            "g-sensitivity if lines have an accelerometer.",
            metavar="CAL",
            panel=PANEL,
        ),
    ] = None,
    saves: _Saves,
    watched: Watched,
    typed: Annotated[Typed, AsTyped()],
) -> None:
    """Answer each line of samples at once with the compensated rate.

    If a header line names the columns, gyro columns are filtered and others pass through. An
    accelerometer detects motion, as in a replay. A garbled line is reported on stderr, answered
    with nan, and treated as a missing sample. With --attitude, the answer is the quaternion w, x,
    y, z from sensor to earth.
    """
    if saves.position:
        print(saves.printed_position())
        return
    origin.check(source, numbers.fields)
    reading = _with_stated(reading, source, origin)
    rate = reading.arguments["rate"]
    if rate is None:
        raise UsageFault("--rate is required: samples per second, unless a header line states it")
    arguments = numbers.arguments()
    if arguments["sequence"] is None:
        arguments |= origin.numbers()
    arguments |= _timing(reading)
    if orientation.attitude:
        _check_attitude_alone(options, accelerometer)
        if calibration is not None:
            raise UsageFault("--calibration has no effect with --attitude")
        arguments |= {**orientation.arguments(), **{name: options.get(name) for name in _OF_BOTH}}
    else:
        _check_filter_alone(options, typed)
        arguments |= {"accel_columns": accelerometer.columns(), **options}
        arguments["calibration"] = _load_calibration(calibration)
    settings = _settings(reading, extra, orientation.attitude, arguments)
    saver = saves.saver(rate)
    lines = saves.resumed(settings, numbers.fields)
    patient = numbers.fields is not None
    with watched.watcher() as watcher:
        server = Server(lines, saver, lambda text: notify(render_text(text)), patient, watcher)
        try:
            _run(server, source, origin, watched.hides_answers)
        finally:
            for one in server.sentences(numbered=arguments["sequence"] is not None):
                notify(one)


def _with_stated(reading: Reading, source: Path | None, origin: Origin) -> Reading:
    """Return the options for reading, with rate and unit from the first line."""
    if reading.arguments["rate"] is not None or not origin.has_lines():
        return reading
    stated = stated_in_header(origin.first_line(source))
    known = {name: value for name, value in reading.arguments.items() if value is not None}
    return replace(reading, arguments={**reading.arguments, **stated, **known})


def _load_calibration(path: Path | None) -> Calibration | None:
    try:
        return calibration_of(path)
    except LogError as error:
        raise DataFault(sentence(error)) from None


def _timing(reading: Reading) -> dict[str, Any]:
    """Return the settings of the time column and its unit."""
    time, unit = reading.arguments["time"], reading.arguments["time_unit"]
    if unit is not None and (time is None or time is False):
        raise UsageFault("--time-unit needs --time, the column of the timestamps")
    return {"time": None if time is False else time, "time_unit": unit}


def _settings(
    reading: Reading, extra: str | None, attitude: bool, arguments: Mapping[str, Any]
) -> Settings | AttitudeSettings:
    kind = AttitudeSettings if attitude else Settings
    known = AttitudeColumn if attitude else DriftColumn
    words = [] if extra is None else parse_choices("--with", extra, [*map(str, known)])
    rate, unit, scale, columns = (
        reading.arguments[name] for name in ("rate", "unit", "scale", "columns")
    )
    more = tuple(words) if attitude else tuple(map(DriftColumn, words))
    with as_usage():
        return kind.of_reading(rate, unit, scale, extra=more, columns=columns, **arguments)


def _check_filter_alone(options: Mapping[str, Any], typed: Typed) -> None:
    """Raise a usage fault for options that require --attitude, or that no method uses."""
    for name in typed:
        if name in _OF_ATTITUDE:
            raise UsageFault(f"{own_flag(name)} needs --attitude")
    check_filter_options(options, [options["method"]])


def _check_attitude_alone(options: Mapping[str, Any], accelerometer: _Accelerometer) -> None:
    """Raise a usage fault for options without effect on attitudes."""
    default = {"method": FILTER_OPTIONS["method"].default}
    default |= {name: options.get(name) for name in _OF_BOTH}
    others = [name for name, value in options.items() if default.get(name) != value]
    if others:
        raise UsageFault(f"{flag(others[0])} has no effect with --attitude")
    if accelerometer.columns() is not None:
        option = "--no-accel" if accelerometer.no_accel else "--accel-columns"
        raise UsageFault(
            f"{option} has no effect with --attitude: give the columns of all sensors in --columns"
        )


def _read(
    path: Path, settings: Settings | AttitudeSettings | None = None, fields: int | None = None
) -> LineStream | None:
    try:
        return LineStream.from_bytes(read_regular(path), settings, fields)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise DataFault(of_a_file(error)) from None
    except SettingsError as error:
        with use_argument_names({name: flag(name) for name in FILTER_OPTIONS}):
            raise UsageFault(f"{path}: {sentence(error)}") from None
    except CheckpointError as error:
        raise DataFault(f"{path}: {error}") from None


def _run(server: Server, source: Path | None, origin: Origin, hidden: bool) -> None:
    """Answer the lines of the source; after a signal, exit with a shell's code."""
    interrupts = Interrupts()
    try:
        with (
            interrupts.catch_signals(),
            _saved(server),
            origin.opened(source, interrupts, hidden) as taken,
            _faults(),
        ):
            server.serve(taken)
    except SignalInterrupt as interrupted:
        if interrupted.args[0] == signal.SIGINT:
            raise KeyboardInterrupt from None
        raise SystemExit(_SIGNAL_CODE + interrupted.args[0]) from None


@contextmanager
def _saved(server: Server) -> Iterator[None]:
    try:
        yield
    finally:
        if server.saver is not None:
            try:
                server.saver.finish(None if server.answer_pending else server.stream)
            except OSError as error:
                raise DataFault(f"the checkpoint cannot be written: {error}") from None


@contextmanager
def _faults() -> Iterator[None]:
    try:
        yield
    except LineError as error:
        raise DataFault(sentence(error)) from None
    except BrokenPipeError:
        drop_stdout()
        raise SystemExit(BROKEN_PIPE) from None
    except OSError as error:
        raise DataFault(f"a sample could not be read or answered: {error}") from None
