"""Findings on a log: observations of an IMU, with numbers, limits and advice."""

from zerorate.findings.before_after import BeforeAfter, Change, before_after
from zerorate.findings.finding import Finding
from zerorate.findings.limits import LIMITS, Limit
from zerorate.findings.report import Report, findings_of

__all__ = [
    "LIMITS",
    "BeforeAfter",
    "Change",
    "Finding",
    "Limit",
    "Report",
    "before_after",
    "findings_of",
]


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
