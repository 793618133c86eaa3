"""A finding: an observation of one kind, its severity, error, time, and advice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from zerorate.faults import make_sentence
from zerorate.findings.limits import Severity

Spans = tuple[tuple[float, float], ...]
RANKS: Final = {"act": 0, "look": 1, "good": 2}
"""Severities, what needs a person first."""


@dataclass(frozen=True)
class Finding:
    """Finding on a log, as data.

    Parameters
    ----------
    section : str
        Of the report: ``"The clock"`` for instance.
    kind : str
        The name of its limit in ``LIMITS``, or what it is.
    severity : str
        ``"good"``, ``"look"`` or ``"act"``.
    text : str
        One sentence: what is seen, never its cause.
    value : float, optional
        The number that it rests on; NaN is never one.
    unit : str
        Of the number.
    sigma : float, optional
        Standard error of the number; None where none is known.
    spans : tuple of (float, float)
        Seconds since the log began that it rests on.
    figure : str
        Anchor of the figure that shows it; empty for none.
    advice : str
        What to do, or to record next; empty for nothing.
    code : str
        Lines to enter, as a file of another program has them; empty for none.

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
    """Return a number with its noun, which is plural unless it is one."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def as_sentence(text: str) -> str:
    """Return a text with a capital and a full stop; the arguments that it names stay arguments."""
    first, *rest = getattr(text, "parts", (text,))
    return make_sentence(
        first[0].upper() + first[1:] if isinstance(first, str) else first, *rest, "."
    )
