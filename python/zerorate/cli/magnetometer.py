"""``zerorate calibrate --magnetometer``: hard and soft iron from ordinary motion."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import typer

from zerorate.calibration.magnetometer import MagnetometerCalibration
from zerorate.cli.errors import DataFault, UsageFault, print_alarms, require
from zerorate.cli.mounts import place_with_field
from zerorate.cli.options import READING, FigureFormat, Reading
from zerorate.cli.outputs import check_outputs, preload_figure, print_written, progress_bar
from zerorate.cli.records import print_title, records
from zerorate.tasks.calibrate import (
    EXPORTS,
    MAGNETOMETER_EXPORTS,
    calibrate_magnetometer,
    check_exports,
)
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.saving import FIGURE_FORMATS, Destination, files_of

PANEL: Final = "Magnetometer instead of IMU"
OPTIONS: Final = (
    "log",
    "output",
    "magnetometer",
    "field",
    "dip",
    "at",
    "one_iron",
    "gyro",
    "export",
    "figure_format",
    "no_figure",
    "force",
    *READING,
)
"""Those of the command that act on it."""


@dataclass(frozen=True)
class Magnetometer:
    """What is asked of a magnetometer's calibration."""

    magnetometer: Annotated[
        bool,
        typer.Option(
            help="Calibrate the magnetometer: its hard and soft iron, by what the gyro tells of "
            "ordinary motion."
        ),
    ] = False
    field: Annotated[
        float | None,
        typer.Option(
            metavar="UT",
            help="Size of the field at the place, uT: a result that cannot be of there is refused.",
        ),
    ] = None
    dip: Annotated[
        float | None,
        typer.Option(
            metavar="DEG", help="The same of its angle below the level, deg; negative in the south."
        ),
    ] = None
    at: Annotated[
        str | None,
        typer.Option(
            "--at",
            metavar="LAT,LON",
            help="The place, deg: field and dip by the World Magnetic Model. Default that of the "
            "log's positions.",
        ),
    ] = None
    one_iron: Annotated[
        bool, typer.Option(help="Nobody touched the device: one hard iron for the whole log.")
    ] = False

    def arguments(self) -> dict[str, Any]:
        """Return those of `zerorate.calibrate_magnetometer`."""
        return {
            "one": self.one_iron,
            "field": self.field,
            "dip": None if self.dip is None else float(np.radians(self.dip)),
            "place": place_with_field(self.at),
        }

    def check_unused(self) -> None:
        """Raise a usage fault for an option that acts with --magnetometer alone."""
        for name in ("field", "dip", "at", "one_iron"):
            if getattr(self, name):
                raise UsageFault(f"--{name.replace('_', '-')} acts with --magnetometer")


def calibrate_compass(
    log: Path,
    reading: Reading,
    asked: Magnetometer,
    gyro: str | None,
    exports: Sequence[str],
    output: str,
    figure_format: FigureFormat | None,
    figure: bool,
    force: bool,
) -> None:
    """Calibrate the magnetometer of each record in a log, print and write what was found."""
    check_exports(exports, MAGNETOMETER_EXPORTS)
    suffixes = ["json", *(FigureFormat if figure else ())]
    place = Destination.of(output, f"{log.stem}-zerorate-magnetometer", suffixes)
    figures = []
    if figure:
        require("matplotlib", "plot")
        figures = [f".{place.choose('figure_format', figure_format, FIGURE_FORMATS)}"]
        preload_figure("magnetometer_figure")
    arguments = {"gyro": gyro or "gyro", **asked.arguments(), **reading.arguments}
    endings = [ending for export in exports for ending in EXPORTS[export]]
    found = records(log, reading.group_by)
    outputs = [place.of_part(one.ending).files(".json", endings, figures, force) for one in found]
    check_outputs([path for files in outputs for path in files.paths], force, log)
    useless = []
    for one, files in zip(found, outputs, strict=True):
        with progress_bar() as progress:
            work = partial(calibrate_magnetometer, one.source, progress=progress)
            calibration = in_background(partial(work, **arguments))
            saved = files_of(calibration, exports=exports, doubtful=force)
            files.save(saved, progress, 0.7)
        print_title(one, first=one is found[0])
        print_alarms(calibration.alarms)
        print(calibration)
        print_written(files.paths)
        useless += [f"{one.title or log}: {why}" for why in _useless(calibration)]
    if useless:
        raise DataFault("; ".join(useless))


def _useless(calibration: MagnetometerCalibration) -> Sequence[str]:
    """Say why nothing can be done with it."""
    if calibration.problems:
        return calibration.problems[:1]
    if not calibration.applied and not any(one.identifiable for one in calibration.hard_iron):
        advice = "; ".join(calibration.advice) or "turn the sensor about two axes that differ"
        return (f"the log does not show the hard iron: {advice}",)
    return ()
