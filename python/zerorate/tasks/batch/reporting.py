"""The report on a log of a batch, as ``zerorate report`` makes it: a page, and a row a finding."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from zerorate.progress import silent
from zerorate.record import atomic_path
from zerorate.tasks.batch.command import Command, Made, Row, number

if TYPE_CHECKING:
    from zerorate.findings import Finding, Report
    from zerorate.tasks.batch.task import Settings

_SENSOR: Final = "figure-"


def _reported(settings: "Settings", source: Path, output: Path) -> Made:
    """Write the page of a log."""
    # What it takes is not needed by the other commands.
    from zerorate.tasks.report import report as report_on

    found = report_on(source, progress=silent, **settings.reading)
    with atomic_path(output, force=True) as temporary:
        temporary.write_text(found.to_html(), encoding="utf-8", newline="\n")
    return Made(tuple(_rows(found)), found.recording.notes)


def _rows(found: "Report") -> Iterator[Row]:
    from zerorate.findings.origin import began

    device, start = found.recording.device, began(found.recording)
    for one in found.findings:
        yield {
            "axis": one.figure.removeprefix(_SENSOR),
            "unit": one.unit,
            "section": one.section,
            "kind": one.kind,
            "severity": one.severity,
            "text": one.text,
            "value": None if one.value is None else number(one.value),
            "sigma": None if one.sigma is None else number(one.sigma),
            **_times(one),
            "advice": one.advice,
            "device": device,
            "began": start,
        }


def _times(one: "Finding") -> dict[str, float | int | None]:
    first = one.spans[0][0] if one.spans else None
    last = one.spans[-1][1] if one.spans else None
    return {"first": first, "last": last, "spans": len(one.spans)}


REPORT: Final = Command(
    name="report",
    mark="-zerorate-report",
    ending=lambda _: ".html",
    work=_reported,
    columns={
        **dict.fromkeys(("section", "kind", "severity", "text"), str),
        **dict.fromkeys(("value", "sigma", "first", "last"), float),
        "spans": int,
        **dict.fromkeys(("advice", "device"), str),
        "began": float,
    },
    compared=(),
)
