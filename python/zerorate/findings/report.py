"""Report on a log: its findings in the order of its sections, as data, text and JSON."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from itertools import chain
from typing import Final

import numpy as np

from zerorate.checks.preparation import FROZEN, GRAVITY, IMPOSSIBLE, Remark
from zerorate.findings.attitude import SECTION as ATTITUDE
from zerorate.findings.attitude import attitude_findings
from zerorate.findings.autopilot import SECTION as AUTOPILOT
from zerorate.findings.autopilot import autopilot_findings
from zerorate.findings.axes import SECTION as AXES
from zerorate.findings.axes import axes_findings
from zerorate.findings.clock import SECTION as CLOCK
from zerorate.findings.clock import clock_findings
from zerorate.findings.contents import SECTION as CONTENTS
from zerorate.findings.contents import contents_findings
from zerorate.findings.external_settings import SECTION as ENTER
from zerorate.findings.external_settings import LogModels, fit_log_models, settings_findings
from zerorate.findings.finding import RANKS, Finding, as_sentence
from zerorate.findings.imus import Imu, find_imus
from zerorate.findings.magnetometer import SECTION as MAGNETOMETER
from zerorate.findings.magnetometer import magnetometer_findings
from zerorate.findings.next_recording import SECTION as RECORD
from zerorate.findings.next_recording import next_record_findings
from zerorate.findings.pairs import SECTION as PAIRS
from zerorate.findings.pairs import pair_findings
from zerorate.findings.receiver import SECTION as RECEIVER
from zerorate.findings.receiver import receiver_findings
from zerorate.findings.rests import NOISE_SECTION, noise_findings, rest_findings
from zerorate.findings.rests import SECTION as RESTS
from zerorate.findings.samples import SECTION as SAMPLES
from zerorate.findings.samples import sample_findings
from zerorate.findings.temperature import temperature_findings
from zerorate.findings.vibration import SECTION as VIBRATION
from zerorate.findings.vibration import vibration_findings
from zerorate.progress import Progress
from zerorate.record.fixes import Fixes
from zerorate.record.log import LogError
from zerorate.record.recording import Recording
from zerorate.record.saved import as_json
from zerorate.views import Result

_FORMAT: Final = "zerorate report"
_VERSION: Final = 1


@dataclass(frozen=True)
class _ReportInput:
    """Input of a report: a recording, its IMUs, fixes, remarks, and earlier findings."""

    recording: Recording
    imus: tuple[Imu, ...]
    fixes: Fixes | None
    remarks: tuple[Remark, ...]
    findings: list[Finding] = field(default_factory=list)

    @cached_property
    def models(self) -> LogModels:
        """Models of the first IMU for the settings of other programs."""
        return fit_log_models(self.recording, self.imus[0])

    def remark_findings(self, check: str, section: str, sensor: str) -> Iterator[Finding]:
        """Yield the alarms of one check of the preparation."""
        figure = next((s.figure for imu in self.imus for s in imu.sensors if s.name == sensor), "")
        for remark in self.remarks:
            if remark.check == check and remark.alarm:
                yield Finding(section, check, "act", as_sentence(remark.text), figure=figure)

    def settings_findings(self) -> Iterator[Finding]:
        """Yield findings with the settings to enter."""
        return settings_findings(self.imus[0], self.models)

    def next_record_findings(self) -> Iterator[Finding]:
        """Yield findings with the data to record next."""
        return next_record_findings(self.recording, self.imus[0], self.models, self.findings)


SECTIONS: Final[dict[str, Callable[[_ReportInput], Iterator[Finding]]]] = {
    CONTENTS: lambda given: contents_findings(given.recording, given.imus),
    CLOCK: lambda given: clock_findings(given.imus),
    SAMPLES: lambda given: chain(
        given.remark_findings(IMPOSSIBLE, SAMPLES, "gyro"), sample_findings(given.imus)
    ),
    RESTS: lambda given: chain(
        rest_findings(given.imus), temperature_findings(given.recording, given.imus)
    ),
    NOISE_SECTION: lambda given: noise_findings(given.imus),
    VIBRATION: lambda given: vibration_findings(given.imus),
    AUTOPILOT: lambda given: autopilot_findings(given.recording),
    PAIRS: lambda given: pair_findings(given.imus),
    AXES: lambda given: chain(
        given.remark_findings(GRAVITY, AXES, "accel"), axes_findings(given.recording, given.imus)
    ),
    MAGNETOMETER: lambda given: chain(
        given.remark_findings(FROZEN, MAGNETOMETER, "gyro"),
        magnetometer_findings(given.recording, given.imus),
    ),
    ATTITUDE: lambda given: attitude_findings(given.recording, given.imus),
    RECEIVER: lambda given: receiver_findings(given.recording, given.imus, given.fixes),
    ENTER: lambda given: given.settings_findings(),
    RECORD: lambda given: given.next_record_findings(),
}
"""Functions that yield the findings of each section, in the order of the page."""


@dataclass(frozen=True, eq=False)
class Report(Result):
    """Findings on a log, as `zerorate.report` returns it.

    Parameters
    ----------
    findings : tuple of Finding
        Findings in the order of the sections.
    source : str
        Name of the log.
    recording : Recording
        Recording of the report, for the figures.

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
        """Findings that require action, one sentence each."""
        return tuple(finding.text for finding in self.findings if finding.severity == "act")

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions made to read the log, and corrections in it, one sentence each."""
        return tuple(finding.text for finding in self.findings if finding.kind == "reading")

    def count(self, severity: str) -> int:
        """Return the number of findings of a severity: ``"good"``, ``"look"`` or ``"act"``."""
        return sum(finding.severity == severity for finding in self.findings)

    def findings_from(self, level: str) -> tuple[Finding, ...]:
        """Return the findings of at least this severity, most severe first.

        `level` is ``"act"``, ``"look"``, or ``"none"`` for no finding.
        """
        if level == "none":
            return ()
        return tuple(one for one in self.urgent_findings if RANKS[one.severity] <= RANKS[level])

    @property
    def urgent_findings(self) -> tuple[Finding, ...]:
        """Findings that require action, then findings worth a look."""
        not_good = (one for one in self.findings if one.severity != "good")
        return tuple(sorted(not_good, key=lambda one: RANKS[one.severity]))

    @property
    def empty(self) -> tuple[str, ...]:
        """Sections without findings in the log, and omitted checks."""
        return tuple(name for name in SECTIONS if all(name != f.section for f in self.findings))

    @property
    def summary(self) -> str:
        """One line: the numbers of findings by severity."""
        act, look = self.count("act"), self.count("look")
        good = [o for o in self.findings if o.severity == "good" and o.value is not None]
        if not act and not look:
            sections = dict.fromkeys(o.section for o in good if o.section != CONTENTS)
            checked = ", ".join(_lower_first(name).removeprefix("the ") for name in sections)
            return f"All within limits: {len(good)} numbers of {checked or 'the log'}."
        return f"{act} to act on, {look} to look at; {len(good)} within their limits."

    def to_json(self) -> str:
        """Return all findings as JSON, with null for unknown numbers."""
        content = {
            "format": _FORMAT,
            "version": _VERSION,
            "source": self.source,
            "summary": self.summary,
            "findings": [asdict(finding) for finding in self.findings],
            "no_data": list(self.empty),
        }
        return as_json(content, indent=1)

    def to_html(self) -> str:
        """Return an HTML document that needs no network and no other file."""
        from zerorate.views import page_of

        return page_of(self)


def _lower_first(name: str) -> str:
    """Return a title for the middle of a sentence; abbreviations such as IMU stay."""
    return name[0].lower() + name[1:] if name[1:2].islower() else name


def findings_of(
    recording: Recording,
    *,
    fixes: Fixes | None = None,
    remarks: Sequence[Remark] = (),
    progress: Progress | None = None,
) -> Report:
    """Return findings on a recording's IMU: clock, samples, rests, noise, vibration, axes.

    `zerorate.report` prepares the recording first.

    Parameters
    ----------
    recording : Recording
        Recording with a gyro or an accelerometer of three axes.
    fixes : Fixes, optional
        Fixes of a receiver on the same body. Default: the fixes in the recording, if any.
    remarks : sequence of Remark
        Contradictions that the preparation of the recording found.
    progress : callable, optional
        Called with the name of the section and the fraction done.

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
    imu_list = find_imus(recording)
    if not imu_list:
        raise LogError(
            "a report needs a gyro or an accelerometer of three axes; the recording has: "
            f"{', '.join(recording)}"
        )
    report_input = _ReportInput(recording, imu_list, fixes, tuple(remarks))
    for number, (name, find) in enumerate(SECTIONS.items()):
        if progress is not None:
            progress(name.lower(), number / len(SECTIONS))
        # Values that overflow do not count as above a limit.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            report_input.findings.extend(find(report_input))
    return Report(tuple(report_input.findings), recording.source, recording)
