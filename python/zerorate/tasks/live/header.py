"""Rate and unit of a stream in a comment in its first line."""

from __future__ import annotations

import json
import math
import re
from typing import Any, Final

from zerorate.io.readers.layouts import META_MARK, STATED_RATE
from zerorate.record.names import canonical_unit

_UNIT: Final = re.compile(r"\bunits?\s*[:=]\s*(\S+?)(?=[\s,;]|$)", re.IGNORECASE)
_KEYS: Final = ("rate", "unit")


def stated_in_header(line: str) -> dict[str, Any]:
    """Return rate, Hz, and unit stated in a comment; empty for other lines.

    Parameters
    ----------
    line : str
        First line: ``# rate: 100 Hz, unit: deg/s``, or the first line of a file from
        `zerorate.write_log`.

    Examples
    --------
    >>> stated_in_header("# rate: 100 Hz, unit: deg/s"), stated_in_header("t,gyro_x_dps")
    ({'rate': 100.0, 'unit': 'deg/s'}, {})
    >>> stated_in_header('# zerorate {"rate": 200.0, "unit": "rad/s"}')
    {'rate': 200.0, 'unit': 'rad/s'}
    """
    text = line.strip().lstrip("\ufeff")
    if not text.startswith("#"):
        return {}
    text = text.lstrip("# ")
    stated = _stated_by_json(text) if text.startswith(META_MARK) else _stated_by_words(text)
    return {name: value for name, value in stated.items() if _is_valid(name, value)}


def _stated_by_json(text: str) -> dict[str, Any]:
    try:
        content = json.loads(text.removeprefix(META_MARK))
    except (ValueError, RecursionError):
        return {}
    return {key: content.get(key) for key in _KEYS} if isinstance(content, dict) else {}


def _stated_by_words(text: str) -> dict[str, Any]:
    rate, unit = STATED_RATE.search(text), _UNIT.search(text)
    return {
        "rate": None if rate is None else _number(rate[1] or rate[2]),
        "unit": None if unit is None else unit[1],
    }


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _is_valid(name: str, value: object) -> bool:
    if name == "rate":
        return isinstance(value, float | int) and math.isfinite(value) and value > 0.0
    try:
        return isinstance(value, str) and bool(canonical_unit(value))
    except ValueError:
        return False
