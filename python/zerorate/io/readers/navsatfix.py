"""ROS messages of type NavSatFix as JSON, as a list or one per line."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from zerorate.io.readers.parsers import decode_text
from zerorate.io.table import Column, Content, Format, Metadata, Table
from zerorate.record.log import LogError


def looks_like_json(head: bytes) -> bool:
    """Return True if a file begins like JSON."""
    return head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith((b"{", b"["))


def _read(path: Path) -> Content:
    messages, notes = _parse_messages(decode_text(path.read_bytes()))
    rows = [dict(_flatten(message)) for message in messages]
    names = tuple(dict.fromkeys(name for row in rows for name in row))
    if not any(name.endswith("latitude") for name in names):
        raise LogError("no message has a latitude, expected those of type sensor_msgs/NavSatFix")
    columns = [_make_column([row.get(name) for row in rows]) for name in names]
    return Content.of(
        Table(
            width=len(names),
            load=lambda wanted: [columns[i] for i in wanted],
            names=names,
            meta=Metadata(notes=notes),
        )
    )


FORMAT: Final = Format("navsatfix", "messages of NavSatFix", (".json", ".jsonl"), (), _read)


def _parse_messages(text: str) -> tuple[list[Mapping[str, Any]], tuple[str, ...]]:
    try:
        whole = json.loads(text)
    except RecursionError:
        raise LogError("the JSON is nested too deeply for messages") from None
    except ValueError:
        return _parse_lines(text)
    listed = whole.get("messages", [whole]) if isinstance(whole, dict) else whole
    if not isinstance(listed, list) or not all(isinstance(message, dict) for message in listed):
        raise LogError("the JSON is no list of messages, each an object")
    return listed, ()


def _parse_lines(text: str) -> tuple[list[Mapping[str, Any]], tuple[str, ...]]:
    """Return the messages from a text with one per line; the last may be incomplete."""
    lines = [(i, line) for i, line in enumerate(text.splitlines(), start=1) if line.strip()]
    messages: list[Mapping[str, Any]] = []
    for number, line in lines:
        try:
            message = json.loads(line)
        except (ValueError, RecursionError):
            message = None
        if isinstance(message, dict):
            messages.append(message)
        elif messages and number == lines[-1][0]:
            return messages, (f"line {number} is cut off, and left out",)
        else:
            raise LogError(f"line {number} is no JSON object, expected a message on each line")
    return messages, ()


def _flatten(message: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Yield the values of a message with names such as ``header.stamp.secs``."""
    for key, value in message.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            yield from _flatten(value, f"{name}.")
        elif isinstance(value, list):
            yield from ((f"{name}_{i}", item) for i, item in enumerate(value))
        else:
            yield name, value


def _make_column(values: list[object]) -> Column:
    """Return a column of numbers, NaN for missing values; or of texts."""
    if any(isinstance(value, str) for value in values):
        return np.array(values, dtype=object)
    whole = all(isinstance(value, int) for value in values)
    if whole and all(abs(value) < 1 << 63 for value in values if isinstance(value, int)):
        return np.array(values, dtype=np.int64)
    return np.array([float(v) if isinstance(v, (int, float)) else math.nan for v in values])
