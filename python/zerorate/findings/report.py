"""A report on a log: its findings in the order of its sections, as data, text and JSON."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from itertools import chain
from typing import Final

import numpy as np

from zerorate.checks.preparation import FROZEN, GRAVITY, IMPOSSIBLE, Remark
from zerorate.findings.attitude import SECTION as ATTITUDE
from zerorate.findings.attitude import attitude
from zerorate.findings.autopilot import SECTION as AUTOPILOT
from zerorate.findings.autopilot import autopilot
from zerorate.findings.axes import SECTION as AXES
from zerorate.findings.axes import axes
from zerorate.findings.clock import SECTION as CLOCK
from zerorate.findings.clock import clock
from zerorate.findings.contents import SECTION as CONTENTS
from zerorate.findings.contents import contents
from zerorate.findings.enter import SECTION as ENTER
from zerorate.findings.enter import Known, enter, known
from zerorate.findings.finding import RANKS, Finding, sentence
from zerorate.findings.imus import Imu, imus
from zerorate.findings.magnetometer import SECTION as MAGNETOMETER
from zerorate.findings.magnetometer import magnetometer
from zerorate.findings.pairs import SECTION as PAIRS
from zerorate.findings.pairs import pairs
from zerorate.findings.receiver import SECTION as RECEIVER
from zerorate.findings.receiver import receiver
from zerorate.findings.record import SECTION as RECORD
from zerorate.findings.record import record
from zerorate.findings.rests import NOISE, noise, rests
from zerorate.findings.rests import SECTION as RESTS
from zerorate.findings.samples import SECTION as SAMPLES
from zerorate.findings.samples import samples
from zerorate.findings.temperature import by_temperature
from zerorate.findings.vibration import SECTION as VIBRATION
from zerorate.findings.vibration import vibration
from zerorate.progress import Progress
from zerorate.record.fixes import Fixes
from zerorate.record.log import LogError
from zerorate.record.recording import Recording
from zerorate.record.saved import as_json
from zerorate.views import Result

_FORMAT: Final = "zerorate report"
_VERSION: Final = 1


@dataclass(frozen=True)
class _Given:
    """What is looked at: a recording, its IMUs, fixes, remarks, and the findings so far."""

    recording: Recording
    imus: tuple[Imu, ...]
    fixes: Fixes | None
    remarks: tuple[Remark, ...]
    findings: list[Finding] = field(default_factory=list)

    @cached_property
    def known(self) -> Known:
        """What the first IMU tells for the settings of others."""
        return known(self.recording, self.imus[0])

    def remarked(self, check: str, section: str, sensor: str) -> Iterator[Finding]:
        """Yield what the preparation says against the recording in one of its checks."""
        figure = next((s.figure for imu in self.imus for s in imu.sensors if s.name == sensor), "")
        for one in self.remarks:
            if one.check == check and one.alarm:
                yield Finding(section, check, "act", sentence(one.text), figure=figure)

    def entered(self) -> Iterator[Finding]:
        """Yield what to enter."""
        return enter(self.imus[0], self.known)

    def recorded(self) -> Iterator[Finding]:
        """Yield what to record next."""
        return record(self.recording, self.imus[0], self.known, self.findings)


SECTIONS: Final[dict[str, Callable[[_Given], Iterator[Finding]]]] = {
    CONTENTS: lambda given: contents(given.recording, given.imus),
    CLOCK: lambda given: clock(given.imus),
    SAMPLES: lambda given: chain(given.remarked(IMPOSSIBLE, SAMPLES, "gyro"), samples(given.imus)),
    RESTS: lambda given: chain(rests(given.imus), by_temperature(given.recording, given.imus)),
    NOISE: lambda given: noise(given.imus),
    VIBRATION: lambda given: vibration(given.imus),
    AUTOPILOT: lambda given: autopilot(given.recording),
    PAIRS: lambda given: pairs(given.imus),
    AXES: lambda given: chain(
        given.remarked(GRAVITY, AXES, "accel"), axes(given.recording, given.imus)
    ),
    MAGNETOMETER: lambda given: chain(
        given.remarked(FROZEN, MAGNETOMETER, "gyro"), magnetometer(given.recording, given.imus)
    ),
    ATTITUDE: lambda given: attitude(given.recording, given.imus),
    RECEIVER: lambda given: receiver(given.recording, given.imus, given.fixes),
    ENTER: lambda given: given.entered(),
    RECORD: lambda given: given.recorded(),
}
"""What finds the findings of each section, in the order of the page."""


@dataclass(frozen=True, eq=False)
class Report(Result):
    """What is seen of a log, as `zerorate.report` returns it.

    Parameters
    ----------
    findings : tuple of Finding
        In the order of the sections.
    source : str
        Name of the log.
    recording : Recording
        What was looked at, for the figures.

    Examples
    --------
    >>> import zerorate as zr
    >>> found = zr.report(zr.simulate_motion("hand", duration=60.0).recording())
    >>> found.count("act"), found.findings[0].section
    (0, 'What is here')
    """

    findings: tuple[Finding, ...]
    source: str
    recording: Recording = field(repr=False)

    @property
    def alarms(self) -> tuple[str, ...]:
        """What to act on, a sentence each."""
        return tuple(one.text for one in self.findings if one.severity == "act")

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed to read the log, and mended in it, a sentence each."""
        return tuple(one.text for one in self.findings if one.kind == "reading")

    def count(self, severity: str) -> int:
        """Return how many findings are of a severity: ``"good"``, ``"look"`` or ``"act"``."""
        return sum(one.severity == severity for one in self.findings)

    @property
    def urgent(self) -> tuple[Finding, ...]:
        """Those to act on, then those to look at."""
        worse = (one for one in self.findings if one.severity != "good")
        return tuple(sorted(worse, key=lambda one: RANKS[one.severity]))

    @property
    def empty(self) -> tuple[str, ...]:
        """Sections of which the log shows nothing, and what is not looked at."""
        return tuple(name for name in SECTIONS if all(name != f.section for f in self.findings))

    @property
    def summary(self) -> str:
        """One line: how many findings ask for what."""
        act, look = self.count("act"), self.count("look")
        if not act and not look:
            return "Nothing in this log passes a limit."
        within = sum(o.severity == "good" and o.value is not None for o in self.findings)
        return f"{act} to act on, {look} to look at; {within} within their limits."

    def to_json(self) -> str:
        """Return all findings as JSON, null where a number is not known."""
        content = {
            "format": _FORMAT,
            "version": _VERSION,
            "source": self.source,
            "summary": self.summary,
            "findings": [asdict(one) for one in self.findings],
            "no_data": list(self.empty),
        }
        return as_json(content, indent=1)

    def to_html(self) -> str:
        """Return the page: one HTML document that needs no network and no other file."""
        from zerorate.views import page_of

        return page_of(self)


