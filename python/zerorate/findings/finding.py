"""A finding: an observation of one kind, its severity, error, time, and advice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from zerorate.faults import make_sentence
from zerorate.findings.limits import Severity

Spans = tuple[tuple[float, float], ...]
RANKS: Final = {"act": 0, "look": 1, "good": 2}
"""Severities, most urgent first."""


@dataclass(frozen=True)
class Finding:
    """Finding on a log, as data.

    Parameters
    ----------
    section : str
        Section of the report, such as ``"The clock"``.
    kind : str
        Name of the finding's limit in ``LIMITS``, or a description if it has no limit.
    severity : str
        ``"good"``, ``"look"`` (worth a look) or ``"act"`` (requires action).
    text : str
        The observation in one sentence, without its cause.
    value : float, optional
        Number that determines the severity; never NaN.
    unit : str
        Unit of the number.
    sigma : float, optional
        Standard error of the number; None if unknown.
    spans : tuple of (float, float)
        Time spans of the finding's data, s after the start of the log.
    figure : str
        Anchor of the figure that shows the finding; empty if there is none.
    advice : str
        Advice on what to do or record next; empty if there is none.
    code : str
        Lines for a settings file of another program; empty if there are none.

    Examples
    --------
    >>> import zerorate as zr
    >>> found = zr.report(zr.simulate_motion("hand", duration=60.0).recording()).findings[0]
    >>> found.section, found.severity, found.text
    ('What is here', 'good', 'gyro: 3 channels in rad/s, 6000 samples at 100 Hz.')
    """

    section: str
    kind: str
    severity: Severity
    text: str
    value: float | None = None
    unit: str = ""
    sigma: float | None = None
    spans: Spans = ()
    figure: str = ""
    advice: str = ""
    code: str = ""


def count_noun(count: int, noun: str) -> str:
    """Return a number with its noun, plural unless the number is one."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def as_sentence(text: str) -> str:
    """Return a text with a capital and a full stop; names of arguments stay unchanged."""
    first, *rest = getattr(text, "parts", (text,))
    return make_sentence(
        first[0].upper() + first[1:] if isinstance(first, str) else first, *rest, "."
    )
