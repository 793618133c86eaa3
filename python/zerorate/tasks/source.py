"""Sources of a task: a recording, the path of a file, a data frame or arrays."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path, PurePath
from typing import Any, TypeAlias, TypedDict

from zerorate.faults import keyword_argument, make_sentence, sentence_of
from zerorate.io.columns import Columns, TimeColumn
from zerorate.io.counts import Scale
from zerorate.io.formats import LogSource
from zerorate.io.recording import read_recording
from zerorate.record.devices import rival_devices, select_device, several_devices
from zerorate.record.log import Log, LogError
from zerorate.record.names import canonical_unit
from zerorate.record.recording import Recording

Source: TypeAlias = Recording | Log | LogSource
"""A `Recording`, a `Log` of a gyro, the path of a file, a data frame, or arrays by name."""


class UnscaledArguments(TypedDict, total=False):
    """Arguments of `zerorate.read_recording` that every task accepts for its sources."""

    rate: float | None
    columns: Columns | Mapping[str, Columns]
    unit: str | Mapping[str, str] | None
    topic: str | None
    sensor: str | None
    start: float | None
    stop: float | None
    time: TimeColumn
    time_unit: str | None
    torn: str | None


class ReadingArguments(UnscaledArguments, total=False):
    """`UnscaledArguments`, with the factor of raw counts."""

    scale: Scale


def split_options(
    options: Mapping[str, Any], table: Mapping[str, object], taken: Iterable[str] = ()
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Split options into arguments for reading and options in a filter's table.

    `taken` are further arguments of the task, for the error on an unknown one.

    Raises
    ------
    TypeError
        If an option is in neither group.
    """
    known = ReadingArguments.__optional_keys__
    unknown = [name for name in options if name not in known and name not in table]
    if unknown:
        further = (*table, *sorted(taken), *sorted(known))
        close = get_close_matches(unknown[0], further, 1)
        hint = (
            f": did you mean '{close[0]}'?" if close else f"; further ones are {', '.join(further)}"
        )
        raise TypeError(f"there is no argument '{unknown[0]}'{hint}")
    reading = {name: value for name, value in options.items() if name in known}
    return reading, {name: value for name, value in options.items() if name in table}


def recording_of(
    source: Source,
    reading: ReadingArguments | Mapping[str, Any],
    **extra: Any,  # noqa: ANN401
) -> Recording:
    """Return the recording of a task; read it if the source is not a recording yet.

    Parameters
    ----------
    source : Source
        Source argument of the task.
    reading : mapping
        Arguments of `zerorate.read_recording`, only for a source that is read.
    **extra
        Further arguments of this kind, set by the task.

    Raises
    ------
    LogError
        If arguments of reading are given with a recording, or the source cannot be read.
    """
    if not isinstance(source, Recording | Log):
        unit = units_of_sensors(reading.get("unit"))
        return read_recording(source, **{**reading, "unit": unit}, **extra)
    recording = source if isinstance(source, Recording) else _recording_of_log(source)
    arguments = {**reading, **extra}
    if (sensor := arguments.pop("sensor", None)) is not None:
        recording = select_device(recording, sensor)
    unused = [name for name, value in arguments.items() if value is not None]
    if unused:
        raise LogError(
            make_sentence(
                keyword_argument(unused[0]),
                " applies to data that are read: a Recording is used unchanged",
            ),
            unused[0],
        )
    return recording


def one_imu_of(
    source: Source,
    reading: ReadingArguments | Mapping[str, Any],
    *chosen: str | None,
    **extra: Any,  # noqa: ANN401
) -> Recording:
    """Return the recording of a task for one IMU; see `recording_of`.

    Parameters
    ----------
    source, reading, **extra
        As in `recording_of`; ``sensor`` chooses an IMU.
    *chosen : str, optional
        Names of logs, which also select the IMU.

    Raises
    ------
    LogError
        If there are several IMUs and none is selected. The message lists their names.
    """
    recording = recording_of(source, reading, **extra)
    is_chosen = any(reading.get(name) is not None for name in ("sensor", "columns", "topic"))
    if not is_chosen and not any(chosen) and (names := rival_devices(recording)):
        raise several_devices(names).with_context(f"{recording.source}: ")
    return recording


def _recording_of_log(log: Log) -> Recording:
    return Recording({"gyro": log}, str(log.meta.get("source", "the log")))


def units_of_sensors(
    unit: str | Mapping[str, str] | None,
) -> Mapping[str, str] | None:
    """Return the units of gyro and accelerometer from a text with one unit, or two and a comma.

    Examples
    --------
    >>> from zerorate.tasks.source import units_of_sensors
    >>> units_of_sensors("deg/s,g")
    {'gyro': 'deg/s', 'accel': 'g'}
    """
    if unit is None or not isinstance(unit, str):
        return unit
    words = [word.strip() for word in unit.split(",")]
    sensors = [
        "accel" if canonical_unit(unit_name) in ("g", "m/s^2") else "gyro" for unit_name in words
    ]
    if len(set(sensors)) < len(sensors):
        text = f" takes one unit of each kind, such as deg/s,g, got '{unit}'"
        raise ValueError(make_sentence(keyword_argument("unit", "", "unit"), text))
    return dict(zip(sensors, words, strict=True))


def stem_of(source: str) -> str:
    """Return the beginning of the file names of a source's results.

    Examples
    --------
    >>> from zerorate.tasks.source import stem_of
    >>> stem_of("logs/my flight.ulg"), stem_of("the recording")
    ('my flight', 'the recording')
    """
    return PurePath(source).stem or "recording"


def sensor_ending(sensor: str | None) -> str:
    """Return the addition to file names for the chosen sensor.

    Examples
    --------
    >>> from zerorate.tasks.source import sensor_ending
    >>> sensor_ending("left ankle"), sensor_ending(None)
    ('-left_ankle', '')
    """
    return "" if sensor is None else "-" + re.sub(r"[^\w.-]+", "_", sensor).strip("_")


def unique_stems(sources: Sequence[str]) -> list[str]:
    """Return the stem of each source's files, all different; ValueError for equal sources.

    Examples
    --------
    >>> from zerorate.tasks.source import unique_stems
    >>> unique_stems(["logs/a.csv", "logs/b.csv"]), unique_stems(["old/a.csv", "new/a.csv"])
    (['a', 'b'], ['old-a', 'new-a'])
    """
    stems = [stem_of(source) for source in sources]
    names = [
        stem if stems.count(stem) == 1 else f"{Path(source).absolute().parent.name}-{stem}"
        for source, stem in zip(sources, stems, strict=True)
    ]
    if len(set(names)) < len(names):
        raise ValueError("two logs have the same name: give each log once, or rename one")
    return names


@contextmanager
def name_source_in_errors(source: str, alarms: Sequence[str] = ()) -> Iterator[None]:
    """Add the name of the recording, and possible causes, to an error in its data.

    Parameters
    ----------
    source : str
        Name of the recording.
    alarms : sequence of str
        Contradictions in the recording. They become notes, which Python shows below the error.
    """
    try:
        yield
    except LogError as error:
        text = sentence_of(error)
        fault = error if text.startswith(source) else error.with_context(f"{source}: ")
        for alarm in alarms:
            fault.add_note(alarm)
        raise fault from None
