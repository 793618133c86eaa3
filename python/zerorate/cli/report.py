"""``zerorate report``: what is seen of the IMU of a log, as a page, as JSON, as a paragraph."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from zerorate.cli.errors import UsageFault, read_faults
from zerorate.cli.options import Force, LogArgument, Output, Reading, with_reading_options
from zerorate.cli.outputs import check_outputs, own_names, print_written, progress_bar
from zerorate.cli.records import print_title, records
from zerorate.findings import Report, before_after
from zerorate.findings import report as report_on
from zerorate.io import read_recording
from zerorate.io.fixes import read_fixes
from zerorate.progress import Progress
from zerorate.show.report_page import format_report
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.saving import Destination, text_writer


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
    if after is not None:
        _side_by_side(log, after, gnss, reading, output, force)
        return
    found = records(log, reading.group_by)
    place = Destination.of(output, f"{log.stem}-zerorate-report", ("html", "json"))
    outputs = [place.of_part(one.ending).files(".html", [".json"], (), force) for one in found]
    check_outputs([path for files in outputs for path in files.paths], force, log, gnss)
    with read_faults():
        fixes = None if gnss is None else read_fixes(gnss)
    for one, files in zip(found, outputs, strict=True):
        with progress_bar() as progress:
            recording = reading.read(read_recording, one.source)
            with read_faults():
                told = in_background(partial(report_on, recording, gnss=fixes, progress=progress))
            texts = (told.to_html(), told.to_json())
            files.write([*map(text_writer, texts)], (), progress)
        print_title(one, first=one is found[0])
        print(format_report(told))
        print_written(files.paths)


def _side_by_side(
    log: Path, after: Path, gnss: Path | None, reading: Reading, output: str, force: bool
) -> None:
    """Write two reports on one page, and print what changed."""
    if gnss is not None or reading.group_by is not None:
        given = "--gnss" if gnss is not None else "--group-by"
        raise UsageFault(f"{given} goes with one log, got two")
    names = "-".join(own_names((log, after)))
    place = Destination.of(output, f"{names}-zerorate-report", ("html", "json"))
    files = place.files(".html", [".json"], (), force)
    check_outputs(files.paths, force, log, after)
    with progress_bar() as progress:
        found = before_after(*(_told(one, reading, progress) for one in (log, after)))
        files.write([*map(text_writer, (found.to_html(), found.to_json()))], (), progress)
    print(found.table())
    print_written(files.paths)


def _told(log: Path, reading: Reading, progress: Progress) -> Report:
    recording = reading.read(read_recording, log)
    with read_faults():
        return in_background(partial(report_on, recording, progress=progress))
