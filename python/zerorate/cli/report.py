"""``zerorate report``: what is seen of the IMU of a log, as a page, as JSON, as a paragraph."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from zerorate.cli.errors import UsageFault
from zerorate.cli.options import Force, LogArgument, Output, Reading, with_reading_options
from zerorate.cli.outputs import check_outputs, own_names, print_written, progress_bar
from zerorate.cli.records import print_title, records
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.report import report as report_on
from zerorate.tasks.saving import Destination, files_of

_ENDING = "-zerorate-report"


@with_reading_options()
def report(
    *,
    log: LogArgument,
    after: Annotated[
        Path | None,
        typer.Argument(
            help="A second log, of the same device later: both go on one page, side by side.",
            show_default=False,
        ),
    ] = None,
    gnss: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Fixes of a receiver on the same body: NMEA, RTKLIB, NavSatFix or a table. By "
            "default those in the log, if any.",
        ),
    ] = None,
    reading: Reading,
    output: Output = ".",
    force: Force = False,
) -> None:
    """Tell what is seen of the IMU of a log: clock, samples, noise, vibration, axes, attitude.

    Writes a page (HTML) that needs no network, and all findings as JSON; prints a paragraph. Of two
    logs it tells what is new, gone, worse, better or different, side by side.
    """
    if after is not None and (gnss is not None or reading.group_by is not None):
        given = "--gnss" if gnss is not None else "--group-by"
        raise UsageFault(f"{given} goes with one log, got two")
    name = log.stem if after is None else "-".join(own_names((log, after)))
    place = Destination.of(output, name + _ENDING, ("html", "json"))
    found = records(log, reading.group_by)
    outputs = [place.of_part(one.ending).files(".html", [".json"], (), force) for one in found]
    paths = [path for files in outputs for path in files.paths]
    check_outputs(paths, force, log, after, gnss)
    for one, files in zip(found, outputs, strict=True):
        with progress_bar() as progress:
            work = partial(report_on, one.source, after, gnss, progress=progress)
            told = in_background(partial(work, **reading.arguments))
            files.save(files_of(told), progress)
        print_title(one, first=one is found[0])
        print(told)
        print_written(files.paths)
