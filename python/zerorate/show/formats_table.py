"""Formats that are read, and what a file is taken for, as plain text."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Final

from zerorate.numerals import NOTHING
from zerorate.show.tables import Table, as_text, bulleted, prose

if TYPE_CHECKING:
    from zerorate.io.explaining import ExplainedTopic, Explanation, KnownFormat
    from zerorate.io.packets import PacketForm

_MOST: Final = 40
"""Columns of a topic that are listed."""


def format_formats(
    logs: Iterable[KnownFormat], fixes: Iterable[KnownFormat], packets: Iterable[PacketForm]
) -> str:
    """Return the formats of logs, those of receivers, and packets of devices, as tables."""
    tables = (
        _formats("Logs that are read", logs),
        _formats("Positions that are read", fixes),
        _packets(packets),
    )
    return "\n\n".join(tables)


def _packets(forms: Iterable[PacketForm]) -> str:
    rows = tuple((form.name, form.meaning) for form in forms)
    title = "Packets of devices, zerorate stream --form"
    return as_text(Table(title, ("form", "devices"), rows, words=2))


def _formats(title: str, known: Iterable[KnownFormat]) -> str:
    rows = tuple(
        (
            one.called.removeprefix("a ").removeprefix("an "),
            " ".join(one.suffixes) or "by its content",
            " ".join(one.written) or NOTHING,
            _needs(one),
        )
        for one in known
    )
    return as_text(Table(title, ("format", "files", "written as", "needs"), rows, words=4))


def _needs(one: KnownFormat) -> str:
    if not one.extra:
        return NOTHING
    return f"[{one.extra}]" if one.there else f"[{one.extra}], not installed"


def format_explanation(told: Explanation) -> str:
    """Return what a file is taken for: its format and why, its logs, its columns, notes."""
    parts = [prose(f"{Path(told.source).name} is read as {told.format}: {told.reason}.")]
    if told.logs:
        rows = tuple(
            (name, str(log.n), f"{log.rate:.6g}", log.unit, str(log.meta.get("sensor", NOTHING)))
            for name, log in told.logs.items()
        )
        head = ("log", "samples", "rate, Hz", "unit", "sensor")
        parts.append(as_text(Table("Logs", head, rows, words=1, spare=(4, 1))))
    parts += map(_topic, told.topics)
    if told.others:
        parts.append(prose(f"Further topics: {', '.join(told.others)}", hang="  "))
    if told.notes:
        parts.append(f"Notes\n{bulleted(told.notes)}")
    return "\n\n".join(parts)


def _topic(topic: ExplainedTopic) -> str:
    listed = topic.columns[:_MOST]
    rows = tuple(
        (one.name, one.meaning or NOTHING, one.unit or NOTHING, one.log or NOTHING)
        for one in listed
    )
    left = len(topic.columns) - len(listed)
    note = f"And {left} further columns." if left else ""
    title = f"Columns of {topic.name}" if topic.name else "Columns"
    head = ("column", "by its name", "unit", "read as")
    return as_text(Table(title, head, rows, words=4, note=note))