def findings_of(
    recording: Recording,
    *,
    fixes: Fixes | None = None,
    remarks: Sequence[Remark] = (),
    progress: Progress | None = None,
) -> Report:
    """Return what is seen of the IMU of a recording: clock, samples, rests, noise, vibration, axes.

    `zerorate.report` prepares the recording first.

    Parameters
    ----------
    recording : Recording
        With a gyro or an accelerometer of three axes.
    fixes : Fixes, optional
        Of a receiver on the same body; by default those of the recording, if any.
    remarks : sequence of Remark
        What the preparation of the recording says against it.
    progress : callable, optional
        Called with the section and the part done, 0 to 1.

    Raises
    ------
    LogError
        If there is neither a gyro nor an accelerometer of three axes.

    Examples
    --------
    >>> import zerorate as zr
    >>> from zerorate.findings import findings_of
    >>> found = findings_of(zr.simulate_motion("hand", duration=60.0).recording())
    >>> found.count("act")
    0
    """
    found = imus(recording)
    if not found:
        raise LogError(
            "a report needs a gyro or an accelerometer of three axes; the recording has: "
            f"{', '.join(recording)}"
        )
    given = _Given(recording, found, fixes, tuple(remarks))
    for number, (name, look) in enumerate(SECTIONS.items()):
        if progress is not None:
            progress(name.lower(), number / len(SECTIONS))
        # Numbers so wild that they overflow pass no limit.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            given.findings.extend(look(given))
    return Report(tuple(given.findings), recording.source, recording)
