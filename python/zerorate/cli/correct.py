"""``zerorate calibrate --apply``: a log without what a calibration has found."""

from pathlib import Path

from zerorate.cli.errors import print_alarms, require
from zerorate.cli.options import LogFormat, Reading
from zerorate.cli.outputs import check_outputs, print_written, progress_bar
from zerorate.cli.records import print_title, records
from zerorate.tasks.calibrate import correct as corrected_by
from zerorate.tasks.corrections import calibration_of
from zerorate.tasks.saving import LOG_FORMATS, Destination, files_of


def correct(
    log: Path,
    reading: Reading,
    gyro: str | None,
    accel: str | None,
    calibration: Path,
    output: str,
    format: LogFormat | None,
    force: bool,
) -> None:
    """Write a log without what a calibration has found."""
    known = calibration_of(calibration)
    place = Destination.of(output, f"{log.stem}-zerorate-calibrated", [*LogFormat])
    suffix = place.choose("format", format, LOG_FORMATS)
    if suffix == "parquet":
        require("pyarrow", "io")
    for i, one in enumerate(records(log, reading.group_by)):
        with progress_bar() as progress:
            found = corrected_by(one.source, known, gyro=gyro, accel=accel, **reading.arguments)
            saved = files_of(found).in_format(suffix)
            outputs = place.of_part(one.ending).files(f".{suffix}", saved.others, (), force)
            check_outputs(outputs.paths, force, log, calibration)
            outputs.save(saved, progress, 0.5)
        print_title(one, first=i == 0)
        print_alarms(found.alarms)
        print(found)
        print_written(outputs.paths)
