"""``zerorate report``: findings on the IMU of a log as a page, JSON and a paragraph."""

from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from zerorate.cli.errors import DataFault, UsageFault
from zerorate.cli.options import Force, LogArgument, Output
from zerorate.cli.outputs import parts_of, print_written
from zerorate.cli.parameters import Argument, Option
from zerorate.cli.reading import OF_IMU, Reading, ReadingOptions
from zerorate.faults import render_text
from zerorate.findings.finding import count_noun
from zerorate.tasks.report import report as report_on
from zerorate.tasks.saving import Destination
from zerorate.tasks.source import unique_stems

_ENDING = "-zerorate-report"


def report(
    *,
    log: LogArgument,
    after: Annotated[
        Path | None,
        Argument("A later log of the same device, for a comparison."),
    ] = None,
    gnss: Annotated[
        Path | None,
        Option(
            "Receiver's fixes: NMEA, RTKLIB, NavSatFix or table. By default those in the log, if "
            "any.",
            metavar="FILE",
        ),
    ] = None,
    reading: Annotated[Reading, ReadingOptions(help=OF_IMU)],
    fail_on: Annotated[
        Literal["act", "look", "none"],
        Option("Exit with 1 if a finding is this severe or worse, and print a line for each."),
    ] = "none",
    output: Output = ".",
    force: Force = False,
) -> None:
    """Report on the IMU of a log: clock, samples, noise, vibration, axes, attitude.

    Writes a page (HTML) that needs no network, and all findings as JSON. Prints a paragraph. For
    two logs, lists new, gone, worse, better and different findings side by side.
    """
    if after is not None and (gnss is not None or reading.group_by is not None):
        given = "--gnss" if gnss is not None else "--group-by"
        raise UsageFault(f"{given} goes with one log, got two")
    name = log.stem if after is None else "-".join(unique_stems([str(log), str(after)]))
    place = Destination.of(output, name + _ENDING, ("html", "json"))
    files = partial(Destination.files, first=".html", others=[".json"], figures=(), force=force)
    failing: list[str] = []
    for part in parts_of([(log, place)], reading, files, after, gnss):
        task = partial(report_on, after=after, fixes=gnss, **reading.arguments)
        result, paths = part.run(task)
        print(result)
        print_written(paths)
        failing += [f"{one.severity}: {one.text}" for one in result.findings_from(fail_on)]
    if failing:
        print("\n".join(["", *map(render_text, failing)]))
        raise DataFault(f"{count_noun(len(failing), 'finding')} of --fail-on {fail_on}")
