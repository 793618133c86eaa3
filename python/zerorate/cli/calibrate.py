"""``zerorate calibrate``: scale, misalignment and bias of an IMU from rotations by hand."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

from zerorate.calibration.calibration import Calibration
from zerorate.calibration.options import CALIBRATION_OPTIONS
from zerorate.cli.errors import DataFault, UsageFault
from zerorate.cli.filter_options import TableOptions, own_flag
from zerorate.cli.magnetometer import OPTIONS as OF_MAGNETOMETER
from zerorate.cli.magnetometer import Magnetometer, calibrate_compass
from zerorate.cli.options import (
    EXPORT_PANEL,
    AccelName,
    Doubtful,
    FigureFormat,
    FigurePanels,
    Fix,
    Force,
    GyroName,
    LogArgument,
    NoFigure,
    Output,
)
from zerorate.cli.outputs import (
    check_outputs,
    check_panels,
    figure_ending,
    log_ending,
    parts_of,
    preload_figure,
    print_result,
    progress_bar,
)
from zerorate.cli.parameters import AsTyped, Option, Typed
from zerorate.cli.reading import OF_IMU, READING, Reading, ReadingOptions
from zerorate.cli.values import parse_choices
from zerorate.show.calibration_table import describe_verdict
from zerorate.tasks.calibrate import EXPORTS, compare_with_earlier
from zerorate.tasks.calibrate import calibrate as calibrate_imu
from zerorate.tasks.calibrate import correct as correct_log
from zerorate.tasks.corrections import calibration_of
from zerorate.tasks.saving import FIGURE_FORMATS, LOG_FORMATS, Destination, files_of

_FIT: Final = "Calibration"
_APPLY: Final = "Instead of a calibration"
"""Panels of help."""

_OF_APPLY: Final = ("log", "apply", "output", "format", "force", "gyro", "accel", *READING)
_READING: Final = ReadingOptions(
    imu=True, help={"unit": f"{OF_IMU['unit']} Values are not converted."}
)


def calibrate(
    *,
    log: LogArgument,
    reading: Annotated[Reading, _READING],
    output: Output = ".",
    choices: Annotated[Mapping[str, Any], TableOptions(CALIBRATION_OPTIONS, _FIT)],
    compass: Magnetometer,
    temperature: Annotated[
        bool,
        Option(
            "Model the bias by temperature, from the same rests.",
            panel=_FIT,
        ),
    ] = False,
    gyro: GyroName = None,
    accel: AccelName = None,
    compare: Annotated[
        Path | None,
        Option(
            "Compare with an earlier calibration (JSON).",
            metavar="OLD",
            panel=_FIT,
        ),
    ] = None,
    export: Annotated[
        Sequence[str],
        Option(
            "Files for other programs: any of kalibr,imu_tk,px4,ardupilot. JSON is always written.",
            panel=EXPORT_PANEL,
            parse=partial(parse_choices, choices=tuple(EXPORTS)),
        ),
    ] = (),
    apply: Annotated[
        Path | None,
        Option("Correct the log by this calibration and write it.", metavar="CAL", panel=_APPLY),
    ] = None,
    fix: Fix = False,
    format: Annotated[
        str | None,
        Option(
            "Log format; by default the suffix of -o, or parquet.",
            choices=LOG_FORMATS,
            panel=_APPLY,
        ),
    ] = None,
    figure_format: FigureFormat = None,
    figure: FigurePanels = "usual",
    no_figure: NoFigure = False,
    doubtful: Doubtful = False,
    force: Force = False,
    typed: Annotated[Typed, AsTyped()],
) -> None:
    """Calibrate an IMU from a log of rests in a dozen poses and rotations by hand between them.

    Prints every parameter with its standard error, and the verdict on the calibration (exit 1 if it
    is not valid). Writes JSON, a figure, and exports. With --apply, corrects a log instead. With
    --magnetometer, calibrates a compass from any motion.
    """
    if compass.magnetometer:
        _check_alone(typed, "--magnetometer", OF_MAGNETOMETER)
        outline = (output, figure_format, no_figure, force)
        calibrate_compass(log, reading, compass, gyro, export, *outline, doubtful)
        return
    compass.check_unused()
    if apply is not None:
        _check_alone(typed, "--apply", _OF_APPLY)
        _correct(log, reading, gyro, accel, apply, output, format, force)
        return
    if format is not None:
        raise UsageFault("--format is the format of the corrected log: give it with --apply")
    old = calibration_of(compare)
    panels = check_panels(figure, no_figure)
    suffixes = ["json", *(() if no_figure else FIGURE_FORMATS)]
    place = Destination.of(output, f"{log.stem}-zerorate-calibration", suffixes)
    figures = figure_ending(place, figure_format, no_figure)
    if figures:
        preload_figure("calibration_figure")
    figures += [f"-temperature{one}" for one in figures if temperature]
    endings = [ending for one in export for ending in EXPORTS[one]]
    files = partial(Destination.files, first=".json", others=endings, figures=figures, force=force)
    task = partial(
        calibrate_imu, gyro=gyro, accel=accel, temperature=temperature, fix=fix,
        **choices, **reading.arguments,
    )  # fmt: skip
    invalid = []
    for part in parts_of([(log, place)], reading, files, compare):
        saved = {"exports": export, "doubtful": doubtful, "panels": panels}
        result, paths = part.run(task, 0.7, **saved)
        print_result(result, paths, _moved(result, old))
        if not result.valid:
            without = "" if doubtful else _unwritten(export)
            invalid.append(f"{part.name}: {describe_verdict(result)}{without}")
    if invalid:
        raise DataFault("; ".join(invalid))


def _correct(
    log: Path,
    reading: Reading,
    gyro: str | None,
    accel: str | None,
    calibration: Path,
    output: str,
    format: str | None,
    force: bool,
) -> None:
    """Write a log corrected by a calibration."""
    known = calibration_of(calibration)
    place = Destination.of(output, f"{log.stem}-zerorate-calibrated", LOG_FORMATS)
    suffix = log_ending(place, format)
    files = partial(Destination.files, first=f".{suffix}", others=(), figures=(), force=force)
    for part in parts_of([(log, place)], reading, files, calibration):
        with progress_bar() as progress:
            source = part.record.source
            result = correct_log(source, known, gyro=gyro, accel=accel, **reading.arguments)
            saved = files_of(result).in_format(suffix)
            of_part = place.of_part(part.record.ending)
            outputs = of_part.files(f".{suffix}", saved.others, (), force)
            check_outputs(outputs.paths, force, log, calibration)
            outputs.save(saved, progress, 0.5)
        part.print_title()
        print_result(result, outputs.paths)


def _check_alone(typed: Typed, context: str, used: Sequence[str]) -> None:
    """Raise a usage fault for an option that has no effect in this context."""
    for name in typed:
        if name not in used:
            raise UsageFault(f"{own_flag(name)} has no effect with {context}")


def _moved(calibration: Calibration, old: Calibration | None) -> str:
    """Return the change of each parameter since an earlier calibration; empty without one."""
    if old is None:
        return ""
    change = compare_with_earlier(calibration, old)
    return f"\nCompared with the earlier calibration (first column)\n{change}"


def _unwritten(exports: Sequence[str]) -> str:
    """Return a note on exports that are not written because the calibration is not valid."""
    names = ", ".join(export for export in exports if EXPORTS[export])
    return f": no export to {names}, unless with --doubtful" if names else ""
