"""Two reports side by side: what is new, gone, worse, better or otherwise, before and after."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Final, Literal

from zerorate.findings.contents import SECTION as CONTENTS
from zerorate.findings.enter import SECTION as ENTER
from zerorate.findings.finding import RANKS, Finding
from zerorate.findings.record import SECTION as RECORD
from zerorate.findings.report import SECTIONS, Report
from zerorate.record.saved import as_json
from zerorate.views import Result

Verdict = Literal["new", "worse", "gone", "better", "differs", "only before", "only after", "alike"]
VERDICTS: Final[tuple[Verdict, ...]] = (
    "new", "worse", "gone", "better", "differs", "only before", "only after", "alike",
)  # fmt: skip
"""In the order in which a person reads them."""
_FORMAT: Final = "zerorate report comparison"
_VERSION: Final = 1
_SURE: Final = 3.0
"""Standard errors beyond which two numbers differ."""
_APART: Final = (CONTENTS, ENTER, RECORD)
"""Sections whose findings are of no state of the sensors."""


@dataclass(frozen=True)
class Change:
    """One kind of finding on one sensor in two logs, of which one may not have it.

    Parameters
    ----------
    before, after : Finding, optional
        Of the one log, and of the other.

    Examples
    --------
    >>> import zerorate as zr
    >>> logs = [zr.simulate_motion("hand", duration=30.0, seed=k).recording() for k in (1, 2)]
    >>> change = zr.findings.before_after(*map(zr.report, logs)).changes[0]
    >>> change.one.kind, change.verdict
    ('gyro bias', 'differs')
    """

    before: Finding | None
    after: Finding | None

    @property
    def one(self) -> Finding:
        """The later of those that there are."""
        found = self.after or self.before
        assert found is not None
        return found

    @property
    def difference(self) -> tuple[float, float] | None:
        """After less before and its standard error, None where either is not known."""
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
        """What became of it: by its severity first, then by its number beyond three sigma."""
        before, after = self.before, self.after
        if before is None:
            return "only after" if self.one.severity == "good" else "new"
        if after is None:
            return "only before" if self.one.severity == "good" else "gone"
        if before.severity != after.severity:
            return "worse" if RANKS[after.severity] < RANKS[before.severity] else "better"
        found = self.difference
        return "differs" if found and abs(found[0]) > _SURE * found[1] else "alike"


@dataclass(frozen=True, eq=False)
class BeforeAfter(Result):
    """Two reports side by side, as `zerorate.report` of two logs returns it.

    Parameters
    ----------
    before, after : Report
        Of the one log, and of the other.

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
        """What to act on in either log, a sentence each."""
        return tuple(dict.fromkeys((*self.before.alarms, *self.after.alarms)))

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed to read either log, a sentence each."""
        return tuple(dict.fromkeys((*self.before.notes, *self.after.notes)))

    @cached_property
    def changes(self) -> tuple[Change, ...]:
        """What is in either, what is new or worse first."""
        found = sorted(_changes(self.before, self.after), key=_order)
        return tuple(found)

    @property
    def summary(self) -> str:
        """One line: how many findings became what."""
        counts = Counter(one.verdict for one in self.changes)
        several = {"differs": "differ"}
        told = [
            f"{n} {several.get(name, name) if n > 1 else name}"
            for name in VERDICTS
            if (n := counts[name])
        ]
        return f"{', '.join(told)}." if told else "Nothing to compare."

    def to_json(self) -> str:
        """Return all changes as JSON, null where a log has no such finding."""
        content = {
            "format": _FORMAT,
            "version": _VERSION,
            "before": self.before.source,
            "after": self.after.source,
            "summary": self.summary,
            "notes": list(self.notes),
            "changes": [{"verdict": one.verdict, **asdict(one)} for one in self.changes],
        }
        return as_json(content, indent=1)

    def to_html(self) -> str:
        """Return the page: one HTML document that needs no network and no other file."""
        from zerorate.views import page_of

        return page_of(self)


def before_after(before: Report, after: Report) -> BeforeAfter:
    """Return two reports side by side: of one device before and after it was changed, say.

    Findings belong together that are of one kind on one sensor. Numbers differ where both have a
    standard error and are further apart than three of them.

    Raises
    ------
    TypeError
        If one of them is no report.

    Examples
    --------
    >>> import zerorate as zr
    >>> logs = [zr.simulate_motion("hand", duration=30.0, seed=k).recording() for k in (1, 2)]
    >>> found = zr.findings.before_after(*map(zr.report, logs))
    >>> [one.verdict for one in found.changes if one.one.kind == "rests"]
    ['alike']
    """
    for one in (before, after):
        if not isinstance(one, Report):
            raise TypeError(f"expected a Report, as zerorate.report returns it, got {type(one)}")
    return BeforeAfter(before, after)


def _changes(before: Report, after: Report) -> Iterator[Change]:
    mine, its = _keyed(before), _keyed(after)
    for key in dict.fromkeys((*mine, *its)):
        yield Change(mine.get(key), its.get(key))


_Key = tuple[str, str, str, int]


def _keyed(report: Report) -> dict[_Key, Finding]:
    """Return findings by section, kind and sensor, and their number among those alike."""
    found: dict[_Key, Finding] = {}
    seen: Counter[tuple[str, str, str]] = Counter()
    for one in report.findings:
        if one.section not in _APART:
            key = (one.section, one.kind, one.figure)
            found[(*key, seen[key])] = one
            seen[key] += 1
    return found


def _order(change: Change) -> tuple[int, int, int]:
    one = change.one
    sections = list(SECTIONS)
    return VERDICTS.index(change.verdict), RANKS[one.severity], sections.index(one.section)
