"""Comparison of two reports: findings that are new, gone, worse, better or different."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Final, Literal

from zerorate.findings.contents import SECTION as CONTENTS
from zerorate.findings.external_settings import SECTION as ENTER
from zerorate.findings.finding import RANKS, Finding
from zerorate.findings.next_recording import SECTION as RECORD
from zerorate.findings.report import SECTIONS, Report
from zerorate.record.saved import as_json
from zerorate.views import Result

Verdict = Literal[
    "new", "worse", "gone", "better", "differs", "only before", "only after", "unchanged"
]
VERDICTS: Final[tuple[Verdict, ...]] = (
    "new", "worse", "gone", "better", "differs", "only before", "only after", "unchanged",
)  # fmt: skip
"""Verdicts, most important first."""
_FORMAT: Final = "zerorate report comparison"
_VERSION: Final = 1
_SIGNIFICANCE_SIGMAS: Final = 3.0
"""Difference of two numbers, in standard errors, that counts as a change."""
_EXCLUDED_SECTIONS: Final = (CONTENTS, ENTER, RECORD)
"""Sections without findings on the sensors' state."""


@dataclass(frozen=True)
class Change:
    """A finding of one kind on one sensor, in two logs; one log may lack the finding.

    Parameters
    ----------
    before, after : Finding, optional
        The finding in the earlier log, and in the later log.

    Examples
    --------
    >>> import zerorate as zr
    >>> logs = [zr.simulate_motion("hand", duration=30.0, seed=k).recording() for k in (1, 2)]
    >>> change = zr.findings.before_after(*map(zr.report, logs)).changes[0]
    >>> change.finding.kind, change.verdict
    ('gyro bias', 'differs')
    """

    before: Finding | None
    after: Finding | None

    @property
    def finding(self) -> Finding:
        """Finding in the later log, or else in the earlier log."""
        finding = self.after or self.before
        assert finding is not None
        return finding

    @property
    def difference(self) -> tuple[float, float] | None:
        """Difference after minus before, and its standard error; None if one of them is unknown."""
        before, after = self.before, self.after
        if before is None or after is None or before.unit != after.unit:
            return None
        if before.value is None or after.value is None:
            return None
        if before.sigma is None or after.sigma is None:
            return None
        return after.value - before.value, math.hypot(before.sigma, after.sigma)

    @property
    def verdict(self) -> Verdict:
        """Verdict on the change: from the severities; if they are equal, from the numbers."""
        before, after = self.before, self.after
        if before is None:
            return "only after" if self.finding.severity == "good" else "new"
        if after is None:
            return "only before" if self.finding.severity == "good" else "gone"
        if before.severity != after.severity:
            return "worse" if RANKS[after.severity] < RANKS[before.severity] else "better"
        difference = self.difference
        return (
            "differs"
            if difference and abs(difference[0]) > _SIGNIFICANCE_SIGMAS * difference[1]
            else "unchanged"
        )


@dataclass(frozen=True, eq=False)
class BeforeAfter(Result):
    """Comparison of two reports, as `zerorate.report` of two logs returns it.

    Parameters
    ----------
    before, after : Report
        Reports of the first and of the second log.

    Examples
    --------
    >>> import zerorate as zr
    >>> logs = [zr.simulate_motion("hand", duration=30.0, seed=k).recording() for k in (1, 2)]
    >>> found = zr.findings.before_after(*map(zr.report, logs))
    >>> found.before.source, found.after.source, len(found.changes) > 10
    ('simulated hand, seed 1', 'simulated hand, seed 2', True)
    """

    before: Report
    after: Report

    @property
    def source(self) -> str:
        """Names of both logs."""
        return f"{self.before.source}, {self.after.source}"

    @property
    def alarms(self) -> tuple[str, ...]:
        """Findings in either log that require action, one sentence each."""
        return tuple(dict.fromkeys((*self.before.alarms, *self.after.alarms)))

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions made to read either log, one sentence each."""
        return tuple(dict.fromkeys((*self.before.notes, *self.after.notes)))

    def findings_from(self, level: str) -> tuple[Finding, ...]:
        """Return the later log's findings of at least this severity, most severe first."""
        return self.after.findings_from(level)

    @cached_property
    def changes(self) -> tuple[Change, ...]:
        """Findings in either log; new and worse findings are first."""
        ordered = sorted(_pair_findings(self.before, self.after), key=_sort_key)
        return tuple(ordered)

    @property
    def summary(self) -> str:
        """One line: the numbers of findings by verdict."""
        counts = Counter(change.verdict for change in self.changes)
        plural_verdicts = {"differs": "differ"}
        counts_text = [
            f"{n} {plural_verdicts.get(name, name) if n > 1 else name}"
            for name in VERDICTS
            if (n := counts[name])
        ]
        return f"{', '.join(counts_text)}." if counts_text else "Nothing to compare."

    def to_json(self) -> str:
        """Return all changes as JSON, with null if a log lacks the finding."""
        content = {
            "format": _FORMAT,
            "version": _VERSION,
            "before": self.before.source,
            "after": self.after.source,
            "summary": self.summary,
            "notes": list(self.notes),
            "changes": [{"verdict": change.verdict, **asdict(change)} for change in self.changes],
        }
        return as_json(content, indent=1)

    def to_html(self) -> str:
        """Return an HTML document that needs no network and no other file."""
        from zerorate.views import page_of

        return page_of(self)


def before_after(before: Report, after: Report) -> BeforeAfter:
    """Compare two reports, for example before and after a change of a device.

    Findings of one kind on one sensor are compared. Two numbers with standard errors differ if the
    difference exceeds three times its own standard error.

    Raises
    ------
    TypeError
        If an argument is not a report.

    Examples
    --------
    >>> import zerorate as zr
    >>> logs = [zr.simulate_motion("hand", duration=30.0, seed=k).recording() for k in (1, 2)]
    >>> found = zr.findings.before_after(*map(zr.report, logs))
    >>> [change.verdict for change in found.changes if change.finding.kind == "rests"]
    ['unchanged']
    """
    for report in (before, after):
        if not isinstance(report, Report):
            raise TypeError(f"expected a Report, as zerorate.report returns it, got {type(report)}")
    return BeforeAfter(before, after)


def _pair_findings(before: Report, after: Report) -> Iterator[Change]:
    mine, its = _index_findings(before), _index_findings(after)
    for key in dict.fromkeys((*mine, *its)):
        yield Change(mine.get(key), its.get(key))


_Key = tuple[str, str, str, int]


def _index_findings(report: Report) -> dict[_Key, Finding]:
    """Return findings by section, kind and sensor, and their number among equal ones."""
    index: dict[_Key, Finding] = {}
    occurrences: Counter[tuple[str, str, str]] = Counter()
    for finding in report.findings:
        if finding.section not in _EXCLUDED_SECTIONS:
            key = (finding.section, finding.kind, finding.figure)
            index[(*key, occurrences[key])] = finding
            occurrences[key] += 1
    return index


def _sort_key(change: Change) -> tuple[int, int, int]:
    finding = change.finding
    sections = list(SECTIONS)
    return VERDICTS.index(change.verdict), RANKS[finding.severity], sections.index(finding.section)
