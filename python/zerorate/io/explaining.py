"""What a file is taken for, and why: its format, its topics, and each of its columns."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Final, Unpack

from zerorate.faults import sentence_of, told
from zerorate.io.clocks.names import looks_like_time, time_unit
from zerorate.io.columns import choose, with_time
from zerorate.io.formats import FORMATS, check_readable, format_of, label_of, opened
from zerorate.io.reading import ReadArguments
from zerorate.io.recording import read_recording
from zerorate.io.table import Content, Format, Table
from zerorate.io.writing import WRITTEN
from zerorate.record.log import Log, LogError
from zerorate.record.names import meaning_of, split_unit
from zerorate.record.recording import Recording

_SAID: Final = "by its name"


@dataclass(frozen=True)
class ExplainedColumn:
    """A column: its name, what that means, its unit and who says it, and the log that has it.

    Texts are empty where nothing is known.
    """

    name: str
    meaning: str
    unit: str
    log: str


@dataclass(frozen=True)
class ExplainedTopic:
    """A table of a file: its topic, empty where there are none, and its columns."""

    name: str
    columns: tuple[ExplainedColumn, ...]


@dataclass(frozen=True)
class Explanation:
    """What a file is taken for.

    Attributes
    ----------
    source : str
        The file.
    format : str
        Its kind, as ``meta["format"]`` of its logs.
    reason : str
        How it was recognised.
    topics : tuple of ExplainedTopic
        The tables from which logs are read.
    others : tuple of str
        Topics that are read only when they are asked for.
    logs : mapping of str to Log
        What is read of it; empty where nothing is.
    notes : tuple of str
        What was assumed, and what is not read and why.
    """

    source: str
    format: str
    reason: str
    topics: tuple[ExplainedTopic, ...]
    others: tuple[str, ...]
    logs: Mapping[str, Log]
    notes: tuple[str, ...]


def explain(path: str | os.PathLike[str], **arguments: Unpack[ReadArguments]) -> Explanation:
    """Return what a file is taken for: its format, its topics, each of its columns.

    Parameters
    ----------
    path
        The file, or the folder of a bag.
    **arguments
        Of `zerorate.io.read_recording`.

    Returns
    -------
    Explanation
        Of a file that cannot be read as a recording ``notes`` begins with the reason.

    Raises
    ------
    LogError
        If the format is not known, or the file is damaged.
    OSError, ImportError
        As of `zerorate.io.read_recording`.
    """
    file = Path(path)
    label = label_of(file)
    check_readable(file)
    try:
        form = format_of(file)
        content = opened(file)[1]
    except LogError as error:
        raise error.around(f"{label}: ") from None
    recording, refused = _read(file, arguments)
    logs = {} if recording is None else dict(recording.items())
    notes = (*refused, *_notes(recording, logs))
    read, others = _topics(content, logs)
    topics = tuple(
        ExplainedTopic(name, _columns(name, table, logs)) for name, table in read.items()
    )
    return Explanation(label, form.kind, reason(file, form), topics, others, logs, notes)


def _read(file: Path, arguments: ReadArguments) -> tuple[Recording | None, tuple[str, ...]]:
    try:
        return read_recording(file, **arguments), ()
    except LogError as error:
        return None, (f"no log is read: {told(sentence_of(error))}",)


def _notes(recording: Recording | None, logs: Mapping[str, Log]) -> Iterator[str]:
    said = [] if recording is None else [*recording.notes]
    for log in logs.values():
        said += log.meta.get("notes", ())
    yield from dict.fromkeys(said)


def reason(file: Path, form: Format) -> str:
    """Return how a file was recognised as of a format, in words."""
    suffix = file.suffix.lower()
    if file.is_dir():
        return "a folder with metadata.yaml" if form.kind == "ros2" else "files named after sensors"
    if form.kind == "dataflash text":
        return "a text that begins with FMT, which declares messages"
    if suffix not in form.suffixes:
        return f"a text with lines of numbers; the suffix '{suffix}' is of no format"
    if not form.marks and form.looks is None:
        return f"by its suffix {suffix}, and no other format begins so"
    return f"by its suffix {suffix} and its first bytes"


def _topics(content: Content, logs: Mapping[str, Log]) -> tuple[dict[str, Table], tuple[str, ...]]:
    """Return the tables from which logs are read, or all of a few, and the names of the others."""
    used = {str(log.meta["sensor"]) for log in logs.values() if "sensor" in log.meta}
    sensors = content.tables if content.sensors is None else content.sensors
    read = {name: content.tables[name] for name in sensors} if "" not in content.tables else {}
    read = read or dict(content.tables)
    shown = {name: table for name, table in read.items() if table.meta.sensor in used} or read
    return shown, tuple(name for name in content.tables if name not in shown)


def _columns(topic: str, table: Table, logs: Mapping[str, Log]) -> tuple[ExplainedColumn, ...]:
    table = with_time(table if table.names is not None else table.loaded())
    time = _time(table)
    of = {
        column: name
        for name, log in logs.items()
        if not topic or log.meta.get("sensor") in (table.meta.sensor, None)
        for column in log.names
    }
    return tuple(
        _column(table, index, "time" if index == time else of.get(table.label(index), ""), time)
        for index in range(table.width)
    )


def _time(table: Table) -> int | None:
    """Return the column of the timestamps, in a table without any sensor that of its last one."""
    try:
        return choose(table, None).time
    except LogError:
        return choose(table, [table.width - 1]).time


def _column(table: Table, index: int, log: str, time: int | None) -> ExplainedColumn:
    name = table.label(index)
    if index == time or looks_like_time(name):
        unit = table.time_unit or time_unit(name)
        return ExplainedColumn(name, "time", f"{unit}, {_SAID}" if unit else "by its numbers", log)
    meaning = meaning_of(name)
    if meaning is None:
        unit = split_unit(name)[1]
        return ExplainedColumn(name, "", f"{unit}, {_SAID}" if unit else "", log)
    words = meaning.words
    parts = [meaning.kind]
    if words is not None:
        parts += [words.stage] if words.stage else []
        parts += ["xyz"[words.axis]] if words.axis is not None else []
    return ExplainedColumn(name, " ".join(parts), _unit(table, meaning.unit), log)


def _unit(table: Table, unit: str | None) -> str:
    if unit is not None:
        return f"{unit}, {_SAID}"
    return f"{table.meta.unit}, by the metadata" if table.meta.unit else "not known"


@dataclass(frozen=True)
class KnownFormat:
    """A format of files.

    Attributes
    ----------
    called : str
        Its name.
    suffixes, written : tuple of str
        Those of its files, and those of them that are written.
    extra : str
        What installs the package that it needs; empty where it needs none.
    there : bool
        Whether that package is installed.
    """

    called: str
    suffixes: tuple[str, ...]
    written: tuple[str, ...]
    extra: str
    there: bool


def known_formats(forms: Iterable[Format] = FORMATS) -> tuple[KnownFormat, ...]:
    """Return the formats that are read, in the order of their documentation."""
    return tuple(map(_known, forms))


def _known(form: Format) -> KnownFormat:
    written = tuple(suffix for suffix in form.suffixes if suffix in WRITTEN)
    there = form.needs is None or find_spec(form.needs.package) is not None
    extra = "" if form.needs is None else form.needs.extra
    return KnownFormat(form.called, form.suffixes, written, extra, there)
