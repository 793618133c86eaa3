"""Report on one log of a batch, as in ``zerorate report``: page and rows."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from zerorate.progress import report_nothing
from zerorate.record import atomic_path
from zerorate.tasks.batch.command import Command, LogOutput, LogPath, Row, finite_or_none

if TYPE_CHECKING:
    from zerorate.findings import Finding, Report
    from zerorate.tasks.batch.task import Settings

_FIGURE_PREFIX: Final = "figure-"


def _report_log(settings: "Settings", source: LogPath, output: Path) -> LogOutput:
    """Write the page of a log."""
    # Imported here, because other commands do not need it.
    from zerorate.tasks.report import report as report_on

    report = report_on(source, progress=report_nothing, **settings.reading)
    with atomic_path(output, force=True) as temporary:
        temporary.write_text(report.to_html(), encoding="utf-8", newline="\n")
    return LogOutput(tuple(_rows(report)), report.recording.notes)


def _rows(report: "Report") -> Iterator[Row]:
    from zerorate.findings.origin import find_start_date

    device, start = report.recording.device, find_start_date(report.recording)
    for finding in report.findings:
        yield {
            "axis": finding.figure.removeprefix(_FIGURE_PREFIX),
            "unit": finding.unit,
            "section": finding.section,
            "kind": finding.kind,
            "severity": finding.severity,
            "text": finding.text,
            "value": None if finding.value is None else finite_or_none(finding.value),
            "sigma": None if finding.sigma is None else finite_or_none(finding.sigma),
            **_span_times(finding),
            "advice": finding.advice,
            "device": device,
            "began": start,
        }


def _span_times(finding: "Finding") -> dict[str, float | int | None]:
    first = finding.spans[0][0] if finding.spans else None
    last = finding.spans[-1][1] if finding.spans else None
    return {"first": first, "last": last, "spans": len(finding.spans)}


REPORT: Final = Command(
    name="report",
    mark="-zerorate-report",
    ending=lambda _: ".html",
    work=_report_log,
    columns={
        **dict.fromkeys(("section", "kind", "severity", "text"), str),
        **dict.fromkeys(("value", "sigma", "first", "last"), float),
        "spans": int,
        **dict.fromkeys(("advice", "device"), str),
        "began": float,
    },
    quantities=(),
)
