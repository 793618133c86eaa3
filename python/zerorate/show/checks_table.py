"""A check of a recording as plain text: what is mistaken, what is seen, what is not."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from zerorate.numerals import NOTHING, with_error
from zerorate.show.tables import Table, as_text, bulleted

if TYPE_CHECKING:
    from zerorate.checks.result import Checks, Finding
    from zerorate.noise.coefficient import Coefficient

_MOST: Final = 3
"""Spans of time, and alternatives, that are listed."""


def format_checks(checks: Checks) -> str:
    """Return what a check has found; what is mistaken comes first, a line each."""
    return "\n\n".join(filter(None, ("\n".join(checks.alarms), *_parts(checks))))


def _parts(checks: Checks) -> Iterator[str]:
    found = [one for one in (checks.gyro, checks.magnetometer) if one.sensor]
    rows = tuple((one.sensor, one.status, _left(one), _when(one)) for one in found)
    head = ("", "what is seen", "axes that fit", "seen at, s")
    if rows:
        yield as_text(Table(f"Units and axes in {checks.source}", head, rows, words=4))
    numbers = tuple(_numbers(checks))
    if numbers:
        yield as_text(Table("The gyro against the accelerometer", (), numbers))
    said = [one.text for one in (checks.gyro, checks.magnetometer) if not one.alarm]
    yield f"Notes\n{bulleted([*said, *_on_dip(checks), *checks.notes])}"


def _left(finding: Finding) -> str:
    if not finding.alternatives:
        return NOTHING
    more = len(finding.alternatives) - _MOST
    listed = " ".join(f"({one})" for one in finding.alternatives[:_MOST])
    return f"{listed} and {more} more" if more > 0 else listed


def _when(finding: Finding) -> str:
    if not finding.spans:
        return NOTHING
    listed = ", ".join(f"{begin:.0f}-{end:.0f}" for begin, end in finding.spans[:_MOST])
    return f"{listed}, ..." if len(finding.spans) > _MOST else listed


def _numbers(checks: Checks) -> Iterator[tuple[str, str]]:
    for axis, scale in zip("xyz", checks.scale, strict=True):
        if scale.identifiable:
            yield f"scale of {axis}", with_error(scale.value, scale.sigma)
    if checks.delay.identifiable:
        yield "delay, ms", _in_ms(checks.delay)


def _in_ms(delay: Coefficient) -> str:
    return with_error(1e3 * delay.value, 1e3 * delay.sigma)


def _on_dip(checks: Checks) -> Iterator[str]:
    if checks.dip is None:
        return
    degrees = math.degrees(checks.dip)
    where = "" if degrees >= 0 else ": south of the magnetic equator, or a sensor's signs are wrong"
    yield f"the magnetic field points {degrees:.0f} deg below the level{where}"
