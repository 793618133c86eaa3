"""Findings on a recording against its limits: ``zerorate report``."""

from __future__ import annotations

import os
from functools import partial
from typing import Final, TypeAlias, Unpack, overload

from zerorate.checks.preparation import AXES, CLIPPED, DEAD, Choices, prepare
from zerorate.faults import keyword_argument, make_sentence
from zerorate.findings.before_after import BeforeAfter, before_after
from zerorate.findings.report import Report, findings_of
from zerorate.io.fixes import read_fixes
from zerorate.progress import Progress
from zerorate.record.fixes import Fixes
from zerorate.tasks.saving import Files, text_writer
from zerorate.tasks.source import (
    ReadingArguments,
    Source,
    name_source_in_errors,
    recording_of,
    stem_of,
    unique_stems,
)

Path_: TypeAlias = str | os.PathLike[str]

_FINDING_CHECKS: Final = (DEAD, AXES, CLIPPED)
"""Checks that the findings include for every IMU, with values and time spans."""


@overload
def report(
    source: Source,
    after: None = None,
    fixes: Fixes | Path_ | None = None,
    *,
    progress: Progress | None = None,
    **reading: Unpack[ReadingArguments],
) -> Report: ...
@overload
def report(
    source: Source,
    after: Source,
    fixes: None = None,
    *,
    progress: Progress | None = None,
    **reading: Unpack[ReadingArguments],
) -> BeforeAfter: ...
@overload
def report(
    source: Source,
    after: Source | None = None,
    fixes: Fixes | Path_ | None = None,
    *,
    progress: Progress | None = None,
    **reading: Unpack[ReadingArguments],
) -> Report | BeforeAfter: ...
def report(
    source: Source,
    after: Source | None = None,
    fixes: Fixes | Path_ | None = None,
    *,
    progress: Progress | None = None,
    **reading: Unpack[ReadingArguments],
) -> Report | BeforeAfter:
    """Report on the IMU of a recording: clock, samples, rests, noise, vibration, axes.

    Each finding states an observation, not its cause. It has a value with its standard error, if
    known, the time span of its data, and advice for the next recording.
    ``zerorate.findings.LIMITS`` determine the severities. ``zerorate report`` does the same.

    Parameters
    ----------
    source : Recording, path, data frame or mapping of arrays
        Recording with a gyro or an accelerometer of three axes.
    after : Recording, path, data frame or mapping of arrays, optional
        A later recording of the same device, to compare with.
    fixes : Fixes or path, optional
        Fixes of a receiver on the same body. Default: fixes in the recording, if any.
    progress : callable, optional
        Called with the name of the section and the fraction done.
    **reading
        Arguments of `zerorate.read_recording`, if the source is a file.

    Returns
    -------
    Report or BeforeAfter
        Findings of one recording, or the changes from the first recording to the second.

    Raises
    ------
    LogError
        If there is neither a gyro nor an accelerometer of three axes.
    ValueError
        If `fixes` are given with two recordings.

    Examples
    --------
    >>> import zerorate as zr
    >>> found = zr.report(zr.simulate_motion("hand", duration=60.0).recording())
    >>> found.count("act"), found.count("look")
    (0, 0)
    """
    if after is None:
        return _report_one(source, fixes, reading, progress)
    if fixes is not None:
        raise ValueError(
            make_sentence(keyword_argument("fixes", "", "fixes"), " goes with one log, got two")
        )
    report_source = partial(_report_one, fixes=None, reading=reading, progress=progress)
    return before_after(report_source(source), report_source(after))


def _report_one(
    source: Source,
    fixes: Fixes | Path_ | None,
    reading: ReadingArguments,
    progress: Progress | None,
) -> Report:
    loaded_fixes = fixes if fixes is None or isinstance(fixes, Fixes) else read_fixes(fixes)
    recording = recording_of(source, reading)
    with name_source_in_errors(recording.source):
        prepared = prepare(recording, Choices(gravity=False, skip=_FINDING_CHECKS))
        return findings_of(
            prepared.recording, fixes=loaded_fixes, remarks=prepared.remarks, progress=progress
        )


def files_of(result: Report | BeforeAfter) -> Files:
    """Return the files of a report: a page and all findings as JSON."""
    data = (text_writer(result.to_html()), text_writer(result.to_json()))
    return Files("-zerorate-report", ".html", data, (".json",), {}, _stem(result))


def _stem(result: Report | BeforeAfter) -> str:
    if isinstance(result, Report):
        return stem_of(result.source)
    return "-".join(unique_stems([result.before.source, result.after.source]))
