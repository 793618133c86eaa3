"""Readable formats, and the explanation of a file, as plain text."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Final

from zerorate.numerals import DASH
from zerorate.show.tables import Table, as_text, bullet_list, wrap_prose

if TYPE_CHECKING:
    from zerorate.io.explaining import Explanation, FormatSupport, TopicExplanation
    from zerorate.io.packets import PacketProtocol

_MAX_COLUMNS: Final = 40
"""Largest number of columns of a topic that are listed."""


def format_formats(
    logs: Iterable[FormatSupport], fixes: Iterable[FormatSupport], packets: Iterable[PacketProtocol]
) -> str:
    """Return tables of the formats of logs and receivers, and of the packets of devices."""
    tables = (
        f"{_format_formats('Logs that are read', logs)}\n  Videos of GoPro cameras need no extra.",
        _format_formats("Positions that are read", fixes),
        _format_packets(packets),
    )
    return "\n\n".join(tables)


def _format_packets(protocols: Iterable[PacketProtocol]) -> str:
    rows = tuple((protocol.name, protocol.meaning) for protocol in protocols)
    title = "Packets of devices, zerorate stream --form"
    return as_text(Table(title, ("form", "devices"), rows, words=2))


def _format_formats(title: str, formats: Iterable[FormatSupport]) -> str:
    rows = tuple(
        (
            known_format.called.removeprefix("a ").removeprefix("an "),
            " ".join(known_format.suffixes) or "by its content",
            " ".join(known_format.written) or DASH,
            _describe_extra(known_format),
        )
        for known_format in formats
    )
    return as_text(Table(title, ("format", "files", "written as", "needs"), rows, words=4))


def _describe_extra(known_format: FormatSupport) -> str:
    if not known_format.extra:
        return DASH
    return (
        f"[{known_format.extra}]"
        if known_format.is_installed
        else f"[{known_format.extra}], not installed"
    )


def format_explanation(explanation: Explanation) -> str:
    """Return the explanation of a file: format with reason, logs, columns, notes."""
    parts = [
        wrap_prose(
            f"{Path(explanation.source).name} is read as {explanation.format}: "
            f"{explanation.reason}."
        )
    ]
    if explanation.logs:
        rows = tuple(
            (name, str(log.n), f"{log.rate:.6g}", log.unit, str(log.meta.get("sensor", DASH)))
            for name, log in explanation.logs.items()
        )
        head = ("log", "samples", "rate, Hz", "unit", "sensor")
        parts.append(as_text(Table("Logs", head, rows, words=1, spare=(4, 1))))
    parts += map(_format_topic, explanation.topics)
    if explanation.others:
        parts.append(wrap_prose(f"Further topics: {', '.join(explanation.others)}", hang="  "))
    if explanation.notes:
        parts.append(f"Notes\n{bullet_list(explanation.notes)}")
    return "\n\n".join(parts)


def _format_topic(topic: TopicExplanation) -> str:
    listed = topic.columns[:_MAX_COLUMNS]
    rows = tuple(
        (column.name, column.meaning or DASH, column.unit or DASH, column.log or DASH)
        for column in listed
    )
    hidden_count = len(topic.columns) - len(listed)
    note = f"And {hidden_count} further columns." if hidden_count else ""
    title = f"Columns of {topic.name}" if topic.name else "Columns"
    head = ("column", "understood as", "unit", "read as")
    return as_text(Table(title, head, rows, words=4, note=note))
