"""``zerorate calibrate --magnetometer``: hard and soft iron from ordinary motion."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Final

from zerorate.cli.errors import DataFault, UsageFault
from zerorate.cli.filter_options import own_flag
from zerorate.cli.outputs import figure_ending, parts_of, preload_figure, print_result
from zerorate.cli.parameters import option
from zerorate.cli.reading import READING, Reading
from zerorate.cli.values import parse_place_of_field
from zerorate.tasks.calibrate import (
    EXPORTS,
    MAGNETOMETER_EXPORTS,
    calibrate_magnetometer,
    check_exports,
    unusable,
)
from zerorate.tasks.saving import FIGURE_FORMATS, Destination

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
    "doubtful",
    *READING,
)
"""Options of the command that apply to a magnetometer."""


@dataclass(frozen=True)
class Magnetometer:
    """Options of a magnetometer's calibration."""

    panel: ClassVar = "Calibrate the magnetometer instead of the IMU"

    magnetometer: bool = option(
        False,
        "Calibrate the magnetometer from motion, with the gyro. The result is hard and soft iron.",
    )
    field: float | None = option(
        None,
        "Local field strength, uT. A result that contradicts it is an error.",
        metavar="UT",
    )
    dip: float | None = option(
        None,
        "Local dip of the field below the horizontal, deg. Negative in the south.",
        metavar="DEG",
        convert=math.radians,
    )
    at: tuple[float, ...] | None = option(
        None,
        "Position, deg, for the World Magnetic Model. The model gives field and dip. Default: the "
        "first position in the log.",
        metavar="LAT,LON",
        parse=parse_place_of_field,
    )
    one_iron: bool = option(False, "Assume one hard iron for the whole log.")

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of `zerorate.calibrate_magnetometer`."""
        return {"one": self.one_iron, "field": self.field, "dip": self.dip, "place": self.at}

    def check_unused(self) -> None:
        """Raise a usage fault for options that need --magnetometer."""
        for name, value in vars(self).items():
            if value:
                raise UsageFault(f"{own_flag(name)} acts with --magnetometer")


def calibrate_compass(
    log: Path,
    reading: Reading,
    compass: Magnetometer,
    gyro: str | None,
    exports: Sequence[str],
    output: str,
    figure_format: str | None,
    no_figure: bool,
    force: bool,
    doubtful: bool,
) -> None:
    """Calibrate the magnetometer of each record of a log; print and write the results."""
    check_exports(exports, MAGNETOMETER_EXPORTS)
    suffixes = ["json", *(() if no_figure else FIGURE_FORMATS)]
    place = Destination.of(output, f"{log.stem}-zerorate-magnetometer", suffixes)
    figures = figure_ending(place, figure_format, no_figure)
    if figures:
        preload_figure("magnetometer_figure")
    endings = [ending for export in exports for ending in EXPORTS[export]]
    files = partial(Destination.files, first=".json", others=endings, figures=figures, force=force)
    arguments = {"gyro": gyro, **compass.arguments(), **reading.arguments}
    useless = []
    for part in parts_of([(log, place)], reading, files):
        task = partial(calibrate_magnetometer, **arguments)
        result, _ = part.run(task, 0.7, exports=exports, doubtful=doubtful)
        print_result(result, part.files.paths)
        useless += [f"{part.name}: {why}" for why in unusable(result)]
    if useless:
        raise DataFault("; ".join(useless))
