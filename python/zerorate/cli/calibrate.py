"""``zerorate calibrate``: scale, misalignment and bias of an IMU from a log of hand turns."""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from zerorate.calibration.calibration import Calibration
from zerorate.calibration.options import CALIBRATION_OPTIONS
from zerorate.cli.correct import correct
from zerorate.cli.errors import DataFault, UsageFault, print_alarms, require
from zerorate.cli.magnetometer import OPTIONS as WITH_MAGNETOMETER
from zerorate.cli.magnetometer import PANEL as COMPASS
from zerorate.cli.magnetometer import Magnetometer, calibrate_compass
from zerorate.cli.options import (
    OF_IMU,
    READING,
    AccelName,
    FigureFormat,
    FigureFormatOption,
    FigurePanels,
    Fix,
    ForceExports,
    GyroName,
    LogArgument,
    LogFormat,
    NoFigure,
    Output,
    PanelsOption,
    Reading,
    parse_choices,
    with_group,
    with_options,
    with_reading_options,
)
from zerorate.cli.outputs import (
    all_panels,
    check_outputs,
    preload_figure,
    print_written,
    progress_bar,
)
from zerorate.cli.records import print_title, records
from zerorate.show.calibration_table import verdict
from zerorate.tasks.calibrate import EXPORTS, moved_since
from zerorate.tasks.calibrate import calibrate as calibrate_imu
from zerorate.tasks.corrections import calibration_of
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.saving import FIGURE_FORMATS, Destination, files_of


class Export(StrEnum):
    """Programs whose files can be written."""

    kalibr = "kalibr"
    imu_tk = "imu_tk"
    px4 = "px4"
    ardupilot = "ardupilot"
    json = "json"


_FIT: Final = "Calibration"
_EXPORTS: Final = "Exports for other programs"
_APPLY: Final = "Instead of a calibration"
"""Panels of help."""


@with_options(CALIBRATION_OPTIONS, "choices", panel=_FIT)
@with_group(Magnetometer, "compass", COMPASS)
@with_reading_options(
    imu=True,
    help={"unit": f"{OF_IMU['unit']} Values are not converted."},
)
def calibrate(
    *,
    log: LogArgument,
    reading: Reading,
    output: Output = ".",
    choices: Mapping[str, Any],
    compass: Magnetometer,
    temperature: Annotated[
        bool,
        typer.Option(
            "--temperature",
            help="Add a model of the gyro's bias by temperature, from the rests of the same log.",
            rich_help_panel=_FIT,
        ),
    ] = False,
    gyro: GyroName = None,
    accel: AccelName = None,
    compare: Annotated[
        Path | None,
        typer.Option(
            metavar="OLD",
            help="An earlier calibration (JSON): how far each parameter has moved.",
            rich_help_panel=_FIT,
        ),
    ] = None,
    export: Annotated[
        str | None,
        typer.Option(
            help="Files for other programs: some of kalibr,imu_tk,px4,ardupilot. The JSON is "
            "always written.",
            rich_help_panel=_EXPORTS,
        ),
    ] = None,
    apply: Annotated[
        Path | None,
        typer.Option(
            metavar="CAL",
            help="Correct the log by this calibration (JSON), and write it.",
            rich_help_panel=_APPLY,
        ),
    ] = None,
    fix: Fix = False,
    format: Annotated[
        LogFormat | None,
        typer.Option(
            help="File format of the corrected log; else the suffix of -o, or parquet.",
            rich_help_panel=_APPLY,
        ),
    ] = None,
    figure_format: FigureFormatOption = None,
    figure: PanelsOption = FigurePanels.usual,
    no_figure: NoFigure = False,
    force: ForceExports = False,
    context: typer.Context,
) -> None:
    """Calibrate an IMU from one log of hand turns: rests in a dozen poses, and turns between them.

    Prints every number with its error, and whether the calibration is valid (exit 1 if not); writes
    it as JSON, a figure, and what is exported. With --apply, corrects a log instead; with
    --magnetometer, calibrates a compass from any motion.
    """
    exports = parse_choices("--export", export, Export)
    if compass.magnetometer:
        _check_alone(context, "--magnetometer", WITH_MAGNETOMETER)
        outline = (output, figure_format, not no_figure, force)
        calibrate_compass(log, reading, compass, gyro, exports, *outline)
        return
    compass.check_unused()
    if apply is not None:
        _check_alone(context, "--apply", _OF_APPLY)
        correct(log, reading, gyro, accel, apply, output, format, force)
        return
    if format is not None:
        raise UsageFault("--format is that of the corrected log: it acts with --apply")
    old = calibration_of(compare)
    saved = {"exports": exports, "doubtful": force}
    saved["panels"] = "all" if all_panels(figure, not no_figure) else "usual"
    place, figures = _place(log, output, figure_format, not no_figure, temperature)
    found = records(log, reading.group_by)
    endings = [ending for one in exports for ending in EXPORTS[one]]
    parts = [place.of_part(one.ending) for one in found]
    outputs = [part.files(".json", endings, figures, force) for part in parts]
    check_outputs([path for files in outputs for path in files.paths], force, log, compare)
    asked = {**choices, "gyro": gyro, "accel": accel, "temperature": temperature, "fix": fix}
    invalid = []
    for one, files in zip(found, outputs, strict=True):
        with progress_bar() as progress:
            work = partial(calibrate_imu, one.source, progress=progress)
            calibration = in_background(partial(work, **asked, **reading.arguments))
            written = files.save(files_of(calibration, **saved), progress, 0.7)
        print_title(one, first=one is found[0])
        print_alarms(calibration.alarms)
        print(calibration)
        _print_moved(calibration, old)
        print_written(written)
        if not calibration.valid:
            without = "" if force else _unwritten(exports)
            invalid.append(f"{one.title or log}: {verdict(calibration)}{without}")
    if invalid:
        raise DataFault("; ".join(invalid))


def _place(
    log: Path, output: str, figure_format: FigureFormat | None, draws: bool, temperature: bool
) -> tuple[Destination, list[str]]:
    """Return where the files go, and how the names of the figures end."""
    suffixes = ["json", *(FigureFormat if draws else ())]
    place = Destination.of(output, f"{log.stem}-zerorate-calibration", suffixes)
    if not draws:
        return place, []
    require("matplotlib", "plot")
    suffix = place.choose("figure_format", figure_format, FIGURE_FORMATS)
    preload_figure("calibration_figure")
    return place, [f".{suffix}", *([f"-temperature.{suffix}"] if temperature else [])]


_OF_APPLY: Final = ("log", "apply", "output", "format", "force", "gyro", "accel", *READING)


def _check_alone(context: typer.Context, asked: str, used: Sequence[str]) -> None:
    """Raise a usage fault for an option that means nothing beside what is asked for."""
    for parameter in context.command.params:
        name = str(parameter.name)
        source = context.get_parameter_source(name)
        if name not in used and source is not None and source.name == "COMMANDLINE":
            raise UsageFault(f"{parameter.opts[0]} has no effect with {asked}")


def _print_moved(calibration: Calibration, old: Calibration | None) -> None:
    if old is not None:
        moved = moved_since(calibration, old)
        print(f"\nCompared with the earlier one, which is first\n{moved}")


def _unwritten(exports: Sequence[str]) -> str:
    """Return what a calibration that is not valid leaves unwritten."""
    names = ", ".join(export for export in exports if EXPORTS[export])
    return f": no export to {names}, unless with --force" if names else ""
