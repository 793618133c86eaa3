"""Checks of one log of a batch by `zerorate.check`: JSON, and one row per sensor."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from zerorate.record import atomic_path
from zerorate.tasks.batch.command import Command, LogOutput, LogPath, Row
from zerorate.tasks.check import check

if TYPE_CHECKING:
    from zerorate.checks.result import Checks
    from zerorate.tasks.batch.task import Settings


def _check_log(settings: "Settings", source: LogPath, output: Path) -> LogOutput:
    """Write the checks of a log."""
    checks = check(source, **settings.reading)
    with atomic_path(output, force=True) as temporary:
        temporary.write_text(checks.to_json(), encoding="utf-8", newline="\n")
    return LogOutput(tuple(_rows(checks)), (*checks.alarms, *checks.notes))


def _rows(checks: "Checks") -> Iterator[Row]:
    for finding in (checks.gyro, checks.magnetometer):
        if finding.sensor:
            yield {
                "axis": finding.sensor,
                "unit": finding.unit,
                "finding": finding.status,
                "alarm": finding.alarm,
                "text": finding.text,
                "likely": finding.likely,
                "ratio": float(finding.ratio),
            }


CHECK: Final = Command(
    name="check",
    mark="-zerorate-check",
    ending=lambda _: "-findings.json",
    work=_check_log,
    columns={
        **dict.fromkeys(("finding", "text", "likely"), str),
        "alarm": bool,
        "ratio": float,
    },
    quantities=(),
)
