"""Check of a recording as plain text: mistakes, confirmed axes, open questions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from zerorate.numerals import DASH, format_with_error
from zerorate.show.tables import Table, as_text, bullet_list

if TYPE_CHECKING:
    from zerorate.checks.result import Checks, Finding
    from zerorate.noise.coefficient import Coefficient

_MAX_LISTED: Final = 3
"""Largest number of spans and alternatives that are listed."""


def format_checks(checks: Checks) -> str:
    """Return the findings of a check, one per line; alarms come first."""
    return "\n\n".join(filter(None, ("\n".join(checks.alarms), *_format_parts(checks))))


def _format_parts(checks: Checks) -> Iterator[str]:
    findings = [finding for finding in (checks.gyro, checks.magnetometer) if finding.sensor]
    rows = tuple(
        (finding.sensor, finding.status, _list_alternatives(finding), _list_spans(finding))
        for finding in findings
    )
    head = ("", "what is seen", "axes that fit", "spans, s")
    if rows:
        yield as_text(Table(f"Units and axes in {checks.source}", head, rows, words=4))
    numbers = tuple(_format_numbers(checks))
    if numbers:
        yield as_text(Table("The gyro compared with the accelerometer", (), numbers))
    sentences = [
        finding.text for finding in (checks.gyro, checks.magnetometer) if not finding.alarm
    ]
    yield f"Notes\n{bullet_list([*sentences, *_describe_dip(checks), *checks.notes])}"


def _list_alternatives(finding: Finding) -> str:
    if not finding.alternatives:
        return DASH
    more = len(finding.alternatives) - _MAX_LISTED
    listed = " ".join(f"({alternative})" for alternative in finding.alternatives[:_MAX_LISTED])
    return f"{listed} and {more} more" if more > 0 else listed


def _list_spans(finding: Finding) -> str:
    if not finding.spans:
        return DASH
    listed = ", ".join(f"{begin:.0f}-{end:.0f}" for begin, end in finding.spans[:_MAX_LISTED])
    return f"{listed}, ..." if len(finding.spans) > _MAX_LISTED else listed


def _format_numbers(checks: Checks) -> Iterator[tuple[str, str]]:
    for axis, scale in zip("xyz", checks.scale, strict=True):
        if scale.identifiable:
            yield f"scale of {axis}", format_with_error(scale.value, scale.sigma)
    if checks.delay.identifiable:
        yield "delay, ms", _format_ms(checks.delay)


def _format_ms(delay: Coefficient) -> str:
    return format_with_error(1e3 * delay.value, 1e3 * delay.sigma)


def _describe_dip(checks: Checks) -> Iterator[str]:
    if checks.dip is None:
        return
    degrees = math.degrees(checks.dip)
    warning = "" if degrees >= 0 else ": south of the magnetic equator, or wrong signs of a sensor"
    yield f"the magnetic field points {degrees:.0f} deg below the level{warning}"
