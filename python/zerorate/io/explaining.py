"""Explanation of a file as it is read: its format, its topics, and each of its columns."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Unpack

import numpy as np

from zerorate.faults import render_text, sentence_of
from zerorate.io.evidence import Evidence, Role
from zerorate.io.formats import check_readable, find_format, known_formats, label_of, open_source
from zerorate.io.reading import ReadArguments
from zerorate.io.recording import read_recording
from zerorate.io.table import Content, Format, Table
from zerorate.io.timecolumns import load_column, load_numbers
from zerorate.io.writing import WRITTEN_SUFFIXES
from zerorate.numerals import shorten
from zerorate.record.log import Log, LogError
from zerorate.record.recording import Recording


@dataclass(frozen=True)
class TopicExplanation:
    """A table of a file: its topic (empty in files without topics) and its columns."""

    name: str
    columns: tuple[Role, ...]


@dataclass(frozen=True)
class Explanation:
    """Explanation of how a file is read.

    Attributes
    ----------
    source : str
        Path of the file.
    format : str
        Name of the format, as in ``meta["format"]`` of the logs.
    reason : str
        Evidence for the format.
    topics : tuple of TopicExplanation
        Tables that contain the logs.
    others : tuple of str
        Topics that are read only on request.
    logs : mapping of str to Log
        Logs in the file; empty if there are none.
    notes : tuple of str
        Sentences on assumptions, and on omitted parts with the reasons.
    """

    source: str
    format: str
    reason: str
    topics: tuple[TopicExplanation, ...]
    others: tuple[str, ...]
    logs: Mapping[str, Log]
    notes: tuple[str, ...]


def explain(path: str | os.PathLike[str], **arguments: Unpack[ReadArguments]) -> Explanation:
    """Explain how a file is read: its format, its topics, each of its columns.

    Parameters
    ----------
    path
        The file, or the folder of a bag.
    **arguments
        Arguments of `zerorate.io.read_recording`.

    Returns
    -------
    Explanation
        If the file cannot be read as a recording, its ``notes`` begin with the reason.

    Raises
    ------
    LogError
        If the format is not known, or the file is damaged.
    OSError, ImportError
        As in `zerorate.io.read_recording`.
    """
    file = Path(path)
    label = label_of(file)
    check_readable(file)
    try:
        form = find_format(file)
        content = open_source(file)[1]
    except LogError as error:
        raise error.with_context(f"{label}: ") from None
    recording, faults = _read_logs(file, arguments)
    logs = {} if recording is None else dict(recording.items())
    notes = (*faults, *_collect_notes(recording, logs))
    read, others = _split_topics(content, logs)
    topics = tuple(
        TopicExplanation(name, _explain_columns(name, table, logs)) for name, table in read.items()
    )
    return Explanation(label, form.kind, explain_format(file, form), topics, others, logs, notes)


def _read_logs(file: Path, arguments: ReadArguments) -> tuple[Recording | None, tuple[str, ...]]:
    try:
        return read_recording(file, **arguments), ()
    except LogError as error:
        return None, (f"no log is read: {render_text(sentence_of(error))}",)


def _collect_notes(recording: Recording | None, logs: Mapping[str, Log]) -> Iterator[str]:
    notes = [] if recording is None else [*recording.notes]
    for log in logs.values():
        notes += log.meta.get("notes", ())
    yield from dict.fromkeys(notes)


def explain_format(file: Path, form: Format) -> str:
    """Return the evidence for a file's format, in words."""
    suffix = file.suffix.lower()
    if file.is_dir():
        return "a folder with metadata.yaml" if form.kind == "ros2" else "files named after sensors"
    if form.kind == "dataflash text":
        return "a text that begins with FMT, which declares messages"
    if suffix not in form.suffixes:
        return f"a text with lines of numbers; the suffix '{suffix}' is of no format"
    if not form.signatures and form.matches_head is None:
        return f"by its suffix {suffix}, and no other format begins so"
    return f"by its suffix {suffix} and its first bytes"


def _split_topics(
    content: Content, logs: Mapping[str, Log]
) -> tuple[dict[str, Table], tuple[str, ...]]:
    """Return the tables with logs (without logs all tables), and the names of other topics."""
    used_sensors = {str(log.meta["sensor"]) for log in logs.values() if "sensor" in log.meta}
    sensors = content.tables if content.sensors is None else content.sensors
    read = {name: content.tables[name] for name in sensors} if "" not in content.tables else {}
    read = read or dict(content.tables)
    shown = {
        name: table for name, table in read.items() if table.meta.sensor in used_sensors
    } or read
    return shown, tuple(name for name in content.tables if name not in shown)


def _explain_columns(topic: str, table: Table, logs: Mapping[str, Log]) -> tuple[Role, ...]:
    evidence = Evidence.of(table)
    own = {
        column: (name, log.unit)
        for name, log in logs.items()
        if not topic or log.meta.get("sensor") in (table.meta.sensor, None)
        for column in log.names
    }
    roles = evidence.roles(own)
    if logs:
        return tuple(roles)
    values = (_values(evidence.table, index) for index in range(evidence.table.width))
    pairs = zip(roles, values, strict=True)
    return tuple(role if role.meaning else role._replace(meaning=text) for role, text in pairs)


def _values(table: Table, index: int) -> str:
    """Return a description of a column's values in a file that is not read."""
    column = load_numbers(table, index)
    if column is None:
        return "holds texts" if load_column(table, index) is None else ""
    known = column[np.isfinite(column)]
    return (
        f"{shorten(known.min(), 4)} to {shorten(known.max(), 4)}" if known.size else "all missing"
    )


@dataclass(frozen=True)
class FormatSupport:
    """A file format and its requirements.

    Attributes
    ----------
    called : str
        Name of the format.
    suffixes, written : tuple of str
        Suffixes of its files, and suffixes that zerorate can write.
    extra : str
        Extra that installs the necessary package; empty if no package is necessary.
    is_installed : bool
        True if the package is installed.
    """

    called: str
    suffixes: tuple[str, ...]
    written: tuple[str, ...]
    extra: str
    is_installed: bool


def list_formats(forms: Iterable[Format] | None = None) -> tuple[FormatSupport, ...]:
    """Return the formats that can be read, in the order of the documentation."""
    return tuple(map(_describe_format, known_formats() if forms is None else forms))


def _describe_format(form: Format) -> FormatSupport:
    written = tuple(suffix for suffix in form.suffixes if suffix in WRITTEN_SUFFIXES)
    is_installed = form.needs is None or find_spec(form.needs.package) is not None
    extra = "" if form.needs is None else form.needs.extra
    return FormatSupport(form.description, form.suffixes, written, extra, is_installed)
